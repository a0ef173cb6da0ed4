"""A Gaussian process over learning curves: what the examinations of all proxies and repetitions say of each mean curve.

A learning curve is the scores of a learner in the target, by number of target samples x (as doublings) and repetition
r. The score of proxy p is the mean curve f_p(x), plus what this repetition's target samples do to every learner, plus
what they do to this one, plus noise:

    y = f_p(x) + s(x) · (g_r(x) + h_pr(x) + ε),    f_p = level + a Gaussian process (Matérn 5/2), alike for g_r and h_pr

where f_p has a part that all learners share and one of its own, and s is larger where scores differ more, as they do
where a curve rises. `draw_curves` draws all mean curves together from their posterior, bounded, and rising where the
data allow it; `crossing` is the number of target samples from which on a draw stays converged, η.
"""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import isotonic_regression, minimize

from proxytune.arrays import Flags, Floats
from proxytune.errors import InputError


@dataclass(frozen=True)
class LearningCurve:
    """A learning curve: scores in the target by number of target samples.

    Attributes:
        counts: Numbers of target samples, rising, the first 0.
        scores: Scores (repetitions, counts); NaN where nobody was examined, or nothing could drive.

    Raises:
        InputError: If the counts do not rise from 0, or do not match the scores.
    """

    counts: tuple[int, ...]
    scores: Floats

    def __post_init__(self) -> None:
        if not self.counts or self.counts[0] != 0:
            raise InputError("a learning curve starts at 0 target samples; add 0 to the grid")
        if any(later <= earlier for earlier, later in itertools.pairwise(self.counts)):
            raise InputError(f"the grid of target samples must rise, got {list(self.counts)}")
        if self.scores.ndim != 2 or self.scores.shape[1] != len(self.counts) or not len(self.scores):
            raise InputError(f"scores have shape {self.scores.shape}; give (seeds, {len(self.counts)})")

    @property
    def examined(self) -> NDArray[np.intp]:
        """Repetition and place in `counts` of every examination (examinations, 2)."""
        return np.argwhere(np.isfinite(self.scores))

    @property
    def repetitions(self) -> int:
        """The number of repetitions that have an examination."""
        return int(np.isfinite(self.scores).any(axis=1).sum())


PRIORS: Mapping[str, tuple[float, float]] = {
    "common": (1.0, 0.5),
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
class Examined:
    """Examinations, one per row: curve, repetition, target samples as doublings (see `places`), and score."""

    curve: NDArray[np.intp]
    repetition: NDArray[np.intp]
    place: Floats
    score: Floats

    @cached_property
    def same(self) -> Flags:
        """True where two are of one curve (examinations, examinations)."""
        return np.asarray(self.curve[:, None] == self.curve)

    @cached_property
    def together(self) -> Flags:
        """True where two are of one repetition."""
        return np.asarray(self.repetition[:, None] == self.repetition)

    @cached_property
    def apart(self) -> Floats:
        """The number of doublings that two are apart."""
        return np.asarray(np.abs(self.place[:, None] - self.place))


def doublings(counts: Floats, first: float) -> Floats:
    """Numbers of target samples as doublings: 0 for none, 1 for the first count, nearly one more for each twofold."""
    return np.asarray(np.log2(1.0 + np.asarray(counts, dtype=float) / first))


def counts_at(place: Floats, first: float) -> Floats:
    """The numbers of target samples at these places."""
    return np.asarray(first * (np.exp2(place) - 1.0))


@dataclass(frozen=True)
class CurveModel:
    """The process, fitted: what it says of the mean curves at any place."""

    marks: Examined
    values: Mapping[str, float]
    centre: float  # of the scores
    unit: float  # their standard deviation
    _factor: tuple[Floats, bool] = field(repr=False)
    _weights: Floats = field(repr=False)

    def mean_curves(self, curve: NDArray[np.intp], place: Floats) -> tuple[Floats, Floats]:
        """Mean (places,) and covariance (places, places) of the mean curves at these places."""
        across = self._means_covariance(curve, place, self.marks.curve, self.marks.place)
        mean = self.centre + self.unit * (across @ self._weights)
        left = self._means_covariance(curve, place, curve, place) - across @ cho_solve(self._factor, across.T)
        return mean, np.asarray(self.unit**2 * left)

    def noise_at(self, curve: NDArray[np.intp], place: Floats) -> Floats:
        """Variance of one more examination's score about the mean curve, at these places."""
        values = self.values
        one = values["shared"] ** 2 + values["own"] ** 2 + values["noise"] ** 2
        scaled = (self.marks.score - self.centre) / self.unit
        residuals = _residuals(self.marks, values, scaled, self._weights)
        relative = _spread(self.marks, residuals, curve, place) ** 2
        return np.asarray(self.unit**2 * one * relative)

    def _means_covariance(
        self, curve: NDArray[np.intp], place: Floats, other: NDArray[np.intp], there: Floats
    ) -> Floats:
        return _means(self.values, curve[:, None] == other, np.abs(place[:, None] - there))


def fit_curve_model(marks: Examined) -> CurveModel:
    """Fit the process to examinations by its most probable hyperparameters: a pure function of them."""
    centre, unit = float(marks.score.mean()), float(marks.score.std()) or 1.0
    scaled = (marks.score - centre) / unit
    spread, start = np.ones(len(scaled)), np.log([median for median, _ in PRIORS.values()])
    # One repetition does not tell what it does to a learner from the learner's mean curve
    held = REPEATED if len(np.unique(marks.repetition)) == 1 else ()
    far = {name: 0.0 if name in held else FARTHEST * width for name, (_, width) in PRIORS.items()}
    bounds = [(np.log(median) - far[name], np.log(median) + far[name]) for name, (median, _) in PRIORS.items()]
    for _ in range(1 + ROUNDS):
        given = (marks, scaled, spread)
        found = minimize(
            _negative_log_posterior, start, args=given, method="L-BFGS-B", bounds=bounds, options={"maxiter": 40}
        )
        start, values = found.x, _named(found.x)
        factor = cho_factor(_covariance(marks, values, spread), lower=True)
        weights = cho_solve(factor, scaled)
        spread = _spread(marks, _residuals(marks, values, scaled, weights), marks.curve, marks.place)
    return CurveModel(marks, values, centre, unit, factor, weights)


def _named(logarithms: Floats) -> dict[str, float]:
    return dict(zip(PRIORS, np.exp(logarithms).tolist(), strict=True))


def _negative_log_posterior(logarithms: Floats, marks: Examined, scaled: Floats, spread: Floats) -> float:
    """Negative logarithm of the posterior of the hyperparameters, up to a constant."""
    factor = cho_factor(_covariance(marks, _named(logarithms), spread), lower=True)
    medians, widths = np.array(list(PRIORS.values())).T
    prior = 0.5 * np.sum(((logarithms - np.log(medians)) / widths) ** 2)
    return float(0.5 * scaled @ cho_solve(factor, scaled) + np.sum(np.log(np.diag(factor[0]))) + prior)


def _covariance(marks: Examined, values: Mapping[str, float], spread: Floats) -> Floats:
    drift = _matern(marks.apart, values["drift"]) * marks.together
    about = drift * (values["shared"] ** 2 + values["own"] ** 2 * marks.same) + values["noise"] ** 2 * np.eye(
        len(spread)
    )
    sure = NUGGET * np.eye(len(spread))
    return np.asarray(_means(values, marks.same, marks.apart) + spread[:, None] * spread * about + sure)


def _means(values: Mapping[str, float], same: Flags, apart: Floats) -> Floats:
    """Prior covariance of mean curves."""
    parts = values["common"] ** 2 + values["amplitude"] ** 2 * same
    return np.asarray(LEVEL**2 + parts * _matern(apart, values["length"]))


def _matern(apart: Floats, length: float) -> Floats:
    scaled = np.sqrt(5.0) * apart / length
    return np.asarray((1.0 + scaled + scaled**2 / 3.0) * np.exp(-scaled))


def _residuals(marks: Examined, values: Mapping[str, float], scaled: Floats, weights: Floats) -> Floats:
    return np.asarray(scaled - _means(values, marks.same, marks.apart) @ weights)


def _spread(marks: Examined, residuals: Floats, curve: NDArray[np.intp], place: Floats) -> Floats:
    """The spread of scores at these places, relative to all: what is left nearby, drawn towards that of all."""
    pooled = float(np.mean(residuals**2)) or 1.0
    near = np.exp(-0.5 * ((place[:, None] - marks.place) / NEAR) ** 2) * (curve[:, None] == marks.curve)
    local = (POOLED * pooled + near @ residuals**2) / (POOLED + near.sum(axis=1))
    return np.asarray(np.sqrt(local / pooled))


POSTERIOR_DRAWS = 2000
STEPS = 8
"""Places of a drawn curve per doubling of target samples."""
LEAST_VARIANCE = 1e-9
DOUBT = 2.5
"""A curve falls where its mean falls by more standard deviations: the greatest of many falls is partly luck."""


@dataclass(frozen=True)
class CurveDraws:
    """Mean scores drawn from their posterior at counts of target samples."""

    counts: Floats
    scores: Mapping[str, Floats]  # by the curve's name (draws, counts), NaN before anything can have been learnt
    monotone: Mapping[str, bool]  # whether the data allow a curve to rise only, and it is drawn so
    model: CurveModel  # what they are drawn from; it numbers its curves in their order
    first: float  # so many samples after which something has been learnt


def draw_curves(
    curves: Mapping[str, LearningCurve], bounds: tuple[float, float], draws: int = POSTERIOR_DRAWS
) -> CurveDraws:
    """Draw the mean curves, within bounds, that the examinations allow: a pure function of these."""
    first = float(min(curve.counts[1] for curve in curves.values()))
    last = max(curve.counts[-1] for curve in curves.values())
    place = np.linspace(0.0, end := float(doublings(np.array(last), first)), 1 + round(STEPS * end))
    model = fit_curve_model(_marks(curves, first))
    which = np.repeat(np.arange(len(curves)), len(place))
    mean, covariance = model.mean_curves(which, np.tile(place, len(curves)))
    normal = np.random.default_rng(0).standard_normal((draws, len(mean)))
    # A matrix whose product with its transpose is the covariance, even one that rounding has made indefinite
    values, vectors = np.linalg.eigh(covariance)
    root = np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
    drawn = np.clip(mean + normal @ root.T, *bounds).reshape(draws, len(curves), -1)
    rising = {
        name: _may_rise_only(mean[which == number], covariance[np.ix_(which == number, which == number)])
        for number, name in enumerate(curves)
    }
    sure = 1.0 / np.maximum(np.diag(covariance), LEAST_VARIANCE).reshape(len(curves), -1)
    scores = {
        name: np.array([isotonic_regression(one, weights=sure[number]).x for one in drawn[:, number]])
        if rising[name]
        else drawn[:, number].copy()
        for number, name in enumerate(curves)
    }
    for name, curve in curves.items():
        if not np.isfinite(curve.scores[:, 0]).any():
            scores[name][:, place < 1.0 - 1e-9] = np.nan
    return CurveDraws(counts_at(place, first), scores, rising, model, first)


def _marks(curves: Mapping[str, LearningCurve], first: float) -> Examined:
    rows = []
    for number, curve in enumerate(curves.values()):
        at = doublings(np.array(curve.counts), first)
        rows += [
            (number, repetition, at[place], curve.scores[repetition, place]) for repetition, place in curve.examined
        ]
    number, repetition, place, score = np.array(rows).T
    return Examined(number.astype(np.intp), repetition.astype(np.intp), place, score)


def _may_rise_only(mean: Floats, covariance: Floats) -> bool:
    """Tell whether the greatest fall of the mean is within doubt."""
    fall = np.triu(mean[:, None] - mean)
    early, late = np.unravel_index(np.argmax(fall), fall.shape)
    variance = covariance[early, early] + covariance[late, late] - 2.0 * covariance[early, late]
    return bool(fall[early, late] <= DOUBT * np.sqrt(max(variance, 0.0)))


def crossing(counts: Floats, scores: Floats, threshold: Floats, first: float) -> Floats:
    """η of each draw: the number of samples from which the mean score stays at its threshold; infinite where none."""
    above = scores - threshold[:, None]
    below = ~(above >= 0.0)
    last = np.where(below.any(axis=1), len(counts) - 1 - np.argmax(below[:, ::-1], axis=1), -1)
    here, after = np.clip(last, 0, None), np.clip(last + 1, None, len(counts) - 1)
    rows = np.arange(len(scores))
    low, high = above[rows, here], above[rows, after]
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(high > low, -low / (high - low), 1.0)
    # Before anything is learnt there is no score to rise from, and the next place drawn may lie beyond the first count
    rising = counts[here] + share * (counts[after] - counts[here])
    between = np.where(np.isnan(low), np.maximum(first, counts[here]), rising)
    return np.asarray(np.where(last < 0, counts[0], np.where(last == len(counts) - 1, np.inf, between)))
