"""The engine `emulator`: calibration as it is done by hand, an emulator of the outputs and Markov chains over θ.

scikit-learn's GaussianProcessRegressor stands for all outputs, with the likelihood of θ that docs/method.md states, of
its means, variances and left-out errors. Chains of Metropolis go through the box, and the simulator is run next at the
most probable θ that they came by.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve
from threadpoolctl import threadpool_limits

from proxytune.arrays import Floats
from proxytune.search import Engine, Goal, Look, Trial, Values, from_unit, unit_array, unit_points
from proxytune.search.likelihood import deviance, temper
from proxytune.seeds import proposal_seed
from proxytune.space import Space

Density = Callable[[Floats], Floats]
"""Log densities (n,) of points (n, parameters) of the unit cube."""
CLOUD, CHAINS, STEPS = 1024, 32, 100
WIDTH = 2.38
"""Of a step over √parameters, in standard deviations of what is sampled: the best one for a normal distribution
(Roberts, Gelman and Gilks, Weak convergence and optimal scaling of random walk Metropolis algorithms, 1997)."""
LEAST = 0.01
"""Standard deviation, in widths of the box, below which a cloud of points does not tell how wide a density is."""


@dataclass(frozen=True)
class Emulator:
    """Proposes the most probable θ that Markov chains come by. A pending trial tells it nothing."""

    goal: Goal

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the trials and the seed alone."""
        known = sorted((trial.values, trial.outcome) for trial in trials if trial.outcome is not None)
        unit, outputs = unit_array(space, [one[0] for one in known]), np.array([one[1] for one in known], dtype=float)
        with threadpool_limits(limits=1):
            density = log_likelihood(unit, outputs, self.goal)
            return from_unit(space, most_probable(density, len(space.intervals), proposal_seed(seed, len(trials))))


def log_likelihood(unit: Floats, outputs: Floats, goal: Goal) -> Density:
    """What trials (trials, parameters) and their outputs (trials, outputs) say of θ.

    Outputs count that every trial and the target know and that change.
    """
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    told = (np.ptp(outputs, axis=0) > 0.0) & ~np.isnan(goal.values)
    if not told.any():
        return lambda points: np.zeros(len(points))
    kernel = ConstantKernel() * Matern(np.ones(unit.shape[1]), nu=2.5) + WhiteKernel()
    model = GaussianProcessRegressor(kernel, normalize_y=True)
    with warnings.catch_warnings():
        # A hyperparameter at its bound is an answer, not a failure.
        warnings.simplefilter("ignore", ConvergenceWarning)
        model.fit(unit, outputs[:, told])
    inverse = cho_solve((model.L_, True), np.eye(len(unit)))
    kappa = temper(model.alpha_.reshape(len(unit), -1) / np.sqrt(np.diag(inverse))[:, None])

    def density(points: Floats) -> Floats:
        mean, deviation = (side.reshape(len(points), -1) for side in model.predict(points, return_std=True))
        variance = deviation**2 + goal.noise[told]  # the kernel's noise is in the former
        against = deviance((goal.values[told] - mean) / np.sqrt(variance)) + 0.5 * np.log(variance)
        return np.asarray(-against.sum(axis=1) / kappa)

    return density


def most_probable(density: Density, dimensions: int, seed: int) -> Floats:
    """The most probable point that chains come by, which begin at the best of a cloud of points."""
    generator = np.random.default_rng(seed)
    cloud = unit_points(dimensions, CLOUD, seed)
    found = density(cloud)
    spread = np.atleast_2d(np.cov(cloud.T, aweights=np.exp(found - found.max()), ddof=0))
    root = np.linalg.cholesky(spread + LEAST**2 * np.eye(dimensions)) * WIDTH / np.sqrt(dimensions)
    best = np.argsort(-found, kind="stable")[:CHAINS]
    chains, levels = [cloud[best]], [found[best]]
    for _ in range(STEPS):
        moved = chains[-1] + generator.standard_normal((CHAINS, dimensions)) @ root.T
        inside = ((moved >= 0.0) & (moved <= 1.0)).all(axis=1)
        found = np.where(inside, density(moved), -np.inf)
        taken = np.log(generator.random(CHAINS)) < found - levels[-1]
        chains.append(np.where(taken[:, None], moved, chains[-1]))
        levels.append(np.where(taken, found, levels[-1]))
    return np.asarray(np.concatenate(chains)[int(np.argmax(np.concatenate(levels)))])


EMULATOR = Engine(
    name="emulator",
    label="emulator with Markov chains",
    summary="the most probable θ by Gaussian processes of all outputs as they come, sampled by Metropolis",
    make=Emulator,
    learns_from="outputs",
    in_studies=False,
    look=Look("#882255", "dashed"),
)
