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

        A trial without an outcome counts as the outcome of the worst score, so that the search moves away from it.

        Raises:
            RunError: If no trial has an outcome.
        """
        drawn = proposal_seed(seed, len(trials))
        with threadpool_limits(limits=1):
            visited, outcomes = _told(space, trials)
            scores = _model(visited, outcomes, self.compose, drawn)
            incumbent = float(scores(visited).mean(axis=0).min())
            return from_unit(
                space,
                highest(lambda points: np.maximum(0.0, incumbent - scores(points)).mean(axis=0), visited, drawn)[0],
            )


def _told(space: Space, trials: Sequence[Trial]) -> tuple[Array, Array]:
    """Points of the unit cube and their outcomes, in an order that does not depend on that of the trials."""
    known = [(trial.score, trial.outcome) for trial in trials if trial.outcome is not None and trial.score is not None]
    if not known:
        raise RunError("no trial has an outcome, so there is nothing to learn from")
    _, worst = max(known)
    told = sorted((trial.values, worst if trial.outcome is None else trial.outcome) for trial in trials)
    return unit_array(space, [values for values, _ in told]), np.array([outcome for _, outcome in told])


def _model(visited: Array, outcomes: Array, compose: Compose, seed: int) -> Callable[[Array], Array]:
    """Draws of the score, shape (draws, n), at points (n, parameters) of the unit cube."""
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
        mean, deviation = model.predict(points, return_std=True)
        smooth = np.sqrt(np.maximum(0.0, deviation**2 - noise)).reshape(mean.shape)
        return np.stack([compose(middle + spread * (mean + smooth * row)) for row in normal])

    return scores
