"""The benchmark of search engines: `python benchmarks/compare.py PATH`, how fast each finds a good θ."""

import argparse
import json
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import NamedTuple

from calibrated import Calibrated
from compare_report import compare_document, compare_figure, compare_lines, compare_tables, compare_view
from compared_engines import NAMES, engine_of, why_not
from judgement import judging_code
from problems import Analytic, Objective, Ranking
from rich.console import Group
from rich.text import Text
from runs import EngineSummary, Run, RunKey, append_run, finished_run, read_runs, summarise
from study_problems import StudyObjective, TruthObjective, lacking_families, noise_floor

from proxytune.cli.commands import add_options
from proxytune.cli.main import add_shared_options, run_command
from proxytune.cli.options import on_its_cluster, study_folder
from proxytune.cli.terminal import Answer
from proxytune.errors import InputError, StoreError
from proxytune.report import foot_of, save_figure, table_text, write_page, write_text
from proxytune.running import Bars, working
from proxytune.search import ENGINE_NAMES as STUDY_ENGINES, Engine, engine_code
from proxytune.storage import Store, locked
from proxytune.study import StudyRun, StudySettings, most_preflight_episodes, open_study

STAND_INS: dict[str, Objective] = {"analytic": Analytic(), "ranking": Ranking(), "calibrated": Calibrated()}
BUDGET, INITIAL = 40, 10
FILE_NAME = "runs.jsonl"
MOST = 100_000
"""Of seeds and of trials, as study.toml has it too."""
LEFT = "every finished run and episode is kept; run the same command to continue"
"""An interruption leaves this."""
EXAMPLES = (
    "my_study --engines gp,sobol --seeds 5",
    "my_study --truths --seeds 10 --budget 30",
    "analytic --engines gp,random --output compared",
)


class Arena(NamedTuple):
    """What engines are compared on."""

    objective: Objective  # what each of them makes small
    budget: int  # evaluations per run
    initial: int  # how many of these are the shared design
    jobs: int  # how many runs at a time; a study's own episodes run in parallel instead
    bars: Bars  # shows how many runs are finished


class WithinRun:
    """Shows which seed a run is of and how many episodes there were; the bar itself counts runs."""

    def __init__(self, bars: Bars) -> None:
        self._bars, self._what, self._episodes = bars, "", 0

    def begin(self, what: str, known: int) -> None:
        """Show what is being done."""
        self._what = what
        self._bars.begin(what, 0)

    def episode(self) -> None:
        """Count it."""
        self._episodes += 1
        self._bars.begin(f"{self._what}, episode {self._episodes}", 0)

    def best(self, score: float) -> None:
        """Say nothing: each run has its own."""

    def finished(self, what: str) -> None:
        """Say nothing: a run is told of as a whole."""

    def waiting(self, episode: str, seconds: float) -> None:
        """Say it."""
        self._bars.waiting(episode, seconds)


@contextmanager
def objective_of(arguments: argparse.Namespace, output: Path, engines: int) -> Iterator[Arena]:
    """The objective with all that a comparison on it needs, and a bar that shows how far it is."""
    bars = Bars(engines * len(arguments.seeds), "runs")
    if arguments.study in STAND_INS:
        with bars:
            yield Arena(STAND_INS[arguments.study], *_spending(arguments, BUDGET, INITIAL), 2, bars)
        return
    study = open_study(study_folder(Path(arguments.study)))
    budget, initial = _spending(arguments, study.settings.budget, study.settings.initial)
    per_run = _episodes_per_run(arguments, study.settings, budget)
    episodes = per_run * len(arguments.seeds) * engines
    print(f"compare: at most {episodes} episodes, {per_run} in each run", file=sys.stderr)
    with Store.open(output) as store, bars:
        yield Arena(_on_study(arguments, StudyRun(study, store, WithinRun(bars))), budget, initial, 1, bars)


def check_truths(arguments: argparse.Namespace) -> None:
    """Refuse --truths for a test problem, which has its own, and --lacks without simulated targets.

    Raises:
        InputError: With the option and the remedy.
    """
    if arguments.lacks and not arguments.truths:
        raise InputError("--lacks: needs simulated targets; add --truths")
    if arguments.truths and arguments.study in STAND_INS:
        raise InputError(f"--truths: '{arguments.study}' has its own truth for every seed; leave the option out")


def _on_study(arguments: argparse.Namespace, run: StudyRun) -> Objective:
    if arguments.truths:
        return TruthObjective(run, lacking_families(run.study, arguments.lacks))
    return StudyObjective(run, noise_floor(run.study))


def _episodes_per_run(arguments: argparse.Namespace, settings: StudySettings, budget: int) -> int:
    """At most: every point, the answer, the pre-flight; with truths also target, truth twice, fresh ones of points."""
    points = 2 * budget + 3 if arguments.truths else budget + 1
    return points * len(settings.agents) * settings.starts + most_preflight_episodes(settings)


def _spending(arguments: argparse.Namespace, budget: int, initial: int) -> tuple[int, int]:
    budget, initial = arguments.budget or budget, arguments.initial or initial
    if initial >= budget:
        raise InputError(f"--budget {budget}: the design of {initial} uses it up; raise it, or lower --initial")
    return budget, initial


def seeds(text: str) -> range:
    """So many seeds from 1 on, or those of FIRST:LAST:STEP."""
    numbers = [int(number) for number in text.split(":")]
    if len(numbers) == 1:
        return range(1, numbers[0] + 1)
    first, last, step = (*numbers, 1)[:3]
    if len(numbers) > 3 or min(numbers) < 1:
        raise ValueError(text)
    return range(first, last + 1, step)


def main(argv: Sequence[str] | None = None) -> int:
    """Compare engines.

    Returns:
        0 done, 1 failed, 2 bad input or usage, 130 interrupted, 143 terminated.
    """
    words = sys.argv[1:] if argv is None else argv
    arguments = parser().parse_args(words, argparse.Namespace(words=words))
    return run_command(lambda: run(arguments), arguments, program="compare", left=LEFT)


def parser() -> argparse.ArgumentParser:
    """The parser, with every option."""
    parser = argparse.ArgumentParser(
        prog="python benchmarks/compare.py",
        description="Compare how fast each search engine finds a good θ.",
        epilog="\n".join(["examples:", *(f"  python benchmarks/compare.py {line}" for line in EXAMPLES)]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("study", metavar="STUDY", help=f"a study's folder, or a test problem: {' or '.join(STAND_INS)}")
    parser.add_argument(
        "--engines",
        metavar="NAME,…",
        help=f"from {', '.join(NAMES)}; the others are compared with the first [all that a study can use]",
    )
    parser.add_argument(
        "--seeds",
        type=seeds,
        default=seeds("30"),
        metavar="N",
        help="runs per engine, with the same seeds for all; or which seeds, as FIRST:LAST:STEP [30]",
    )
    parser.add_argument("--budget", type=int, metavar="N", help=f"evaluations per run [the study's, or {BUDGET}]")
    parser.add_argument(
        "--initial", type=int, metavar="N", help=f"how many of these are the shared design [the study's, or {INITIAL}]"
    )
    parser.add_argument(
        "--truths", action="store_true", help="with a study: simulate a new target for each seed, at a random θ"
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
    add_options(parser, "cluster")
    add_shared_options(parser, draws=True)
    return parser


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
    summaries = [summarise(group, grouped[0], objective.tolerance, objective.seconds) for group in grouped]
    return _answer(objective, summaries, grouped, output, _typed(arguments))


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


def _typed(arguments: argparse.Namespace) -> str:
    """What repeats the command in a shell."""
    return shlex.join(["python", "benchmarks/compare.py", *(word for word in arguments.words if word != "--json")])


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
    given = {**vars(arguments), "seeds": len(arguments.seeds)}
    for name, least in (("seeds", 2), ("budget", 2), ("initial", 1)):
        value = given[name]
        if value is not None and not least <= value <= MOST:
            raise InputError(f"--{name} {value}: give at least {least} and at most {MOST}")
    check_truths(arguments)


def _keys(objective: Objective, engines: Sequence[Engine], seeds: range, budget: int, initial: int) -> list[RunKey]:
    return [
        RunKey(objective.identity, engine.name, seed, budget, initial, engine_code(engine))
        for seed in seeds
        for engine in engines
    ]


def _finish_all(arena: Arena, keys: Sequence[RunKey], path: Path, beside: Path) -> Mapping[RunKey, Run]:
    """All runs, each written as soon as it is finished.

    Runs that the file lacks are run now; runs that an older version judged are judged again.
    """
    runs = read_runs(path)
    missing = [key for key in keys if key not in runs or runs[key].judgement.code != judging_code()]
    arena.bars.begin("comparing", len(keys) - len(missing))
    work, pieces = partial(finished_run, arena.objective, beside), [(key, runs.get(key)) for key in missing]
    with working(work, pieces, arena.jobs) as ended:
        for number, run in enumerate(ended, start=1 + len(keys) - len(missing)):
            append_run(path, run)
            runs[run.key] = run
            arena.bars.episode()
            arena.bars.finished(f"run {number} of {len(keys)}: {run.key.engine}, seed {run.key.seed}")
    return runs


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise StoreError(f"{folder}: cannot be created ({problem.strerror}); choose another --output") from None


if __name__ == "__main__":
    sys.exit(main())
