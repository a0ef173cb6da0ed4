"""A study scored anew by other metrics or tolerances, from the episodes it has; nothing is simulated."""

from collections.abc import Sequence
from dataclasses import replace

from proxytune.errors import InputError
from proxytune.scores import Metric
from proxytune.settings import nearest
from proxytune.storage.records import TrialRecord
from proxytune.study.result import StudyResult, result_of
from proxytune.study.run import record
from proxytune.study.stages.cutting import by_other_metrics
from proxytune.study.stages.stopping import stopped
from proxytune.study.study import Study
from proxytune.study.study_run import StudyRun
from proxytune.study.target import read_target


def with_metrics(study: Study, metrics: Sequence[Metric]) -> Study:
    """The study with its agents compared by these metrics instead.

    Raises:
        InputError: If the domain family or the target's table lacks one, or one is named twice.
    """
    names = [metric.name for metric in metrics]
    for name in names:
        if name not in study.family.metrics:
            raise InputError(f"--metric {name}: no such metric; {nearest(name, study.family.metrics)}")
        if names.count(name) > 1:
            raise InputError(f"--metric {name}: is given twice; give each metric once")
    settings = replace(study.settings, metrics=tuple(metrics))
    return replace(study, settings=settings, target=read_target(settings, study.family)[0])


def rescored(run: StudyRun, metrics: Sequence[Metric]) -> StudyResult:
    """The result that the study's trials give by these metrics; they remain those that its own metrics led to.

    Raises:
        InputError: If a metric cannot be used.
        RunError: If no trial has a score, or episodes are missing.
    """
    own, other = run.finished_trials(), run.of(with_metrics(run.study, metrics))
    trials = [_rescored(other, trial) for trial in own]
    return replace(result_of(other, trials), stopped=stopped(run, own))


def _rescored(other: StudyRun, trial: TrialRecord) -> TrialRecord:
    if trial.state == "cut":
        return by_other_metrics(other, trial)
    return record(trial.number, other.evaluation_of(trial))
