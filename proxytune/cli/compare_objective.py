"""What `compare` compares engines on: a test problem, a study, or a study with a new target for every seed."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from proxytune.cli.terminal.study_folder import study_folder
from proxytune.comparison.analytic import Analytic, Objective
from proxytune.comparison.calibrated import Calibrated
from proxytune.comparison.of_study import StudyObjective, noise_floor
from proxytune.comparison.of_truths import TruthObjective, lacking_families
from proxytune.comparison.ranking import Ranking
from proxytune.errors import InputError
from proxytune.running.progress import Bars
from proxytune.storage.store import Store
from proxytune.study.provenance import adopt
from proxytune.study.settings import StudySettings
from proxytune.study.stages.preflight import most_episodes
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun

STAND_INS: dict[str, Objective] = {"analytic": Analytic(), "ranking": Ranking(), "calibrated": Calibrated()}
BUDGET, INITIAL = 40, 10


@contextmanager
def objective_of(
    arguments: argparse.Namespace, output: Path, engines: int
) -> Iterator[tuple[Objective, int, int, int]]:
    """The objective with budget, design and how many runs at a time: a study's own episodes run in parallel instead."""
    if arguments.study in STAND_INS:
        yield STAND_INS[arguments.study], *_spending(arguments, BUDGET, INITIAL), 2
        return
    study = open_study(study_folder(Path(arguments.study)))
    budget, initial = _spending(arguments, study.settings.budget, study.settings.initial)
    per_run = _episodes_per_run(arguments, study.settings, budget)
    episodes = per_run * arguments.seeds * engines
    print(f"compare: at most {episodes} episodes, {per_run} in each run", file=sys.stderr)
    with Store.open(output) as store, Bars(episodes) as bars:
        adopt(study, store)
        yield _on_study(arguments, StudyRun(study, store, bars)), budget, initial, 1


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
    return points * len(settings.agents) * settings.starts + most_episodes(settings)


def _spending(arguments: argparse.Namespace, budget: int, initial: int) -> tuple[int, int]:
    budget, initial = arguments.budget or budget, arguments.initial or initial
    if initial >= budget:
        raise InputError(f"--budget {budget}: the design of {initial} uses it up; raise it, or lower --initial")
    return budget, initial
