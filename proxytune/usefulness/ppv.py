"""PPV, the proxy predictivity value: how far the proxy's scores are from the target's."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from proxytune.errors import InputError
from proxytune.scores import Array, Metric, ScoreTable, varies
from proxytune.settings import nearest
from proxytune.usefulness.comparison import Comparison, compare

SMALLEST_SPREAD = 1e-150


@dataclass(frozen=True)
class Ppv:
    """A proxy predictivity value.

    Attributes:
        value: Weighted error of an agent's scores, 0 (every score foretold) or more; None if no metric has a weight.
        beta: Weight of each metric; None where the target's agents all score alike, so that there is no spread.
        inputs: What was compared, with its sample sizes.
    """

    value: float | None
    beta: Mapping[str, float | None]
    inputs: Comparison
    better: ClassVar[str] = "lower"
    range: ClassVar[tuple[int, None]] = (0, None)

    @property
    def notes(self) -> tuple[str, ...]:
        """What had to be left out, in one line each."""
        return tuple(
            f"{name}: left out of PPV, since all agents score alike on the target and no weight is given"
            for name, weight in self.beta.items()
            if weight is None
        )


def ppv_of_means(proxy: Array, target: Array, weights: Array) -> Array:
    """PPV, eq. (2), of many pairs of tables at once.

    Args:
        proxy: Mean scores in the proxy, shape (…, agents, metrics).
        target: Mean scores on the target, broadcastable to the same shape.
        weights: β, one per metric, shape (…, metrics).

    Returns:
        Shape (…).
    """
    return np.asarray((np.abs(proxy - target) @ weights[..., None])[..., 0].mean(axis=-1), dtype=np.float64)


def ppv(
    *,
    proxy: ScoreTable,
    target: ScoreTable,
    metrics: Sequence[Metric],
    beta: Mapping[str, float] | None = None,
) -> Ppv:
    """Weigh how far the proxy's scores are from the target's, eq. (2) of the paper.

    The definition taken: Σ_m β_m |M_m(proxy) − M_m(target)|, averaged over the agents. Without β each metric weighs
    one over its spread on the target (standard deviation of the agents' means), so that PPV counts standard deviations.

    Args:
        proxy: Scores in the proxy.
        target: Scores on the target.
        metrics: Which metrics count; direction and tolerance play no part.
        beta: A weight for every metric, in one over its unit.

    Raises:
        ScoresError: If an agent is missing on one side, there are fewer than two, or a metric is unknown.
        InputError: If a weight is missing, unknown, negative or not finite.
    """
    inputs = compare(proxy=proxy, target=target, metrics=metrics)
    weights = _given(inputs, beta) if beta is not None else weights_of_spread(inputs.target.means)
    named = {m.name: float(weight) if weight > 0 or beta else None for m, weight in zip(metrics, weights, strict=True)}
    value = float(ppv_of_means(*inputs.means, weights)) if any(w is not None for w in named.values()) else None
    return Ppv(value, named, inputs)


def weights_of_spread(target: Array) -> Array:
    """One over the spread of the agents' mean scores on the target.

    Args:
        target: Mean scores, shape (…, agents, metrics).

    Returns:
        Shape (…, metrics), 0 where all agents score alike, or so nearly that squares of it are none.
    """
    spreads = target.std(axis=-2, ddof=1)
    varied = varies(target) & (spreads > SMALLEST_SPREAD)
    return np.where(varied, 1.0 / np.where(varied, spreads, 1.0), 0.0)


def _given(inputs: Comparison, beta: Mapping[str, float]) -> Array:
    names = [metric.name for metric in inputs.metrics]
    for name, weight in beta.items():
        if name not in names:
            raise InputError(f"weight of '{name}': no such metric; {nearest(name, names)}")
        if not (np.isfinite(weight) and weight >= 0):
            raise InputError(f"weight of '{name}': must be zero or more, got {weight}")
    missing = [name for name in names if name not in beta]
    if missing:
        raise InputError(f"no weight is given for {', '.join(missing)}; give one for every metric or none at all")
    return np.array([beta[name] for name in names])
