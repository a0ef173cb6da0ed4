"""Proxy learning value: how many target samples a proxy saves (Courchesne et al. 2021, equations 5 and 6)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from proxytune.learning.curves import Array, Curve
from proxytune.learning.posterior import DRAWS, Draws, crossing, draw_curves

LEVELS = (0.025, 0.975)
"""Ends of a 95 % interval, as quantiles of draws."""
ROUNDING = 1e-9
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

    @property
    def above_zero(self) -> bool:
        """Whether its whole interval lies above 0; how far above may be unknown."""
        return self.low is not None and self.low > 0.0

    @property
    def at_most_zero(self) -> bool:
        """Whether no part of its interval lies above 0."""
        return self.high is not None and self.high <= 0.0


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
        gain: What the learner without a proxy gains over the last doubling of samples; None where it has learnt nothing
            before that.
        needed: η by name (draws,); infinite where it is not reached up to the largest count.
    """

    curves: Mapping[str, Curve]
    draws: Draws
    when: Convergence
    gain: float | None
    needed: Mapping[str, Array]

    @property
    def settled(self) -> bool:
        """Whether the learner without a proxy converges: over the last doubling it gains no more than the tolerance."""
        return self.gain is not None and self.gain <= self.when.tolerance

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
        best_score: The score of a flawless examination; none is expected beyond it, nor below its negative.
        tolerance: How far below the level still counts as converged.
        level: The score that counts as converged; None for what the learner without a proxy comes to.
        draws: How many draws.
    """
    drawn = draw_curves(curves, _bounds(curves, best_score), draws)
    alone = drawn.scores[none]
    levels = alone[:, -1] if level is None else np.full(len(alone), level)
    needed = {
        name: crossing(drawn.counts, scores, levels - tolerance, drawn.first) for name, scores in drawn.scores.items()
    }
    when = Convergence(float(levels.mean()) if level is None else level, tolerance)
    return SampleNeeds(curves, drawn, when, _last_gain(drawn, alone), needed)


def _last_gain(drawn: Draws, alone: Array) -> float | None:
    """What the learner without a proxy gains over the last doubling of samples; None if it begins within that."""
    if 2.0 * drawn.first > drawn.counts[-1] * (1.0 + ROUNDING):
        return None
    # Where the first count is half the last one, the place drawn next to it may lie before anything is learnt
    half = max(np.flatnonzero(2.0 * drawn.counts <= drawn.counts[-1])[-1], np.argmax(np.isfinite(alone[0])))
    return float(alone[:, -1].mean() - alone[:, half].mean())


def _bounds(curves: Mapping[str, Curve], best_score: float) -> tuple[float, float]:
    """Lowest and highest score there can be; a family's own scores may lie beyond those of one that drives."""
    scores = np.concatenate([curve.scores[np.isfinite(curve.scores)] for curve in curves.values()])
    return float(min(-best_score, scores.min())), float(max(best_score, scores.max()))


def teaching(needs: SampleNeeds, *, none: str, proxy: str) -> Teaching:
    """What a proxy is worth as a teacher, with 95 % intervals.

    Where convergence is not reached, η is known to lie beyond the largest count: ends that this leaves open are None.
    """
    return Teaching(
        without=samples_needed(needs, none),
        needed=samples_needed(needs, proxy),
        plv=difference(needs, more=none, less=proxy),
        factor=estimate(lambda alone, taught: alone / taught, needs, more=none, less=proxy),
        reduction=estimate(lambda alone, taught: 1.0 - taught / alone, needs, more=none, less=proxy),
    )


def samples_needed(needs: SampleNeeds, name: str) -> Estimate:
    """How many target samples a learner needs, with its 95 % interval; None beyond the largest count."""
    needed = needs.needed[name]
    least = np.minimum(needed, needs.last)
    return _ends(least=least, middle=needed, most=needed)


def difference(needs: SampleNeeds, *, more: str, less: str) -> Estimate:
    """How many more target samples one learner needs than another, with its 95 % interval."""
    return estimate(lambda one, other: plv(without=one, with_proxy=other), needs, more=more, less=less)


def estimate(figure: Callable[[Array, Array], Array], needs: SampleNeeds, *, more: str, less: str) -> Estimate:
    """A figure of what two learners need, with the ends of its 95 % interval that unreached η leave possible.

    Args:
        figure: From the η of both, draw by draw; it rises with the first and falls with the second.
        needs: How many target samples each learner needs.
        more: The name of the first learner.
        less: The name of the second.
    """
    first, second, last = needs.needed[more], needs.needed[less], needs.last
    reached = np.isfinite(second)
    with np.errstate(invalid="ignore", divide="ignore"):
        least = np.where(reached, figure(np.minimum(first, last), second), -np.inf)
        most = figure(first, np.minimum(second, last))
        # Even a figure that is bounded is not known where the first is not
        known = np.where(np.isfinite(first), figure(first, second), np.inf)
    return _ends(least=least, middle=np.where(reached, known, -np.inf), most=most)


def mean_score(needs: SampleNeeds, name: str, place: int) -> Estimate:
    """The mean score of a learner at a place of the drawn curves; None before anything can have been learnt."""
    scores = needs.draws.scores[name][:, place]
    return Estimate(*(_finite(float(end)) for end in (scores.mean(), *np.quantile(scores, LEVELS))))


def _ends(*, least: Array, middle: Array, most: Array) -> Estimate:
    """The median of a figure, and its 95 % interval from the least and the most that it may be in each draw."""
    ends = (_quantile(middle, 0.5), _quantile(least, LEVELS[0]), _quantile(most, LEVELS[1]))
    return Estimate(*(_finite(end) for end in ends))


def _quantile(values: Array, level: float) -> float:
    """The value at a level, without interpolating towards infinity; NaN where nothing is known."""
    known = np.sort(values[~np.isnan(values)])
    return float(known[round(level * (len(known) - 1))]) if len(known) else np.nan


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
