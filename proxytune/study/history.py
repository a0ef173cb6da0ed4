"""A study's trials as a search of any kind has them, to be kept by other optimisers."""

from typing import Literal

from proxytune.search.history import History, PastTrial
from proxytune.storage.records import TrialRecord
from proxytune.study.result import StudyResult


def history_of(result: StudyResult) -> History:
    """The trials of a study that have ended."""
    study = result.study
    trials = tuple(_past(trial, study.objective.name) for trial in result.trials)
    answer = [trial.number for trial in result.trials].index(result.best.trial.number)
    return History(study.settings.name, study.settings.space, trials, study.objective.maximise, answer)


def _past(trial: TrialRecord, objective: str) -> PastTrial:
    state: Literal["finished", "cut", "failed"] = "failed"
    if trial.state in ("finished", "cut"):
        state = "finished" if trial.state == "finished" else "cut"
    facts = {
        "trial": trial.number,
        **trial.measures,
        "at_least": trial.bound,
        "expected": trial.estimate,
        "failed_episodes": trial.failed_episodes,
        "failure": trial.failure,
    }
    known = {name: value for name, value in facts.items() if value not in (None, "")}
    return PastTrial(trial.theta, state, trial.measures.get(objective), known)
