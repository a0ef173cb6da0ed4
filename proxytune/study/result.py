"""A study's result: its best θ, how useful the proxy is there, what is known of θ, and how all that was found.

`result_of` sums up what the store has, and `rescored` what the same episodes give by other metrics or tolerances;
nothing is simulated by either. `history_of` gives the trials as a search of any kind has them, to be kept by other
optimisers.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Literal, cast

from proxytune.errors import InputError, RunError
from proxytune.running import ENDLESS
from proxytune.scores import Metric
from proxytune.search import History, Importance, Information, Knowledge, PastTrial, fit_surrogate, importances
from proxytune.settings import nearest
from proxytune.space import Theta
from proxytune.storage import TrialRecord
from proxytune.study.answer import UNVISITED, Confirmation, Nominal, confirmation_of, finalists, nominal_of
from proxytune.study.apart import apart_notes
from proxytune.study.earlier import earlier_trials
from proxytune.study.opening import Study, read_target
from proxytune.study.preflight import Preflight, noise_of, preflight_of
from proxytune.study.pruning import rescored_pruned, spared
from proxytune.study.run import knowledge_of, record, stopped
from proxytune.study.study_run import StudyRun, failure_of, score_trials
from proxytune.usefulness import Assessment, Estimate, Expectation, NoiseFloor, assess

FAILURES_TOLD = 10
BEYOND_DOUBT = 1.7
"""Half widths of its 95 % interval above which an excess of PPV is no chance: 0.1 %, for it holds in nine of ten."""


@dataclass(frozen=True, repr=False)
class Best:
    """The answer: the θ that fresh episodes confirm, and until then the visited one of lowest expected PRPV.

    It is never the trial with the lowest PRPV for that alone, which is partly luck.
    """

    trial: TrialRecord  # the trial that visited it, or its own episodes as a trial of number UNVISITED
    posterior_mean: float  # PRPV that is expected there in fresh episodes
    posterior_deviation: float  # its standard deviation
    assessment: Assessment  # of the proxy there in the trial's own episodes, by every measure

    def __repr__(self) -> str:
        theta = ", ".join(f"{name}={value:.4g}" for name, value in self.trial.theta.items())
        return f"Best: {theta}; {self.assessment!r} in its own episodes"


@dataclass(frozen=True, repr=False)
class StudyResult:
    """A study as it stands."""

    study: Study  # which one
    trials: tuple[TrialRecord, ...]  # its finished and failed trials, in order
    best: Best  # the best of them
    knowledge: Knowledge  # what is known of θ, by trials, and by fresh episodes where there are any
    earlier: int  # the number of trials of earlier studies that count
    low_fidelity: int  # the number of trials of a cheaper proxy
    answers: tuple[TrialRecord | None, ...]  # after each trial, the visited θ of lowest expected PRPV, if any has
    truth: Theta | None  # the θ that made the target, where that is known
    importances: tuple[Importance, ...]  # how much each parameter matters, in the order of the box
    confirmation: Confirmation | None  # what fresh episodes say of it; None if they are off, or not all driven yet
    nominal: Nominal | None  # the simulator as it is; None without nominal values, or before they are driven
    preflight: Preflight | None  # what was learnt before the first trial; None if it is off or was never run
    stopped: str  # why it runs no further; empty while it is not at its end
    spared: tuple[int, float]  # what trials that were cut off did without: episodes, and about their seconds
    failures: tuple[str, ...]  # the first failed episodes, told in one line each
    cautions: tuple[str, ...]  # what the target's table does not allow, and what is probably not meant: a line each
    rescored: bool = False  # whether other metrics judge it than the study searched by

    def __repr__(self) -> str:
        return f"StudyResult of '{self.study.settings.name}': {len(self.trials)} trials; {self.best!r}"

    @property
    def inside(self) -> bool:
        """True if the best θ lies in the 95 % region, which is by every metric of every agent."""
        return self.knowledge.holds(self.knowledge.space.values(self.best.trial.theta))

    @property
    def judged(self) -> Assessment:
        """The usefulness that the answer is judged by: its fresh episodes, or while there are none its trial's own."""
        fresh = self.confirmation.answer.assessment if self.confirmation else None
        return fresh or self.best.assessment

    @property
    def floor(self) -> NoiseFloor:
        """The score of a perfect proxy: of the same starts where fresh episodes tell."""
        return self.judged.noise_floor

    @property
    def expected(self) -> Expectation | None:
        """What is expected of the answer in more episodes; None while no fresh ones tell."""
        return self.confirmation.expected if self.confirmation else None

    @property
    def excess(self) -> Estimate | None:
        """By how much more PRPV is expected of the answer than of a perfect proxy; None where that is not known."""
        return self.expected.prpv.excess if self.expected else None

    @property
    def perfect(self) -> bool:
        """True if the proxy cannot be told from a perfect one.

        By the PRPV expected of it, by a PPV that is worse beyond doubt, and by every other output: where the answer
        lies outside the 95 % region, these tell.
        """
        excess, fits = self.excess, self.knowledge.misfit.fits is not False and self.inside
        if excess is None or excess.low > 0.0 or self.judged.chance.explains or not fits:
            return False
        error = self.expected.ppv.excess if self.expected and self.expected.ppv else None
        return error is None or bool(error.value <= BEYOND_DOUBT * (error.value - error.low))

    @property
    def dead(self) -> frozenset[str]:
        """The parameters that changed no episode at all as the pre-flight moved each by itself."""
        moved = self.preflight.movements if self.preflight else ()
        return frozenset(one.interval.name for one in moved if one.dead and one.pairs)

    @property
    def information(self) -> tuple[Information, ...]:
        """Information of agents and metrics on each parameter; none on those that nothing shows to change anything."""
        silent = self.dead & set(self.knowledge.unidentified)
        return tuple(one for one in self.knowledge.information if one.name not in silent)

    def value_of(self, trial: TrialRecord) -> float | None:
        """The objective of a finished trial; None of any other."""
        return trial.measures.get(self.study.objective.name)

    @property
    def failed_episodes(self) -> int:
        """The number of failed episodes of all trials."""
        return sum(trial.failed_episodes for trial in self.trials)

    @property
    def pruned(self) -> tuple[TrialRecord, ...]:
        """The trials that were stopped early."""
        return tuple(trial for trial in self.trials if trial.state == "cut")

    @property
    def episodes(self) -> int:
        """The number of episodes of trials, pre-flight, nominal θ and confirmation, failed ones counted."""
        settings = self.study.settings
        trials = sum((len(trial.decided) or len(settings.agents)) * settings.starts for trial in self.trials)
        before = self.preflight.episodes if self.preflight else 0
        each, last = len(settings.agents) * settings.starts, self.confirmation
        after = each if self.nominal else 0
        if last:
            own = sum(one.trial.number == UNVISITED for one in last.candidates) + last.repetitions
            after += last.episodes * len(last.candidates) + each * own
        return before + trials + after


def result_of(run: StudyRun, scored_anew: Sequence[TrialRecord] | None = None) -> StudyResult:
    """Sum up what the store has, or the same trials scored anew; a RunError if no trial has a score."""
    trials = tuple(run.finished_trials() if scored_anew is None else scored_anew)
    earlier = earlier_trials(run)
    if not any(trial.state == "finished" for trial in trials) and (run.settings.budget or not earlier):
        reason = f"all trials failed, the first because {trials[0].failure}" if trials else "no trial is finished yet"
        raise RunError(f"{run.store.path}: {reason}")
    study, space = run.study, run.settings.space
    learnt = knowledge_of(run, trials)
    confirmation = confirmation_of(run, trials, learnt)
    answers = _answers(trials, learnt)
    if confirmation:
        answer, learnt = confirmation.answer.trial, confirmation.knowledge
    else:
        answer = answers[-1] if answers and answers[-1] else record(0, run.evaluation_of(finalists(trials, learnt)[0]))
    values = learnt.space.values(answer.theta)
    told = (*study.cautions, _misfit_caution(learnt), noise_of(run).caution, *apart_notes(run.store), _overran(run))
    _, deviation = learnt.scores([values])
    proxy = run.evaluation_of(answer).proxy
    assert proxy is not None
    assessment = assess(proxy=proxy, target=run.study.target, metrics=run.settings.metrics)
    mean = learnt.expected_of({values: answer.score or 0.0})[values]
    best = Best(answer, mean, float(deviation[0]), assessment)
    return StudyResult(
        study=study,
        trials=trials,
        best=best,
        knowledge=learnt,
        earlier=len(earlier),
        low_fidelity=sum(trial.low_fidelity for trial in learnt.trials),
        answers=answers,
        truth=study.truth,
        importances=importances(fit_surrogate(space, [*earlier, *score_trials(space, trials)])),
        confirmation=confirmation,
        nominal=nominal_of(run, confirmation),
        preflight=preflight_of(run),
        stopped=stopped(run, trials),
        spared=spared(run, trials),
        failures=_failures(run, trials),
        cautions=tuple(filter(None, (*told, *best.assessment.cautions))),
    )


def _misfit_caution(learnt: Knowledge) -> str:
    """What a misfit makes of θ, in one line; empty if none is said."""
    if learnt.misfit.fits is not False:
        return ""
    wider = f"the 95 % region is wider for it (log likelihood divided by {learnt.misfit.dispersion:.1f})"
    return f"what the proxy lacks bends θ: {wider}; do not trust θ elsewhere before it is found and added"


def _overran(run: StudyRun) -> str:
    """What a time limit made fail, in one line; empty if nothing."""
    store, study = run.store, run.study
    if not (late := store.failed_by(study.identity, ENDLESS)):
        return ""
    agents = ", ".join(f"'{agent}'" for agent in sorted({episode.agent for episode in late}))
    again = late & store.failed_in_other_code(study.identity, study.code)
    tried = "the same command tries them once more" if again else "in two runs; study --retry-failed tries them again"
    return f"episodes that failed because they took longer than episode_timeout_s: {len(late)}, of {agents}; {tried}"


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


def _failures(run: StudyRun, trials: tuple[TrialRecord, ...]) -> tuple[str, ...]:
    driven = ((trial.number, run.known(run.episodes_of(trial))) for trial in trials if trial.failed_episodes)
    failed = ((number, one) for number, known in driven for one in known.values() if one.metrics is None)
    return tuple(f"trial {number}: {failure_of(one)}" for number, one in islice(failed, FAILURES_TOLD))


def with_metrics(study: Study, metrics: Sequence[Metric]) -> Study:
    """The study with its agents compared by these metrics; an InputError if one is lacking, or named twice."""
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

    An InputError if a metric cannot be used, a RunError if no trial has a score, or episodes are missing.
    """
    own, other = run.finished_trials(), run.of(with_metrics(run.study, metrics))
    trials = [
        rescored_pruned(other, trial) if trial.state == "cut" else record(trial.number, other.evaluation_of(trial))
        for trial in own
    ]
    return replace(result_of(other, trials), stopped=stopped(run, own), rescored=True)


def history_of(result: StudyResult) -> History:
    """The trials of a study that have ended."""
    study = result.study

    def past(trial: TrialRecord) -> PastTrial:
        facts = {
            "trial": trial.number,
            **trial.measures,
            "at_least": trial.bound,
            "expected": trial.estimate,
            "failed_episodes": trial.failed_episodes,
            "failure": trial.failure,
        }
        known = {name: value for name, value in facts.items() if value not in (None, "")}
        state = cast(Literal["finished", "cut", "failed"], trial.state)
        return PastTrial(trial.theta, state, trial.measures.get(study.objective.name), known)

    trials = tuple(past(trial) for trial in result.trials)
    # Where no trial visited the answer, the best of them is as near as a history of trials comes.
    best = result.best.trial if result.best.trial.number else result.answers[-1] if result.answers else None
    if best is None:
        raise RunError(f"{study.settings.path}: no trial is finished yet; raise budget to have any to export")
    answer = [trial.number for trial in result.trials].index(best.number)
    return History(study.settings.name, study.settings.space, trials, study.objective.maximise, answer)
