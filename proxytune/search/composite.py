"""Bayesian optimisation of a composite score: expected improvement of PRPV composed of modelled outputs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from proxytune.search.design import from_unit
from proxytune.search.gaussian_process import highest
from proxytune.search.goal import Goal
from proxytune.search.output_model import OutputModel, fit_outputs
from proxytune.search.proposer import Trial, Values, proposal_seed
from proxytune.search.surrogate import Array, unit_array
from proxytune.space import Space

DRAWS = 24
"""Outputs drawn at every point; all points share the normal numbers behind them."""


@dataclass(frozen=True)
class Composite:
    """Proposes where the score of drawn outputs is expected to improve most.

    PRPV is a count of flipped pairs, but the metrics that it compares change smoothly with θ: each is modelled on its
    own (Astudillo and Frazier, Bayesian optimization of composite functions, ICML 2019). The improvement is measured
    from the lowest expected score of a visited point.

    Attributes:
        goal: The target.
    """

    goal: Goal

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the set of trials and the seed alone; never a point visited before.

        Raises:
            RunError: If no trial has an outcome.
        """
        return most_improving(space, trials, self.goal, proposal_seed(seed, len(trials)))


def most_improving(space: Space, trials: Sequence[Trial], goal: Goal, seed: int) -> Values:
    """The θ whose composed score is expected to improve most on the best visited one.

    Raises:
        RunError: If no trial has an outcome.
    """
    with threadpool_limits(limits=1):
        model = fit_outputs(space, trials)
        scores = composed_scores(model, goal, seed)
        incumbent = float(scores(model.visited).mean(axis=0).min())
        taken = unit_array(space, [trial.values for trial in trials])
        best, _ = highest(lambda points: np.maximum(0.0, incumbent - scores(points)).mean(axis=0), taken, seed)
        return from_unit(space, best)


def composed_scores(model: OutputModel, goal: Goal, seed: int) -> Callable[[Array], Array]:
    """Draw scores anywhere.

    An output that the trials do not change is what it was in them; one that none knows is the target's.

    Args:
        model: Of the outputs.
        goal: The target, and how a score is composed.
        seed: Seeds the draws.

    Returns:
        A function of points (n, parameters) of the unit cube that gives draws of their scores, shape (draws, n).
    """
    normal = np.random.default_rng(seed).standard_normal((DRAWS, 1, model.outputs))
    known = np.where(np.isnan(model.constant), goal.values, model.constant)

    def scores(points: Array) -> Array:
        mean, variance = model.predict(points)
        mean, deviation = np.where(np.isnan(mean), known, mean), np.sqrt(np.nan_to_num(variance))
        return np.stack([goal.compose(mean + deviation * row) for row in normal])

    return scores
