"""What a study has found out: its best θ, how useful the proxy is there, and what that is worth.

After the search: the answer is driven again in fresh episodes, together with those that are nearly as good.

All trials share the placement noise of the study's seed, so the θ that the search likes best also suits that noise.
The candidates (the visited θ of lowest expected PRPV given all trials, the one that explains the target's outputs best,
and others not more than a standard deviation of a fresh score's noise behind) get episodes under seeds that the search
has not seen. The answer is the candidate whose expected PRPV and fresh scores are lowest on average; what fresh
episodes say of it beside the search's own is how much of that was luck. They tell the noise floor too: what the same
domain scores against itself from the same starts. No trial depends on any of this.
A study's trials as a search of any kind has them, to be kept by other optimisers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from proxytune.domain import Episode, Outcome
from proxytune.errors import RunError
from proxytune.scores import ScoreTable
from proxytune.search import History, Importance, Knowledge, PastTrial, fit_surrogate, importances
from proxytune.seeds import fresh_seed
from proxytune.space import Theta
from proxytune.storage import TrialRecord
from proxytune.study.opening import Study
from proxytune.study.preflight import Preflight, noise_of, preflight_of
from proxytune.study.pruning import knowledge_of, spared, stopped
from proxytune.study.settings import StudySettings
from proxytune.study.study_run import (
    StudyRun,
    evaluate_outcomes,
    failure_of,
    in_common,
    plan_episodes,
    score_table,
    score_trials,
)
from proxytune.usefulness import Assessment, NoiseFloor, assess, floor_of_repeats

CANDIDATES = 3
"""At most so many θ are driven again."""


@dataclass(frozen=True)
class Finalist:
    """A visited θ that has been driven again.

    Attributes:
        trial: The trial that visited it.
        scores: What the study makes small, of each fresh repetition of it; None where an agent has no episode that
            worked.
        assessment: How useful the proxy is there, over all fresh episodes; None if an agent has none that worked.
    """

    trial: TrialRecord
    scores: tuple[float | None, ...]
    assessment: Assessment | None

    @property
    def optimism(self) -> float | None:
        """How much better its trial scored than its fresh repetitions do on average."""
        known = [one for one in self.scores if one is not None]
        return float(np.mean(known)) - self.trial.score if known and self.trial.score is not None else None


@dataclass(frozen=True)
class Confirmation:
    """What fresh episodes say.

    Attributes:
        answer: The candidate whose expected PRPV and fresh scores are lowest on average.
        candidates: All that were driven again, the search's own favourite first.
        episodes: How many fresh episodes each was driven in.
    """

    answer: Finalist
    candidates: tuple[Finalist, ...]
    episodes: int


def run_confirmation(run: StudyRun) -> None:
    """Simulate what is missing of the fresh episodes of a study that has come to its end.

    Raises:
        EpisodeError: If an episode fails and the study is to stop then.
        RunError: If no trial has a score.
    """
    settings, trials = run.settings, run.finished_trials()
    if not settings.confirm or not stopped(run, trials):
        return
    chosen = candidates(trials, knowledge_of(run, trials))
    run.watcher.begin("fresh episodes", most_confirmation_episodes(settings) - len(chosen) * per_candidate(settings))
    for number, trial in enumerate(chosen, start=1):
        planned = [episode for repetition in _plans(settings, trial) for episode in repetition]
        what = f"fresh episodes {number} of {len(chosen)}"
        run.outcomes(planned, what)
        run.watcher.finished(what)


def confirmation_of(run: StudyRun, trials: Sequence[TrialRecord], learnt: Knowledge) -> Confirmation | None:
    """What the fresh episodes say of these trials; None if it is off, or an episode is still missing.

    Args:
        run: The study.
        trials: Finished trials, one of them with a score.
        learnt: What they say of θ.
    """
    if not run.settings.confirm:
        return None
    driven = [_driven_again(run, trial) for trial in candidates(trials, learnt)]
    known = tuple(candidate for candidate in driven if candidate is not None)
    if len(known) < len(driven):
        return None
    return Confirmation(_answer(known, learnt), known, per_candidate(run.settings))


def candidates(trials: Sequence[TrialRecord], learnt: Knowledge) -> list[TrialRecord]:
    """The trials that are driven again, that of lowest expected PRPV first: a function of what was finished alone.

    Args:
        trials: Finished trials, one of them with a score.
        learnt: What they say of θ.
    """
    # Of a trial that was cut off it is certain that it is none of the best.
    scored = {learnt.space.values(trial.theta): trial for trial in trials if trial.state == "finished"}
    expected = {values: mean for values, mean in learnt.expected.items() if values in scored}
    best = min(expected, key=expected.__getitem__)
    noise = float(learnt.fresh_scores(best).std())
    near = [values for values, mean in expected.items() if mean - expected[best] <= noise]
    likeliest = learnt.likeliest_of(list(expected))
    return [scored[values] for values in dict.fromkeys([near[0], likeliest, *near[1:]])][:CANDIDATES]


def per_candidate(settings: StudySettings) -> int:
    """How many fresh episodes a candidate is driven in."""
    return settings.confirm * len(settings.agents) * settings.starts


def most_confirmation_episodes(settings: StudySettings) -> int:
    """How many episodes a confirmation takes at most."""
    return CANDIDATES * per_candidate(settings)


def _plans(settings: StudySettings, trial: TrialRecord) -> list[list[Episode]]:
    """The episodes of each fresh repetition of a trial."""
    seeds = [fresh_seed(settings.seed, repetition) for repetition in range(1, settings.confirm + 1)]
    return [plan_episodes(settings, trial.theta, seed) for seed in seeds]


def _driven_again(run: StudyRun, trial: TrialRecord) -> Finalist | None:
    repetitions = []
    for planned in _plans(run.settings, trial):
        known = run.known(planned)
        if len(known) < len(planned):
            return None
        repetitions.append(list(known.values()))
    scores = tuple(evaluate_outcomes(run.study, trial.theta, outcomes).score for outcomes in repetitions)
    own = list(run.known(plan_episodes(run.settings, trial.theta, run.settings.seed)).values())
    return Finalist(trial, scores, _assessed(run.study, own, repetitions))


def _assessed(study: Study, own: list[Outcome], runs: Sequence[Sequence[Outcome]]) -> Assessment | None:
    """All fresh episodes as one table; of several repetitions, each start is another episode every time.

    The noise floor is what the domain's own trial scores against them.
    """
    scored: dict[tuple[str, str], Mapping[str, float]] = {}
    for repetition, outcomes in enumerate(runs):
        for one in outcomes:
            label = f"{one.episode.start}/{repetition}" if len(runs) > 1 else str(one.episode.start)
            if one.metrics is not None:
                scored[one.episode.agent, label] = one.metrics
    if {agent for agent, _ in scored} != set(study.settings.agents):
        return None
    proxy, metrics = ScoreTable.from_episodes(in_common(scored)), study.settings.metrics
    floor = floor_of_repeats(domain=score_table(own), again=proxy, metrics=metrics)
    return assess(proxy=proxy, target=study.target, metrics=metrics, floor=floor)


def _answer(known: Sequence[Finalist], learnt: Knowledge) -> Finalist:
    """Each candidate has as many fresh episodes, so what fresh noise does to all of them alike favours none."""
    expected = [learnt.expected[learnt.space.values(one.trial.theta)] for one in known]
    scores = [[mean, *(s for s in one.scores if s is not None)] for mean, one in zip(expected, known, strict=True)]
    return known[int(np.argmin([np.mean(each) for each in scores]))]


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
