"""MMRV, the mean maximum rank violation of SIMPLER: what a wrong order costs on the target."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from proxytune.scores import ROUNDING, Array, Metric, ScoreTable
from proxytune.usefulness.comparison import Comparison, compare
from proxytune.usefulness.many_agents import by_table, violations_of_table
from proxytune.usefulness.standing import FEW_AGENTS


@dataclass(frozen=True)
class Mmrv:
    """A mean maximum rank violation per metric.

    Attributes:
        value: Metric to violation, in the metric's unit: 0 (same order) up to the largest difference on the target.
        inputs: What was compared, with its sample sizes.
    """

    value: Mapping[str, float]
    inputs: Comparison
    better: ClassVar[str] = "lower"

    @property
    def range(self) -> Mapping[str, tuple[float, float]]:
        """Smallest and largest possible value per metric."""
        spreads = np.ptp(self.inputs.target.means, axis=0)
        return {m.name: (0.0, float(spread)) for m, spread in zip(self.inputs.metrics, spreads, strict=True)}


def mmrv_of_means(proxy: Array, target: Array, metrics: Sequence[Metric]) -> Array:
    """MMRV of many pairs of tables at once.

    Args:
        proxy: Mean scores in the proxy, shape (…, agents, metrics).
        target: Mean scores on the target, broadcastable to the same shape.
        metrics: Which direction is better; tolerances play no part.

    Returns:
        Shape (…, metrics).
    """
    signs = np.array([1.0 if metric.direction == "max" else -1.0 for metric in metrics])
    if proxy.shape[-2] > FEW_AGENTS:
        return np.asarray(by_table(violations_of_table, proxy * signs, target * signs).mean(axis=-2), dtype=np.float64)
    violated = _above(proxy * signs) != _above(target * signs)
    costs = np.abs(target[..., :, None, :] - target[..., None, :, :]) * violated
    return np.asarray(costs.max(axis=-2).mean(axis=-2), dtype=np.float64)


def mmrv(*, proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> Mmrv:
    """Average over agents the largest target difference among the pairs that the proxy orders wrongly.

    Of two agents that the proxy ties and the target does not, the better one counts as violated, as in SIMPLER's code.
    Source: Li et al., Evaluating Real-World Robot Manipulation Policies in Simulation (2024).

    Raises:
        ScoresError: If an agent is missing on one side, there are fewer than two, or a metric is unknown.
    """
    inputs = compare(proxy=proxy, target=target, metrics=metrics)
    values = mmrv_of_means(*inputs.means, inputs.metrics)
    return Mmrv({m.name: float(value) for m, value in zip(inputs.metrics, values, strict=True)}, inputs)


def _above(scores: Array) -> NDArray[np.bool_]:
    """Whether row scores above column, shape (…, agents, agents, metrics)."""
    tie = ROUNDING * np.abs(scores).max(axis=-2)[..., None, None, :]
    return np.asarray(scores[..., :, None, :] - scores[..., None, :, :] > tie, dtype=np.bool_)
