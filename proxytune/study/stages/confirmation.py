"""After the search: the answer is driven again in fresh episodes, together with those that are nearly as good.

All trials share the placement noise of the study's seed, so the θ that the search likes best also suits that noise.
The candidates (the visited θ of lowest expected PRPV given all trials, the one that explains the target's outputs best,
and others not more than a standard deviation of a fresh score's noise behind) get episodes under seeds that the search
has not seen. The answer is the candidate whose expected PRPV and fresh scores are lowest on average; what fresh
episodes say of it beside the search's own is how much of that was luck. They tell the noise floor too: what the same
domain scores against itself from the same starts. No trial depends on any of this.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from proxytune.domain import Episode, Outcome
from proxytune.scores import ScoreTable
from proxytune.search.knowledge.knowledge import Knowledge
from proxytune.seeds import fresh_seed
from proxytune.storage.records import TrialRecord
from proxytune.study.evaluation import in_common, plan, score, table
from proxytune.study.knowledge import knowledge_of
from proxytune.study.settings import StudySettings
from proxytune.study.stages.stopping import stopped
from proxytune.study.study import Study
from proxytune.study.study_run import StudyRun
from proxytune.usefulness import Assessment, assess, floor_of_repeats

CANDIDATES = 3
"""At most so many θ are driven again."""


@dataclass(frozen=True)
class Candidate:
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

    answer: Candidate
    candidates: tuple[Candidate, ...]
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
    run.watcher.begin("fresh episodes", most_episodes(settings) - len(chosen) * per_candidate(settings))
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


def most_episodes(settings: StudySettings) -> int:
    """How many episodes a confirmation takes at most."""
    return CANDIDATES * per_candidate(settings)


def _plans(settings: StudySettings, trial: TrialRecord) -> list[list[Episode]]:
    """The episodes of each fresh repetition of a trial."""
    seeds = [fresh_seed(settings.seed, repetition) for repetition in range(1, settings.confirm + 1)]
    return [plan(settings, trial.theta, seed) for seed in seeds]


def _driven_again(run: StudyRun, trial: TrialRecord) -> Candidate | None:
    repetitions = []
    for planned in _plans(run.settings, trial):
        known = run.known(planned)
        if len(known) < len(planned):
            return None
        repetitions.append(list(known.values()))
    scores = tuple(score(run.study, trial.theta, outcomes).score for outcomes in repetitions)
    own = list(run.known(plan(run.settings, trial.theta, run.settings.seed)).values())
    return Candidate(trial, scores, _assessed(run.study, own, repetitions))


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
    floor = floor_of_repeats(domain=table(own), again=proxy, metrics=metrics)
    return assess(proxy=proxy, target=study.target, metrics=metrics, floor=floor)


def _answer(known: Sequence[Candidate], learnt: Knowledge) -> Candidate:
    """Each candidate has as many fresh episodes, so what fresh noise does to all of them alike favours none."""
    expected = [learnt.expected[learnt.space.values(one.trial.theta)] for one in known]
    scores = [[mean, *(s for s in one.scores if s is not None)] for mean, one in zip(expected, known, strict=True)]
    return known[int(np.argmin([np.mean(each) for each in scores]))]
