"""A Gaussian process over learning curves: what the examinations of all proxies and repetitions say of each mean curve.

A score is the mean curve of its proxy, plus what this repetition's target samples do to every learner, plus what they
do to this one, plus noise. The last three are larger where scores differ more, as they do where a curve rises.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from proxytune.learning.curves import Array

PRIORS: Mapping[str, tuple[float, float]] = {
    "amplitude": (1.0, 1.0),
    "length": (2.0, 0.5),
    "shared": (0.2, 1.0),
    "own": (0.3, 1.0),
    "drift": (1.5, 0.5),
    "noise": (0.3, 1.0),
}
"""Median of each hyperparameter, and the spread of its logarithm; scores have standard deviation 1."""

REPEATED = ("shared", "own", "drift")
"""Hyperparameters that only several repetitions tell."""
LEVEL = 3.0
"""Prior standard deviation of the level that all curves share."""
NEAR = 0.7
"""Examinations tell each other's spread within about so many doublings of target samples."""
POOLED = 4.0
"""The spread of all weighs as much as so many examinations nearby."""
NUGGET = 1e-6
"""Relative variance of a score that is sure, so that rounding does no harm."""
FARTHEST = 3.0
"""No hyperparameter is farther from its prior median than so many of its spreads."""
ROUNDS = 2
"""How often the spread is told anew from what the mean curves leave."""


@dataclass(frozen=True)
class Marks:
    """Examinations, one per row.

    Attributes:
        curve: Which learning curve, from 0 (examinations,).
        repetition: Which repetition (examinations,).
        place: How many target samples, as doublings (examinations,); see `places`.
        score: The score (examinations,).
    """

    curve: NDArray[np.intp]
    repetition: NDArray[np.intp]
    place: Array
    score: Array

    @cached_property
    def same(self) -> NDArray[np.bool_]:
        """Whether two are of one curve (examinations, examinations)."""
        return np.asarray(self.curve[:, None] == self.curve)

    @cached_property
    def together(self) -> NDArray[np.bool_]:
        """Whether two are of one repetition."""
        return np.asarray(self.repetition[:, None] == self.repetition)

    @cached_property
    def apart(self) -> Array:
        """How many doublings two are apart."""
        return np.asarray(np.abs(self.place[:, None] - self.place))


def places(counts: Array, first: float) -> Array:
    """Numbers of target samples as doublings: 0 for none, 1 for the first count, nearly one more for each twofold."""
    return np.asarray(np.log2(1.0 + np.asarray(counts, dtype=float) / first))


def counts_at(place: Array, first: float) -> Array:
    """The numbers of target samples at these places."""
    return np.asarray(first * (np.exp2(place) - 1.0))


@dataclass(frozen=True)
class CurveModel:
    """The process, fitted: what it says of the mean curves at any place.

    Attributes:
        marks: What it is fitted to.
        values: Its hyperparameters by name.
        centre: Mean of all scores.
        unit: Their standard deviation.
    """

    marks: Marks
    values: Mapping[str, float]
    centre: float
    unit: float
    _factor: tuple[Array, bool] = field(repr=False)
    _weights: Array = field(repr=False)

    def mean_curves(self, curve: NDArray[np.intp], place: Array) -> tuple[Array, Array]:
        """Mean (places,) and covariance (places, places) of the mean curves at these places."""
        across = self._means_covariance(curve, place, self.marks.curve, self.marks.place)
        mean = self.centre + self.unit * (across @ self._weights)
        left = self._means_covariance(curve, place, curve, place) - across @ cho_solve(self._factor, across.T)
        return mean, np.asarray(self.unit**2 * left)

    def noise_at(self, curve: NDArray[np.intp], place: Array) -> Array:
        """Variance of one more examination's score about the mean curve, at these places."""
        values = self.values
        one = values["shared"] ** 2 + values["own"] ** 2 + values["noise"] ** 2
        relative = _spread(self.marks, self._residuals(), curve, place) ** 2
        return np.asarray(self.unit**2 * one * relative)

    def _residuals(self) -> Array:
        return _residuals(self.marks, self.values, (self.marks.score - self.centre) / self.unit, self._weights)

    def _means_covariance(self, curve: NDArray[np.intp], place: Array, other: NDArray[np.intp], there: Array) -> Array:
        return _means(self.values, curve[:, None] == other, np.abs(place[:, None] - there))


def fit_curve_model(marks: Marks) -> CurveModel:
    """Fit the process to examinations by its most probable hyperparameters: a pure function of them."""
    centre, unit = float(marks.score.mean()), float(marks.score.std()) or 1.0
    scaled = (marks.score - centre) / unit
    spread, start = np.ones(len(scaled)), np.log([median for median, _ in PRIORS.values()])
    for _ in range(1 + ROUNDS):
        given = (marks, scaled, spread)
        found = minimize(_misfit, start, args=given, method="L-BFGS-B", bounds=_bounds(marks), options={"maxiter": 40})
        start, values = found.x, _named(found.x)
        factor = cho_factor(_covariance(marks, values, spread), lower=True)
        weights = cho_solve(factor, scaled)
        spread = _spread(marks, _residuals(marks, values, scaled, weights), marks.curve, marks.place)
    return CurveModel(marks, values, centre, unit, factor, weights)


def _bounds(marks: Marks) -> list[tuple[float, float]]:
    """How small and how large the logarithm of each hyperparameter may be."""
    # One repetition does not tell what it does to a learner from the learner's mean curve
    held = REPEATED if len(np.unique(marks.repetition)) == 1 else ()
    far = {name: 0.0 if name in held else FARTHEST * width for name, (_, width) in PRIORS.items()}
    return [(np.log(median) - far[name], np.log(median) + far[name]) for name, (median, _) in PRIORS.items()]


def _named(logarithms: Array) -> dict[str, float]:
    return dict(zip(PRIORS, np.exp(logarithms).tolist(), strict=True))


def _misfit(logarithms: Array, marks: Marks, scaled: Array, spread: Array) -> float:
    """Negative logarithm of the posterior of the hyperparameters, up to a constant."""
    factor = cho_factor(_covariance(marks, _named(logarithms), spread), lower=True)
    medians, widths = np.array(list(PRIORS.values())).T
    prior = 0.5 * np.sum(((logarithms - np.log(medians)) / widths) ** 2)
    return float(0.5 * scaled @ cho_solve(factor, scaled) + np.sum(np.log(np.diag(factor[0]))) + prior)


def _covariance(marks: Marks, values: Mapping[str, float], spread: Array) -> Array:
    drift = _matern(marks.apart, values["drift"]) * marks.together
    about = drift * (values["shared"] ** 2 + values["own"] ** 2 * marks.same) + values["noise"] ** 2 * np.eye(
        len(spread)
    )
    sure = NUGGET * np.eye(len(spread))
    return np.asarray(_means(values, marks.same, marks.apart) + spread[:, None] * spread * about + sure)


def _means(values: Mapping[str, float], same: NDArray[np.bool_], apart: Array) -> Array:
    """Prior covariance of mean curves."""
    return np.asarray(LEVEL**2 + values["amplitude"] ** 2 * same * _matern(apart, values["length"]))


def _matern(apart: Array, length: float) -> Array:
    """The Matérn kernel of smoothness 5/2."""
    scaled = np.sqrt(5.0) * apart / length
    return np.asarray((1.0 + scaled + scaled**2 / 3.0) * np.exp(-scaled))


def _residuals(marks: Marks, values: Mapping[str, float], scaled: Array, weights: Array) -> Array:
    """What the mean curves leave of the scores, scaled."""
    return np.asarray(scaled - _means(values, marks.same, marks.apart) @ weights)


def _spread(marks: Marks, residuals: Array, curve: NDArray[np.intp], place: Array) -> Array:
    """How much scores differ at these places, relative to all: what is left nearby, drawn towards that of all."""
    pooled = float(np.mean(residuals**2)) or 1.0
    near = np.exp(-0.5 * ((place[:, None] - marks.place) / NEAR) ** 2) * (curve[:, None] == marks.curve)
    local = (POOLED * pooled + near @ residuals**2) / (POOLED + near.sum(axis=1))
    return np.asarray(np.sqrt(local / pooled))
