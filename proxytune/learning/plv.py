"""Proxy learning value: how many target samples a proxy saves (Courchesne et al. 2021, equations 5 and 6)."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from proxytune.errors import InputError

Array = NDArray[np.float64]
Number = TypeVar("Number", float, Array)
RESAMPLES = 2000
LEVELS = (2.5, 97.5)


@dataclass(frozen=True)
class Curve:
    """A learning curve: scores in the target by number of target samples.

    Attributes:
        counts: Numbers of target samples, rising, the first 0.
        scores: Scores (seeds, counts); a column is NaN where there is nothing that could drive.

    Raises:
        InputError: If the counts do not rise from 0, or do not match the scores.
    """

    counts: tuple[int, ...]
    scores: Array

    def __post_init__(self) -> None:
        if not self.counts or self.counts[0] != 0:
            raise InputError("a learning curve starts at 0 target samples; add 0 to the grid")
        if any(later <= earlier for earlier, later in itertools.pairwise(self.counts)):
            raise InputError(f"the grid of target samples must rise, got {list(self.counts)}")
        if self.scores.ndim != 2 or self.scores.shape[1] != len(self.counts) or not len(self.scores):
            raise InputError(f"scores have shape {self.scores.shape}; give (seeds, {len(self.counts)})")

    @property
    def mean(self) -> Array:
        """Mean over seeds at each count (counts,)."""
        return np.asarray(self.scores.mean(axis=0))

    def resampled(self, rows: NDArray[np.int64]) -> "Curve":
        """The curve of these seeds, some of them more than once."""
        return Curve(self.counts, self.scores[rows])


@dataclass(frozen=True)
class Convergence:
    """When a learner counts as having converged in the target.

    Attributes:
        level: The score it has to reach: what it converges to without a proxy, unless stated otherwise.
        tolerance: How far below that level still counts as there.
    """

    level: float
    tolerance: float

    @property
    def threshold(self) -> float:
        """The lowest mean score that counts."""
        return self.level - self.tolerance


def converged_level(curve: Curve) -> float:
    """What a learner without a proxy converges to: its mean score at the largest count."""
    return float(curve.mean[-1])


def settled(curve: Curve, tolerance: float) -> bool:
    """Whether the mean score gains no more than the tolerance over the last doubling of samples."""
    half = [place for place, count in enumerate(curve.counts) if 2 * count <= curve.counts[-1]]
    return bool(curve.mean[-1] - curve.mean[half[-1]] <= tolerance)


def samples_needed(curve: Curve, when: Convergence) -> int | None:
    """η: the smallest count of the grid from which on the mean score stays converged; None where it never does.

    Nothing is interpolated or extrapolated: the answer is one of the counts that were tried.
    """
    below = ~(curve.mean >= when.threshold)
    first = int(np.flatnonzero(below)[-1]) + 1 if below.any() else 0
    return curve.counts[first] if first < len(curve.counts) else None


@dataclass(frozen=True)
class Estimate:
    """A figure with its 95 % interval; None where it was not reached, or where the interval's end was not."""

    value: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Teaching:
    """What a proxy is worth as a teacher.

    Attributes:
        without: Target samples needed without it, η(∅).
        needed: Target samples needed with it, η(S).
        plv: η(∅) − η(S): below zero where the proxy harms. None where either is not reached.
        factor: η(∅) / η(S); None also where none are needed.
        reduction: PLV as a share of η(∅).
    """

    without: Estimate
    needed: Estimate
    plv: Estimate
    factor: Estimate
    reduction: Estimate


def plv(*, without: float, with_proxy: float) -> float:
    """PLV (eq. 5): target samples needed without the proxy, less those needed with it."""
    return without - with_proxy  # eq. (5)


def general_plv(
    *,
    without: tuple[Number, Number],
    with_proxy: tuple[Number, Number],
    cost_on: float = 1.0,
    cost_off: float = 1.0,
) -> Number:
    """PLV where samples gathered by the learner itself cost otherwise than an expert's (eq. 6, as we read it).

    Args:
        without: Target samples needed without the proxy: on-policy η_on, off-policy η_off.
        with_proxy: The same with it.
        cost_on: Cost of an on-policy sample.
        cost_off: Cost of an off-policy sample; with on-policy samples none and cost 1, eq. 5.
    """
    return cost_on * (without[0] - with_proxy[0]) + cost_off * (without[1] - with_proxy[1])  # eq. (6)


def teaching(*, without: Curve, with_proxy: Curve, when: Convergence, seed: int = 0) -> Teaching:
    """What a proxy is worth as a teacher, with intervals from resampling the seeds of both curves together.

    The two curves' rows belong to the same seeds, and so to the same target samples. A resample in which convergence
    is not reached counts as beyond the grid: an interval's end that lies there is None.

    Raises:
        InputError: If the two are not on the same grid and seeds.
    """
    if without.counts != with_proxy.counts or without.scores.shape != with_proxy.scores.shape:
        raise InputError("the two learning curves have other counts or seeds; teach both on one grid and seeds")
    rows = np.random.default_rng(seed).integers(0, len(without.scores), (RESAMPLES, len(without.scores)))
    pairs = [
        (_samples_or_infinity(without.resampled(row), when), _samples_or_infinity(with_proxy.resampled(row), when))
        for row in rows
    ]
    base, helped = np.array(pairs).T
    first, second = _samples_or_infinity(without, when), _samples_or_infinity(with_proxy, when)
    return Teaching(
        without=_estimate(first, base),
        needed=_estimate(second, helped),
        plv=_estimate(_difference(first, second), _difference(base, helped)),
        factor=_estimate(_ratio(first, second), _ratio(base, helped)),
        reduction=_estimate(_share(first, second), _share(base, helped)),
    )


def _samples_or_infinity(curve: Curve, when: Convergence) -> float:
    """η, infinite where it is not reached."""
    found = samples_needed(curve, when)
    return np.inf if found is None else float(found)


def _difference(without: Array | float, needed: Array | float) -> Array:
    """η(∅) − η(S); where neither is reached nothing is known."""
    with np.errstate(invalid="ignore"):
        return np.subtract(without, needed)


def _ratio(without: Array | float, needed: Array | float) -> Array:
    """η(∅) / η(S); where η(S) is not reached it lies below anything known."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(np.isinf(needed), -np.inf, np.divide(without, needed))


def _share(without: Array | float, needed: Array | float) -> Array:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.divide(np.subtract(without, needed), without)


def _estimate(value: Array | float, resampled: Array) -> Estimate:
    """The figure and its interval; ends that are not finite are None."""
    known: Sequence[float] = np.sort(resampled[~np.isnan(resampled)]).tolist()
    ends = [_quantile(known, level) for level in LEVELS]
    return Estimate(_finite(float(value)), *(_finite(end) for end in ends))


def _quantile(ordered: Sequence[float], level: float) -> float:
    """The value at a level, without interpolating towards infinity."""
    return ordered[min(len(ordered) - 1, round(level / 100.0 * (len(ordered) - 1)))] if ordered else np.nan


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
