"""The least error that a model could have, measured without trusting any model: noise of poses, and what repeats."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls
from scipy.stats import chi2

from proxytune.diagnosis.horizon.windows import Windows, measured_motion
from proxytune.diagnosis.measured.drives import Drives, Floats
from proxytune.diagnosis.model.replay import increments
from proxytune.space import Theta

LAGS = (1, 2, 3, 4, 6)
"""Third differences are taken over so many samples."""

NOISE_WEIGHT, WALK_WEIGHT = 20.0, 6.0
"""What third differences make of white noise and of a walk: 1² + 3² + 3² + 1², and of its steps 1² + 2² + 1²."""

CUT = 9.0
"""Squares beyond so many times the median are cut: motion that a model misses for a moment is not noise."""

FEWEST = 20
"""With fewer third differences a lag says nothing."""


class PoseNoise(NamedTuple):
    """White noise of measured poses, one standard deviation: of x and of y [m], of the heading [rad]."""

    place: float
    turn: float


def pose_noise(drives: Drives, theta: Theta) -> PoseNoise:
    """The noise of measured poses, from third differences of the path of what a model leaves over.

    A model's slow errors, and those of a robot that drifts, vanish in third differences or grow with the lag; the noise
    of a pose does neither.

    Args:
        drives: The measured drives.
        theta: The model that is taken off; the better it is, the fewer of its errors pass for noise.
    """
    left = drives.measured - increments(drives, theta)
    heading = drives.poses[:, 0, 2]
    along = (left[:, 0] + 1j * left[:, 1]) * np.exp(1j * heading)
    steps = np.stack((along.real, along.imag, left[:, 2]), axis=1)
    differences = {lag: _third_differences(drives, steps, lag) for lag in LAGS}
    enough = {lag: rows for lag, rows in differences.items() if len(rows) >= FEWEST}
    return PoseNoise(_white(enough, slice(0, 2)), _white(enough, slice(2, 3)))


def _third_differences(drives: Drives, steps: Floats, lag: int) -> Floats:
    """Third differences of the path that these steps make, over runs of unbroken poses (rows, 3)."""
    path = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    start = np.arange(len(steps) - 3 * lag + 1)
    run = np.cumsum(~drives.linked)
    start = start[run[start] == run[start + 3 * lag - 1]]
    return np.asarray(path[start + 3 * lag] - 3.0 * path[start + 2 * lag] + 3.0 * path[start + lag] - path[start])


def _white(differences: dict[int, Floats], columns: slice) -> float:
    """The standard deviation of white noise in one coordinate: E|Δ³|² = 20 σ² + 6 q · lag, both fitted."""
    if not differences:
        return 0.0
    means = np.array([_mean_square(rows[:, columns]) for rows in differences.values()])
    terms = np.array([(NOISE_WEIGHT, WALK_WEIGHT * lag) for lag in differences])
    weights = 1.0 / np.maximum(means, 1e-18)
    (square, _), _ = nnls(terms * weights[:, None], means * weights)
    return float(np.sqrt(square))


def _mean_square(rows: Floats) -> float:
    """Mean square of a coordinate; large ones are cut, and what the cut takes from Gaussian ones is given back."""
    count = rows.shape[1]
    squares = (rows**2).sum(axis=1)
    limit = CUT * float(np.median(squares))
    end = CUT * float(chi2.ppf(0.5, count))
    kept = chi2.cdf(end, count + 2) + end / count * chi2.sf(end, count)
    return float(np.minimum(squares, limit).mean() / kept / count)


def noise_floor(drives: Drives, windows: Windows, noise: PoseNoise) -> tuple[float, float]:
    """The error that the noise of poses alone makes over windows: RMSE of position [m] and heading [rad].

    Both ends of a motion are measured, each with noise in x and y; the heading at its beginning turns all of it.
    """
    chords = np.square(measured_motion(drives, windows)[:, :2]).sum(axis=1).mean()
    place = 4.0 * noise.place**2 + noise.turn**2 * chords
    return float(np.sqrt(place)), float(np.sqrt(2.0) * noise.turn)
