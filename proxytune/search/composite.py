"""Bayesian optimisation of a composite score: Gaussian processes of what the score is computed from."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from threadpoolctl import threadpool_limits

from proxytune.errors import RunError
from proxytune.search.design import from_unit
from proxytune.search.gaussian_process import highest
from proxytune.search.proposer import Compose, Trial, Values, proposal_seed
from proxytune.search.surrogate import Array, most_probable, prior_kernel, unit_array
from proxytune.space import Space

DRAWS = 24
"""Outcomes drawn at every point; all points share the normal numbers behind them."""


@dataclass(frozen=True)
class Composite:
    """Proposes where the score of drawn outcomes is expected to improve most.

    PRPV is a count of flipped pairs, but the metrics that it compares change smoothly with θ: each is modelled on its
    own, all with one kernel, and the score is composed of draws (Astudillo and Frazier, Bayesian optimization of
    composite functions, ICML 2019). The improvement is measured from the lowest expected score of a visited point.

    Attributes:
        compose: Scores of outcomes.
    """

    compose: Compose

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the set of trials and the seed alone; never a point visited before.

        Raises:
            RunError: If no trial has an outcome.
        """
        told = sorted((trial.values, trial.outcome) for trial in trials if trial.outcome is not None)
        if not told:
            raise RunError("no trial has an outcome, so there is nothing to learn from")
        visited, outcomes = unit_array(space, [values for values, _ in told]), np.array([found for _, found in told])
        drawn = proposal_seed(seed, len(trials))
        with threadpool_limits(limits=1):
            scores = composed_scores(visited, outcomes, self.compose, drawn)
            incumbent = float(scores(visited).mean(axis=0).min())
            best, _ = highest(lambda points: np.maximum(0.0, incumbent - scores(points)).mean(axis=0), visited, drawn)
            return from_unit(space, best)


def composed_scores(visited: Array, outcomes: Array, compose: Compose, seed: int) -> Callable[[Array], Array]:
    """Model the outcomes of visited points and draw scores anywhere.

    Args:
        visited: Points of the unit cube, shape (trials, parameters).
        outcomes: What was found there, shape (trials, outputs).
        compose: Scores of outcomes.
        seed: Seeds the draws.

    Returns:
        A function of points (n, parameters) of the unit cube that gives draws of their scores, shape (draws, n).
    """
    middle, spread = outcomes.mean(axis=0), outcomes.std(axis=0)
    spread[spread == 0.0] = 1.0
    model = GaussianProcessRegressor(prior_kernel(visited.shape[1]), optimizer=most_probable)
    with warnings.catch_warnings():
        # A hyperparameter at its bound is an answer, not a failure.
        warnings.simplefilter("ignore", ConvergenceWarning)
        model.fit(visited, (outcomes - middle) / spread)
    noise = model.kernel_.k2.noise_level
    normal = np.random.default_rng(seed).standard_normal((DRAWS, 1, outcomes.shape[1]))

    def scores(points: Array) -> Array:
        # The regressor drops the outputs' axis where there is but one.
        mean, deviation = (found.reshape(len(points), -1) for found in model.predict(points, return_std=True))
        smooth = np.sqrt(np.maximum(0.0, deviation**2 - noise))
        return np.stack([compose(middle + spread * (mean + smooth * row)) for row in normal])

    return scores
