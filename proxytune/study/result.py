"""What a study has found out: its best θ, how useful the proxy is there, and what that is worth."""

from collections.abc import Sequence
from dataclasses import dataclass

from proxytune.errors import RunError
from proxytune.search.knowledge.importance import Importance, importances
from proxytune.search.knowledge.knowledge import Knowledge
from proxytune.search.surrogate import fit_surrogate
from proxytune.space import Theta
from proxytune.storage.records import TrialRecord
from proxytune.study.evaluation import failure_of
from proxytune.study.knowledge import knowledge_of
from proxytune.study.outputs import score_trials
from proxytune.study.stages.confirmation import Confirmation, confirmation_of
from proxytune.study.stages.cutting import spared
from proxytune.study.stages.noise import noise_of
from proxytune.study.stages.preflight import Preflight, preflight_of
from proxytune.study.stages.stopping import stopped
from proxytune.study.study import Study
from proxytune.study.study_run import StudyRun
from proxytune.usefulness import Assessment, NoiseFloor, assess

FAILURES_TOLD = 10


@dataclass(frozen=True)
class Best:
    """The answer: the θ that fresh episodes confirm, and until then the visited one of lowest expected PRPV.

    It is never the trial with the lowest PRPV for that alone, which is partly luck.

    Attributes:
        trial: The trial that visited it.
        posterior_mean: PRPV that is expected there in fresh episodes.
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
        knowledge: What is known of θ.
        answers: After each trial, the visited θ of lowest expected PRPV as all trials judge it; None while none has
            a score.
        truth: The θ that made the target, where that is known.
        importances: How much each parameter matters, in the order of the box.
        confirmation: What fresh episodes say of it; None if they are off, or not all driven yet.
        preflight: What was learnt of the parameters before the first trial; None if it is off or was never run.
        stopped: Why it runs no further; empty while it is not at its end.
        spared: What the trials that were cut off did without: episodes, and about how many seconds of them.
        failures: The first failed episodes, told in one line each.
        cautions: What the target's table does not allow, in one line each.
    """

    study: Study
    trials: tuple[TrialRecord, ...]
    best: Best
    knowledge: Knowledge
    answers: tuple[TrialRecord | None, ...]
    truth: Theta | None
    importances: tuple[Importance, ...]
    confirmation: Confirmation | None
    preflight: Preflight | None
    stopped: str
    spared: tuple[int, float]
    failures: tuple[str, ...]
    cautions: tuple[str, ...]

    @property
    def unidentified(self) -> tuple[str, ...]:
        """The parameters of which nearly any value in the box is compatible with the target."""
        return self.knowledge.unidentified

    @property
    def inside(self) -> bool:
        """Whether the best θ lies in the 95 % region, which is by every metric of every agent."""
        return self.knowledge.holds(self.knowledge.space.values(self.best.trial.theta))

    @property
    def judged(self) -> Assessment:
        """What the answer is judged by: its fresh episodes, or while there are none its trial's own."""
        fresh = self.confirmation.answer.assessment if self.confirmation else None
        return fresh or self.best.assessment

    @property
    def floor(self) -> NoiseFloor:
        """What a perfect proxy would score: of the same starts where fresh episodes tell."""
        return self.judged.noise_floor

    @property
    def perfect(self) -> bool:
        """Whether it has been shown that the proxy cannot be told from a perfect one.

        By PRPV in fresh episodes, and by every other output: where the answer lies outside the 95 % region, these tell.
        """
        if self.confirmation is None or self.confirmation.answer.assessment is None:
            return False
        return bool(self.judged.at_noise_floor) and self.knowledge.misfit.fits is not False and self.inside

    def value_of(self, trial: TrialRecord) -> float | None:
        """The objective of a finished trial; None of any other."""
        return trial.measures.get(self.study.objective.name)

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
        settings = self.study.settings
        trials = sum((len(trial.decided) or len(settings.agents)) * settings.starts for trial in self.trials)
        before = self.preflight.episodes if self.preflight else 0
        after = self.confirmation.episodes * len(self.confirmation.candidates) if self.confirmation else 0
        return before + trials + after


def result_of(run: StudyRun, scored_anew: Sequence[TrialRecord] | None = None) -> StudyResult:
    """Sum up what the store has, or the same trials scored anew; nothing is simulated.

    Raises:
        RunError: If no trial has a score.
    """
    trials = tuple(run.finished_trials() if scored_anew is None else scored_anew)
    if not any(trial.state == "finished" for trial in trials):
        reason = f"all trials failed, the first because {trials[0].failure}" if trials else "no trial is finished yet"
        raise RunError(f"{run.store.path}: {reason}")
    study, space = run.study, run.settings.space
    learnt = knowledge_of(run, trials)
    confirmation = confirmation_of(run, trials, learnt)
    answers = _answers(trials, learnt)
    answer = confirmation.answer.trial if confirmation else answers[-1]
    assert answer is not None
    return StudyResult(
        study=study,
        trials=trials,
        best=_best(run, answer, learnt),
        knowledge=learnt,
        answers=answers,
        truth=study.truth,
        importances=importances(fit_surrogate(space, score_trials(space, trials))),
        confirmation=confirmation,
        preflight=preflight_of(run),
        stopped=stopped(run, trials),
        spared=spared(run, trials),
        failures=_failures(run, trials),
        cautions=_cautions(run),
    )


def _answers(trials: tuple[TrialRecord, ...], learnt: Knowledge) -> tuple[TrialRecord | None, ...]:
    scored = [trial for trial in trials if trial.state == "finished"]
    expected = {trial.number: learnt.expected[learnt.space.values(trial.theta)] for trial in scored}
    found: list[TrialRecord | None] = []
    best: TrialRecord | None = None
    for trial in trials:
        if trial.number in expected and (best is None or expected[trial.number] < expected[best.number]):
            best = trial
        found.append(best)
    return tuple(found)


def _cautions(run: StudyRun) -> tuple[str, ...]:
    return tuple(line for line in (*run.study.cautions, noise_of(run).caution) if line)


def _best(run: StudyRun, answer: TrialRecord, learnt: Knowledge) -> Best:
    values = learnt.space.values(answer.theta)
    _, deviation = learnt.scores([values])
    proxy = run.evaluation_of(answer).proxy
    assert proxy is not None
    assessment = assess(proxy=proxy, target=run.study.target, metrics=run.settings.metrics)
    return Best(answer, learnt.expected[values], float(deviation[0]), assessment)


def _failures(run: StudyRun, trials: tuple[TrialRecord, ...]) -> tuple[str, ...]:
    lines: list[str] = []
    for trial in trials:
        if trial.failed_episodes and len(lines) < FAILURES_TOLD:
            driven = run.known(run.episodes_of(trial)).values()
            lines += [f"trial {trial.number}: {failure_of(outcome)}" for outcome in driven if outcome.metrics is None]
    return tuple(lines[:FAILURES_TOLD])
