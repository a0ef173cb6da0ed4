"""PRPV, the proxy relative predictivity value: how many pairs of agents the proxy ranks unlike the target."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from proxytune.scores import Array, Metric, ScoreTable
from proxytune.usefulness.comparison import Comparison, compare

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
        flipped = []
        for i, j in zip(*np.nonzero(proxy != target), strict=True):
            if (target[i, j], proxy[i, j]) in FLIPS:
                flipped.append(FlippedPair(agents[i], agents[j], FLIPS[target[i, j], proxy[i, j]]))
        return tuple(flipped)


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
    wins = np.zeros((*means.shape[:-1], means.shape[-2]), dtype=np.bool_)
    for column, metric in enumerate(metrics):
        merits, tie = metric.merits(means[..., column])
        wins |= merits[..., :, None] - merits[..., None, :] > tie[..., None]
    return 0.5 + 0.5 * (wins.astype(np.float64) - np.swapaxes(wins, -1, -2))


def prpv_of_means(proxy: Array, target: Array, metrics: Sequence[Metric]) -> Array:
    """PRPV, eq. (4), of many pairs of tables at once.

    Args:
        proxy: Mean scores in the proxy, shape (…, agents, metrics).
        target: Mean scores on the target, broadcastable to the same shape.
        metrics: How each of the metrics compares.

    Returns:
        Shape (…).
    """
    difference = np.abs(dominance(proxy, metrics) - dominance(target, metrics))
    return np.asarray(difference.sum(axis=(-1, -2)), dtype=np.float64)


def prpv(*, proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> Prpv:
    """Count how unlike the target the proxy ranks the agents, eqs. (3) and (4) of the paper.

    Raises:
        ScoresError: If an agent is missing on one side, there are fewer than two, or a metric is unknown.
    """
    inputs = compare(proxy=proxy, target=target, metrics=metrics)
    return Prpv(round(float(prpv_of_means(*inputs.means, inputs.metrics))), inputs)
