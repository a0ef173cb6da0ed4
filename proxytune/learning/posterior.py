"""The posterior of learning curves: draws of all mean curves together, bounded, and rising where the data allow it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import isotonic_regression

from proxytune.learning.curve_model import CurveModel, Marks, counts_at, fit_curve_model, places
from proxytune.learning.curves import Array, Curve

DRAWS = 2000
STEPS = 8
"""Places of a drawn curve per doubling of target samples."""
LEAST_VARIANCE = 1e-9
DOUBT = 2.5
"""A curve falls where its mean falls by more standard deviations: the greatest of many falls is partly luck."""


@dataclass(frozen=True)
class Draws:
    """Mean curves drawn from their posterior, all proxies' together.

    Attributes:
        counts: Numbers of target samples (counts,), rising from 0.
        scores: Mean scores by name of the curve, (draws, counts) each; NaN before anything can have been learnt.
        monotone: Whether the data allow a curve to rise only, by name; then it is drawn so.
        model: What they are drawn from; its curves are numbered in the order of `scores`.
        first: The smallest number of target samples after which something has been learnt.
    """

    counts: Array
    scores: Mapping[str, Array]
    monotone: Mapping[str, bool]
    model: CurveModel
    first: float


def draw_curves(curves: Mapping[str, Curve], bounds: tuple[float, float], draws: int = DRAWS, seed: int = 0) -> Draws:
    """Draw the mean curves that the examinations allow: a pure function of these.

    Args:
        curves: Scores by name of the learning curve.
        bounds: Lowest and highest score there can be.
        draws: How many.
        seed: Of what is drawn.
    """
    first = float(min(curve.counts[1] for curve in curves.values()))
    last = max(curve.counts[-1] for curve in curves.values())
    place = np.linspace(0.0, end := float(places(np.array(last), first)), 1 + round(STEPS * end))
    model = fit_curve_model(_marks(curves, first))
    which = np.repeat(np.arange(len(curves)), len(place))
    mean, covariance = model.mean_curves(which, np.tile(place, len(curves)))
    normal = np.random.default_rng(seed).standard_normal((draws, len(mean)))
    drawn = np.clip(mean + normal @ _root(covariance).T, *bounds).reshape(draws, len(curves), -1)
    rising = {
        name: _may_rise_only(mean[which == number], covariance[np.ix_(which == number, which == number)])
        for number, name in enumerate(curves)
    }
    sure = 1.0 / np.maximum(np.diag(covariance), LEAST_VARIANCE).reshape(len(curves), -1)
    scores = {
        name: _rising(drawn[:, number], sure[number]) if rising[name] else drawn[:, number].copy()
        for number, name in enumerate(curves)
    }
    for name, curve in curves.items():
        if not np.isfinite(curve.scores[:, 0]).any():
            scores[name][:, place < 1.0 - 1e-9] = np.nan
    return Draws(counts_at(place, first), scores, rising, model, first)


def _marks(curves: Mapping[str, Curve], first: float) -> Marks:
    rows = []
    for number, curve in enumerate(curves.values()):
        at = places(np.array(curve.counts), first)
        rows += [
            (number, repetition, at[place], curve.scores[repetition, place]) for repetition, place in curve.examined
        ]
    number, repetition, place, score = np.array(rows).T
    return Marks(number.astype(np.intp), repetition.astype(np.intp), place, score)


def _root(covariance: Array) -> Array:
    """A matrix whose product with its transpose is a covariance, even one that rounding has made indefinite."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _may_rise_only(mean: Array, covariance: Array) -> bool:
    """Whether the greatest fall of the mean is within doubt."""
    fall = np.triu(mean[:, None] - mean)
    early, late = np.unravel_index(np.argmax(fall), fall.shape)
    variance = covariance[early, early] + covariance[late, late] - 2.0 * covariance[early, late]
    return bool(fall[early, late] <= DOUBT * np.sqrt(max(variance, 0.0)))


def _rising(drawn: Array, sure: Array) -> Array:
    """The rising curves nearest to those drawn (draws, counts), where these are surest above all.

    Projecting a draw of a Gaussian process is a draw of a posterior of rising curves (Lin and Dunson 2014).
    """
    return np.array([isotonic_regression(one, weights=sure).x for one in drawn])


def crossing(counts: Array, scores: Array, threshold: Array, first: float) -> Array:
    """η of each draw: the number of target samples from which on the mean score stays converged; infinite where none.

    Args:
        counts: Numbers of target samples (counts,).
        scores: Mean scores (draws, counts); NaN where there is no learner yet.
        threshold: The lowest score that counts (draws,).
        first: The number of target samples after which there is a learner.
    """
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
