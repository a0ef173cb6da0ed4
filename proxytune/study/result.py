"""What a study has found out: its best θ, how useful the proxy is there, and what that is worth."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from proxytune.errors import RunError
from proxytune.search.importance import Importance, importances
from proxytune.search.profile import Profile, profiles
from proxytune.search.surrogate import Surrogate, fit_surrogate, unit_array
from proxytune.study.confirmation import Confirmation, confirmation_of
from proxytune.study.cutting import spared
from proxytune.study.evaluate import Evaluation, evaluation, known_outcomes, told
from proxytune.study.history import as_trials, episodes_of
from proxytune.study.preflight import Preflight, preflight_of
from proxytune.study.stopping import stopped
from proxytune.study.store import Store, TrialRecord
from proxytune.study.study import Study
from proxytune.usefulness import Assessment, assess

FAILURES_TOLD = 10


@dataclass(frozen=True)
class Best:
    """The answer: the θ that fresh episodes confirm, and until then the visited one with the lowest posterior mean.

    It is never the trial with the lowest PRPV for that alone, which is partly luck.

    Attributes:
        trial: The trial that visited it.
        posterior_mean: Mean of PRPV there, given all trials.
        posterior_deviation: Its standard deviation.
        assessment: How useful the proxy is there in the trial's own episodes, by every measure, with noise floor and
            chance level.
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
        importances: How much each parameter matters, in the order of the box.
        confirmation: What fresh episodes say of it; None if they are off, or not all driven yet.
        preflight: What was learnt of the parameters before the first trial; None if it is off or was never run.
        stopped: Why it runs no further; empty while it is not at its end.
        spared: What the trials that were cut off did without: episodes, and about how many seconds of them.
        failures: The first failed episodes, told in one line each.
    """

    study: Study
    trials: tuple[TrialRecord, ...]
    best: Best
    profiles: tuple[Profile, ...]
    importances: tuple[Importance, ...]
    confirmation: Confirmation | None
    preflight: Preflight | None
    stopped: str
    spared: tuple[int, float]
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
    def cut(self) -> tuple[TrialRecord, ...]:
        """The trials that were cut off."""
        return tuple(trial for trial in self.trials if trial.state == "cut")

    @property
    def episodes(self) -> int:
        """How many episodes trials, pre-flight and confirmation took, failed ones counted."""
        trials = sum(len(episodes_of(self.study.settings, trial)) for trial in self.trials)
        before = self.preflight.episodes if self.preflight else 0
        after = self.confirmation.episodes * len(self.confirmation.candidates) if self.confirmation else 0
        return before + trials + after


def result_of(study: Study, store: Store, scored_anew: Sequence[TrialRecord] | None = None) -> StudyResult:
    """Sum up what the store has, or the same trials scored anew; nothing is simulated.

    Raises:
        RunError: If no trial has a score.
    """
    known = store.trials() if scored_anew is None else scored_anew
    trials = tuple(trial for trial in known if trial.state != "open")
    scored = [trial for trial in trials if trial.prpv is not None]
    if not scored:
        reason = f"all trials failed, the first because {trials[0].failure}" if trials else "no trial is finished yet"
        raise RunError(f"{store.path}: {reason}")
    space = study.settings.space
    surrogate = fit_surrogate(space, as_trials(space, trials))
    confirmation = confirmation_of(study, store, trials)
    answer = confirmation.answer.trial if confirmation else _favourite(scored, surrogate)
    return StudyResult(
        study=study,
        trials=trials,
        best=_best(study, store, answer, surrogate),
        profiles=profiles(surrogate, space.values(answer.theta)),
        importances=importances(surrogate),
        confirmation=confirmation,
        preflight=preflight_of(study, store),
        stopped=stopped(study, store, trials),
        spared=spared(study, store, trials),
        failures=_failures(study, store, trials),
    )


def _favourite(scored: list[TrialRecord], surrogate: Surrogate) -> TrialRecord:
    means, _ = surrogate.predict(unit_array(surrogate.space, [surrogate.space.values(t.theta) for t in scored]))
    return scored[int(np.argmin(means))]


def _best(study: Study, store: Store, answer: TrialRecord, surrogate: Surrogate) -> Best:
    mean, deviation = surrogate.predict(unit_array(surrogate.space, [surrogate.space.values(answer.theta)]))
    proxy = known_evaluation(study, store, answer).proxy
    assert proxy is not None
    assessment = assess(proxy=proxy, target=study.target, metrics=study.settings.metrics)
    return Best(answer, float(mean[0]), float(deviation[0]), assessment)


def known_evaluation(study: Study, store: Store, trial: TrialRecord) -> Evaluation:
    """What a finished trial's episodes came to.

    Raises:
        RunError: If the store lacks some of them.
    """
    found = evaluation(study, store, trial.theta)
    if found is None:
        raise RunError(f"{store.path}: lacks episodes of trial {trial.number}; move it away and run the study again")
    return found


def _failures(study: Study, store: Store, trials: tuple[TrialRecord, ...]) -> tuple[str, ...]:
    lines: list[str] = []
    for trial in trials:
        if trial.failed_episodes and len(lines) < FAILURES_TOLD:
            driven = known_outcomes(study, store, episodes_of(study.settings, trial)).values()
            lines += [f"trial {trial.number}: {told(outcome)}" for outcome in driven if outcome.metrics is None]
    return tuple(lines[:FAILURES_TOLD])
