"""PRPV, the proxy relative predictivity value: the number of pairs of agents that the proxy ranks unlike the target.

    α_ij = 1 if agent i dominates j, 0 if j dominates i, 0.5 if neither             # eq. (3)
    PRPV = Σ_ij |α_ij(proxy) − α_ij(target)|, from 0 to K(K−1) for K agents         # eq. (4)

Up to FEW_AGENTS agents every pair is compared, in many tables at once. For more agents the same numbers come from
sorted columns: who is ahead of whom is a set of bits per agent, and pairs are counted by words of 64. Kendall's τ and
MMRV of many agents use the same sorted columns.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Floats, Whole
from proxytune.scores import ROUNDING, Metric
from proxytune.usefulness.comparison import Comparison

FEW_AGENTS = 128
"""Up to so many agents each pair is compared, in many tables at once, which is quicker for them."""
Flip = Literal["reversed", "lost", "invented"]
FLIPS: dict[tuple[float, float], Flip] = {(1.0, 0.0): "reversed", (1.0, 0.5): "lost", (0.5, 1.0): "invented"}


@dataclass(frozen=True)
class FlippedPair:
    """Two agents that the proxy ranks unlike the target; `better` dominates there, or in the proxy if only that orders.

    It is "reversed" by the proxy, or "lost" where only the target has an order, "invented" where only the proxy has
    one.
    """

    better: str
    worse: str
    flip: Flip


@dataclass(frozen=True)
class Prpv:
    """A proxy relative predictivity value."""

    value: int  # sum over ordered pairs of agents, 0 (same order) to K(K−1) (every pair reversed) for K agents
    inputs: Comparison  # what was compared, with its sample sizes

    @property
    def range(self) -> tuple[int, int]:
        """Smallest and largest possible value."""
        agents = len(self.inputs.agents)
        return 0, agents * (agents - 1)

    @property
    def normalised(self) -> float:
        """The value as a fraction of its largest possible one."""
        return self.value / self.range[1]

    @cached_property
    def pairs(self) -> tuple[FlippedPair, ...]:
        """Every pair that the proxy ranks unlike the target; a reversed one costs 2, others 1."""
        proxy, target = (dominance(means, self.inputs.metrics) for means in self.inputs.means)
        agents = self.inputs.agents
        better, worse = np.nonzero((proxy != target) & ((target == 1.0) | ((target == 0.5) & (proxy == 1.0))))
        sides = zip(target[better, worse].tolist(), proxy[better, worse].tolist(), strict=True)
        pairs = zip(better.tolist(), worse.tolist(), sides, strict=True)
        return tuple(FlippedPair(agents[i], agents[j], FLIPS[flip]) for i, j, flip in pairs)


def prpv(inputs: Comparison) -> Prpv:
    """Count how unlike the target the proxy ranks the agents, eqs. (3) and (4) of the paper."""
    return Prpv(round(float(prpv_of_means(*inputs.means, inputs.metrics))), inputs)


def prpv_of_means(proxy: Floats, target: Floats, metrics: Sequence[Metric]) -> Floats:
    """PRPV, eq. (4), of many pairs of tables of mean scores (…, agents, metrics), which broadcast: shape (…)."""
    if proxy.shape[-2] > FEW_AGENTS:
        return by_table(lambda one, other: prpv_of_table(one, other, metrics), proxy, target)
    # Each pair counts half in either order.
    return np.asarray(np.abs(_signs(proxy, metrics) - _signs(target, metrics)).sum(axis=-1), dtype=np.float64)


def dominance(means: Floats, metrics: Sequence[Metric]) -> Floats:
    """α, eq. (3), of mean scores (…, agents, metrics): who dominates whom, shape (…, agents, agents).

    It is 1 where row dominates column (better beyond tolerance on one metric, worse on none), 0 where column dominates
    row, 0.5 where they are incomparable or tied.
    """
    first, second = np.triu_indices(means.shape[-2], 1)
    signs = 0.5 * _signs(means, metrics)
    alpha = np.full((*means.shape[:-1], means.shape[-2]), 0.5)
    alpha[..., first, second] += signs
    alpha[..., second, first] -= signs
    return alpha


def _signs(means: Floats, metrics: Sequence[Metric]) -> NDArray[np.int8]:
    """2α − 1 of every pair of agents (…, pairs), the first of them before the second."""
    first, second = np.triu_indices(means.shape[-2], 1)
    better, worse = (np.zeros((*means.shape[:-2], len(first)), dtype=np.int8) for _ in range(2))
    for column, metric in enumerate(metrics):
        merits, tie = metric.merits(means[..., column])
        # take: an index would need three times as long
        ahead = merits.take(first, axis=-1) - merits.take(second, axis=-1)
        better |= ahead > tie
        worse |= ahead < -tie
    return better - worse


Sets = NDArray[np.uint64]
"""One set of agents per row, one bit per agent."""
BITS = 64
WORDS = 2**20
"""Most words of 64 bits that one set of agents per agent may take, 8 MiB: more agents go in several blocks."""


@dataclass(frozen=True)
class Standing:
    """One column sorted: how many agents each is ahead of (first in the order), and how many are not ahead of it."""

    order: Whole
    below: Whole
    reach: Whole

    def sets(self, block: slice) -> Sets:
        """The first 0, 1, … agents of the order as sets, shape (agents + 1, words): the bits of this block of words."""
        agents, words = len(self.order), block.stop - block.start
        word = self.order // BITS - block.start
        rows = np.flatnonzero((word >= 0) & (word < words))
        sets = np.zeros((agents + 1, words), dtype=np.uint64)
        sets[rows + 1, word[rows]] = np.uint64(1) << (self.order[rows] % BITS).astype(np.uint64)
        return np.bitwise_or.accumulate(sets, axis=0, out=sets)


def stand(scores: Floats, tie: float) -> Standing:
    """Sort a column (agents,), finite; differences up to `tie` are ties."""
    agents = len(scores)
    order = np.argsort(scores)
    ahead_of = _ahead_of(scores[order], tie)
    below, reach = np.empty((2, agents), dtype=np.int64)
    below[order] = ahead_of
    reach[order] = np.searchsorted(ahead_of, np.arange(agents), side="right")
    return Standing(order, below, reach)


def stand_by_rounding(scores: Floats) -> Standing:
    """Sort a column in which only rounding makes ties."""
    return stand(scores, ROUNDING * float(np.abs(scores).max()))


def blocks(agents: int) -> Iterator[slice]:
    """The words of a set of agents, as many at a time as memory is to take."""
    words, size = -(-agents // BITS), max(1, WORDS // (agents + 1))
    return (slice(start, min(start + size, words)) for start in range(0, words, size))


def count(sets: Sets) -> int:
    """Count the agents in all these sets together."""
    return int(np.bitwise_count(sets).sum(dtype=np.int64))


def _ahead_of(ascending: Floats, tie: float) -> Whole:
    """Count, for each of ascending scores, those that it exceeds by more than a tie, as the difference rounds."""
    guess = np.searchsorted(ascending, ascending - tie)
    last, first = ascending[np.maximum(guess - 1, 0)], ascending[guess]
    if (((ascending - last > tie) | (guess == 0)) & ~(ascending - first > tie)).all():
        return np.asarray(guess, dtype=np.int64)
    low, high = np.zeros(len(ascending), dtype=np.int64), np.arange(len(ascending))
    while (low < high).any():
        middle = (low + high) // 2
        exceeds = ascending - ascending[middle] > tie
        low, high = np.where(exceeds, middle + 1, low), np.where(exceeds, high, middle)
    return low


def by_table(measure: Callable[[Floats, Floats], float | Floats], proxy: Floats, target: Floats) -> Floats:
    """Measure pairs of tables (…, agents, metrics), which broadcast, one by one: (…), and the shape of a measure."""
    proxy, target = np.broadcast_arrays(proxy, target)
    leading, table = proxy.shape[:-2], proxy.shape[-2:]
    tables = zip(proxy.reshape(-1, *table), target.reshape(-1, *table), strict=True)
    values = np.array([measure(one, other) for one, other in tables], dtype=np.float64)
    return values.reshape((*leading, *values.shape[1:]))


def prpv_of_table(proxy: Floats, target: Floats, metrics: Sequence[Metric]) -> float:
    """PRPV of mean scores, each of shape (agents, metrics)."""
    sides, value = [], 0
    for means in (proxy, target):
        merits = (metric.merits(means[:, column]) for column, metric in enumerate(metrics))
        sides.append([stand(scores, float(tie[0])) for scores, tie in merits])
    for block in blocks(len(proxy)):
        one, other = (_dominated(standings, block) for standings in sides)
        # A pair costs 1 where one side alone has an order, 2 where both have one and it is not the same.
        value += count(one) + count(other) - 2 * count(one & other)
    return float(value)


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


def kendall_of_table(proxy: Floats, target: Floats) -> Floats:
    """Kendall's τ-b of mean scores, each of shape (agents, metrics): shape (metrics,), NaN where undefined."""
    coefficients = []
    for one, other in zip(map(stand_by_rounding, proxy.T), map(stand_by_rounding, target.T), strict=True):
        concordant = 0
        for block in blocks(len(proxy)):
            below, sets = one.sets(block)[one.below], other.sets(block)
            concordant += 2 * (count(below & sets[other.below]) - count(below & ~sets[other.reach]))
        pairs = 2.0 * one.below.sum() * 2.0 * other.below.sum()
        coefficients.append(float(concordant / np.sqrt(pairs)) if pairs else np.nan)
    return np.array(coefficients)


def violations_of_table(proxy: Floats, target: Floats) -> Floats:
    """The largest violation of each agent in each metric, more being better: arrays of shape (agents, metrics)."""
    return np.stack([_violations(one, other) for one, other in zip(proxy.T, target.T, strict=True)], axis=-1)


def _violations(proxy: Floats, target: Floats) -> Floats:
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
