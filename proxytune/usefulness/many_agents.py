"""PRPV, Kendall's τ and MMRV of many agents, as exact as pair by pair and in seconds instead of minutes."""

from collections.abc import Callable, Sequence

import numpy as np

from proxytune.scores import ROUNDING, Array, Metric
from proxytune.usefulness.standing import Sets, Standing, blocks, count, stand, stand_by_rounding


def by_table(measure: Callable[[Array, Array], float | Array], proxy: Array, target: Array) -> Array:
    """Measure many pairs of tables one by one.

    Args:
        measure: Of two arrays of shape (agents, metrics).
        proxy: Mean scores in the proxy, shape (…, agents, metrics).
        target: Mean scores on the target, broadcastable to the same shape.

    Returns:
        Shape (…), followed by that of what is measured.
    """
    proxy, target = np.broadcast_arrays(proxy, target)
    leading, table = proxy.shape[:-2], proxy.shape[-2:]
    tables = zip(proxy.reshape(-1, *table), target.reshape(-1, *table), strict=True)
    values = np.array([measure(one, other) for one, other in tables], dtype=np.float64)
    return values.reshape((*leading, *values.shape[1:]))


def prpv_of_table(proxy: Array, target: Array, metrics: Sequence[Metric]) -> float:
    """PRPV of mean scores, each of shape (agents, metrics)."""
    sides = [_standings(means, metrics) for means in (proxy, target)]
    value = 0
    for block in blocks(len(proxy)):
        one, other = (_dominated(standings, block) for standings in sides)
        # A pair costs 1 where one side alone has an order, 2 where both have one and it is not the same.
        value += count(one) + count(other) - 2 * count(one & other)
    return float(value)


def kendall_of_table(proxy: Array, target: Array) -> Array:
    """Kendall's τ-b of mean scores, each of shape (agents, metrics): shape (metrics,), NaN where undefined."""
    return np.array([_kendall(one, other) for one, other in zip(proxy.T, target.T, strict=True)])


def violations_of_table(proxy: Array, target: Array) -> Array:
    """The largest violation of each agent in each metric, more being better: arrays of shape (agents, metrics)."""
    return np.stack([_violations(one, other) for one, other in zip(proxy.T, target.T, strict=True)], axis=-1)


def _kendall(proxy: Array, target: Array) -> float:
    """Kendall's τ-b of one metric's mean scores, each of shape (agents,); NaN where all are alike on a side."""
    one, other = stand_by_rounding(proxy), stand_by_rounding(target)
    concordant = 0
    for block in blocks(len(proxy)):
        below, sets = one.sets(block)[one.below], other.sets(block)
        discordant = below & ~sets[other.reach]
        concordant += 2 * (count(below & sets[other.below]) - count(discordant))
    pairs = 2.0 * one.below.sum() * 2.0 * other.below.sum()
    return float(concordant / np.sqrt(pairs)) if pairs else np.nan


def _violations(proxy: Array, target: Array) -> Array:
    """The largest violation of each agent in one metric, more being better: arrays of shape (agents,)."""
    one, other = stand_by_rounding(proxy), stand_by_rounding(target)
    along, tie = target[one.order], ROUNDING * float(np.abs(target).max())
    best_beaten = np.append(-np.inf, np.maximum.accumulate(along))[one.below]
    worst_unbeaten = np.minimum.accumulate(along[::-1])[::-1][one.below]
    invented = np.where(target - best_beaten > tie, 0.0, np.abs(target - best_beaten))
    missed = np.where(target - worst_unbeaten > tie, target - worst_unbeaten, 0.0)
    # Two scores that are not equal but tie cost their difference, which the best of those beaten may not show.
    near = (target > target[other.order][other.below]) & (np.abs(target - best_beaten) < tie)
    for agent in np.flatnonzero(near):
        costs = np.abs(target[agent] - along[: one.below[agent]])
        invented[agent] = costs[target[agent] - along[: one.below[agent]] <= tie].max(initial=0.0)
    return np.maximum(invented, missed)


def _standings(means: Array, metrics: Sequence[Metric]) -> list[Standing]:
    """Where the agents stand in each metric, more being better."""
    merits = (metric.merits(means[:, column]) for column, metric in enumerate(metrics))
    return [stand(scores, float(tie[0])) for scores, tie in merits]


def _dominated(standings: Sequence[Standing], block: slice) -> Sets:
    """The agents that each dominates: ahead of them in one metric, none of them ahead in another."""
    first, *rest = standings
    sets = first.sets(block)
    ahead, not_behind = sets[first.below], sets[first.reach]
    for standing in rest:
        sets = standing.sets(block)
        ahead |= sets[standing.below]
        not_behind &= sets[standing.reach]
    return np.bitwise_and(ahead, not_behind, out=ahead)
