"""`compare`: how fast each engine finds a good θ, on a stand-in or on a study."""

import argparse
import json
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

from rich.console import Group
from rich.text import Text

from proxytune.cli.compare_objective import BUDGET, INITIAL, STAND_INS, Arena, check_truths, objective_of
from proxytune.cli.terminal.answer import Answer
from proxytune.cli.terminal.cluster_options import configure_cluster, on_its_cluster
from proxytune.cli.terminal.typed import typed
from proxytune.comparison.analytic import Objective
from proxytune.comparison.judgement import judging_code
from proxytune.comparison.runs import Run, RunKey, judged_again, run_document, run_engine, run_from
from proxytune.comparison.summary import EngineSummary, summarise
from proxytune.errors import InputError, StoreError
from proxytune.report.compare.document import compare_document, compare_lines, compare_tables
from proxytune.report.compare.figure import compare_figure
from proxytune.report.compare.page import compare_view
from proxytune.report.html import write_page
from proxytune.report.text import table_text
from proxytune.report.view import foot_of
from proxytune.report.writing import save_figure, write_text
from proxytune.running import working
from proxytune.search import NAMES, STUDY_ENGINES, Engine, engine_code, engine_of, why_not
from proxytune.storage import locked

FILE_NAME = "runs.jsonl"
MOST = 100_000
"""Of seeds and of trials, as study.toml has it too."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the objective, the engines and the budget."""
    parser.add_argument("study", metavar="STUDY", help=f"a study's folder, or a test problem: {' or '.join(STAND_INS)}")
    parser.add_argument(
        "--engines",
        metavar="NAME,…",
        help=f"from {', '.join(NAMES)}; the others are compared with the first [all that a study can use]",
    )
    parser.add_argument(
        "--seeds", type=int, default=30, metavar="N", help="runs per engine, with the same seeds for all [30]"
    )
    parser.add_argument("--budget", type=int, metavar="N", help=f"evaluations per run [the study's, or {BUDGET}]")
    parser.add_argument(
        "--initial", type=int, metavar="N", help=f"how many of these are the shared design [the study's, or {INITIAL}]"
    )
    parser.add_argument(
        "--truths",
        action="store_true",
        help="with a study: simulate a new target for each seed, at a random θ",
    )
    parser.add_argument(
        "--lacks",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="with --truths: a model.toml whose effects the targets have and the proxy lacks; repeat for several",
    )
    parser.add_argument("--output", type=Path, metavar="DIR", help="folder for runs and figure [./compare_STUDY]")
    configure_cluster(parser)


@on_its_cluster
def run(arguments: argparse.Namespace) -> Answer:
    """Run what is missing of every engine and seed, and sum all up."""
    name = Path(arguments.study).absolute().name
    output = arguments.output or Path(f"compare_{name}")
    engines = _engines(arguments)
    _check(arguments)
    _make(output)
    with locked(output), objective_of(arguments, output, len(engines)) as arena:
        objective = arena.objective
        keys = _keys(objective, engines, arguments.seeds, arena.budget, arena.initial)
        runs = _finish_all(arena, keys, output / FILE_NAME, _beside(arguments))
    grouped = [[runs[key] for key in keys if key.engine == engine.name] for engine in engines]
    summaries = [summarise(group, grouped[0], objective.tolerance) for group in grouped]
    return _answer(objective, summaries, grouped, output, typed(arguments))


def _answer(
    objective: Objective,
    summaries: Sequence[EngineSummary],
    grouped: Sequence[Sequence[Run]],
    output: Path,
    command: str,
) -> Answer:
    budget, figure = grouped[0][0].key.budget, output / "compare.png"
    save_figure(compare_figure(grouped, objective.tolerance), figure)
    document = compare_document(objective.name, summaries, budget, objective.tolerance)
    write_text(output / "compare.json", json.dumps(document, indent=2, allow_nan=False) + "\n")
    page, foot = output / "report.html", foot_of(command, [("budget", str(budget))])
    write_page(page, compare_view(objective.name, summaries, budget, figure.read_bytes()), foot)
    lines = [*compare_lines(summaries), f"figure: {figure}", f"report: {page}"]
    tables = map(table_text, compare_tables(objective.name, summaries, budget))
    return Answer(
        {**document, "figures": [str(figure)], "report": str(page)}, Group(*tables, *(Text(line) for line in lines))
    )


def _engines(arguments: argparse.Namespace) -> list[Engine]:
    """The engines asked for, in that order."""
    stand_in = STAND_INS.get(arguments.study)
    composed = stand_in is None or stand_in.goal(1) is not None
    if arguments.engines is None:
        return [engine_of(name) for name in STUDY_ENGINES if not why_not(name, composed=composed)]
    named = [name.strip() for name in arguments.engines.split(",") if name.strip()]
    for name in named:
        reason = why_not(name, composed=composed, beside=_beside(arguments))
        if reason:
            raise InputError(f"--engines: {reason}")
    if not named:
        raise InputError(f"--engines: names no engine; give some of {', '.join(NAMES)}")
    return [engine_of(name, _beside(arguments)) for name in dict.fromkeys(named)]


def _beside(arguments: argparse.Namespace) -> Path:
    """Where one's own engines lie: beside the study, or for a test problem in the current folder."""
    path = Path(arguments.study).absolute()  # another process may be in another folder
    return path if path.is_dir() else path.parent


def _check(arguments: argparse.Namespace) -> None:
    for name, least in (("seeds", 2), ("budget", 2), ("initial", 1)):
        value = getattr(arguments, name)
        if value is not None and not least <= value <= MOST:
            raise InputError(f"--{name} {value}: give at least {least} and at most {MOST}")
    check_truths(arguments)


def _keys(objective: Objective, engines: Sequence[Engine], seeds: int, budget: int, initial: int) -> list[RunKey]:
    return [
        RunKey(objective.identity, engine.name, seed, budget, initial, engine_code(engine))
        for seed in range(1, seeds + 1)
        for engine in engines
    ]


def _finish_all(arena: Arena, keys: Sequence[RunKey], path: Path, beside: Path) -> Mapping[RunKey, Run]:
    """All runs, each written as soon as it is finished.

    Runs that the file lacks are run now; runs that an older version judged are judged again.
    """
    runs = read_runs(path)
    missing = [key for key in keys if key not in runs or runs[key].judgement.code != judging_code()]
    arena.bars.begin("comparing", len(keys) - len(missing))
    work, pieces = partial(_finish, arena.objective, beside), [(key, runs.get(key)) for key in missing]
    with working(work, pieces, arena.jobs) as ended:
        for number, run in enumerate(ended, start=1 + len(keys) - len(missing)):
            _append(path, run)
            runs[run.key] = run
            arena.bars.episode()
            arena.bars.finished(f"run {number} of {len(keys)}: {run.key.engine}, seed {run.key.seed}")
    return runs


def _finish(objective: Objective, beside: Path, piece: tuple[RunKey, Run | None]) -> Run:
    key, run = piece
    engine = engine_of(key.engine, beside)
    return judged_again(objective, run, engine) if run else run_engine(objective, key, engine)


def read_runs(path: Path) -> dict[RunKey, Run]:
    """Read the finished runs from a file of JSON lines; a line left unfinished by an interruption is skipped."""
    runs = {}
    for line in path.read_bytes().splitlines() if path.exists() else []:
        try:
            run = run_from(json.loads(line))
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            continue
        runs[run.key] = run
    return runs


def _append(path: Path, run: Run) -> None:
    try:
        with path.open("a", encoding="utf-8") as file:
            # On a separate line even after one that was left unfinished.
            file.write("\n" * (file.tell() > 0) + json.dumps(run_document(run)))
    except OSError as problem:
        raise StoreError(f"{path}: cannot be written ({problem.strerror}); choose another --output") from None


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise StoreError(f"{folder}: cannot be created ({problem.strerror}); choose another --output") from None
