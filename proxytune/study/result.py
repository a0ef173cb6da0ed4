"""What a study has found out: its best θ, how useful the proxy is there, and what that is worth."""

from dataclasses import dataclass

import numpy as np

from proxytune.errors import RunError
from proxytune.search.profile import Profile, profiles
from proxytune.search.surrogate import Surrogate, fit_surrogate
from proxytune.study.evaluate import Evaluation, evaluation, told
from proxytune.study.preflight import Preflight, preflight_of
from proxytune.study.run import as_trials
from proxytune.study.stopping import stopped
from proxytune.study.store import Store, TrialRecord
from proxytune.study.study import Study
from proxytune.usefulness import Assessment, assess

FAILURES_TOLD = 10


@dataclass(frozen=True)
class Best:
    """The visited θ with the lowest posterior mean: the trial with the lowest PRPV of all is partly luck.

    Attributes:
        trial: The trial that visited it.
        posterior_mean: Mean of PRPV there, given all trials.
        posterior_deviation: Its standard deviation.
        assessment: How useful the proxy is there, by every measure, with noise floor and chance level.
    """

    trial: TrialRecord
    posterior_mean: float
    posterior_deviation: float
    assessment: Assessment


@dataclass(frozen=True)
class StudyResult:
    """A study as it stands.

    Attributes:
        study: Which one.
        trials: Its finished and failed trials, in order.
        best: The best of them.
        profiles: What is known of each parameter, in the order of the box.
        preflight: What was learnt of the parameters before the first trial; None if it is off or was never run.
        stopped: Why it runs no further; empty while it is not at its end.
        failures: The first failed episodes, told in one line each.
    """

    study: Study
    trials: tuple[TrialRecord, ...]
    best: Best
    profiles: tuple[Profile, ...]
    preflight: Preflight | None
    stopped: str
    failures: tuple[str, ...]

    @property
    def unidentified(self) -> tuple[str, ...]:
        """The parameters of which every value in the box is as good as the best, beyond noise."""
        return tuple(profile.name for profile in self.profiles if profile.unidentified)

    @property
    def failed_episodes(self) -> int:
        """How many episodes of all trials failed."""
        return sum(trial.failed_episodes for trial in self.trials)

    @property
    def episodes(self) -> int:
        """How many episodes trials and pre-flight took, failed ones counted."""
        trials = len(self.trials) * len(self.study.settings.agents) * self.study.settings.starts
        return trials + (self.preflight.episodes if self.preflight else 0)


def result_of(study: Study, store: Store) -> StudyResult:
    """Sum up what the store has; nothing is simulated.

    Raises:
        RunError: If no trial has a score.
    """
    trials = tuple(trial for trial in store.trials() if trial.state != "open")
    scored = [trial for trial in trials if trial.prpv is not None]
    if not scored:
        reason = f"all trials failed, the first because {trials[0].failure}" if trials else "no trial is finished yet"
        raise RunError(f"{store.path}: {reason}")
    surrogate = fit_surrogate(study.settings.space, as_trials(study.settings.space, scored))
    return StudyResult(
        study=study,
        trials=trials,
        best=_best(study, store, scored, surrogate),
        profiles=profiles(surrogate),
        preflight=preflight_of(study, store),
        stopped=stopped(study, store, trials),
        failures=_failures(study, store, trials),
    )


def _best(study: Study, store: Store, scored: list[TrialRecord], surrogate: Surrogate) -> Best:
    space = study.settings.space
    mean, deviation = surrogate.at_visited()
    row = int(np.argmin(mean))
    values = surrogate.visited[row].values
    trial = next(trial for trial in scored if space.values(trial.theta) == values)
    proxy = _known(study, store, trial).proxy
    assert proxy is not None
    assessment = assess(proxy=proxy, target=study.target, metrics=study.settings.metrics)
    return Best(trial, float(mean[row]), float(deviation[row]), assessment)


def _known(study: Study, store: Store, trial: TrialRecord) -> Evaluation:
    found = evaluation(study, store, trial.theta)
    if found is None:
        raise RunError(f"{store.path}: lacks episodes of trial {trial.number}; move it away and run the study again")
    return found


def _failures(study: Study, store: Store, trials: tuple[TrialRecord, ...]) -> tuple[str, ...]:
    lines: list[str] = []
    for trial in trials:
        if trial.failed_episodes and len(lines) < FAILURES_TOLD:
            lines += [f"trial {trial.number}: {told(outcome)}" for outcome in _known(study, store, trial).failures]
    return tuple(lines[:FAILURES_TOLD])
