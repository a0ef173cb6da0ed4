"""How well a θ explains the target's outputs: a tempered Student likelihood over the search box.

Outputs of one trial go up and down together (an agent that crashes early drives less far), and so do their errors.
Taken for independent they would promise far too much: on simulated targets whose θ was known, a 95 % region then held
it in 3 to 6 of 12 cases. The log likelihood is therefore divided by κ, which follows from how errors of
left-out trials correlate: with p outputs that are all one, κ is p.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from proxytune.search.goal import Goal
from proxytune.search.knowledge.output_model import OutputModel, Rows
from proxytune.search.surrogate import Array

FREEDOM = 4.0
"""Degrees of freedom of Student's distribution: an output that is far off counts for less than a normal's would."""

LEAST_NOISE = 1e-6
"""Of an output's variance over the trials: without any, a deterministic target would be a spike."""


@dataclass(frozen=True, eq=False)
class Likelihood:
    """The tempered log likelihood of the target's outputs given θ.

    Attributes:
        model: What the trials say of every output.
        goal: The target.
    """

    model: OutputModel
    goal: Goal

    @cached_property
    def columns(self) -> Rows:
        """The outputs that are modelled and known of the target."""
        modelled = self.model.modelled
        return modelled[~np.isnan(self.goal.values[modelled])]

    @cached_property
    def kappa(self) -> float:
        """What the log likelihood is divided by, at least 1."""
        return temper(self.model.left_out[:, self.columns])

    def standardised(self, points: Array) -> tuple[Array, Array]:
        """How far the target is from what is predicted at points (n, parameters), and the variance of that.

        Returns:
            Two arrays (n, columns): the distance in standard deviations, and the variance in the outputs' units.
        """
        mean, variance = self.model.predict(points)
        chosen = self.columns
        least = LEAST_NOISE * self.model.rough[chosen] / self.model.roughness
        total = variance[:, chosen] + self.model.rough[chosen] + self.goal.noise[chosen] + least
        return (self.goal.values[chosen] - mean[:, chosen]) / np.sqrt(total), total

    def log(self, points: Array) -> Array:
        """The tempered log likelihood (n,) at points (n, parameters) of the unit cube, up to a constant."""
        distance, variance = self.standardised(points)
        against = deviance(distance) + 0.5 * np.log(variance)
        return np.asarray(-against.sum(axis=1) / self.kappa)


def deviance(distance: Array) -> Array:
    """Student's negative log density, up to a constant, of distances in standard deviations; 0 where there is none."""
    return np.asarray(0.5 * (FREEDOM + 1.0) * np.log1p(distance**2 / FREEDOM))


def temper(errors: Array) -> float:
    """κ: how many outputs count as one, by the correlation of the errors of left-out trials.

    With C the correlations of p outputs, κ = 1 + Σ_{j≠k} (C_jk² − 1/n_jk) / p, at least 1: n_jk trials know both, and
    two independent outputs correlate with a mean square of 1/n_jk by chance.

    Args:
        errors: Shape (trials, outputs); NaN where a trial does not know an output.
    """
    known = ~np.isnan(errors)
    filled = np.where(known, errors, 0.0)
    size: Array = np.sqrt((filled**2).sum(axis=0) / known.sum(axis=0))
    both = known.astype(float).T @ known
    filled = filled / np.where(size > 0.0, size, 1.0)
    excess = ((filled.T @ filled) ** 2 / np.maximum(both, 1.0) - 1.0) / np.maximum(both, 1.0)
    np.fill_diagonal(excess, 0.0)
    columns: int = errors.shape[1]
    return 1.0 + max(0.0, float(np.sum(excess))) / max(1, columns)
