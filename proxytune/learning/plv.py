"""Proxy learning value: how many target samples a proxy saves (Courchesne et al. 2021, equations 5 and 6)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from proxytune.learning.curves import Array, Curve
from proxytune.learning.posterior import DRAWS, Draws, crossing, draw_curves

LEVELS = (0.025, 0.975)
Samples = TypeVar("Samples", float, Array)


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


@dataclass(frozen=True)
class SampleNeeds:
    """How many target samples each learner needs, draw by draw from the posterior of the learning curves.

    Attributes:
        curves: The scores that the examinations gave, by name.
        draws: The mean curves.
        when: When a learner counts as converged; its level is the posterior's mean where none was stated.
        settled: Whether the learner without a proxy converges: over the last doubling of samples it gains no more than
            the tolerance.
        needed: η by name (draws,); infinite where it is not reached up to the largest count.
    """

    curves: Mapping[str, Curve]
    draws: Draws
    when: Convergence
    settled: bool
    needed: Mapping[str, Array]

    @property
    def last(self) -> float:
        """The largest number of target samples."""
        return float(self.draws.counts[-1])


def plv(*, without: Samples, with_proxy: Samples) -> Samples:
    """PLV (eq. 5): target samples needed without the proxy, less those needed with it."""
    return without - with_proxy  # eq. (5)


def general_plv(
    *,
    without: tuple[Samples, Samples],
    with_proxy: tuple[Samples, Samples],
    cost_on: float = 1.0,
    cost_off: float = 1.0,
) -> Samples:
    """PLV where samples gathered by the learner itself cost otherwise than an expert's (eq. 6, as we read it).

    Args:
        without: Target samples needed without the proxy: on-policy η_on, off-policy η_off.
        with_proxy: The same with it.
        cost_on: Cost of an on-policy sample.
        cost_off: Cost of an off-policy sample; with on-policy samples none and cost 1, eq. 5.
    """
    return cost_on * (without[0] - with_proxy[0]) + cost_off * (without[1] - with_proxy[1])  # eq. (6)


def sample_needs(
    curves: Mapping[str, Curve],
    *,
    none: str,
    best_score: float,
    tolerance: float,
    level: float | None = None,
    draws: int = DRAWS,
) -> SampleNeeds:
    """How many target samples each learner needs, from the posterior of all learning curves together.

    Args:
        curves: Scores by name of the learning curve.
        none: The name of the learner without a proxy.
        best_score: The score of a flawless examination; none lies beyond it, nor below its negative.
        tolerance: How far below the level still counts as converged.
        level: The score that counts as converged; None for what the learner without a proxy comes to.
        draws: How many draws.
    """
    drawn = draw_curves(curves, (-best_score, best_score), draws)
    alone = drawn.scores[none]
    levels = alone[:, -1] if level is None else np.full(len(alone), level)
    half = int(np.flatnonzero(2.0 * drawn.counts <= drawn.counts[-1])[-1])
    settled = bool(alone[:, -1].mean() - alone[:, half].mean() <= tolerance)
    needed = {name: crossing(drawn.counts, scores, levels - tolerance) for name, scores in drawn.scores.items()}
    return SampleNeeds(
        curves, drawn, Convergence(float(levels.mean()) if level is None else level, tolerance), settled, needed
    )


def teaching(needs: SampleNeeds, *, none: str, proxy: str) -> Teaching:
    """What a proxy is worth as a teacher, with 95 % intervals.

    Where convergence is not reached, η is known to lie beyond the largest count: ends that this leaves open are None.
    """
    without, needed, last = needs.needed[none], needs.needed[proxy], needs.last
    return Teaching(
        without=_estimate(lambda alone, taught: alone, without, needed, last),
        needed=_estimate(lambda alone, taught: -taught, without, needed, last, sign=-1.0),
        plv=_estimate(lambda alone, taught: plv(without=alone, with_proxy=taught), without, needed, last),
        factor=_estimate(lambda alone, taught: alone / taught, without, needed, last),
        reduction=_estimate(lambda alone, taught: (alone - taught) / alone, without, needed, last),
    )


def difference(needs: SampleNeeds, *, more: str, less: str) -> Estimate:
    """How many more target samples one learner needs than another, with its 95 % interval."""
    return _estimate(lambda one, other: one - other, needs.needed[more], needs.needed[less], needs.last)


def mean_score(needs: SampleNeeds, name: str, place: int) -> Estimate:
    """The mean score of a learner at a place of the drawn curves; None before anything can have been learnt."""
    scores = needs.draws.scores[name][:, place]
    return Estimate(*(_finite(float(end)) for end in (scores.mean(), *np.quantile(scores, LEVELS))))


def _estimate(
    figure: Callable[[Array, Array], Array], without: Array, needed: Array, last: float, sign: float = 1.0
) -> Estimate:
    """A figure that rises with η(∅) and falls with η(S): its median, and the ends that unreached η leave possible."""
    with np.errstate(invalid="ignore", divide="ignore"):
        reached = np.isfinite(needed)
        least = np.where(reached, figure(np.minimum(without, last), needed), -np.inf)
        most = figure(without, np.minimum(needed, last))
        middle = np.where(reached, figure(without, needed), -np.inf)
    ends = (_quantile(middle, 0.5), _quantile(least, LEVELS[0]), _quantile(most, LEVELS[1]))
    value, low, high = (_finite(sign * end) for end in ends)
    return Estimate(value, low, high) if sign > 0 else Estimate(value, high, low)


def _quantile(values: Array, level: float) -> float:
    """The value at a level, without interpolating towards infinity; NaN where nothing is known."""
    known = np.sort(values[~np.isnan(values)])
    return float(known[round(level * (len(known) - 1))]) if len(known) else np.nan


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
