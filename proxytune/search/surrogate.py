"""A Gaussian process of the score over the search box: what the finished trials say of every θ."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, minimize
from threadpoolctl import threadpool_limits

from proxytune.errors import RunError
from proxytune.search.design import to_unit
from proxytune.search.proposer import Trial, Values
from proxytune.space import Space

# Loading scikit-optimize takes longer than all else that a figure needs, so it waits for the first fit.
if TYPE_CHECKING:
    from skopt.learning import GaussianProcessRegressor
    from skopt.learning.gaussian_process.kernels import ConstantKernel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Prior:
    """What is held of a hyperparameter before any trial: log-normal, and within bounds.

    A few dozen steps of an integer score say little about seven hyperparameters. Fitted to the data alone they jump
    from bound to bound with every trial, between all noise and none; with a prior, predictions of held-out trials are
    better and far better calibrated.

    Attributes:
        median: Its median.
        spread: The standard deviation of its logarithm.
        bounds: Smallest and largest value.
    """

    median: float
    spread: float
    bounds: tuple[float, float]


AMPLITUDE = Prior(1.0, 0.5, (0.05, 20.0))
"""Of the variance, relative to the scores' own."""

LENGTH_SCALE = Prior(0.4, 0.4, (0.05, 20.0))
"""In widths of the box."""

NOISE = Prior(0.1, 0.7, (1e-2, 1.0))
"""Of the noise variance, relative to the scores' own. The floor stands for the steps, which no smooth function
follows, so the surrogate never threads them exactly."""


@dataclass(frozen=True)
class Surrogate:
    """The posterior of the score given the finished trials.

    Attributes:
        space: The search box.
        model: The fitted regressor, on the unit cube.
        visited: The trials it was fitted to, in canonical order, without the failed ones.
    """

    space: Space
    model: "GaussianProcessRegressor"
    visited: tuple[Trial, ...]

    @property
    def noise_deviation(self) -> float:
        """Standard deviation of one score around the mean, the steps included; in the score's unit."""
        return float(np.sqrt(self.model.noise_) * self.model.y_train_std_)

    def predict(self, unit: Array) -> tuple[Array, Array]:
        """Posterior mean and standard deviation, noise excluded, at points (n, parameters) of the unit cube."""
        with threadpool_limits(limits=1), warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Predicted variances smaller than 0")
            mean, deviation = self.model.predict(unit, return_std=True)
        return mean, deviation

    def mean(self, unit: Array) -> Array:
        """Posterior mean (n,) at points (n, parameters) of the unit cube."""
        with threadpool_limits(limits=1):
            mean: Array = self.model.predict(unit)
        return mean

    def joint(self, unit: Array) -> tuple[Array, Array]:
        """Posterior mean (n,) and covariance (n, n), noise excluded, at points (n, parameters) of the unit cube."""
        with threadpool_limits(limits=1):
            mean, covariance = self.model.predict(unit, return_cov=True)
        return mean, covariance

    def at_visited(self) -> tuple[Array, Array]:
        """Posterior mean and standard deviation at the visited trials."""
        return self.predict(unit_array(self.space, [trial.values for trial in self.visited]))

    def incumbent(self) -> tuple[Values, float]:
        """The visited point with the lowest posterior mean, and that mean: not the luckiest score."""
        mean, _ = self.at_visited()
        best = int(np.argmin(mean))
        return self.visited[best].values, float(mean[best])


def fit_surrogate(space: Space, trials: Sequence[Trial]) -> Surrogate:
    """Fit the surrogate to the trials that have a score: same trials in any order, same surrogate to the last bit.

    Raises:
        RunError: If no trial has a score.
    """
    from sklearn.exceptions import ConvergenceWarning
    from skopt.learning import GaussianProcessRegressor

    visited = tuple(sorted((t for t in trials if t.score is not None), key=lambda t: (t.values, t.score)))
    if not visited:
        raise RunError("no trial has a score, so there is nothing to learn from")
    unit = unit_array(space, [trial.values for trial in visited])
    scores = np.array([trial.score for trial in visited], dtype=float)
    model = GaussianProcessRegressor(
        kernel=prior_kernel(len(space.intervals)), optimizer=most_probable, normalize_y=True, noise="gaussian"
    )
    with threadpool_limits(limits=1), warnings.catch_warnings():
        # A hyperparameter at its bound is an answer, not a failure.
        warnings.simplefilter("ignore", ConvergenceWarning)
        return Surrogate(space, model.fit(unit, scores), visited)


def unit_array(space: Space, points: Sequence[Values]) -> Array:
    """Points of the box as an array (n, parameters) of the unit cube."""
    return np.array([to_unit(space, values) for values in points]).reshape(-1, len(space.intervals))


def prior_kernel(dimensions: int) -> "ConstantKernel":
    """Covariance of a score over the unit cube, noise last, at the medians of its priors."""
    from skopt.learning.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    scales, bounds = np.full(dimensions, LENGTH_SCALE.median), [LENGTH_SCALE.bounds] * dimensions
    smooth = Matern(scales, length_scale_bounds=bounds, nu=2.5)
    return ConstantKernel(AMPLITUDE.median, AMPLITUDE.bounds) * smooth + WhiteKernel(NOISE.median, NOISE.bounds)


def most_probable(misfit: Callable[[Array], tuple[float, Array]], start: Array, bounds: Array) -> tuple[Array, float]:
    """The hyperparameters' logarithms of highest posterior density, as the regressor's optimiser.

    Args:
        misfit: Negative log marginal likelihood and its gradient.
        start: The priors' medians, in the kernel's order: amplitude, length scales, noise.
        bounds: Shape (hyperparameters, 2).
    """
    spread = np.array([AMPLITUDE.spread, *[LENGTH_SCALE.spread] * (len(start) - 2), NOISE.spread])

    def improbable(logarithms: Array) -> tuple[float, Array]:
        value, gradient = misfit(logarithms)
        distance = (logarithms - start) / spread
        return value + 0.5 * float(distance @ distance), gradient + distance / spread

    found = minimize(improbable, start, jac=True, bounds=Bounds(bounds[:, 0], bounds[:, 1]), method="L-BFGS-B")
    return np.asarray(found.x), float(found.fun)
