"""PRPV, the proxy relative predictivity value: how many pairs of agents the proxy ranks unlike the target."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from proxytune.scores import Array, Metric, ScoreTable
from proxytune.usefulness.comparison import Comparison, compare
from proxytune.usefulness.many_agents import by_table, prpv_of_table
from proxytune.usefulness.standing import FEW_AGENTS

Flip = Literal["reversed", "lost", "invented"]


@dataclass(frozen=True)
class FlippedPair:
    """Two agents that the proxy ranks unlike the target.

    Attributes:
        better: The one that dominates on the target, or in the proxy where the target has no order.
        worse: The other.
        flip: "reversed" if the proxy says the opposite, "lost" if it sees no order where the target has one,
            "invented" if it sees one where the target has none.
    """

    better: str
    worse: str
    flip: Flip


@dataclass(frozen=True)
class Prpv:
    """A proxy relative predictivity value.

    Attributes:
        value: Sum over ordered pairs of agents, 0 (same order) to K(K−1) (every pair reversed) for K agents.
        inputs: What was compared, with its sample sizes.
    """

    value: int
    inputs: Comparison
    better: ClassVar[str] = "lower"

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


FLIPS: dict[tuple[float, float], Flip] = {(1.0, 0.0): "reversed", (1.0, 0.5): "lost", (0.5, 1.0): "invented"}


def dominance(means: Array, metrics: Sequence[Metric]) -> Array:
    """α, eq. (3): who dominates whom.

    Args:
        means: Mean scores, shape (…, agents, metrics).
        metrics: How each of the metrics compares.

    Returns:
        Shape (…, agents, agents): 1 where row dominates column (better beyond tolerance on one metric, worse on
        none), 0 where column dominates row, 0.5 where they are incomparable or tied.
    """
    first, second = np.triu_indices(means.shape[-2], 1)
    signs = 0.5 * _signs(means, metrics)
    alpha = np.full((*means.shape[:-1], means.shape[-2]), 0.5)
    alpha[..., first, second] += signs
    alpha[..., second, first] -= signs
    return alpha


def prpv_of_means(proxy: Array, target: Array, metrics: Sequence[Metric]) -> Array:
    """PRPV, eq. (4), of many pairs of tables at once.

    Args:
        proxy: Mean scores in the proxy, shape (…, agents, metrics).
        target: Mean scores on the target, broadcastable to the same shape.
        metrics: How each of the metrics compares.

    Returns:
        Shape (…).
    """
    if proxy.shape[-2] > FEW_AGENTS:
        return by_table(lambda one, other: prpv_of_table(one, other, metrics), proxy, target)
    # Each pair counts half in either order.
    difference = np.abs(_signs(proxy, metrics) - _signs(target, metrics))
    return np.asarray(difference.sum(axis=-1), dtype=np.float64)


def _signs(means: Array, metrics: Sequence[Metric]) -> NDArray[np.int8]:
    """2α − 1 of every pair of agents (…, pairs), the first of them before the second."""
    first, second = np.triu_indices(means.shape[-2], 1)
    better, worse = (np.zeros((*means.shape[:-2], len(first)), dtype=np.int8) for _ in range(2))
    for column, metric in enumerate(metrics):
        merits, tie = metric.merits(means[..., column])
        ahead = merits[..., first] - merits[..., second]
        better |= ahead > tie
        worse |= ahead < -tie
    return better - worse


def prpv(*, proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> Prpv:
    """Count how unlike the target the proxy ranks the agents, eqs. (3) and (4) of the paper.

    Raises:
        ScoresError: If an agent is missing on one side, there are fewer than two, or a metric is unknown.
    """
    inputs = compare(proxy=proxy, target=target, metrics=metrics)
    return Prpv(round(float(prpv_of_means(*inputs.means, inputs.metrics))), inputs)
