"""How sure the fitted parameters are."""

import numpy as np
from scipy.stats import t as student

from proxytune.diagnosis.measured.drives import Floats
from proxytune.diagnosis.model.coordinates import Coordinate, is_stepwise, span, theta_at
from proxytune.diagnosis.model.fitting import KEPT_SOLVABLE, Fit, slopes_by_block, sum_by_block
from proxytune.diagnosis.model.innovations import huber
from proxytune.diagnosis.model.replay import increments

LOOKS = (np.geomspace(0.6, 1.6, 31), np.geomspace(0.97, 1.03, 31))
"""Where a coordinate that changes the motion by steps is looked at, as multiples of its value."""

LEAST = 0.003
"""Half of such an interval is no less than this share of the value."""


def intervals(fitted: Fit) -> dict[str, tuple[float, float]]:
    """95 % intervals of the fitted parameters, from what blocks say differently."""
    smooth = _smooth_intervals(fitted)
    rough = (coordinate for coordinate in fitted.free if is_stepwise(coordinate, fitted.drives.robot))
    for coordinate in rough:
        ends = _stepwise_interval(fitted, coordinate)
        smooth |= dict.fromkeys(coordinate, ends)
    return smooth


def _stepwise_interval(fitted: Fit, coordinate: Coordinate) -> tuple[float, float]:
    """From the best values without each block in turn (jackknife)."""
    low, high = span(coordinate, fitted.drives.robot)
    here = fitted.theta[coordinate[0]]
    values = np.unique(np.clip(here * np.concatenate(([1.0], *LOOKS)), low, high))
    losses = np.stack([_losses(fitted, coordinate, value) for value in values], axis=1)
    best = values[(losses.sum(axis=0) - losses).argmin(axis=1)]
    count = len(best)
    if count < 2:
        return low, high
    spread = np.sqrt((count - 1) / count * np.square(best - best.mean()).sum())
    half = max(float(student.ppf(0.975, count - 1) * spread), LEAST * here)
    return max(low, here - half), min(high, here + half)


def _losses(fitted: Fit, coordinate: Coordinate, value: float) -> Floats:
    """Each block's loss at a value (blocks,) [nats]."""
    drives = fitted.drives
    theta = theta_at(fitted.theta, (coordinate,), np.array([value]))
    left = fitted.whiten.whiten(drives.measured - increments(drives, theta))
    return sum_by_block(drives, huber(left))


def _smooth_intervals(fitted: Fit) -> dict[str, tuple[float, float]]:
    """From the spread between blocks (sandwich)."""
    pull, curve = slopes_by_block(fitted, fitted.slopes)
    blocks, count = pull.shape
    inverse = np.linalg.inv(curve.sum(axis=0) + KEPT_SOLVABLE * np.eye(count))
    spread = inverse @ (pull.T @ pull) @ inverse * blocks / max(1, blocks - count)
    found = {}
    for coordinate, variance in zip(fitted.free, np.diag(spread), strict=True):
        if is_stepwise(coordinate, fitted.drives.robot):
            continue
        low, high = span(coordinate, fitted.drives.robot)
        half = 1.96 * float(np.sqrt(variance)) * (high - low)
        for name in coordinate:
            value = fitted.theta[name]
            found[name] = (max(low, value - half), min(high, value + half))
    return found
