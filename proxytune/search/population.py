"""The population of a fleet: p(θ) over robots of one kind, from what each robot's own scores say of its θ.

Robot r has θ_r ~ N(μ, Σ). Its posterior has a flat prior over the box, so its weights are the likelihood of θ_r, and
are 0 outside: the normal distribution itself is not cut off. `population_of` draws from the joint posterior of μ, Σ
and all θ_r by Gibbs sampling. The likelihood of each robot is a mixture of normal densities at points drawn from its
posterior, narrowed and smoothed so that mean and covariance stay what they are (West, 1993). So every conditional
distribution is in closed form, and a spread between robots far below what is measured is no special case. The prior
of each parameter's spread is half-Student's (2 degrees of freedom), of each correlation uniform (Huang and Wand, 2013).
A bootstrap over robots would have no spread to offer where there are few of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.stats import invwishart

from proxytune.arrays import Floats
from proxytune.search.posterior import Posterior

POINTS = 256
"""So many points stand for the likelihood of a robot."""
BURN_IN, DRAWS, KEPT = 500, 4000, 2
"""Steps before those that count, steps that count, and of which every so many is kept."""
FREEDOM = 2.0
"""Of the prior of spreads; with 2, correlations are uniform."""
PRIOR_SPREAD = 12.0**-0.5
"""Scale of that prior, in widths of the box: robots that fill the box evenly have this standard deviation."""
TAILS = (2.5, 50.0, 97.5)
LEAST = 1e-6
"""Widths of the box: a robot is known no better than this."""


@dataclass(frozen=True, eq=False)
class Population:
    """Draws from what is known of a fleet, in the unit cube."""

    mean: Floats  # μ, shape (draws, parameters)
    covariance: Floats  # σ between robots, shape (draws, parameters, parameters)
    robots: Floats  # θ of each robot given the whole fleet, shape (draws, robots, parameters)
    next_robot: Floats  # θ of a robot that has not been measured, shape (draws, parameters)

    @cached_property
    def deviation(self) -> Floats:
        """Standard deviation of each parameter between robots (draws, parameters)."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    @cached_property
    def correlation(self) -> Floats:
        """Correlation of each two parameters between robots (draws, parameters, parameters)."""
        return np.asarray(self.covariance / (self.deviation[:, :, None] * self.deviation[:, None, :]))


def summary_of(draws: Floats) -> Floats:
    """The lower end, middle and upper end of the central 95 % of draws (draws, …): shape (3, …)."""
    return np.percentile(draws, TAILS, axis=0)


def population_of(posteriors: Sequence[Posterior], seed: int = 0) -> Population:
    """Learn the population from the robots' own posteriors; robots in any order, same draws to the last bit."""
    order = np.lexsort(np.array([one.mean for one in posteriors]).T)
    mixtures = [_mixture(posteriors[row]) for row in order]
    points, kernel = np.array([one[0] for one in mixtures]), np.array([one[1] for one in mixtures])
    robots, names = len(points), points.shape[2]
    rng, steps = np.random.default_rng(seed), []
    own, centre, scale = points.mean(axis=1), points.mean(axis=(0, 1)), np.full(names, PRIOR_SPREAD**2)
    for step in range(BURN_IN + DRAWS):
        away = own - centre
        spread = away.T @ away + 2.0 * FREEDOM * np.diag(1.0 / scale)
        covariance = np.reshape(invwishart.rvs(FREEDOM + names - 1 + robots, spread, random_state=rng), (names, names))
        precision = np.diag(np.linalg.inv(covariance))
        scale = (FREEDOM * precision + PRIOR_SPREAD**-2) / rng.gamma((FREEDOM + names) / 2.0, size=names)
        root = np.linalg.cholesky(covariance)
        centre = own.mean(axis=0) + root @ rng.standard_normal(names) / np.sqrt(robots)
        own = _draw_robots(points, kernel, centre, covariance, rng)
        if step >= BURN_IN and step % KEPT == 0:
            steps.append((centre, covariance, own, centre + root @ rng.standard_normal(names)))
    mean, covariances, drawn, following = map(np.array, zip(*steps, strict=True))
    return Population(mean, covariances, np.clip(drawn[:, np.argsort(order)], 0.0, 1.0), following)


def _mixture(posterior: Posterior) -> tuple[Floats, Floats]:
    """The centres (points, parameters) of a mixture of equal parts, and the covariance that all of them have."""
    weights, mean = posterior.weights, posterior.mean
    away = posterior.points - mean
    known = LEAST**2 * np.eye(len(mean))
    covariance = posterior.covariance + known
    # At random: quasi-random points have a rhythm, and so would be chosen.
    drawn = away[np.random.default_rng(0).choice(len(weights), POINTS, p=weights)]
    drawn = drawn - drawn.mean(axis=0)
    count = min(float(POINTS), 1.0 / float(weights @ weights))
    smoothing = count ** (-2.0 / (len(mean) + 4.0))
    to_own = np.linalg.inv(np.linalg.cholesky(drawn.T @ drawn / POINTS + known)).T @ np.linalg.cholesky(covariance).T
    return mean + np.sqrt(1.0 - smoothing) * drawn @ to_own, smoothing * covariance


def _draw_robots(
    points: Floats, kernel: Floats, centre: Floats, covariance: Floats, rng: np.random.Generator
) -> Floats:
    """θ of each robot given the population: a part of its mixture, and then the normal distribution that is left."""
    total = np.linalg.inv(covariance + kernel)
    away = points - centre
    fit = -0.5 * np.einsum("rjp,rpq,rjq->rj", away, total, away, optimize=True)
    chosen = np.argmax(fit + rng.gumbel(size=fit.shape), axis=1)
    gain = covariance @ total
    left = covariance - gain @ covariance
    left = 0.5 * (left + np.swapaxes(left, 1, 2)) + LEAST**2 * np.eye(len(centre))
    drawn = np.linalg.cholesky(left) @ rng.standard_normal((*left.shape[:2], 1))
    return np.asarray(centre + (gain @ away[np.arange(len(chosen)), chosen][..., None] + drawn)[..., 0])
