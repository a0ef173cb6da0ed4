"""`sweep`: usefulness along one parameter, or along each parameter of the study."""

import argparse
from pathlib import Path

from proxytune.cli.terminal.answer import Answer
from proxytune.cli.terminal.cluster_options import configure_cluster, on_its_cluster
from proxytune.cli.terminal.study_folder import study_folder
from proxytune.cli.terminal.theta import read_theta
from proxytune.cli.terminal.typed import typed
from proxytune.effects import Catalogue
from proxytune.errors import InputError
from proxytune.report import curve_document, draw_curves, held_values, sweep_text, write_curves, write_sweep_page
from proxytune.running import Bars
from proxytune.space import Theta
from proxytune.storage import Store, SweepRecord, locked
from proxytune.study import Study, StudyRun, open_study
from proxytune.sweep import (
    best_theta,
    check_base,
    curve_of,
    discrepancy_study,
    has_answer,
    plan_sweep,
    run_sweep,
    sweep_interval,
    with_target,
)

MOST_POINTS = 10_000


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the study, the parameter, and the values of the others."""
    parser.add_argument("path", type=Path, metavar="PATH", help="a study's folder")
    parser.add_argument(
        "--parameter", required=True, metavar="NAME", help="the parameter to sweep, or 'all' of the study"
    )
    parser.add_argument("--points", type=int, default=13, metavar="N", help="number of values of the parameter [13]")
    parser.add_argument(
        "--at",
        metavar="NAME=VALUE,…|MODEL|best|nominal",
        help="values of the other parameters: given, from a model.toml, the study's best θ, or the robot's own"
        " [best once a trial is finished, else nominal]",
    )
    parser.add_argument(
        "--target-model",
        type=Path,
        metavar="MODEL",
        help="the target's model.toml, if there is one; adds POD (proxy observation discrepancy): the same commands are"
        " replayed in both domains",
    )
    parser.add_argument("--output", type=Path, metavar="DIR", help="folder for the curves [the study's figures]")
    configure_cluster(parser)


@on_its_cluster
def run(arguments: argparse.Namespace) -> Answer:
    """Simulate what is missing of the sweeps, and draw them."""
    folder = study_folder(arguments.path)
    study = open_study(folder)
    word = arguments.at or ("best" if has_answer(study) else "nominal")
    sweeps, discrepancy = _plan(study, arguments, word), None
    if arguments.target_model:
        discrepancy = discrepancy_study(study, arguments.target_model)
        sweeps = [with_target(sweep, arguments.target_model, discrepancy) for sweep in sweeps]
    per_point = len(study.settings.agents) + (discrepancy is not None)
    points = sum(len(sweep.points) for sweep in sweeps)
    with locked(folder), Store.open(folder) as store:
        with Bars(points * per_point * study.settings.starts) as bars:
            run = StudyRun(study, store, bars)
            for sweep in sweeps:
                run_sweep(run, sweep, discrepancy)
        curves = [curve for sweep in sweeps if (curve := curve_of(run, sweep))]
    output = arguments.output or folder / "figures"
    figures = draw_curves(curves, output, study.truth)
    held = _held(word, sweeps[0].base)
    page = write_sweep_page(study.settings, curves, output, held, typed(arguments))
    files = [*write_curves(curves, output), page]
    document = {
        "curves": [curve_document(curve) for curve in curves],
        "episodes": {"run": run.spent.episodes},
        "figures": [str(path) for path in figures],
        "files": [str(path) for path in files],
        "at": {"chosen": word if word in ("best", "nominal") else "given", "theta": dict(sweeps[0].base)},
    }
    return Answer(document, sweep_text(curves, run.spent.episodes, [*figures, *files], held))


def _plan(study: Study, arguments: argparse.Namespace, word: str) -> list[SweepRecord]:
    if not 2 <= arguments.points <= MOST_POINTS:
        raise InputError(f"--points must be between 2 and {MOST_POINTS}, got {arguments.points}")
    base = best_theta(study) if word == "best" else read_theta(word, Catalogue(study.settings.folder.resolve()), "--at")
    check_base(study, base)
    names = study.settings.space.names if arguments.parameter == "all" else (arguments.parameter,)
    return [plan_sweep(sweep_interval(study, name), base, arguments.points) for name in names]


def _held(word: str, base: Theta) -> str:
    """What the other parameters are held at."""
    if word == "best":
        values = held_values(base, whose="the study's best θ: ")
        return f"{values}; --at nominal holds the robot's own"
    return "the others are nominal" if word == "nominal" else held_values(base)
