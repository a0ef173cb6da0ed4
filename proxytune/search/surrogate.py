"""A Gaussian process of the score over the search box, and the engine `gp`: Bayesian optimisation by it.

`Surrogate` is what the finished trials say of the score at every θ. The engine proposes where it expects to improve
most. Of a pending trial it believes the posterior mean given the finished ones (Ginsbourger, Le Riche and Carraro,
Kriging is well-suited to parallelize optimization, 2010): nothing is left to be learnt there, so the next proposal goes
elsewhere.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import Bounds, minimize

from proxytune.arrays import Floats, one_thread
from proxytune.errors import RunError
from proxytune.search.engine import Engine, Look, from_unit, to_unit, unit_points
from proxytune.search.loop import Trial, Values, with_failures_as_worst
from proxytune.seeds import proposal_seed
from proxytune.space import Space

if TYPE_CHECKING:
    from skopt.learning import GaussianProcessRegressor
    from skopt.learning.gaussian_process.kernels import ConstantKernel

# Loading scikit-optimize takes longer than all else that a figure needs, so it waits for the first fit.


@dataclass(frozen=True)
class Prior:
    """The prior of a hyperparameter before any trial: log-normal, of this median and spread, and within bounds.

    A few dozen steps of an integer score say little about seven hyperparameters. Fitted to the data alone they jump
    from bound to bound with every trial, between all noise and none; with a prior, predictions of held-out trials are
    better and far better calibrated.
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
    """The posterior of the score given the finished trials."""

    space: Space  # the search box
    model: "GaussianProcessRegressor"  # the fitted regressor, on the unit cube
    visited: tuple[Trial, ...]  # the trials it was fitted to, in canonical order, without the failed ones

    @property
    def noise_deviation(self) -> float:
        """Standard deviation of one score around the mean, the steps included; in the score's unit."""
        return float(np.sqrt(self.model.noise_) * self.model.y_train_std_)

    def predict(self, unit: Floats) -> tuple[Floats, Floats]:
        """Posterior mean and standard deviation, noise excluded, at points (n, parameters) of the unit cube."""
        with one_thread(), warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Predicted variances smaller than 0")
            mean, deviation = self.model.predict(unit, return_std=True)
        return mean, deviation

    def mean(self, unit: Floats) -> Floats:
        """Posterior mean (n,) at points (n, parameters) of the unit cube."""
        with one_thread():
            mean: Floats = self.model.predict(unit)
        return mean

    def joint(self, unit: Floats) -> tuple[Floats, Floats]:
        """Posterior mean (n,) and covariance (n, n), noise excluded, at points (n, parameters) of the unit cube."""
        with one_thread():
            mean, covariance = self.model.predict(unit, return_cov=True)
        return mean, covariance

    def at_visited(self) -> tuple[Floats, Floats]:
        """Posterior mean and standard deviation at the visited trials."""
        return self.predict(unit_array(self.space, [trial.values for trial in self.visited]))

    def incumbent(self) -> tuple[Values, float]:
        """The visited point with the lowest posterior mean, and that mean: not the luckiest score."""
        mean, _ = self.at_visited()
        best = int(np.argmin(mean))
        return self.visited[best].values, float(mean[best])


def fit_surrogate(space: Space, trials: Sequence[Trial]) -> Surrogate:
    """Fit the surrogate to the trials with a score, in any order to the same bit; a RunError if there are none."""
    from sklearn.exceptions import ConvergenceWarning
    from skopt.learning import GaussianProcessRegressor

    visited = tuple(sorted((t for t in trials if t.score is not None), key=lambda t: (t.values, t.score)))
    if not visited:
        raise RunError("no trial has a score, so there is nothing to learn from")
    unit = unit_array(space, [trial.values for trial in visited])
    scores = np.array([trial.score for trial in visited], dtype=float)
    kernel = prior_kernel(len(space.intervals))
    model = GaussianProcessRegressor(kernel=kernel, optimizer=most_probable, normalize_y=True, noise="gaussian")
    with one_thread(), warnings.catch_warnings():
        # A hyperparameter at its bound is an answer, not a failure.
        warnings.simplefilter("ignore", ConvergenceWarning)
        return Surrogate(space, model.fit(unit, scores), visited)


def unit_array(space: Space, points: Sequence[Values]) -> Floats:
    """Points of the box as an array (n, parameters) of the unit cube."""
    return np.array([to_unit(space, values) for values in points]).reshape(-1, len(space.intervals))


def prior_kernel(dimensions: int) -> "ConstantKernel":
    """Covariance of a score over the unit cube, noise last, at the medians of its priors."""
    from skopt.learning.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    scales, bounds = np.full(dimensions, LENGTH_SCALE.median), [LENGTH_SCALE.bounds] * dimensions
    smooth = Matern(scales, length_scale_bounds=bounds, nu=2.5)
    return ConstantKernel(AMPLITUDE.median, AMPLITUDE.bounds) * smooth + WhiteKernel(NOISE.median, NOISE.bounds)


def most_probable(
    negative_log_likelihood: Callable[[Floats], tuple[float, Floats]], start: Floats, bounds: Floats
) -> tuple[Floats, float]:
    """The hyperparameters' logarithms of highest posterior density, as the regressor's optimiser, from the medians."""
    spread = np.array([AMPLITUDE.spread, *[LENGTH_SCALE.spread] * (len(start) - 2), NOISE.spread])

    def improbable(logarithms: Floats) -> tuple[float, Floats]:
        value, gradient = negative_log_likelihood(logarithms)
        distance = (logarithms - start) / spread
        return value + 0.5 * float(distance @ distance), gradient + distance / spread

    found = minimize(improbable, start, jac=True, bounds=Bounds(bounds[:, 0], bounds[:, 1]), method="L-BFGS-B")
    return np.asarray(found.x), float(found.fun)


CLOUD = 2048
REFINED = 8
WIDTHS = (0.05, 0.015, 0.005)
SAME = 0.1
"""Points closer than this, divided by the number of trials, in every parameter (in widths of the box) are the same
point: a deterministic score has nothing new to say there."""


@dataclass(frozen=True)
class GaussianProcess:
    """Proposes where the score is expected to improve most.

    The improvement is measured from the best posterior mean among the visited points: the lowest score itself is
    partly luck.
    """

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the set of trials and the seed alone; never a point visited or pending."""
        with one_thread():
            surrogate = _fit_with_pending(space, trials)
            return from_unit(space, _most_promising(surrogate, proposal_seed(seed, len(trials)))[0])


def expected_improvement(space: Space, trials: Sequence[Trial], seed: int) -> tuple[float, float]:
    """The most that any θ is expected to improve the score, and the standard deviation of the score's noise.

    Raises:
        RunError: If no trial has a score.
    """
    surrogate = fit_surrogate(space, with_failures_as_worst(trials))
    with one_thread():
        _, gain = _most_promising(surrogate, proposal_seed(seed, len(trials)))
    return gain, surrogate.noise_deviation


def _fit_with_pending(space: Space, trials: Sequence[Trial]) -> Surrogate:
    """The surrogate as a kriging believer has it: a pending trial takes its posterior mean for a score."""
    surrogate = fit_surrogate(space, trials)
    pending = [trial for trial in trials if trial.pending]
    if not pending:
        return surrogate
    means = surrogate.mean(unit_array(space, [trial.values for trial in pending]))
    believed = [replace(trial, score=float(mean)) for trial, mean in zip(pending, means, strict=True)]
    return fit_surrogate(space, [*surrogate.visited, *believed])


def _most_promising(surrogate: Surrogate, seed: int) -> tuple[Floats, float]:
    """The point of the unit cube with the highest expected improvement, and that."""
    # Takes a second to load, so only where a point is looked for.
    from skopt.acquisition import gaussian_ei

    _, incumbent = surrogate.incumbent()
    visited = unit_array(surrogate.space, [trial.values for trial in surrogate.visited])
    return maximise_gain(lambda points: gaussian_ei(points, surrogate.model, y_opt=incumbent, xi=0.0), visited, seed)


def maximise_gain(gain: Callable[[Floats], Floats], visited: Floats, seed: int) -> tuple[Floats, float]:
    """The point of the unit cube not yet visited of highest gain, and that: a Sobol cloud, then closer looks."""
    dimensions = visited.shape[1]
    points = _unvisited(unit_points(dimensions, CLOUD, seed), visited)
    gains = gain(points)
    offsets = 2.0 * unit_points(dimensions, CLOUD // 16, seed + 1) - 1.0
    for width in WIDTHS:
        leaders = points[np.argsort(-gains, kind="stable")[:REFINED]]
        around = np.clip(leaders[:, None, :] + width * offsets, 0.0, 1.0).reshape(-1, dimensions)
        points = np.concatenate([leaders, _unvisited(around, visited)])
        gains = gain(points)
    best = int(np.argmax(gains))
    return points[best], float(gains[best])


def _unvisited(points: Floats, visited: Floats) -> Floats:
    distances = np.abs(points[:, None, :] - visited[None, :, :]).max(axis=2)
    return np.asarray(points[distances.min(axis=1) > SAME / len(visited)])


GAUSSIAN_PROCESS = Engine(
    name="gp",
    label="Gaussian process of the score",
    summary="the θ whose score is expected to improve most, by a Gaussian process of the score",
    make=GaussianProcess,
    look=Look("#0072B2"),
)
