"""Cutting an evaluation off once it cannot reach the incumbents any more.

Agents are driven one after the other, each from all starts; then its place among those before it is decided. The pairs
of decided agents are a lower bound of PRPV: eq. (4) of the paper is a sum over pairs, none of them negative. As soon as
that bound lies above the limit, the evaluation cannot end among the incumbents (the trials within one standard
deviation of the score's noise of the lowest posterior mean), whatever the other agents do, and they are not driven. The
order of the agents puts those first that disagreed most with the target so far. Order, limit and verdict follow from
the finished trials and the decided agents' episodes alone: a trial comes to the same end with any number of processes.
The trials of a batch are all held against the trials before it, each by its own episodes.

What the search is told of such a trial is an estimate: the bound, divided by the share that these pairs had of PRPV in
the trials that were not cut off.

What a study is after, and what its finished trials say of θ.
When a study ends, before or with its budget: a function of what is stored, so nothing need be remembered.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from proxytune.arrays import Floats
from proxytune.domain import Episode, Instance, Outcome
from proxytune.search import Goal, Knowledge, batch_at, expected_gain, expected_improvement, fit_surrogate, learn_theta
from proxytune.storage import TrialRecord
from proxytune.study.opening import PRPV, Study
from proxytune.study.preflight import noise_of
from proxytune.study.settings import StopRules
from proxytune.study.study_run import (
    Spent,
    StudyRun,
    compose_of,
    disagreement_of,
    plan_episodes,
    score_table,
    score_trials,
)

FEWEST = 3
"""Trials that must have been scored before one is cut off: fewer say nothing of noise."""
PRIOR_DISAGREEMENT = 1e-3
"""Added to every pair, so that a pair that has never disagreed keeps some weight."""


@dataclass(frozen=True)
class PruningRule:
    """What the evaluations of a batch are held against: a function of the trials finished before it.

    Attributes:
        limit: The score above which one is not among the incumbents.
        order: The agents in the order in which they are driven.
        disagreement: Mean |α_proxy − α_target| of each pair over the scored trials, shape (agents, agents), in the
            same order.
    """

    limit: float
    order: tuple[str, ...]
    disagreement: Floats


@dataclass(frozen=True)
class Pruned:
    """An evaluation that was cut off.

    Attributes:
        decided: The agents that had been driven from all starts.
        bound: PRPV of their pairs, which PRPV of all cannot be below.
        estimate: What PRPV of all is expected to be.
    """

    decided: tuple[str, ...]
    bound: float
    estimate: float


def pruning_rule(run: StudyRun, done: Sequence[TrialRecord]) -> PruningRule | None:
    """What the next trials are held against; None where none is to be cut off.

    That is so during the design, on which all else rests; where a tolerance is a percentage: what is a tie then depends
    on agents not driven yet, so that no pair is decided before the last; and where the objective is another than PRPV,
    of which the pairs decided say nothing.
    """
    settings = run.settings
    scored = [trial for trial in done if trial.state == "finished"]
    percent = any(metric.percent for metric in settings.metrics)
    cuts = settings.cut_off and not percent and run.study.objective == PRPV
    if not cuts or len(done) < settings.initial or len(scored) < FEWEST:
        return None
    surrogate = fit_surrogate(settings.space, score_trials(settings.space, done))
    means, _ = surrogate.at_visited()
    agents = sorted(settings.agents)
    pairs = [run.evaluation_of(trial).disagreement for trial in scored]
    disagreement = PRIOR_DISAGREEMENT + np.mean([matrix for matrix in pairs if matrix is not None], axis=0)
    rows = _telling_first(disagreement)
    limit = float(means.min()) + surrogate.noise_deviation
    return PruningRule(limit, tuple(agents[row] for row in rows), disagreement[np.ix_(rows, rows)])


def run_or_prune(run: StudyRun, trials: Sequence[TrialRecord], against: PruningRule, what: str) -> list[Pruned | None]:
    """Simulate what is missing of the trials until each is through or cut off.

    Episodes that other processes have begun by then are kept in the store, but no trial stands on them.

    Raises:
        EpisodeError: If an episode fails and the study is to stop then.
    """
    study = run.study
    plans = [_in_order(study, trial, against) for trial in trials]
    planned, plan_of = [episode for one in plans for episode in one], {one[0].theta: one for one in plans}
    before = run.known(planned)

    def enough(instance: Instance, known: Mapping[Episode, Outcome]) -> bool:
        # The bound never falls, so the last of the agents decided tells for those before it.
        count = _decided(study, against, plan_of[instance], known)
        return count >= 2 and _pruned_at(study, against, plan_of[instance], known, count) is not None

    run.outcomes(planned, what, enough)
    known = run.known(planned)
    cuts = [_first_pruning(study, against, one, known) for one in plans]
    run.watcher.begin(what, len(planned) - len(known))
    vain = [e for cut, one in zip(cuts, plans, strict=True) if cut for e in one if e.agent not in cut.decided]
    run.spent += Spent(unused=sum(episode in known and episode not in before for episode in vain))
    return cuts


def rescored_pruned(run: StudyRun, trial: TrialRecord) -> TrialRecord:
    """What a trial that was cut off comes to by the study's metrics, if others had led to its end.

    Its agents decided then bound PRPV now (beside a tolerance in percent only nearly); the estimate takes every other
    pair for one like theirs.
    """
    outcomes = run.known(run.episodes_of(trial)).values()
    worked = [outcome for outcome in outcomes if outcome.metrics is not None]
    bound = float(disagreement_of(run.study, score_table(worked), trial.decided).sum())
    driven, agents = len(trial.decided), len(run.settings.agents)
    return replace(trial, bound=bound, score=bound * agents * (agents - 1) / (driven * (driven - 1)))


def spared(run: StudyRun, trials: Sequence[TrialRecord]) -> tuple[int, float]:
    """How many episodes the cut trials did without, and how long their like take [s], by the others' mean time.

    Those that other processes had begun in vain are not among them.
    """
    settings, seconds = run.settings, run.store.seconds()
    planned = [
        episode for trial in trials if trial.decided for episode in plan_episodes(settings, trial.theta, settings.seed)
    ]
    known = run.known(planned)
    missing = [episode for episode in planned if episode not in known]
    return len(missing), sum(seconds.get((episode.agent, episode.start), 0.0) for episode in missing)


def _in_order(study: Study, trial: TrialRecord, against: PruningRule) -> list[Episode]:
    """The episodes of a trial, agent by agent as they are driven."""
    place = {agent: number for number, agent in enumerate(against.order)}
    planned = plan_episodes(study.settings, trial.theta, study.settings.seed)
    return sorted(planned, key=lambda episode: place[episode.agent])


def _first_pruning(
    study: Study, against: PruningRule, planned: Sequence[Episode], known: Mapping[Episode, Outcome]
) -> Pruned | None:
    """The cut by the fewest agents; None if the trial is through."""
    last = _decided(study, against, planned, known)
    cuts = (_pruned_at(study, against, planned, known, count) for count in range(2, last + 1))
    return next((found for found in cuts if found is not None), None)


def _decided(study: Study, against: PruningRule, planned: Sequence[Episode], known: Mapping[Episode, Outcome]) -> int:
    """How many agents, in their order and without the last, have been driven from all starts."""
    starts, most = study.settings.starts, len(against.order) - 1
    through = (all(e in known for e in planned[row * starts : (row + 1) * starts]) for row in range(most))
    return next((row for row, done in enumerate(through) if not done), most)


def _pruned_at(
    study: Study, against: PruningRule, planned: Sequence[Episode], known: Mapping[Episode, Outcome], count: int
) -> Pruned | None:
    """Whether the first so many agents are enough to cut off."""
    names = against.order[:count]
    worked = [known[episode] for episode in planned[: count * study.settings.starts] if known[episode].metrics]
    if {outcome.episode.agent for outcome in worked} != set(names):
        # An agent that failed from every start leaves the trial without a score, not with a bad one.
        return None
    bound = float(disagreement_of(study, score_table(worked), names).sum())
    share = against.disagreement[:count, :count].sum() / against.disagreement.sum()
    return Pruned(names, bound, float(bound / share)) if bound > against.limit else None


def _telling_first(disagreement: Floats) -> list[int]:
    """Rows in the order in which their pairs disagree most, one added after the other."""
    chosen = [int(np.argmax(disagreement.max(axis=1)))]
    while len(chosen) < len(disagreement):
        gains = disagreement[:, chosen].sum(axis=1)
        gains[chosen] = -1.0
        chosen.append(int(np.argmax(gains)))
    return chosen


def goal_of(run: StudyRun) -> Goal:
    """What the study's search is after; a function of the pre-flight and the target's table."""
    table = run.study.target
    outputs = tuple((agent, metric) for agent in table.agents for metric in table.metrics)
    return Goal(outputs, table.means.ravel(), noise_of(run).variance.ravel(), compose_of(run.study))


def knowledge_of(run: StudyRun, done: Iterable[TrialRecord]) -> Knowledge:
    """What finished trials say of θ.

    Raises:
        RunError: If no trial has an outcome, or the store lacks episodes of one.
    """
    trials = [run.search_trial(trial) for trial in done]
    return learn_theta(run.settings.space, trials, goal_of(run), run.settings.seed)


FILE_REMEDY = "raise or remove it to continue"


def stopped(run: StudyRun, done: Sequence[TrialRecord]) -> str:
    """Why a study with these finished trials runs no further, in one phrase; empty while it goes on.

    Only finished trials and the time of their own episodes count, never the clock of this process: a study that was
    stopped stays so when it is run again, and without the rule it goes on to the trials it would have had anyway. Rules
    are asked where a batch has ended: a budget that cut one short has no say in what they would have said of the whole.
    """
    settings = run.settings
    if len(done) >= settings.budget:
        kept = f"; all {len(done)} that are finished count" if len(done) > settings.budget else ""
        return f"the budget of {settings.budget} trials is spent{kept}"
    if batch_at(len(done), settings.batch, settings.initial).start < len(done):
        return ""
    return _out_of_time(run, done) or _nothing_to_gain(run, done)


def seconds_of(run: StudyRun, done: Sequence[TrialRecord]) -> float:
    """How long the episodes of finished trials have taken, all runs together, divided by the processes [s]."""
    settings = run.settings
    seeds = {episode.seed for episode in plan_episodes(settings, {}, settings.seed)}
    return run.store.seconds_of_trials(run.study.objective.name, len(done), seeds) / settings.jobs


def out_of_time(seconds: float, rules: StopRules) -> str:
    """What to say where so many seconds are more than the rules allow; empty where they are not."""
    if rules.wall_time_s is None or seconds < rules.wall_time_s:
        return ""
    return f"episodes took {seconds:.3g} s and stop.wall_time_s is {rules.wall_time_s:g}; {FILE_REMEDY}"


def nothing_to_gain(label: str, gain_and_noise: tuple[float, float], rules: StopRules) -> str:
    """What to say where the most that any θ is expected to improve an objective is too little; else empty."""
    gain, noise = gain_and_noise
    if rules.no_improvement is None or gain >= rules.no_improvement * noise:
        return ""
    return (
        f"no θ is expected to improve {label} by more than {gain:.2g}; its noise is {noise:.2g} and"
        f" stop.no_improvement is {rules.no_improvement:g}; lower or remove it to continue"
    )


def _out_of_time(run: StudyRun, done: Sequence[TrialRecord]) -> str:
    rules = run.settings.stop
    return "" if rules.wall_time_s is None else out_of_time(seconds_of(run, done), rules)


def _nothing_to_gain(run: StudyRun, done: Sequence[TrialRecord]) -> str:
    rules = run.settings.stop
    finished = any(trial.state == "finished" for trial in done)
    if rules.no_improvement is None or len(done) < run.settings.initial or not finished:
        return ""
    return nothing_to_gain(run.study.objective.label, _gain(run, done), rules)


def _gain(run: StudyRun, done: Sequence[TrialRecord]) -> tuple[float, float]:
    """The most that any θ is expected to improve the objective, and its noise, as the study's engine sees it."""
    settings = run.settings
    if run.study.engine.learns_from == "outputs":
        trials = [run.search_trial(trial) for trial in done]
        return expected_gain(settings.space, trials, goal_of(run), settings.seed)
    return expected_improvement(settings.space, score_trials(settings.space, done), settings.seed)
