"""What a study is after, and what its finished trials say of θ."""

from collections.abc import Iterable

from proxytune.search.goal import Goal
from proxytune.search.knowledge.knowledge import Knowledge, learn
from proxytune.storage.records import TrialRecord
from proxytune.study.outputs import compose_of
from proxytune.study.stages.noise import noise_of
from proxytune.study.study_run import StudyRun


def goal_of(run: StudyRun) -> Goal:
    """What the study's search is after; a function of the pre-flight and the target's table."""
    table = run.study.target
    outputs = tuple((agent, metric) for agent in table.agents for metric in table.metrics)
    return Goal(outputs, table.means.ravel(), noise_of(run).variance.ravel(), compose_of(run.study))


def knowledge_of(run: StudyRun, done: Iterable[TrialRecord]) -> Knowledge:
    """What finished trials say of θ.

    Raises:
        RunError: If no trial has an outcome, or the store lacks episodes of one.
    """
    trials = [run.search_trial(trial) for trial in done]
    return learn(run.settings.space, trials, goal_of(run), run.settings.seed)
