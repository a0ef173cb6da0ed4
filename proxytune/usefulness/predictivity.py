"""The measures beside PRPV: errors, costs of a wrong order and correlations of scores, and unlike observations.

POD  = mean over time of ‖o(proxy) − o(target)‖, under the same commands        # eq. (1)
PPV  = mean over agents of Σ_m β_m |M_m(proxy) − M_m(target)|                        # eq. (2)
MMRV = mean over agents i of max_j |M_i(target) − M_j(target)| where i, j are ordered wrongly (SIMPLER)
SRCC = Pearson's correlation of the agents' mean scores in proxy and target, per metric
Kendall's τ-b = Σ sign(proxy) sign(target) / √(pairs untied in proxy · on target), per metric
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from proxytune.arrays import Floats
from proxytune.errors import InputError
from proxytune.scores import ROUNDING, Metric, varies
from proxytune.settings import nearest
from proxytune.usefulness.comparison import Comparison
from proxytune.usefulness.pairs import FEW_AGENTS, by_table, kendall_of_table, violations_of_table

SMALLEST_SPREAD = 1e-150
LARGEST_WEIGHT = 1e70


@dataclass(frozen=True)
class Ppv:
    """A proxy predictivity value.

    Attributes:
        value: Weighted error of an agent's scores, 0 (every score foretold) or more; None if no metric has a weight.
        beta: Weight of each metric; None where the target's agents all score alike, so that there is no spread.
    """

    value: float | None
    beta: Mapping[str, float | None]

    @property
    def notes(self) -> tuple[str, ...]:
        """Lines on what had to be left out."""
        return tuple(
            f"{name}: left out of PPV, since all agents score alike on the target and no weight is given"
            for name, weight in self.beta.items()
            if weight is None
        )


def ppv_of_means(proxy: Floats, target: Floats, weights: Floats) -> Floats:
    """PPV, eq. (2), of many pairs of tables (…, agents, metrics), which broadcast, by weights β (…, metrics): (…)."""
    return np.asarray((np.abs(proxy - target) @ weights[..., None])[..., 0].mean(axis=-1), dtype=np.float64)


def ppv(inputs: Comparison, beta: Mapping[str, float] | None = None) -> Ppv:
    """Weigh how far the proxy's scores are from the target's, eq. (2) of the paper.

    The definition taken: Σ_m β_m |M_m(proxy) − M_m(target)|, averaged over the agents. Without β each metric weighs
    one over its spread on the target (standard deviation of the agents' means), so that PPV counts standard deviations.
    Direction and tolerance of the metrics play no part.
    """
    weights = weights_of_spread(inputs.target.means)
    if beta is not None:
        names = [metric.name for metric in inputs.metrics]
        for name, weight in beta.items():
            if name not in names:
                raise InputError(f"weight of '{name}': no such metric; {nearest(name, names)}")
            if not 0.0 <= weight <= LARGEST_WEIGHT:
                raise InputError(f"weight of '{name}': must be zero to {LARGEST_WEIGHT:g}, got {weight}")
        if missing := [name for name in names if name not in beta]:
            raise InputError(f"no weight is given for {', '.join(missing)}; give one for every metric or none at all")
        weights = np.array([beta[name] for name in names])
    each = zip(inputs.metrics, weights, strict=True)
    named = {metric.name: float(weight) if weight > 0 or beta else None for metric, weight in each}
    value = float(ppv_of_means(*inputs.means, weights)) if any(w is not None for w in named.values()) else None
    return Ppv(value, named)


def weights_of_spread(target: Floats) -> Floats:
    """One over the spread of agents' mean scores (…, agents, metrics) on the target; 0 where all are nearly alike."""
    spreads = target.std(axis=-2, ddof=1)
    varied = varies(target) & (spreads > SMALLEST_SPREAD)
    return np.where(varied, 1.0 / np.where(varied, spreads, 1.0), 0.0)


@dataclass(frozen=True)
class Mmrv:
    """A mean maximum rank violation per metric, in its unit: 0 (same order) up to the target's largest difference."""

    value: Mapping[str, float]


def mmrv_of_means(proxy: Floats, target: Floats, metrics: Sequence[Metric]) -> Floats:
    """MMRV (…, metrics) of many pairs of tables (…, agents, metrics), which broadcast; tolerances play no part."""
    signs = np.array([1.0 if metric.direction == "max" else -1.0 for metric in metrics])
    if proxy.shape[-2] > FEW_AGENTS:
        return np.asarray(by_table(violations_of_table, proxy * signs, target * signs).mean(axis=-2), dtype=np.float64)
    violated = (orders(proxy * signs) > 0.0) != (orders(target * signs) > 0.0)
    costs = np.abs(target[..., :, None, :] - target[..., None, :, :]) * violated
    return np.asarray(costs.max(axis=-2).mean(axis=-2), dtype=np.float64)


def mmrv(inputs: Comparison) -> Mmrv:
    """Average over agents the largest target difference among the pairs that the proxy orders wrongly.

    Of two agents that the proxy ties and the target does not, the better one counts as violated, as in SIMPLER's code.
    Source: Li et al., Evaluating Real-World Robot Manipulation Policies in Simulation (2024).
    """
    values = mmrv_of_means(*inputs.means, inputs.metrics)
    return Mmrv({m.name: float(value) for m, value in zip(inputs.metrics, values, strict=True)})


SIMPLER_EPSILON = 1e-8
"""SIMPLER adds this to Pearson's denominator unless both sides are equal; so do we, for its published figures to come
out to every digit. Of small scores it is no more than a hundred-thousandth of the denominator, whatever their unit."""


@dataclass(frozen=True)
class Correlation:
    """A correlation of proxy and target per metric, −1 to 1, None where undefined; notes say why, or caution."""

    value: Mapping[str, float | None]
    notes: tuple[str, ...]


def pearson_of_means(proxy: Floats, target: Floats) -> Floats:
    """Pearson's coefficient (…, metrics) of tables (…, agents, metrics); NaN where all agents score alike in one."""
    one = proxy - proxy.mean(axis=-2, keepdims=True)
    other = target - target.mean(axis=-2, keepdims=True)
    norms = np.sqrt((one**2).sum(axis=-2) * (other**2).sum(axis=-2))
    norms = np.where(norms > 0.0, norms + np.minimum(SIMPLER_EPSILON, 1e-5 * norms), 1.0)
    coefficients = np.where((one == other).all(axis=-2), 1.0, (one * other).sum(axis=-2) / norms)
    return np.where(varies(proxy) & varies(target), np.clip(coefficients, -1, 1), np.nan)


def kendall_of_means(proxy: Floats, target: Floats) -> Floats:
    """Kendall's τ-b between two domains, shapes as in pearson_of_means."""
    if proxy.shape[-2] > FEW_AGENTS:
        return by_table(kendall_of_table, proxy, target)
    one, other = orders(proxy), orders(target)
    concordant = (one * other).sum(axis=(-2, -3))
    pairs = np.abs(one).sum(axis=(-2, -3)) * np.abs(other).sum(axis=(-2, -3))
    return np.asarray(concordant / np.sqrt(np.where(pairs > 0, pairs, np.nan)), dtype=np.float64)


def srcc(inputs: Comparison) -> Correlation:
    """Pearson's correlation of mean scores, the sim-to-real correlation coefficient of Kadian et al. (2020)."""
    return _correlation("SRCC", pearson_of_means(*inputs.means), inputs)


def kendall_tau(inputs: Comparison) -> Correlation:
    """Kendall's τ-b of mean scores: how far the orders of the agents agree; tolerances play no part."""
    return _correlation("Kendall's τ", kendall_of_means(*inputs.means), inputs)


def orders(means: Floats) -> Floats:
    """Sign of the difference of every two agents, shape (…, agents, agents, metrics), zero for ties."""
    differences = means[..., :, None, :] - means[..., None, :, :]
    tie = ROUNDING * np.abs(means).max(axis=-2)[..., None, None, :]
    return np.where(np.abs(differences) > tie, np.sign(differences), 0.0)


def _correlation(name: str, values: Floats, inputs: Comparison) -> Correlation:
    named = {m.name: None if np.isnan(v) else float(v) for m, v in zip(inputs.metrics, values, strict=True)}
    notes = []
    for column, metric in enumerate(inputs.metrics):
        for where, table in (("in the proxy", inputs.proxy), ("on the target", inputs.target)):
            if not varies(table.means)[column]:
                notes.append(f"{metric.name}: {name} is undefined, since all agents score alike {where}")
    if len(inputs.agents) == 2:
        notes.append(f"{name} of two agents is always 1, −1 or undefined; score more agents")
    return Correlation(named, tuple(notes))


def pod_of_poses(*, proxy: ArrayLike, target: ArrayLike) -> float:
    """Mean distance of places under the same commands [m], eq. (1) of the paper: ‖(Δx, Δy)‖₂ at each time.

    Both sides have poses at the same times, (…, time, 3): x [m], y [m], heading [rad].

    Raises:
        InputError: If the shapes differ or are none of poses, or a value is missing.
    """
    one, other = _pair(proxy, target)
    if one.ndim < 2 or one.shape[-1] != 3:
        raise InputError(f"poses are arrays of shape (…, time, 3): x, y, heading; got {one.shape}")
    difference = one - other
    return float(np.sqrt(difference[..., 0] ** 2 + difference[..., 1] ** 2).mean())


def pod_of_images(*, proxy: ArrayLike, target: ArrayLike) -> float:
    """Mean difference of camera images under the same commands, eq. (1): root mean square over pixels at each time.

    That is the Euclidean norm of the paper divided by the square root of the number of pixels and channels, as a
    fraction of full scale, so that it does not depend on the resolution. Both sides have images at the same times,
    (time, height, width) or with channels last: whole numbers of 0 to 255 or fractions of 0 to 1.

    Raises:
        InputError: If shapes or types differ or are none of images, or a value is missing or beyond full scale.
    """
    if (np.asarray(proxy).dtype.kind in "iu") != (np.asarray(target).dtype.kind in "iu"):
        raise InputError("images of proxy and target must both be whole numbers (0 to 255) or both fractions (0 to 1)")
    full_scale = 255.0 if np.asarray(proxy).dtype.kind in "iu" else 1.0
    one, other = _pair(proxy, target)
    if one.ndim not in (3, 4):
        raise InputError(f"images are arrays of shape (time, height, width) or with channels last; got {one.shape}")
    if min(one.min(), other.min()) < 0 or max(one.max(), other.max()) > full_scale:
        raise InputError(f"images must be within 0 and {full_scale:g}")
    squares = ((one - other) / full_scale) ** 2
    return float(np.sqrt(squares.reshape(len(squares), -1).mean(axis=1)).mean())


def _pair(proxy: ArrayLike, target: ArrayLike) -> tuple[Floats, Floats]:
    one, other = np.asarray(proxy, dtype=np.float64), np.asarray(target, dtype=np.float64)
    if one.shape != other.shape:
        raise InputError(f"proxy and target must be observed at the same times: shapes {one.shape} and {other.shape}")
    if one.size == 0:
        raise InputError("there is no observation to compare")
    if not (np.isfinite(one).all() and np.isfinite(other).all()):
        raise InputError("an observation is missing (NaN); leave out times at which either domain was not observed")
    return one, other
