"""Fitting a model's free parameters, drive noise and pose noise to the whitened innovations, together.

`fit` minimises Σ huber(z(θ)) over θ by least squares with z = L⁻¹(measured − increments(θ)) and L frozen, then the
noise by likelihood, in rounds; a coordinate that changes the motion by steps is scanned instead. With J = ∂z/∂θ
(`slopes`), ψ Huber's clipped z and w the weight of what is no outlier, each block b has

    gradient  g_b = J_bᵀψ_b,    Hessian  H_b = J_bᵀ(w·J)_b,

and leaving it out moves the parameters by one Newton step, −(H − H_b)⁻¹(g − g_b): `held_out_log_likelihood`. The same
blocks give the `intervals` (sandwich; jackknife where there is no slope). `check_motion` and `check_units` refuse logs
that cannot bear the question: no motion, or other units and axes than the commands'.
"""

import functools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from proxytune.diagnosis.motion.drives import Drives, Floats, Whole, sum_by
from proxytune.diagnosis.motion.innovations import (
    FIRST_GUESS,
    HUBER,
    Coordinate,
    Noise,
    Whitener,
    clip_outliers,
    difference_quotient,
    fit_noise,
    huber,
    increments,
    is_lateness,
    is_stepwise,
    smooth_coordinates,
    span,
    spans,
    theta_at,
    values_at,
    whitener,
)
from proxytune.diagnosis.motion.prediction import jackknife_half_width
from proxytune.errors import LogError
from proxytune.space import Theta

ROUNDS = 3
"""Parameters and noise are fitted in turn so often."""
STEP = 1e-3
"""Finite differences step by this fraction of a coordinate's range."""
KEPT_SOLVABLE = 1e-6
"""Added to the Hessian of the loss, so that a coordinate without a slope does no harm."""
SCANS = (np.geomspace(0.5, 1.8, 25), np.geomspace(0.95, 1.05, 15), np.geomspace(0.99, 1.01, 11))
"""Where a scan looks in each round, as multiples of the value it starts from."""


@dataclass(frozen=True)
class Fit:
    """A model fitted to drives."""

    drives: Drives  # what it was fitted to
    theta: Mapping[str, float]  # all its values besides the robot's nominal ones, fitted or fixed
    free: tuple[Coordinate, ...]  # the coordinates that were fitted
    noise: Noise  # drive and pose noise
    whiten: Whitener  # the whitener of that noise
    innovations: Floats  # whitened residuals of the increments, white noise if the model is right (3N,)
    slopes: Floats  # their change per unit of each coordinate, as a fraction of its range (3N, coordinates)


def fit(drives: Drives, theta: Theta, free: tuple[Coordinate, ...], noise: Noise = FIRST_GUESS) -> Fit:
    """Fit free coordinates from where θ has them, in rounds of parameters and noise."""
    # Within a round the filter's gains are frozen: otherwise flat gains would pass for evidence.
    for number in range(ROUNDS):
        theta = fit_theta(drives, theta, free, whitener(drives, noise), SCANS[min(number, len(SCANS) - 1)])
        noise = fit_noise(drives, drives.measured - increments(drives, theta), noise)
    return evaluate(drives, theta, free, noise)


def evaluate(drives: Drives, theta: Theta, free: tuple[Coordinate, ...], noise: Noise) -> Fit:
    """Evaluate a model with its noise on these drives: innovations and slopes; nothing is fitted."""
    whiten = whitener(drives, noise)
    innovations = whiten.whiten(drives.measured - increments(drives, theta))
    return Fit(drives, theta, free, noise, whiten, innovations, slopes(drives, theta, free, whiten))


def fit_theta(
    drives: Drives, theta: Theta, free: tuple[Coordinate, ...], whiten: Whitener, multiples: Floats = SCANS[0]
) -> Theta:
    """Fit free coordinates from where θ has them, gains frozen, those of steps first, at multiples of their values."""
    sloped = smooth_coordinates(free, drives.robot)
    rough = tuple(coordinate for coordinate in free if coordinate not in sloped)
    return _fit_sloped(drives, _scan(drives, theta, rough, whiten, multiples), sloped, whiten)


def _fit_sloped(drives: Drives, theta: Theta, free: tuple[Coordinate, ...], whiten: Whitener) -> Theta:
    if not free:
        return theta
    low, high = spans(free, drives)

    def residuals(fractions: Floats) -> Floats:
        moved = theta_at(theta, free, low + fractions * (high - low))
        return whiten.whiten(drives.measured - increments(drives, moved))

    def jacobian(fractions: Floats, *, across_ticks: bool = False) -> Floats:
        moved = theta_at(theta, free, low + fractions * (high - low))
        return slopes(drives, moved, free, whiten, across_ticks=across_ticks)

    # A search by the slope at a delay ends in the nearest kink, far from its best value: one across ticks comes first.
    late = any(is_lateness(coordinate, drives.robot) for coordinate in free)
    best = (values_at(theta, free) - low) / (high - low)
    for across_ticks in (True, False) if late else (False,):
        start = np.clip(best, 1e-6, 1.0 - 1e-6)
        best = least_squares(
            residuals,
            start,
            functools.partial(jacobian, across_ticks=across_ticks),
            (0.0, 1.0),
            loss="huber",
            f_scale=HUBER,
            ftol=1e-7,
            max_nfev=30,
        ).x
    return theta_at(theta, free, low + np.clip(best, 0.0, 1.0) * (high - low))


def _scan(drives: Drives, theta: Theta, rough: tuple[Coordinate, ...], whiten: Whitener, multiples: Floats) -> Theta:
    """Scan for the best value of each coordinate in which the motion changes by steps, all others held."""
    for coordinate in rough:
        low, high = span(coordinate, drives)
        here = theta[coordinate[0]]
        # People set thresholds and steps to round numbers, and a duty just on one goes the other way a hair beside it.
        round_numbers = [float(f"{here:.{figures}g}") for figures in (1, 2, 3)]
        values = np.clip(np.concatenate((round_numbers, [here], here * multiples)), low, high)
        losses = [loss_of(drives, theta_at(theta, (coordinate,), (value,)), whiten) for value in values]
        theta = theta_at(theta, (coordinate,), (values[np.argmin(losses)],))
    return theta


def loss_of(drives: Drives, theta: Theta, whiten: Whitener) -> float:
    """Sum Huber's loss of a model under frozen gains [nats]."""
    return float(huber(whiten.whiten(drives.measured - increments(drives, theta))).sum())


def slopes(
    drives: Drives, theta: Theta, free: tuple[Coordinate, ...], whiten: Whitener, *, across_ticks: bool = False
) -> Floats:
    """Differentiate the innovations by each coordinate, as a fraction of its range (3N, coordinates)."""
    if not free:
        return np.empty((3 * len(drives.episode), 0))
    columns, predicted = [], functools.partial(increments, drives)
    for coordinate in free:
        if is_stepwise(coordinate, drives.robot):
            # The slope there says nothing of the next step.
            columns.append(np.zeros_like(drives.measured))
            continue
        slope = difference_quotient(predicted, drives, theta, coordinate, STEP, across_ticks=across_ticks)
        columns.append(-slope)
    return whiten.whiten(np.stack(columns, axis=-1))


def sum_by_block(drives: Drives, values: Floats) -> Floats:
    """Sum over the innovations of each block, (3N, …) to (blocks, …)."""
    return sum_by(np.repeat(drives.block, 3), values, int(drives.block.max()) + 1)


def held_out_log_likelihood(fitted: Fit) -> Floats:
    """Each block's log-likelihood under the model fitted to all others, a Newton step away (blocks,) [nats]."""
    sums = derivatives_by_block(fitted, fitted.slopes)
    shifted = held_out_innovations(fitted, fitted.slopes, sums, KEPT_SOLVABLE * np.eye(fitted.slopes.shape[1]))
    loss = huber(shifted).reshape(-1, 3).sum(axis=1) + fitted.whiten.log_determinant
    return sum_by(fitted.drives.block, -loss, int(fitted.drives.block.max()) + 1)


def held_out_innovations(fitted: Fit, columns: Floats, sums: tuple[Floats, Floats], penalty: Floats) -> Floats:
    """Give the innovations (3N,) with each block's columns weighted, under a penalty, as all others have it."""
    gradient, hessian = sums
    rest = hessian.sum(axis=0) - hessian + penalty
    moved = -np.linalg.solve(rest, (gradient.sum(axis=0) - gradient)[:, :, None])[:, :, 0]
    own = np.repeat(moved[fitted.drives.block], 3, axis=0)
    return np.asarray(fitted.innovations + np.einsum("nc,nc->n", columns, own))


def derivatives_by_block(fitted: Fit, columns: Floats) -> tuple[Floats, Floats]:
    """Gradient (blocks, columns) and Hessian (blocks, columns, columns) of each block's loss along the columns."""
    z, label = fitted.innovations, np.repeat(fitted.drives.block, 3)
    inner = columns * (np.abs(z) < HUBER)[:, None]
    gradient = sum_by_block(fitted.drives, columns * clip_outliers(z)[:, None])
    hessian = [columns[own].T @ inner[own] for own in (label == block for block in range(len(gradient)))]
    return gradient, np.stack(hessian)


LOOKS = (np.geomspace(0.6, 1.6, 31), np.geomspace(0.97, 1.03, 31))
"""Where a coordinate that changes the motion by steps is looked at, as multiples of its value."""
LEAST = 0.003
"""Half of such an interval is no less than this share of the value."""


def intervals(fitted: Fit) -> dict[str, tuple[float, float]]:
    """Give 95 % intervals of the fitted parameters, from the scatter between blocks."""
    # A delay's best value is at a kink as a rule, where the slope says nothing of how far off it may be.
    across = slopes(fitted.drives, fitted.theta, fitted.free, fitted.whiten, across_ticks=True)
    gradients, hessian = derivatives_by_block(fitted, across)
    known = sandwich_intervals(fitted.theta, fitted.free, fitted.drives, gradients, hessian.sum(axis=0))
    for coordinate in fitted.free:
        if is_stepwise(coordinate, fitted.drives.robot):
            known |= dict.fromkeys(coordinate, _stepwise_interval(fitted, coordinate))
    return known


def _stepwise_interval(fitted: Fit, coordinate: Coordinate) -> tuple[float, float]:
    """From the best values without each block in turn (jackknife)."""
    low, high = span(coordinate, fitted.drives)
    here = fitted.theta[coordinate[0]]
    values = np.unique(np.clip(here * np.concatenate(([1.0], *LOOKS)), low, high))
    drives = fitted.drives
    thetas = (theta_at(fitted.theta, (coordinate,), (value,)) for value in values)
    left = (fitted.whiten.whiten(drives.measured - increments(drives, theta)) for theta in thetas)
    losses = np.stack([sum_by_block(drives, huber(innovations)) for innovations in left], axis=1)
    best = values[(losses.sum(axis=0) - losses).argmin(axis=1)]
    half = max(jackknife_half_width(best), LEAST * here)
    return max(low, here - half), min(high, here + half)


def sandwich_intervals(
    theta: Theta, free: tuple[Coordinate, ...], drives: Drives, gradients: Floats, hessian: Floats
) -> dict[str, tuple[float, float]]:
    """95 % intervals from the spread of gradients between blocks (blocks, coordinates), and the Hessian.

    Values at an end of their range cannot give way to the others, whose intervals are those beside them.
    """

    def variances(chosen: Whole) -> Floats:
        inverse = np.linalg.pinv(hessian[np.ix_(chosen, chosen)] + KEPT_SOLVABLE * np.eye(len(chosen)), hermitian=True)
        return np.asarray(np.square(gradients[:, chosen] @ inverse).sum(axis=0))

    ranges = [span(coordinate, drives) for coordinate in free]
    ends = [drives.rules.at_end(value, own) for value, own in zip(values_at(theta, free), ranges, strict=True)]
    inside, spread = np.flatnonzero(~np.array(ends, dtype=bool)), variances(np.arange(len(free)))
    spread[inside] = variances(inside)
    freedom = max(1, len(gradients) - len(free))
    spread *= len(gradients) / freedom
    found: dict[str, tuple[float, float]] = {}
    for coordinate, (low, high), variance in zip(free, ranges, spread, strict=True):
        half = float(student.ppf(0.975, freedom) * np.sqrt(variance)) * (high - low)
        found |= {name: (max(low, theta[name] - half), min(high, theta[name] + half)) for name in coordinate}
    return found


LEAST_TRAVEL_M = 0.05
LEAST_TURN_RAD = 0.2
"""A robot that got no further than both from where it was most of the time has shown nothing but noise."""
MOST_TIMES = 6.0
"""A robot that drove so many times as far as it was told, or as much less, is in other units."""
MOST_ASKEW_DEG = 60.0
"""A robot that drives further than this from its heading has another zero of the heading."""


def check_motion(name: str, drives: Drives) -> None:
    """Refuse a log in which the robot stands or is never told to move, and say which."""
    if np.abs(drives.duties).max() < 1e-6:
        raise LogError(f"{name}: every command is zero; nothing can be learnt from a robot that is never told to move")
    furthest = np.zeros(2)
    for episode in np.unique(drives.episode):
        poses = drives.poses[drives.episode == episode, 1]
        off = np.abs(poses - np.median(poses, axis=0))
        furthest = np.maximum(furthest, np.quantile((np.hypot(off[:, 0], off[:, 1]), off[:, 2]), 0.9, axis=1))
    way, turn = furthest
    if way < LEAST_TRAVEL_M and turn < LEAST_TURN_RAD:
        got = f"{name}: the robot got {way:.3f} m far and turned {turn:.2f} rad"
        raise LogError(f"{got}; nothing can be learnt from a robot that stands still: check the poses, or drive")


def check_units(name: str, drives: Drives, theta: Theta) -> None:
    """Refuse poses in other units or axes than the commands can have led to, and say which."""
    asked = increments(drives, theta)
    way, driven = float(np.abs(asked[:, 0]).sum()), float(drives.travel[:, 0].sum())
    if way > LEAST_TRAVEL_M and not 1.0 / MOST_TIMES < driven / way < MOST_TIMES:
        problem = f"{name}: the poses say that the robot drove {driven:.3g} m where its commands say {way:.3g} m"
        raise LogError(f"{problem}; check the units (m, rad) and the robot's figures")
    moved = drives.measured
    course = float(np.degrees(np.arctan2(asked[:, 0] @ moved[:, 1], asked[:, 0] @ moved[:, 0])))
    if abs(course) > MOST_ASKEW_DEG:
        problem = f"{name}: the robot drives {course:.0f}° from where its heading points"
        raise LogError(f"{problem}; check the heading's zero, and which way x and y go")
    turn, turned = asked[:, 2], moved[:, 2]
    if turn @ turned < -0.5 * np.sqrt((turn @ turn) * (turned @ turned)):
        raise LogError(f"{name}: the robot turns the other way than its commands say; check the signs, left and right")
