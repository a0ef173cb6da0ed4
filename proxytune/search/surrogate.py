"""A Gaussian process of the score over the search box: what the finished trials say of every θ."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sklearn.exceptions import ConvergenceWarning
from skopt.learning import GaussianProcessRegressor
from skopt.learning.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from threadpoolctl import threadpool_limits

from proxytune.errors import RunError
from proxytune.search.design import to_unit
from proxytune.search.proposer import Trial, Values
from proxytune.space import Space

Array = NDArray[np.float64]

LENGTH_SCALES = (0.3, 3.0)
"""Bounds in widths of the box: below, a plateau of the step-like score would be taken for structure; above, the
parameter does next to nothing, and a longer scale only lets the surrogate jump to conclusions from few trials."""

AMPLITUDES = (0.5, 5.0)
"""Bounds of the variance relative to the scores' own: few trials say little of it, and they have been scaled."""

NOISE = (1e-2, 1.0)
"""Bounds of the noise variance relative to the scores' own: the floor stands for the steps, which no smooth
function follows, so the surrogate never threads them exactly."""


@dataclass(frozen=True)
class Surrogate:
    """The posterior of the score given the finished trials.

    Attributes:
        space: The search box.
        model: The fitted regressor, on the unit cube.
        visited: The trials it was fitted to, in canonical order, without the failed ones.
    """

    space: Space
    model: GaussianProcessRegressor
    visited: tuple[Trial, ...]

    def predict(self, unit: Array) -> tuple[Array, Array]:
        """Posterior mean and standard deviation, noise excluded, at points (n, parameters) of the unit cube."""
        with threadpool_limits(limits=1), warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Predicted variances smaller than 0")
            mean, deviation = self.model.predict(unit, return_std=True)
        return mean, deviation

    def at_visited(self) -> tuple[Array, Array]:
        """Posterior mean and standard deviation at the visited trials."""
        return self.predict(unit_array(self.space, [trial.values for trial in self.visited]))

    def incumbent(self) -> tuple[Values, float]:
        """The visited point with the lowest posterior mean, and that mean: not the luckiest score."""
        mean, _ = self.at_visited()
        best = int(np.argmin(mean))
        return self.visited[best].values, float(mean[best])


def fit_surrogate(space: Space, trials: Sequence[Trial], seed: int) -> Surrogate:
    """Fit the surrogate to the trials that have a score: same trials in any order, same surrogate to the last bit.

    Raises:
        RunError: If no trial has a score.
    """
    visited = tuple(sorted((t for t in trials if t.score is not None), key=lambda t: (t.values, t.score)))
    if not visited:
        raise RunError("no trial has a score, so there is nothing to learn from")
    unit = unit_array(space, [trial.values for trial in visited])
    scores = np.array([trial.score for trial in visited], dtype=float)
    model = GaussianProcessRegressor(
        kernel=_kernel(len(space.intervals)),
        normalize_y=True,
        noise="gaussian",
        n_restarts_optimizer=2,
        random_state=seed % 2**32,
    )
    with threadpool_limits(limits=1), warnings.catch_warnings():
        # A length scale at its bound is an answer (the parameter does nothing), not a failure.
        warnings.simplefilter("ignore", ConvergenceWarning)
        return Surrogate(space, model.fit(unit, scores), visited)


def unit_array(space: Space, points: Sequence[Values]) -> Array:
    """Points of the box as an array (n, parameters) of the unit cube."""
    return np.array([to_unit(space, values) for values in points]).reshape(-1, len(space.intervals))


def _kernel(dimensions: int) -> ConstantKernel:
    smooth = Matern(np.full(dimensions, 0.5), length_scale_bounds=[LENGTH_SCALES] * dimensions, nu=2.5)
    return ConstantKernel(1.0, AMPLITUDES) * smooth + WhiteKernel(0.1, NOISE)
