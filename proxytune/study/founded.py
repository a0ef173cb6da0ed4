"""Whether the scores that a study has stored are those that its stored episodes give."""

import math
from collections.abc import Iterator
from dataclasses import replace

from proxytune.errors import StoreError
from proxytune.storage.records import TrialRecord
from proxytune.study.objective import KEPT, PRPV
from proxytune.study.stages.cutting import by_other_metrics
from proxytune.study.study_run import StudyRun


def check_scores(run: StudyRun) -> None:
    """Refuse a study of which a trial is not what its episodes come to: PRPV and PPV are computed again.

    Raises:
        StoreError: With the first such trial.
    """
    for number, problem in unfounded(run):
        remedy = f"run: python -m proxytune repair {run.settings.home}"
        raise StoreError(f"{run.store.path}: was damaged or edited: trial {number} {problem}; {remedy}")


def unfounded(run: StudyRun) -> Iterator[tuple[int, str]]:
    """The number of each ended trial that is not what its episodes come to, and in a phrase why not."""
    # A measure of one's own is code, and may have changed.
    shipped = run if run.study.objective.name in KEPT else run.of(replace(run.study, objective=PRPV))
    for trial in run.finished_trials():
        problem = _lacks(run, trial) or _scored_otherwise(shipped, run.study.objective.name, trial)
        if problem:
            yield trial.number, problem


def _lacks(run: StudyRun, trial: TrialRecord) -> str:
    if set(trial.theta) != set(run.settings.space.names):
        return "has other parameters than the study"
    planned = run.episodes_of(trial)
    known = run.store.outcomes(run.study.identity, trial.theta)
    missing = sum(episode not in known for episode in planned)
    return f"lacks {missing} of its {len(planned)} episodes" if missing else ""


def _scored_otherwise(run: StudyRun, objective: str, trial: TrialRecord) -> str:
    """How a trial's scores differ from what its episodes give; nothing where failures were tried again since."""
    if trial.state == "failed" or _failed_now(run, trial) != trial.failed_episodes:
        return ""
    if trial.state == "cut":
        return _differ("a bound of PRPV of", trial.bound, by_other_metrics(run, trial).bound)
    measures = run.evaluation_of(trial).measures
    score = trial.score
    if objective in KEPT and measures.get(objective) is not None:
        score = KEPT[objective].sign * float(measures[objective] or 0.0)
    pairs = [(KEPT[name].label, trial.measures.get(name), measures.get(name)) for name in KEPT]
    compared = (_differ(*pair) for pair in (*pairs, ("the score", trial.score, score)))
    return next(filter(None, compared), "")


def _failed_now(run: StudyRun, trial: TrialRecord) -> int:
    return sum(outcome.metrics is None for outcome in run.known(run.episodes_of(trial)).values())


def _differ(name: str, stored: float | None, computed: float | None) -> str:
    if stored is None or computed is None:
        same = stored is computed
    else:
        same = math.isclose(stored, computed, rel_tol=1e-9, abs_tol=1e-9)
    return "" if same else f"has {name} {_say(stored)}, and its episodes give {_say(computed)}"


def _say(value: float | None) -> str:
    return "none" if value is None else f"{value:g}"
