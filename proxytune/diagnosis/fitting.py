"""Fitting a model's free parameters, drive noise and pose noise to the innovations, together."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from proxytune.diagnosis.drives import Drives, Floats, sum_by
from proxytune.diagnosis.innovations import (
    FIRST_GUESS,
    HUBER,
    Noise,
    Whitener,
    clipped,
    fit_noise,
    huber,
    whitener,
)
from proxytune.diagnosis.replay import increments
from proxytune.effects import CATALOGUE, PARAMETERS, effect_of
from proxytune.space import Theta

ROUNDS = 3
"""Parameters and noise are fitted in turn so often."""

STEP = 1e-3
"""Finite differences step by this fraction of a coordinate's range."""

EDGE = 0.01
"""A value this near to an end of its range, as a share of the range, is at the end."""

KEPT_SOLVABLE = 1e-6
"""Added to the curvature of the loss, so that a coordinate without a slope does no harm."""

SCANS = (np.geomspace(0.5, 1.8, 25), np.geomspace(0.95, 1.05, 15), np.geomspace(0.99, 1.01, 11))
"""Where a scan looks in each round, as multiples of the value it starts from."""

Coordinate = tuple[str, ...]
"""Parameters of θ that share one value."""


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


def span(coordinate: Coordinate) -> tuple[float, float]:
    """Lowest and highest value of a coordinate."""
    return PARAMETERS[coordinate[0]].low, PARAMETERS[coordinate[0]].high


def at_edge(name: str, value: float, figures: Mapping[str, float]) -> bool:
    """Whether a value lies at an end of its parameter's range that is not neutral."""
    parameter = PARAMETERS[name]
    reach = EDGE * (parameter.high - parameter.low)
    ends = [end for end in (parameter.low, parameter.high) if end != parameter.neutral_value(figures)]
    return any(abs(value - end) <= reach for end in ends)


def fit(drives: Drives, theta: Theta, free: tuple[Coordinate, ...], noise: Noise = FIRST_GUESS) -> Fit:
    """Fit free coordinates from where θ has them, in rounds of parameters and noise.

    Within a round the filter's gains are frozen: otherwise flat gains would pass for evidence.
    """
    for number in range(ROUNDS):
        whiten = whitener(drives, noise)
        theta = _scanned(drives, theta, tuple(filter(is_stepwise, free)), whiten, SCANS[min(number, len(SCANS) - 1)])
        smooth = tuple(coordinate for coordinate in free if not is_stepwise(coordinate))
        theta = _fit_theta(drives, theta, smooth, whiten)
        noise = fit_noise(drives, drives.measured - increments(drives, theta), noise)
    return seen(drives, theta, free, noise)


def seen(drives: Drives, theta: Theta, free: tuple[Coordinate, ...], noise: Noise) -> Fit:
    """A model with its noise as these drives show it, nothing fitted."""
    whiten = whitener(drives, noise)
    left = whiten.whiten(drives.measured - increments(drives, theta))
    return Fit(drives, theta, free, noise, whiten, left, slopes(drives, theta, free, whiten))


def renoised(fitted: Fit, noise: Noise) -> Fit:
    """The same model with another noise."""
    return seen(fitted.drives, fitted.theta, fitted.free, noise)


def _fit_theta(drives: Drives, theta: Theta, free: tuple[Coordinate, ...], whiten: Whitener) -> Theta:
    if not free:
        return theta
    low, high = np.array([span(coordinate) for coordinate in free]).T

    def left(fractions: Floats) -> Floats:
        moved = placed(theta, free, low + fractions * (high - low))
        return whiten.whiten(drives.measured - increments(drives, moved))

    def slope(fractions: Floats) -> Floats:
        return slopes(drives, placed(theta, free, low + fractions * (high - low)), free, whiten)

    start = (np.array([theta[coordinate[0]] for coordinate in free]) - low) / (high - low)
    found = least_squares(
        left, np.clip(start, 1e-6, 1.0 - 1e-6), slope, (0.0, 1.0), loss="huber", f_scale=HUBER, ftol=1e-7, max_nfev=30
    )
    return placed(theta, free, low + np.clip(found.x, 0.0, 1.0) * (high - low))


def _scanned(drives: Drives, theta: Theta, rough: tuple[Coordinate, ...], whiten: Whitener, multiples: Floats) -> Theta:
    """The best value of each coordinate in which the motion changes by steps, all others held."""
    for coordinate in rough:
        low, high = span(coordinate)
        here = theta[coordinate[0]]
        values = np.clip(here * np.concatenate(([1.0], multiples)), low, high)
        losses = [loss_of(drives, placed(theta, (coordinate,), np.array([value])), whiten) for value in values]
        theta = placed(theta, (coordinate,), values[[int(np.argmin(losses))]])
    return theta


def is_stepwise(coordinate: Coordinate) -> bool:
    """Whether it changes the motion by steps: no slope leads to its best value, so that is scanned for."""
    trace = CATALOGUE[effect_of(coordinate[0])].trace
    return trace is not None and trace.stepwise


def loss_of(drives: Drives, theta: Theta, whiten: Whitener) -> float:
    """The loss of a model under frozen gains [nats]."""
    return float(huber(whiten.whiten(drives.measured - increments(drives, theta))).sum())


def placed(theta: Theta, free: tuple[Coordinate, ...], values: Floats) -> dict[str, float]:
    """θ with its free coordinates at these values."""
    given = {name: float(value) for names, value in zip(free, values, strict=True) for name in names}
    return {**theta, **given}


def slopes(drives: Drives, theta: Theta, free: tuple[Coordinate, ...], whiten: Whitener) -> Floats:
    """Change of the innovations per coordinate, as a fraction of its range (3N, coordinates)."""
    if not free:
        return np.empty((3 * len(drives.episode), 0))
    here = increments(drives, theta)
    columns = []
    for coordinate in free:
        low, high = span(coordinate)
        step = STEP if theta[coordinate[0]] + STEP * (high - low) <= high else -STEP
        there = placed(theta, (coordinate,), np.array([theta[coordinate[0]] + step * (high - low)]))
        columns.append((here - increments(drives, there)) / step)
    return whiten.whiten(np.stack(columns, axis=-1))


def by_block(drives: Drives, values: Floats) -> Floats:
    """Sums over the innovations of each block, (3N, …) to (blocks, …)."""
    return sum_by(np.repeat(drives.block, 3), values, int(drives.block.max()) + 1)


def predictive(fitted: Fit) -> Floats:
    """Each block's log-likelihood under the model fitted to all others (blocks,), in nats.

    Leaving a block out moves the parameters by one Newton step.
    """
    sums = slopes_by_block(fitted, fitted.slopes)
    shifted = left_out(fitted, fitted.slopes, sums, KEPT_SOLVABLE * np.eye(fitted.slopes.shape[1]))
    loss = huber(shifted).reshape(-1, 3).sum(axis=1) + fitted.whiten.log_determinant
    return sum_by(fitted.drives.block, -loss, int(fitted.drives.block.max()) + 1)


def left_out(fitted: Fit, columns: Floats, sums: tuple[Floats, Floats], penalty: Floats) -> Floats:
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
    pull = by_block(fitted.drives, columns * clipped(z)[:, None])
    curve = [columns[own].T @ inner[own] for own in (label == block for block in range(len(pull)))]
    return pull, np.stack(curve)


def intervals(fitted: Fit) -> dict[str, tuple[float, float]]:
    """Intervals of the fitted parameters: 95 %, from the spread between blocks (sandwich)."""
    pull, curve = slopes_by_block(fitted, fitted.slopes)
    blocks, count = pull.shape
    inverse = np.linalg.inv(curve.sum(axis=0) + KEPT_SOLVABLE * np.eye(count))
    spread = inverse @ (pull.T @ pull) @ inverse * blocks / max(1, blocks - count)
    found = {}
    for coordinate, variance in zip(fitted.free, np.diag(spread), strict=True):
        low, high = span(coordinate)
        half = 1.96 * float(np.sqrt(variance)) * (high - low)
        for name in coordinate:
            value = fitted.theta[name]
            found[name] = (max(low, value - half), min(high, value + half))
    return found
