"""How much each parameter matters to the score over the whole search box, as the surrogate has it."""

from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from proxytune.search.design import unit_points
from proxytune.search.surrogate import Array, Surrogate

POINTS = 2048
"""At most so many points for the posterior mean."""

DRAWN_POINTS = 1024
"""At most so many for the functions drawn: these are drawn jointly, which takes the cube of their number."""

DRAWS = 200
LEVELS = (0.025, 0.975)
JITTER = 1e-8


@dataclass(frozen=True)
class Importance:
    """A parameter's share in the variance of the score over the box (Sobol indices, θ uniform).

    Attributes:
        name: The parameter.
        share: Of the posterior mean's variance, what the parameter takes part in, alone or together with others (the
            total-effect index). Shares add up to 1 where parameters do not interact, and to more where they do.
        interval: 95 % of the shares of functions drawn from the posterior, widened to hold the share itself.
        alone: What the parameter does whatever the others are (the first-order index); not above the share.
    """

    name: str
    share: float
    interval: tuple[float, float]
    alone: float


def importances(surrogate: Surrogate) -> tuple[Importance, ...]:
    """The importance of every parameter, in the order of the box: a function of the surrogate alone.

    Indices are those of Jansen (1999), on a Sobol sequence, as in Saltelli et al. (2010), table 2. The functions drawn
    share the surrogate's length scales, so the interval leaves out that these are not known exactly either.
    """
    names = surrogate.space.names
    with threadpool_limits(limits=1):
        share, alone = _indices(surrogate.mean(_points(len(names), POINTS)).reshape(2 + len(names), -1))
        drawn = _draws(surrogate, _points(len(names), DRAWN_POINTS)).reshape(DRAWS, 2 + len(names), -1)
    low, high = np.quantile(_indices(drawn)[0], LEVELS, axis=0)
    return tuple(
        Importance(
            name=name,
            share=float(share[column]),
            interval=(float(min(low[column], share[column])), float(max(high[column], share[column]))),
            alone=float(alone[column]),
        )
        for column, name in enumerate(names)
    )


def _points(dimensions: int, most: int) -> Array:
    """At most so many points of the unit cube in 2 + parameters rows, one after another: (points, parameters).

    Row 0 is one set of points, row 1 another, row 2 + i the first with column i of the other.
    """
    pairs = unit_points(2 * dimensions, 2 ** int(np.log2(most / (2 + dimensions))), 0)
    first, second = pairs[:, :dimensions], pairs[:, dimensions:]
    swapped = [np.where(np.arange(dimensions) == column, second, first) for column in range(dimensions)]
    return np.concatenate([first, second, *swapped])


def _draws(surrogate: Surrogate, points: Array) -> Array:
    """Functions drawn from the posterior, at points of the unit cube: (draws, points)."""
    mean, covariance = surrogate.joint(points)
    scale = max(float(np.diag(covariance).mean()), JITTER)
    root = np.linalg.cholesky(covariance + JITTER * scale * np.eye(len(mean)))
    drawn: Array = mean + np.random.default_rng(0).standard_normal((DRAWS, len(mean))) @ root.T
    return drawn


def _indices(values: Array) -> tuple[Array, Array]:
    """Total-effect and first-order indices (…, parameters) of values (…, 2 + parameters, points); 0 if constant."""
    first, second, swapped = values[..., :1, :], values[..., 1:2, :], values[..., 2:, :]
    variance = values[..., :2, :].var(axis=(-1, -2))[..., None]
    safe = np.where(variance > 0, variance, 1.0)
    total = np.clip(0.5 * ((first - swapped) ** 2).mean(axis=-1) / safe, 0.0, 1.0)
    rest = 0.5 * ((second - swapped) ** 2).mean(axis=-1) / safe
    return total, np.where(variance > 0, np.clip(1.0 - rest, 0.0, total), 0.0)
