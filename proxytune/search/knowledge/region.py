"""What is known of θ: the posterior over the search box, and the 95 % region that is compatible with the target."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from proxytune.search.design import unit_points
from proxytune.search.surrogate import Array

LEVEL = 0.95
POINTS = 4096
ZOOMS = 8
DEPTH = 12.0
"""What lies so far below the largest log density holds nothing that counts."""
PAD = 0.1
"""Of the width of what counts, left round it at every zoom."""
MOST_OF = 0.8
"""A box that keeps more than this of its volume is not worth another look."""
TRADE = 0.6
"""Parameters that correlate by more in the posterior make up for each other."""
UNIDENTIFIED = 0.9
"""A parameter whose interval fills more of its range than this is not identified."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """θ given the target's outputs, uniform over the box before: points of equal volume with their densities.

    Attributes:
        points: Of the unit cube, shape (n, parameters), evenly over the part of it that counts.
        density: Logarithm of the density at each, up to a constant.
        volume: The part's share of the cube.
    """

    points: Array
    density: Array
    volume: float

    @cached_property
    def weights(self) -> Array:
        """Probability of each point; they add up to 1."""
        weights = np.exp(self.density - self.density.max())
        return np.asarray(weights / weights.sum())

    @cached_property
    def threshold(self) -> float:
        """The density down to which the most probable points hold 95 %."""
        order = np.argsort(-self.density, kind="stable")
        reached = int(np.searchsorted(np.cumsum(self.weights[order]), LEVEL))
        return float(self.density[order[min(reached, len(order) - 1)]])

    @cached_property
    def inside(self) -> Array:
        """Which points are in the region, as truth values."""
        return np.asarray(self.density >= self.threshold)

    @property
    def share(self) -> float:
        """The region's share of the box."""
        return float(self.inside.mean() * self.volume)

    @property
    def mode(self) -> Array:
        """The most probable point."""
        return np.asarray(self.points[int(np.argmax(self.density))])

    @property
    def mean(self) -> Array:
        """The mean of θ."""
        return np.asarray(self.weights @ self.points)

    @cached_property
    def intervals(self) -> Array:
        """The central 95 % of every parameter, shape (parameters, 2)."""
        tails = ((1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0)
        return np.array([_quantiles(column, self.weights, tails) for column in self.points.T])

    @cached_property
    def unidentified(self) -> Array:
        """Which parameters are not identified, as truth values."""
        return np.asarray(np.diff(self.intervals, axis=1)[:, 0] > UNIDENTIFIED)

    @property
    def trades(self) -> tuple[tuple[int, int, float], ...]:
        """Pairs of parameters that make up for each other, with their correlation."""
        away = self.points - self.mean
        covariance = (self.weights[:, None] * away).T @ away
        size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        matrix = covariance / np.outer(size, size)
        pairs = [(i, j, float(matrix[i, j])) for i in range(len(size)) for j in range(i)]
        return tuple((j, i, found) for i, j, found in pairs if abs(found) > TRADE)

    def draw(self, seed: int) -> Array:
        """A point drawn from the posterior, moved within the volume that it stands for."""
        generator = np.random.default_rng(seed)
        row = int(generator.choice(len(self.points), p=self.weights))
        reach = (self.volume / len(self.points)) ** (1.0 / self.points.shape[1]) / 2.0
        return np.asarray(np.clip(self.points[row] + generator.uniform(-reach, reach, self.points.shape[1]), 0.0, 1.0))


def posterior_of(log_density: Callable[[Array], Array], dimensions: int, count: int = POINTS) -> Posterior:
    """Look at the whole box, then ever closer at the box round what counts.

    Args:
        log_density: Logarithm of the density (n,) at points (n, parameters) of the unit cube, up to a constant.
        dimensions: How many parameters there are.
        count: How many points each look takes.
    """
    low, high, cloud = np.zeros(dimensions), np.ones(dimensions), unit_points(dimensions, count, 0)
    for _ in range(ZOOMS):
        points = low + (high - low) * cloud
        density = log_density(points)
        inner_low, inner_high = _what_counts(points, density, high - low)
        inner_low, inner_high = np.maximum(low, inner_low), np.minimum(high, inner_high)
        if np.prod(inner_high - inner_low) > MOST_OF * np.prod(high - low):
            break
        low, high = inner_low, inner_high
    points = low + (high - low) * cloud
    return Posterior(points, log_density(points), float(np.prod(high - low)))


def _what_counts(points: Array, density: Array, width: Array) -> tuple[Array, Array]:
    near = points[density > density.max() - DEPTH]
    between = 0.5 * width / len(points) ** (1.0 / points.shape[1])
    reach = PAD * np.ptp(near, axis=0) + between
    return near.min(axis=0) - reach, near.max(axis=0) + reach


def _quantiles(values: Array, weights: Array, shares: tuple[float, float]) -> list[float]:
    order = np.argsort(values, kind="stable")
    reached = np.searchsorted(np.cumsum(weights[order]), shares)
    return [float(values[order[min(row, len(values) - 1)]]) for row in reached]
