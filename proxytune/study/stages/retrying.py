"""Trials with failed episodes, once the code that failed has been corrected."""

from proxytune.storage.records import TrialRecord
from proxytune.study.evaluation import plan
from proxytune.study.run import record
from proxytune.study.study_run import StudyRun


def retry_failed(run: StudyRun) -> None:
    """Drive failed episodes of ended trials again where the user's code has changed since, and score these trials anew.

    Such a trial is driven in full, also if it was cut off before. θ of later trials stay what they are.

    Raises:
        EpisodeError: If an episode fails and the study is to stop then.
    """
    for trial in run.finished_trials():
        if trial.failed_episodes and _has_changed(run, trial):
            run.outcomes(plan(run.settings, trial.theta, run.settings.seed), f"trial {trial.number} again")
            run.save_trials(record(trial.number, run.evaluation_of(trial)))


def _has_changed(run: StudyRun, trial: TrialRecord) -> bool:
    """Whether episodes are to be tried again, or were before this process and are not in the trial yet."""
    known = run.known(run.episodes_of(trial))
    failed = [episode for episode, outcome in known.items() if outcome.metrics is None]
    return len(failed) != trial.failed_episodes or any(episode in run.corrected for episode in failed)
