"""Correlation of the agents' scores in two domains: SRCC (Pearson) and Kendall's τ, metric by metric."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from proxytune.scores import ROUNDING, Array, Metric, ScoreTable, varies
from proxytune.usefulness.comparison import Comparison, compare
from proxytune.usefulness.many_agents import by_table, kendall_of_table
from proxytune.usefulness.standing import FEW_AGENTS

SIMPLER_EPSILON = 1e-8
"""SIMPLER adds this to Pearson's denominator unless both sides are equal; so do we, for its published figures to come
out to every digit. Elsewhere it is below notice, as long as scores are not of the order of 1e-4 or less."""


@dataclass(frozen=True)
class Correlation:
    """A correlation of proxy and target per metric.

    Attributes:
        name: Which correlation.
        value: Metric to coefficient, −1 to 1; None where it is undefined.
        notes: Why it is undefined or means little, in one line each.
        inputs: What was compared, with its sample sizes.
    """

    name: str
    value: Mapping[str, float | None]
    notes: tuple[str, ...]
    inputs: Comparison
    better: ClassVar[str] = "higher"
    range: ClassVar[tuple[int, int]] = (-1, 1)


def pearson_of_means(proxy: Array, target: Array) -> Array:
    """Pearson's coefficient between two domains.

    Args:
        proxy: Mean scores in the proxy, shape (…, agents, metrics).
        target: Mean scores on the target, broadcastable to the same shape.

    Returns:
        Shape (…, metrics), from −1 to 1; NaN where all agents score alike in one of the domains.
    """
    one = proxy - proxy.mean(axis=-2, keepdims=True)
    other = target - target.mean(axis=-2, keepdims=True)
    norms = np.sqrt((one**2).sum(axis=-2) * (other**2).sum(axis=-2))
    coefficients = np.where((one == other).all(axis=-2), 1.0, (one * other).sum(axis=-2) / (norms + SIMPLER_EPSILON))
    return np.where(varies(proxy) & varies(target), np.clip(coefficients, -1, 1), np.nan)


def kendall_of_means(proxy: Array, target: Array) -> Array:
    """Kendall's τ-b between two domains, shapes as in pearson_of_means."""
    if proxy.shape[-2] > FEW_AGENTS:
        return by_table(kendall_of_table, proxy, target)
    one, other = _orders(proxy), _orders(target)
    concordant = (one * other).sum(axis=(-2, -3))
    pairs = np.abs(one).sum(axis=(-2, -3)) * np.abs(other).sum(axis=(-2, -3))
    return np.asarray(concordant / np.sqrt(np.where(pairs > 0, pairs, np.nan)), dtype=np.float64)


def srcc(*, proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> Correlation:
    """Pearson's correlation of mean scores, the sim-to-real correlation coefficient of Kadian et al. (2020).

    Raises:
        ScoresError: If an agent is missing on one side, there are fewer than two, or a metric is unknown.
    """
    inputs = compare(proxy=proxy, target=target, metrics=metrics)
    return _correlation("SRCC", pearson_of_means(*inputs.means), inputs)


def kendall_tau(*, proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> Correlation:
    """Kendall's τ-b of mean scores: how far the orders of the agents agree; tolerances play no part.

    Raises:
        ScoresError: As in srcc.
    """
    inputs = compare(proxy=proxy, target=target, metrics=metrics)
    return _correlation("Kendall's τ", kendall_of_means(*inputs.means), inputs)


def _orders(means: Array) -> Array:
    """Sign of the difference of every two agents, shape (…, agents, agents, metrics), zero for ties."""
    differences = means[..., :, None, :] - means[..., None, :, :]
    tie = ROUNDING * np.abs(means).max(axis=-2)[..., None, None, :]
    return np.where(np.abs(differences) > tie, np.sign(differences), 0.0)


def _correlation(name: str, values: Array, inputs: Comparison) -> Correlation:
    named = {m.name: None if np.isnan(v) else float(v) for m, v in zip(inputs.metrics, values, strict=True)}
    notes = []
    for column, metric in enumerate(inputs.metrics):
        for where, table in (("in the proxy", inputs.proxy), ("on the target", inputs.target)):
            if not varies(table.means)[column]:
                notes.append(f"{metric.name}: {name} is undefined, since all agents score alike {where}")
    if len(inputs.agents) == 2:
        notes.append(f"{name} of two agents is always 1, −1 or undefined; score more agents")
    return Correlation(name, named, tuple(notes), inputs)
