"""`sweep`: usefulness along one parameter, or along each parameter of the study."""

import argparse
from pathlib import Path

from proxytune.api import run_sweep
from proxytune.cli.options import check_made, configure_cluster, on_its_cluster, study_folder, typed
from proxytune.cli.terminal import Answer
from proxytune.files import check_place
from proxytune.report import sweep_text


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
    check_made(folder) if arguments.output is None else check_place(arguments.output, folder=True)
    report = run_sweep(
        folder,
        arguments.parameter,
        points=arguments.points,
        at=arguments.at,
        target_model=arguments.target_model,
        progress=True,
    )
    figures, files = report.write(arguments.output, typed(arguments))
    document = report.document()
    at = document.pop("at")
    paths = {"figures": [str(path) for path in figures], "files": [str(path) for path in files]}
    text = sweep_text(report.curves, report.episodes, [*figures, *files], report.held)
    return Answer(document | paths | {"at": at}, text)
