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
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from proxytune.domain import Episode, Outcome
from proxytune.running.progress import Watcher
from proxytune.scores import ScoreTable
from proxytune.search.surrogate import fit_surrogate
from proxytune.storage.records import TrialRecord
from proxytune.storage.store import Store
from proxytune.study.evaluation import Instance, Spent, evaluation, known_outcomes, plan, run_missing, table
from proxytune.study.history import as_trials, episodes_of
from proxytune.study.study import Study
from proxytune.usefulness.prpv import dominance

Array = NDArray[np.float64]
FEWEST = 3
"""Trials that must have been scored before one is cut off: fewer say nothing of noise."""
SHARE = 1e-3
"""Added to every pair, so that a pair that has never disagreed keeps some weight."""


@dataclass(frozen=True)
class Reference:
    """What the evaluations of a batch are held against: a function of the trials finished before it.

    Attributes:
        limit: The score above which one is not among the incumbents.
        order: The agents in the order in which they are driven.
        disagreement: Mean |α_proxy − α_target| of each pair over the scored trials, shape (agents, agents), in the
            same order.
    """

    limit: float
    order: tuple[str, ...]
    disagreement: Array


@dataclass(frozen=True)
class Cut:
    """An evaluation that was cut off.

    Attributes:
        decided: The agents that had been driven from all starts.
        bound: PRPV of their pairs, which PRPV of all cannot be below.
        estimate: What PRPV of all is expected to be.
    """

    decided: tuple[str, ...]
    bound: float
    estimate: float


def reference(study: Study, store: Store, done: Sequence[TrialRecord]) -> Reference | None:
    """What the next trials are held against; None where none is to be cut off.

    That is so during the design, on which all else rests, and where a tolerance is a percentage: what is a tie then
    depends on agents not driven yet, so that no pair is decided before the last.
    """
    settings = study.settings
    scored = [trial for trial in done if trial.state == "finished"]
    percent = any(metric.percent for metric in settings.metrics)
    if not settings.cut_off or percent or len(done) < settings.initial or len(scored) < FEWEST:
        return None
    surrogate = fit_surrogate(settings.space, as_trials(settings.space, done))
    means, _ = surrogate.at_visited()
    tables = [found.proxy for trial in scored if (found := evaluation(study, store, trial.theta)) and found.proxy]
    agents = sorted(settings.agents)
    disagreement = SHARE + np.mean([_disagreement(study, proxy, agents) for proxy in tables], axis=0)
    rows = _telling_first(disagreement)
    limit = float(means.min()) + surrogate.noise_deviation
    return Reference(limit, tuple(agents[row] for row in rows), disagreement[np.ix_(rows, rows)])


def run_or_cut(
    study: Study, store: Store, trials: Sequence[TrialRecord], against: Reference, watcher: Watcher, what: str
) -> tuple[Spent, list[Cut | None]]:
    """Simulate what is missing of the trials until each is through or cut off.

    Episodes that other processes have begun by then are kept in the store, but no trial stands on them.

    Raises:
        EpisodeError: If an episode fails and the study is to stop then.
    """
    plans = [_in_order(study, trial, against) for trial in trials]
    planned, plan_of = [episode for one in plans for episode in one], {one[0].theta: one for one in plans}
    before = known_outcomes(study, store, planned)

    def enough(instance: Instance, known: Mapping[Episode, Outcome]) -> bool:
        # The bound never falls, so the last of the agents decided tells for those before it.
        count = _decided(study, against, plan_of[instance], known)
        return count >= 2 and _cut_at(study, against, plan_of[instance], known, count) is not None

    spent = run_missing(study, store, planned, watcher, what, enough)
    known = known_outcomes(study, store, planned)
    cuts = [_first_cut(study, against, one, known) for one in plans]
    watcher.begin(what, len(planned) - len(known))
    ended = [(cut, one) for cut, one in zip(cuts, plans, strict=True) if cut]
    vain = [episode for cut, one in ended for episode in one if episode.agent not in cut.decided]
    return spent + Spent(unused=sum(episode in known and episode not in before for episode in vain)), cuts


def by_other_metrics(study: Study, store: Store, trial: TrialRecord) -> TrialRecord:
    """What a trial that was cut off comes to by the study's metrics, if others had led to its end.

    Its agents decided then bound PRPV now (beside a tolerance in percent only nearly); the estimate takes every other
    pair for one like theirs.
    """
    outcomes = known_outcomes(study, store, episodes_of(study.settings, trial)).values()
    worked = [outcome for outcome in outcomes if outcome.metrics is not None]
    bound = float(_disagreement(study, table(worked), trial.decided).sum())
    driven, agents = len(trial.decided), len(study.settings.agents)
    return replace(trial, bound=bound, estimate=bound * agents * (agents - 1) / (driven * (driven - 1)))


def spared(study: Study, store: Store, trials: Sequence[TrialRecord]) -> tuple[int, float]:
    """How many episodes the cut trials did without, and how long their like take [s], by the others' mean time.

    Those that other processes had begun in vain are not among them.
    """
    settings, seconds = study.settings, store.seconds()
    planned = [episode for trial in trials if trial.decided for episode in plan(settings, trial.theta, settings.seed)]
    known = known_outcomes(study, store, planned)
    missing = [episode for episode in planned if episode not in known]
    return len(missing), sum(seconds.get((episode.agent, episode.start), 0.0) for episode in missing)


def _in_order(study: Study, trial: TrialRecord, against: Reference) -> list[Episode]:
    """The episodes of a trial, agent by agent as they are driven."""
    place = {agent: number for number, agent in enumerate(against.order)}
    planned = plan(study.settings, trial.theta, study.settings.seed)
    return sorted(planned, key=lambda episode: place[episode.agent])


def _first_cut(
    study: Study, against: Reference, planned: Sequence[Episode], known: Mapping[Episode, Outcome]
) -> Cut | None:
    """The cut by the fewest agents; None if the trial is through."""
    last = _decided(study, against, planned, known)
    cuts = (_cut_at(study, against, planned, known, count) for count in range(2, last + 1))
    return next((found for found in cuts if found is not None), None)


def _decided(study: Study, against: Reference, planned: Sequence[Episode], known: Mapping[Episode, Outcome]) -> int:
    """How many agents, in their order and without the last, have been driven from all starts."""
    starts, most = study.settings.starts, len(against.order) - 1
    through = (all(e in known for e in planned[row * starts : (row + 1) * starts]) for row in range(most))
    return next((row for row, done in enumerate(through) if not done), most)


def _cut_at(
    study: Study, against: Reference, planned: Sequence[Episode], known: Mapping[Episode, Outcome], count: int
) -> Cut | None:
    """Whether the first so many agents are enough to cut off."""
    names = against.order[:count]
    worked = [known[episode] for episode in planned[: count * study.settings.starts] if known[episode].metrics]
    if {outcome.episode.agent for outcome in worked} != set(names):
        # An agent that failed from every start leaves the trial without a score, not with a bad one.
        return None
    bound = float(_disagreement(study, table(worked), names).sum())
    share = against.disagreement[:count, :count].sum() / against.disagreement.sum()
    return Cut(names, bound, float(bound / share)) if bound > against.limit else None


def _disagreement(study: Study, proxy: ScoreTable, agents: Sequence[str]) -> Array:
    """|α_proxy − α_target| of each pair of these agents, in their order."""
    metrics = study.settings.metrics
    names = [metric.name for metric in metrics]
    sides = [table.select(names).arrange(agents=agents).means for table in (proxy, study.target)]
    ranked = [dominance(means, metrics) for means in sides]
    return np.abs(ranked[0] - ranked[1])


def _telling_first(disagreement: Array) -> list[int]:
    """Rows in the order in which their pairs disagree most, one added after the other."""
    chosen = [int(np.argmax(disagreement.max(axis=1)))]
    while len(chosen) < len(disagreement):
        gains = disagreement[:, chosen].sum(axis=1)
        gains[chosen] = -1.0
        chosen.append(int(np.argmax(gains)))
    return chosen
