"""A study from its first trial to its answer, confirmed by fresh episodes; `run_stages` is the whole of it.

All trials share the placement noise of the study's seed, so the θ that the search likes best also suits that noise.
After the trials, finalists are driven under seeds that the search has not seen: the visited θ of lowest expected PRPV,
the most probable θ, visited or not, and the mean of what trials and these two tell of θ, whose fresh episodes count
like trials under other placement noise. The answer is the mean, unless it scores worse than the best finalist by more
than a standard deviation of a fresh score: then the most probable of those that do not. It is driven in repetitions
that nothing was chosen by, as many as its interval needs (`_repetitions`). Beside it stands the nominal θ. What was
driven twice from the same start, here and in the pre-flight, tells the noise of all that (`expect`). No trial depends
on it.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product
from numbers import Real

import numpy as np

from proxytune.arrays import NORMAL_95, Floats
from proxytune.domain import Episode, Outcome, instance_of
from proxytune.errors import EpisodeError
from proxytune.scores import ScoreTable
from proxytune.search import Knowledge, Trial, make_proposer
from proxytune.seeds import fresh_seed
from proxytune.space import Theta
from proxytune.storage import TrialRecord
from proxytune.study.earlier import known_trials, learn
from proxytune.study.facts import NOMINAL, check_facts, note_search
from proxytune.study.opening import Study
from proxytune.study.preflight import placement_pairs, run_preflight
from proxytune.study.run import AfterEarlier, goal_of, knowledge_of, record, retry_failed, run_trials, stopped
from proxytune.study.settings import StudySettings
from proxytune.study.study_run import StudyRun, evaluate_outcomes, outputs_of, plan_episodes, score_table
from proxytune.usefulness import Assessment, Donors, Expectation, assess, donors_of, expect

MOST_FINALISTS = 3
"""At most so many θ are driven again."""
UNVISITED = 0
"""Number of a finalist that no trial visited."""
MOST_REPETITIONS = 5
"""At most so many of the answer, which nothing is chosen by; at least one."""
NARROW = 1.0
"""Half an interval of PRPV [ordered pairs] that more repetitions need not make narrower."""


def run_stages(run: StudyRun, warn: Callable[[str], None], known: Sequence[Outcome | Theta] = ()) -> None:
    """Run a study to its end, from wherever it was left: pre-flight, trials, fresh episodes.

    Before the first trial `warn` hears of another search than before and of parameters without effect. What is known
    are θ to try next, before what the search proposes, and outcomes that need not be simulated.

    Raises:
        InputError, RunError: As `run_trials`.
    """
    check_facts(run)
    _attach(run, known)
    retry_failed(run)
    for line in learn(run):
        warn(line)
    if line := note_search(run.study, run.store):
        warn(line)
    learnt = run_preflight(run)
    for warning in learnt.warnings if learnt and run.spent.episodes else ():
        warn(warning)
    # The proposer allows for the noise that the pre-flight measured.
    proposer = make_proposer(run.study.engine, run.settings.initial, goal_of(run))
    run_trials(run, AfterEarlier(proposer, earlier) if (earlier := known_trials(run)) else proposer)
    run_nominal(run)
    run_confirmation(run)


def _attach(run: StudyRun, known: Sequence[Outcome | Theta]) -> None:
    """Keep outcomes, and open a trial for each θ that has none yet: what is open is not proposed."""
    if outcomes := [one for one in known if isinstance(one, Outcome)]:
        run.store.save_outcome(run.study.identity, *outcomes)
    trials = [*run.finished_trials(), *run.open_trials()]
    tried = {instance_of(trial.theta) for trial in trials}
    wanted = (dict(one.episode.theta) if isinstance(one, Outcome) else one for one in known)
    new = [one for key, one in {instance_of(theta): theta for theta in wanted}.items() if key not in tried]
    if opened := [TrialRecord(number, dict(theta)) for number, theta in enumerate(new, start=len(trials) + 1)]:
        run.save_trials(*opened)


@dataclass(frozen=True)
class Finalist:
    """A θ that has been driven again."""

    trial: TrialRecord  # the trial that visited it, or its own episodes as a trial of number UNVISITED
    fresh: tuple[tuple[Outcome, ...], ...]  # outcomes of each fresh repetition
    scores: tuple[float | None, ...]  # cost in each of these, None where an agent has no episode that worked
    assessment: Assessment | None = None  # over all fresh episodes, of the answer alone

    @property
    def optimism(self) -> float | None:
        """The trial's luck: how much better it scored than its fresh repetitions do on average."""
        known = [one for one in self.scores if one is not None]
        return float(np.mean(known)) - self.trial.score if known and self.trial.score is not None else None


@dataclass(frozen=True)
class Confirmation:
    """The answer of fresh episodes."""

    answer: Finalist  # the answer, its fresh episodes those of the repetitions that nothing was chosen by
    candidates: tuple[Finalist, ...]  # all finalists, the search's own favourite first
    episodes: int  # how many fresh episodes each of these was driven in
    expected: Expectation | None  # what is expected of the answer; None if an agent failed in all its fresh episodes
    knowledge: Knowledge  # what is known of θ, by trials and finalists together

    @property
    def repetitions(self) -> int:
        """How many repetitions of the answer were driven."""
        return len(self.answer.fresh)


@dataclass(frozen=True)
class Nominal:
    """The simulator as it is: the nominal values of the parameters that are searched, and what is expected of it."""

    theta: Theta
    expected: Expectation


def nominal_theta(study: Study) -> Theta | None:
    """The nominal values of the parameters that are searched; None where the family does not know all of them.

    They are the family's `nominal`; where it has none and follows no model, the neutral values of its parameters.
    """
    names, known = study.settings.space.names, getattr(study.family, "nominal", None)
    if not isinstance(known, Mapping):
        known = {} if study.settings.proxy else {name: study.family.parameters[name].neutral for name in names}
    numbers = {name: float(known[name]) for name in names if isinstance(known.get(name), Real)}
    return numbers if len(numbers) == len(names) and all(map(math.isfinite, numbers.values())) else None


def run_nominal(run: StudyRun) -> None:
    """Drive the nominal θ once, where there is one: no trial, and out of the search's sight."""
    if theta := nominal_theta(run.study):
        run.store.save_fact(NOMINAL, dict(theta))
        # Where it fails, nothing is said of it.
        with suppress(EpisodeError):
            run.outcomes(plan_episodes(run.settings, theta), "nominal θ")
    else:
        run.watcher.begin("no nominal θ", len(run.settings.agents) * run.settings.starts)


def nominal_of(run: StudyRun, confirmation: Confirmation | None) -> Nominal | None:
    """The nominal θ from what has been simulated; None if there is none, or an agent has no episode of it."""
    theta = run.store.facts().get(NOMINAL)
    if not isinstance(theta, dict) or set(theta) != set(run.settings.space.names):
        return None
    found = run.evaluation(theta)
    if found is None or found.proxy is None:
        return None
    donors = _donors(run, confirmation.candidates if confirmation else ())
    return Nominal(theta, _expect(run, [found.proxy], donors))


def run_confirmation(run: StudyRun) -> None:
    """Simulate what is missing of the fresh episodes of a study that has come to its end."""
    settings, trials = run.settings, run.finished_trials()
    # An answer that no trial visited needs episodes of its own, also without fresh ones.
    if not stopped(run, trials) or (trials and not settings.confirm):
        return
    learnt, each = knowledge_of(run, trials), len(settings.agents) * settings.starts
    chosen = finalists(trials, learnt)
    planned = [_planned(settings, trial) for trial in chosen]
    after = (settings.confirm + 1 + MOST_REPETITIONS) * each
    run.watcher.begin("fresh episodes", most_confirmation_episodes(settings) - sum(map(len, planned)) - after)
    for number, episodes in enumerate(planned, start=1):
        what = f"fresh episodes {number} of {len(chosen)}"
        run.outcomes(episodes, what)
        run.watcher.finished(what)
    first = _driven(run, chosen) if settings.confirm else None
    mean = _mean_of(run, learnt, first) if first else []
    episodes = [one for trial in mean for one in _planned(settings, trial)]
    run.watcher.begin("fresh episodes of the mean", (settings.confirm + 1) * each - len(episodes))
    run.outcomes(episodes, "fresh episodes of the mean")
    if mean:
        run.watcher.finished("fresh episodes of the mean")
    driven = [*(first or ()), *(_driven(run, mean) or ())]
    more = _repetitions(run, _answer(driven, learnt, _learn_again(run, learnt, driven)), driven) if driven else []
    run.watcher.begin("the answer again", (MOST_REPETITIONS - len(more)) * each)
    run.outcomes([episode for repetition in more for episode in repetition], "the answer again")


def confirmation_of(run: StudyRun, trials: Sequence[TrialRecord], learnt: Knowledge) -> Confirmation | None:
    """The answer of the fresh episodes of these trials; None if it is off, or an episode is still missing."""
    settings = run.settings
    first = _driven(run, finalists(trials, learnt)) if settings.confirm else None
    last = _driven(run, _mean_of(run, learnt, first)) if first else None
    if first is None or last is None:
        return None
    driven = [*first, *last]
    again, each = _learn_again(run, learnt, driven), len(settings.agents) * settings.starts
    answer = _answer(driven, learnt, again)
    known = [run.known(planned) for planned in _repetitions(run, answer, driven)]
    if any(len(one) < each for one in known):
        return None
    answer = _finalist(run, answer.trial, tuple(tuple(one.values()) for one in known))
    tables = [table for one in answer.fresh if (table := _table(run.study, one))]
    expected = _expect(run, tables, _donors(run, driven)) if tables else None
    if expected and (table := _table(run.study, *answer.fresh)):
        whole = assess(proxy=table, target=run.study.target, metrics=settings.metrics)
        answer = replace(answer, assessment=whole.as_expected(expected))
    return Confirmation(answer, tuple(driven), settings.confirm * each, expected, again)


def finalists(trials: Sequence[TrialRecord], learnt: Knowledge) -> list[TrialRecord]:
    """The θ that are driven again before the mean, that of lowest expected PRPV first, by what was finished alone."""
    # Of a pruned trial it is certain that it is none of the best.
    scored = {learnt.space.values(trial.theta): trial for trial in trials if trial.state == "finished"}
    pruned = {learnt.space.values(trial.theta) for trial in trials} - scored.keys()
    whole = {one.values for one in learnt.trials if one.outcome and not np.isnan(one.outcome).any()} - pruned
    expected = {values: mean for values, mean in learnt.expected.items() if values in scored or values in whole}
    best = min(expected, key=expected.__getitem__)
    noise = float(learnt.fresh_scores(best).std())
    near = [values for values, mean in expected.items() if mean - expected[best] <= noise]
    # Where no θ explains the target, the most probable one and the mean are worth little: visited ones do instead.
    lacks = learnt.misfit.fits is False
    probable = learnt.likeliest_of(list(expected)) if lacks else learnt.mode
    chosen = list(dict.fromkeys([near[0], probable, *near[1:]]))[: MOST_FINALISTS - (not lacks)]
    return [scored.get(values) or TrialRecord(UNVISITED, learnt.space.theta(values)) for values in chosen]


def _mean_of(run: StudyRun, learnt: Knowledge, driven: Sequence[Finalist]) -> list[TrialRecord]:
    """The mean of what trials and these finalists tell of θ, if it is worth being driven: none, or one."""
    if learnt.misfit.fits is False:
        return []
    theta = learnt.space.theta(_learn_again(run, learnt, driven).mean)
    return [] if theta in [dict(one.trial.theta) for one in driven] else [TrialRecord(UNVISITED, theta)]


def _planned(settings: StudySettings, trial: TrialRecord) -> list[Episode]:
    """The fresh episodes of a finalist, and under the search's seed those that no trial has driven."""
    first = 1 if trial.number else 0
    seeds = [fresh_seed(settings.seed, repetition) for repetition in range(first, settings.confirm + 1)]
    return [episode for seed in seeds for episode in plan_episodes(settings, trial.theta, seed)]


def _driven(run: StudyRun, chosen: Sequence[TrialRecord]) -> list[Finalist] | None:
    """These finalists with their fresh episodes; None while one is missing, and without θ that fail in their own."""
    found, settings = [], run.settings
    for trial in chosen:
        own, fresh = run.evaluation(trial.theta), []
        for repetition in range(1, settings.confirm + 1):
            planned = plan_episodes(settings, trial.theta, fresh_seed(settings.seed, repetition))
            known = run.known(planned)
            if len(known) < len(planned) or own is None:
                return None
            fresh.append(tuple(known.values()))
        found.append(_finalist(run, trial if trial.number or own is None else record(UNVISITED, own), tuple(fresh)))
    return [one for one in found if one.trial.score is not None]


def _finalist(run: StudyRun, trial: TrialRecord, fresh: tuple[tuple[Outcome, ...], ...]) -> Finalist:
    return Finalist(trial, fresh, tuple(evaluate_outcomes(run.study, trial.theta, one).score for one in fresh))


def _learn_again(run: StudyRun, learnt: Knowledge, driven: Sequence[Finalist]) -> Knowledge:
    """What is known of θ by the trials and by what the finalists did: each repetition has a placement of its own."""

    # On 30 targets whose θ was known its mean was 0.047 of the box off in the median, that of the trials alone 0.054.
    def trial_of(one: Finalist, outcomes: Iterable[Outcome], placement: int) -> Trial:
        values = learnt.space.values(one.trial.theta)
        return Trial(values, None, outputs_of(run.study, list(outcomes)), placement=placement)

    fresh = [trial_of(one, outcomes, -number) for one in driven for number, outcomes in enumerate(one.fresh, start=1)]
    unvisited = [one for one in driven if one.trial.number == UNVISITED]
    own = [run.known(plan_episodes(run.settings, one.trial.theta)).values() for one in unvisited]
    fresh += [trial_of(one, outcomes, 0) for one, outcomes in zip(unvisited, own, strict=True)]
    # A family that draws nothing does the same again, which tells nothing.
    told = {(one.values, one.outcome) for one in learnt.trials}
    new = {(one.values, one.outcome): one for one in fresh}
    return run.learn([*learnt.trials, *(one for key, one in new.items() if key not in told)], learnt.goal)


def _answer(driven: Sequence[Finalist], learnt: Knowledge, again: Knowledge) -> Finalist:
    """The mean, or the most probable, of those that PRPV cannot tell from the best; the best where no θ explains it."""
    by_values = {learnt.space.values(one.trial.theta): one for one in driven}
    own = learnt.expected_of({values: one.trial.score or 0.0 for values, one in by_values.items()})
    # Each has as many fresh episodes, so what fresh noise does to all of them alike favours none.
    fresh = {values: [score for score in one.scores if score is not None] for values, one in by_values.items()}
    expected = {values: float(np.mean([own[values], *scores])) for values, scores in fresh.items()}
    best = min(expected, key=expected.__getitem__)
    if False in (learnt.misfit.fits, again.misfit.fits):
        return by_values[best]
    limit = expected[best] + float(learnt.fresh_scores(best).std())
    alike = [values for values in expected if expected[values] <= limit]
    mean = list(by_values)[-1]
    return by_values[mean if mean in alike else again.likeliest_of(alike)]


def _repetitions(run: StudyRun, answer: Finalist, driven: Sequence[Finalist]) -> list[list[Episode]]:
    """The repetitions of the answer that nothing was chosen by: as many as make its interval narrow."""
    settings, table = run.settings, _table(run.study, answer.fresh[0])
    reach = NORMAL_95 * _expect(run, [table], _donors(run, driven)).deviation if table else np.inf
    count = int(np.clip(np.ceil((reach / NARROW) ** 2), 1, MOST_REPETITIONS))
    seeds = [fresh_seed(settings.seed, settings.confirm + 1 + number) for number in range(count)]
    return [plan_episodes(settings, answer.trial.theta, seed) for seed in seeds]


def _donors(run: StudyRun, driven: Sequence[Finalist]) -> Donors:
    """What was driven twice from the same start: finalists, and the pre-flight's θ."""
    metrics = run.settings.metrics
    pairs = [np.moveaxis(placement_pairs(run)[..., : len(metrics)], 1, 0)]
    for one in driven:
        own = run.known(plan_episodes(run.settings, one.trial.theta))
        pairs += [np.stack([_cells(run, own.values()), _cells(run, fresh)]) for fresh in one.fresh]
    return donors_of(pairs, len(metrics))


def _expect(run: StudyRun, tables: Sequence[ScoreTable], donors: Donors) -> Expectation:
    """What is expected by these tables, under the noise of the donors."""
    settings = run.settings
    return expect(fresh=tables, target=run.study.target, metrics=settings.metrics, donors=donors, seed=settings.seed)


def _cells(run: StudyRun, outcomes: Iterable[Outcome]) -> Floats:
    """The metrics of each agent and start, in the order in which they are planned; NaN where one failed."""
    known = {(one.episode.agent, one.episode.start): one.metrics or {} for one in outcomes}
    places, names = product(run.settings.agents, range(run.settings.starts)), run.settings.metric_names
    return np.array([[known.get(place, {}).get(name, np.nan) for name in names] for place in places])


def most_confirmation_episodes(settings: StudySettings) -> int:
    """The number of episodes that a confirmation takes at most, the nominal θ not counted."""
    repetitions = MOST_FINALISTS * settings.confirm + MOST_FINALISTS - 1 + MOST_REPETITIONS
    return repetitions * len(settings.agents) * settings.starts if settings.confirm else 0


def _table(study: Study, *repetitions: Sequence[Outcome]) -> ScoreTable | None:
    """The scores of repetitions; None if an agent has no episode that worked."""
    worked = {one.episode.agent for outcomes in repetitions for one in outcomes if one.metrics is not None}
    return score_table(*repetitions) if worked == set(study.settings.agents) else None
