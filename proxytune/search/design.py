"""Points that fill the search box evenly: scrambled Sobol sequences."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from proxytune.search.proposer import Values
from proxytune.space import Space


def unit_points(dimensions: int, count: int, seed: int) -> NDArray[np.float64]:
    """The first points of the scrambled Sobol sequence with this seed.

    Returns:
        Array (count, dimensions) within [0, 1); a longer answer begins with every shorter one.
    """
    exponent = max(0, math.ceil(math.log2(count)))
    points: NDArray[np.float64] = qmc.Sobol(dimensions, scramble=True, rng=np.random.default_rng(seed)).random_base2(
        exponent
    )
    return points[:count]


def design_point(space: Space, index: int, seed: int) -> Values:
    """The point number `index` (from 0) of the design: given by index and seed alone."""
    unit = unit_points(len(space.intervals), index + 1, seed)[index]
    return from_unit(space, unit)


def from_unit(space: Space, unit: NDArray[np.float64]) -> Values:
    """A point of the unit cube as values in the box, never beyond its bounds."""
    pairs = zip(space.intervals, unit, strict=True)
    return tuple(min(max(i.low + float(u) * (i.high - i.low), i.low), i.high) for i, u in pairs)


def to_unit(space: Space, values: Values) -> NDArray[np.float64]:
    """Values in the box as a point of the unit cube."""
    pairs = zip(space.intervals, values, strict=True)
    return np.array([(value - i.low) / (i.high - i.low) for i, value in pairs])
