"""What `compare` compares engines on: a test problem, a study, or a study with a new target for every seed."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from proxytune.cli.terminal.study_folder import study_folder
from proxytune.comparison.analytic import Analytic, Objective
from proxytune.comparison.calibrated import Calibrated
from proxytune.comparison.of_study import StudyObjective, noise_floor
from proxytune.comparison.of_truths import TruthObjective, lacking_families
from proxytune.comparison.ranking import Ranking
from proxytune.errors import InputError
from proxytune.running import Bars
from proxytune.storage import Store
from proxytune.study import StudyRun, StudySettings, adopt, most_preflight_episodes, open_study

STAND_INS: dict[str, Objective] = {"analytic": Analytic(), "ranking": Ranking(), "calibrated": Calibrated()}
BUDGET, INITIAL = 40, 10


class Arena(NamedTuple):
    """What engines are compared on.

    Attributes:
        objective: What each of them makes small.
        budget: Evaluations per run.
        initial: How many of these are the shared design.
        jobs: How many runs at a time; a study's own episodes run in parallel instead.
        bars: Shows how many runs are finished.
    """

    objective: Objective
    budget: int
    initial: int
    jobs: int
    bars: Bars


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
    bars = Bars(engines * arguments.seeds, "runs")
    if arguments.study in STAND_INS:
        with bars:
            yield Arena(STAND_INS[arguments.study], *_spending(arguments, BUDGET, INITIAL), 2, bars)
        return
    study = open_study(study_folder(Path(arguments.study)))
    budget, initial = _spending(arguments, study.settings.budget, study.settings.initial)
    per_run = _episodes_per_run(arguments, study.settings, budget)
    episodes = per_run * arguments.seeds * engines
    print(f"compare: at most {episodes} episodes, {per_run} in each run", file=sys.stderr)
    with Store.open(output) as store, bars:
        adopt(study, store)
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
