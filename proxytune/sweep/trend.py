"""What a curve shows: where a measure is best, and whether it gets worse on both sides of where it was held."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from proxytune.sweep.curves import Estimate, Series

Side = Literal["worsens", "flat", "turns", "unknown", "unseen"]

OUTWARDS: dict[Side, str] = {
    "worsens": "worsens monotonically within noise",
    "flat": "does not end up worse beyond noise",
    "turns": "turns: gets better again beyond noise",
    "unknown": "cannot be judged without intervals",
    "unseen": "was not looked at",
}


@dataclass(frozen=True)
class Shape:
    """The shape of one measure along a parameter.

    Noise is told by the points' own 95 % intervals: one point is beyond noise of another where the two do not meet.
    That is cautious, since the points share their starts. A point without interval is beyond noise of none.

    Attributes:
        best: The values of the parameter where the measure is best; empty if it is defined nowhere.
        score: Its score there.
        near_best: The values where it is not worse than the best beyond noise.
        held: Where the parameter is held when others are swept; None if that was not said.
        below: What the measure does from there downwards: "worsens" if it never gets better again beyond noise and
            ends up worse beyond noise, "flat" if neither, "turns" if it gets better again beyond noise, "unknown"
            where there is no interval at an end, "unseen" without a point.
        above: The same upwards.
    """

    best: tuple[float, ...]
    score: float | None
    near_best: tuple[float, ...]
    held: float | None
    below: Side
    above: Side

    @property
    def monotone(self) -> bool | None:
        """Whether it worsens on every side that was seen, without a turn; None where that cannot be told."""
        seen = {self.below, self.above} - {"unseen"}
        if seen & {"flat", "turns"}:
            return False
        return True if seen == {"worsens"} else None


@dataclass(frozen=True)
class _Cost:
    """A point whose scores are turned such that lower is better."""

    value: float
    cost: float
    low: float
    high: float


def shape_of(series: Series, held: float | None) -> Shape:
    """Describe one measure round the value at which its parameter is held, as a pure function."""
    sign = -1.0 if series.higher_is_better else 1.0
    costs = [cost for estimate in series.estimates if (cost := _cost(estimate, sign))]
    if not costs:
        return Shape((), None, (), held, "unseen", "unseen")
    least = min(cost.cost for cost in costs)
    best = [cost for cost in costs if cost.cost == least]
    margin = max(cost.high for cost in best)
    near = tuple(cost.value for cost in costs if cost.low <= margin)
    sides = (_side(costs[::-1], held, -1), _side(costs, held, 1))
    return Shape(tuple(cost.value for cost in best), sign * least + 0.0, near, held, *sides)


def describe(series: Series, held: float | None) -> str:
    """The shape in one line."""
    shape = shape_of(series, held)
    if shape.score is None:
        return f"{series.name}: undefined at every point"
    extreme = "highest" if series.higher_is_better else "lowest"
    best, near = ", ".join(f"{value:.4g}" for value in shape.best), _listed(shape.near_best, series)
    line = f"{series.name}: {extreme} ({shape.score:.3g}) at {best}; not worse beyond noise: {near}"
    if held is None:
        return line
    if "unseen" == shape.below == shape.above:
        return line
    return f"{line}; from {held:.4g} downwards it {OUTWARDS[shape.below]}, upwards it {OUTWARDS[shape.above]}"


def _listed(chosen: Sequence[float], series: Series) -> str:
    """The values as a range where they are one, by name where there are gaps."""
    between = [one.value for one in series.estimates if chosen[0] <= one.value <= chosen[-1] and one.score is not None]
    if len(chosen) > 1 and len(between) == len(chosen):
        return f"{chosen[0]:.4g} to {chosen[-1]:.4g}"
    return ", ".join(f"{value:.4g}" for value in chosen)


def _cost(estimate: Estimate, sign: float) -> _Cost | None:
    if estimate.score is None:
        return None
    cost = sign * estimate.score
    if estimate.interval is None:
        return _Cost(estimate.value, cost, -math.inf, math.inf)
    low, high = sorted(sign * end for end in estimate.interval)
    return _Cost(estimate.value, cost, min(low, cost), max(high, cost))


def _side(costs: Sequence[_Cost], held: float | None, direction: int) -> Side:
    """What happens outwards of the held value; the points come in outward order."""
    if held is None or not any(cost.value == held for cost in costs):
        return "unseen"
    path = [cost for cost in costs if direction * (cost.value - held) >= 0]
    if len(path) < 2:
        return "unseen"
    if any(later.high < earlier.low for place, earlier in enumerate(path) for later in path[place + 1 :]):
        return "turns"
    if math.inf in (path[0].high, path[-1].high):
        return "unknown"
    return "worsens" if path[-1].low > path[0].high else "flat"
