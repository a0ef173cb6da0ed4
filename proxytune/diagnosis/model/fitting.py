"""Fitting a model's free parameters, drive noise and pose noise to the innovations, together."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from proxytune.diagnosis.measured.drives import Drives, Floats, sum_by
from proxytune.diagnosis.model.coordinates import Coordinate, is_stepwise, smooth_coordinates, span, theta_at
from proxytune.diagnosis.model.innovations import (
    FIRST_GUESS,
    HUBER,
    Noise,
    Whitener,
    clip_outliers,
    fit_noise,
    huber,
    whitener,
)
from proxytune.diagnosis.model.replay import increments
from proxytune.space import Theta

ROUNDS = 3
"""Parameters and noise are fitted in turn so often."""

STEP = 1e-3
"""Finite differences step by this fraction of a coordinate's range."""

KEPT_SOLVABLE = 1e-6
"""Added to the curvature of the loss, so that a coordinate without a slope does no harm."""

SCANS = (np.geomspace(0.5, 1.8, 25), np.geomspace(0.95, 1.05, 15), np.geomspace(0.99, 1.01, 11))
"""Where a scan looks in each round, as multiples of the value it starts from."""


@dataclass(frozen=True)
class Fit:
    """A model fitted to drives.

    Attributes:
        drives: What it was fitted to.
        theta: All its values besides the robot's nominal ones, fitted or fixed.
        free: The coordinates that were fitted.
        noise: Drive and pose noise.
        whiten: The whitener of that noise.
        innovations: What the model leaves over, white if it is right (3N,).
        slopes: Their change per unit of each coordinate, as a fraction of its range (3N, coordinates).
    """

    drives: Drives
    theta: Mapping[str, float]
    free: tuple[Coordinate, ...]
    noise: Noise
    whiten: Whitener
    innovations: Floats
    slopes: Floats


def fit(drives: Drives, theta: Theta, free: tuple[Coordinate, ...], noise: Noise = FIRST_GUESS) -> Fit:
    """Fit free coordinates from where θ has them, in rounds of parameters and noise.

    Within a round the filter's gains are frozen: otherwise flat gains would pass for evidence.
    """
    sloped = smooth_coordinates(free, drives.robot)
    rough = tuple(coordinate for coordinate in free if coordinate not in sloped)
    for number in range(ROUNDS):
        whiten = whitener(drives, noise)
        theta = _scan(drives, theta, rough, whiten, SCANS[min(number, len(SCANS) - 1)])
        theta = _fit_theta(drives, theta, sloped, whiten)
        noise = fit_noise(drives, drives.measured - increments(drives, theta), noise)
    return evaluate(drives, theta, free, noise)


def evaluate(drives: Drives, theta: Theta, free: tuple[Coordinate, ...], noise: Noise) -> Fit:
    """Evaluate a model with its noise on these drives: innovations and slopes; nothing is fitted."""
    whiten = whitener(drives, noise)
    left = whiten.whiten(drives.measured - increments(drives, theta))
    return Fit(drives, theta, free, noise, whiten, left, slopes(drives, theta, free, whiten))


def replace_noise(fitted: Fit, noise: Noise) -> Fit:
    """Evaluate the same model with another noise."""
    return evaluate(fitted.drives, fitted.theta, fitted.free, noise)


def _fit_theta(drives: Drives, theta: Theta, free: tuple[Coordinate, ...], whiten: Whitener) -> Theta:
    if not free:
        return theta
    low, high = np.array([span(coordinate, drives.robot) for coordinate in free]).T

    def left(fractions: Floats) -> Floats:
        moved = theta_at(theta, free, low + fractions * (high - low))
        return whiten.whiten(drives.measured - increments(drives, moved))

    def slope(fractions: Floats) -> Floats:
        return slopes(drives, theta_at(theta, free, low + fractions * (high - low)), free, whiten)

    start = (np.array([theta[coordinate[0]] for coordinate in free]) - low) / (high - low)
    found = least_squares(
        left, np.clip(start, 1e-6, 1.0 - 1e-6), slope, (0.0, 1.0), loss="huber", f_scale=HUBER, ftol=1e-7, max_nfev=30
    )
    return theta_at(theta, free, low + np.clip(found.x, 0.0, 1.0) * (high - low))


def _scan(drives: Drives, theta: Theta, rough: tuple[Coordinate, ...], whiten: Whitener, multiples: Floats) -> Theta:
    """Scan for the best value of each coordinate in which the motion changes by steps, all others held.

    Round numbers near by are looked at first: people set thresholds and steps to them, and a duty that lies just on one
    goes the other way at a value a hair beside it.
    """
    for coordinate in rough:
        low, high = span(coordinate, drives.robot)
        here = theta[coordinate[0]]
        values = np.clip(np.concatenate((_round_numbers(here), [here], here * multiples)), low, high)
        losses = [loss_of(drives, theta_at(theta, (coordinate,), np.array([value])), whiten) for value in values]
        theta = theta_at(theta, (coordinate,), values[[int(np.argmin(losses))]])
    return theta


def _round_numbers(value: float) -> list[float]:
    """The value with one, two and three significant figures."""
    return [float(f"{value:.{figures}g}") for figures in (1, 2, 3)]


def loss_of(drives: Drives, theta: Theta, whiten: Whitener) -> float:
    """The loss of a model under frozen gains [nats]."""
    return float(huber(whiten.whiten(drives.measured - increments(drives, theta))).sum())


def slopes(drives: Drives, theta: Theta, free: tuple[Coordinate, ...], whiten: Whitener) -> Floats:
    """Change of the innovations per coordinate, as a fraction of its range (3N, coordinates).

    It is 0 along coordinates that change the motion by steps: the slope there says nothing of the next step.
    """
    if not free:
        return np.empty((3 * len(drives.episode), 0))
    here = increments(drives, theta)
    columns = []
    for coordinate in free:
        if is_stepwise(coordinate, drives.robot):
            columns.append(np.zeros_like(here))
            continue
        low, high = span(coordinate, drives.robot)
        step = STEP if theta[coordinate[0]] + STEP * (high - low) <= high else -STEP
        there = theta_at(theta, (coordinate,), np.array([theta[coordinate[0]] + step * (high - low)]))
        columns.append((here - increments(drives, there)) / step)
    return whiten.whiten(np.stack(columns, axis=-1))


def sum_by_block(drives: Drives, values: Floats) -> Floats:
    """Sums over the innovations of each block, (3N, …) to (blocks, …)."""
    return sum_by(np.repeat(drives.block, 3), values, int(drives.block.max()) + 1)


def held_out_log_likelihood(fitted: Fit) -> Floats:
    """Each block's log-likelihood under the model fitted to all others (blocks,), in nats.

    Leaving a block out moves the parameters by one Newton step.
    """
    sums = slopes_by_block(fitted, fitted.slopes)
    shifted = held_out_innovations(fitted, fitted.slopes, sums, KEPT_SOLVABLE * np.eye(fitted.slopes.shape[1]))
    loss = huber(shifted).reshape(-1, 3).sum(axis=1) + fitted.whiten.log_determinant
    return sum_by(fitted.drives.block, -loss, int(fitted.drives.block.max()) + 1)


def held_out_innovations(fitted: Fit, columns: Floats, sums: tuple[Floats, Floats], penalty: Floats) -> Floats:
    """The innovations (3N,) once each block's columns (3N, columns) are weighted as all other blocks have it.

    Args:
        fitted: What was fitted without the columns.
        columns: Change of the innovations per unit of each weight.
        sums: The blocks' slopes along the columns.
        penalty: Curvature that pulls the weights to 0.
    """
    pull, curve = sums
    rest = curve.sum(axis=0) - curve + penalty
    moved = -np.linalg.solve(rest, (pull.sum(axis=0) - pull)[:, :, None])[:, :, 0]
    own = np.repeat(moved[fitted.drives.block], 3, axis=0)
    return np.asarray(fitted.innovations + np.einsum("nc,nc->n", columns, own))


def slopes_by_block(fitted: Fit, columns: Floats) -> tuple[Floats, Floats]:
    """Gradient (blocks, columns) and curvature (blocks, columns, columns) of each block's loss along the columns."""
    z, label = fitted.innovations, np.repeat(fitted.drives.block, 3)
    inner = columns * (np.abs(z) < HUBER)[:, None]
    pull = sum_by_block(fitted.drives, columns * clip_outliers(z)[:, None])
    curve = [columns[own].T @ inner[own] for own in (label == block for block in range(len(pull)))]
    return pull, np.stack(curve)
