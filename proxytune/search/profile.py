"""What the surrogate says of one parameter at a time: its profile, its partial dependence, and how well it is known."""

from dataclasses import dataclass

import numpy as np

from proxytune.search.design import from_unit, unit_points
from proxytune.search.proposer import Values
from proxytune.search.surrogate import Array, Surrogate, unit_array

GRID = 31
CLOUD = 128
AVERAGED = 64
LEVEL = 1.96
"""In standard deviations: 95 % of a normal distribution."""


@dataclass(frozen=True)
class Profile:
    """One parameter of the box, the others either at their best or averaged out; arrays are along its grid.

    Attributes:
        name: The parameter.
        values: The grid, from one bound to the other.
        lowest: Posterior mean of the score with the other parameters where that is lowest.
        deviation: Standard deviation of its difference to the incumbent's, the noise of a fresh score included.
        low: How low a fresh score may be, for some values of the other parameters, at the 95 % level: also where no
            trial has been.
        high: How high it may be at most, for some values of the other parameters.
        average: Posterior mean of the score, averaged over the other parameters: the partial dependence.
        average_deviation: Its standard deviation, noise excluded.
        best: The incumbent's value.
        incumbent: Posterior mean of the score there.
    """

    name: str
    values: Array
    lowest: Array
    deviation: Array
    low: Array
    high: Array
    average: Array
    average_deviation: Array
    best: float
    incumbent: float

    @property
    def not_worse(self) -> Array:
        """Where some θ is not worse than the incumbent at the 95 % level, as far as is known, as truth values.

        Looking only where the posterior mean is lowest would leave out what has not been explored: on the analytic
        stand-in such an interval held the true blur in 7 of 12 searches, this one in all.
        """
        return np.asarray(self.low <= self.incumbent)

    @property
    def interval(self) -> tuple[float, float]:
        """The smallest and largest value not worse than the incumbent's beyond noise."""
        inside = [*self.values[self.not_worse].tolist(), self.best]
        return min(inside), max(inside)

    @property
    def unidentified(self) -> bool:
        """Whether the profile is flat: with the others at their best, no value is worse than the best beyond noise."""
        return bool((self.lowest - self.incumbent <= LEVEL * self.deviation).all())


def profiles(surrogate: Surrogate, answer: Values | None = None) -> tuple[Profile, ...]:
    """The profile of every parameter, in the order of the box, against the answer or, without one, the incumbent."""
    values = surrogate.incumbent()[0] if answer is None else answer
    best = unit_array(surrogate.space, [values])[0]
    incumbent = float(surrogate.mean(best[None])[0])
    return tuple(_profile(surrogate, column, best, incumbent) for column in range(len(best)))


def _profile(surrogate: Surrogate, column: int, best: Array, incumbent: float) -> Profile:
    dimensions = len(best)
    places = np.linspace(0.0, 1.0, GRID)
    above, deviation, low, high = _along(surrogate, column, places, best)
    average, average_deviation = _averaged(surrogate, column, places, dimensions)
    interval = surrogate.space.intervals[column]
    ends = [np.where(np.arange(dimensions) == column, place, best) for place in places]
    return Profile(
        name=interval.name,
        values=np.array([from_unit(surrogate.space, end)[column] for end in ends]),
        lowest=incumbent + above,
        deviation=deviation,
        low=incumbent + low,
        high=incumbent + high,
        average=average,
        average_deviation=average_deviation,
        best=interval.low + float(best[column]) * (interval.high - interval.low),
        incumbent=incumbent,
    )


def _along(surrogate: Surrogate, column: int, places: Array, best: Array) -> Array:
    """How far above the best one parameter's grid lies: rows lowest mean, its deviation, and both ends of the band.

    The ends are lowest over the other parameters, each for itself, so that they do not jump where the lowest mean
    moves from one valley to another.
    """
    visited = unit_array(surrogate.space, [trial.values for trial in surrogate.visited])
    points = np.concatenate([visited, unit_points(visited.shape[1], CLOUD, 0)])
    found = []
    for place in places:
        points[:, column] = place
        above, deviation = _above(surrogate, points, best)
        row, reach = int(np.argmin(above)), LEVEL * deviation
        found.append((above[row], deviation[row], (above - reach).min(), (above + reach).min()))
    return np.array(found).T


def _averaged(surrogate: Surrogate, column: int, places: Array, dimensions: int) -> tuple[Array, Array]:
    """Mean of the posterior over the other parameters at each place of one, and the standard deviation of that."""
    points = unit_points(dimensions, AVERAGED, 0)
    averages, deviations = [], []
    for place in places:
        points[:, column] = place
        mean, covariance = surrogate.joint(points)
        averages.append(mean.mean())
        deviations.append(np.sqrt(max(0.0, covariance.mean())))
    return np.array(averages), np.array(deviations)


def _above(surrogate: Surrogate, points: Array, best: Array) -> tuple[Array, Array]:
    """How much higher the mean is at points than at the best, and the deviation of that, fresh noise included."""
    mean, covariance = surrogate.joint(np.vstack([points, best]))
    variance = np.diag(covariance)
    apart = np.maximum(0.0, variance[:-1] + variance[-1] - 2.0 * covariance[:-1, -1])
    return mean[:-1] - mean[-1], np.sqrt(apart + surrogate.noise_deviation**2)
