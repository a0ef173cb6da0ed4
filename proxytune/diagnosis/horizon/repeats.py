"""Manoeuvres that were driven twice from the same commands: what differs between them no model can predict."""

from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.horizon.windows import Ratio, Windows, cut, measured_motion, pose_errors, ratio
from proxytune.diagnosis.measured.drives import Drives, Floats, Whole, sum_by
from proxytune.space import Theta

FEWEST = 20
"""Of fewer windows that were driven several times nothing is said."""

ALIKE = 1e-6
"""Commands that differ by less than this [duty] are the same."""


class Repeated(NamedTuple):
    """The scatter of drives from the same commands, beside the error of a model.

    Attributes:
        share: What they do not repeat, by the model's error over the same windows: at 1 it predicts all that repeats.
        apart: What they do not repeat: RMSE of position [m].
        part: The share of all windows that have repeats.
    """

    share: Ratio
    apart: float
    part: float


def compare_repeats(drives: Drives, theta: Theta, horizon_s: float) -> Repeated | None:
    """Compare a model's error with what drives do not repeat; None where too little was driven twice.

    Of windows driven n times the mean is taken off, and n/(n − 1) gives back
    what that takes: for two drives, √(½ mean square of their difference).

    Args:
        drives: All drives of a log, each as one block, so that windows of repeats begin together.
        theta: The model.
        horizon_s: Length of the windows [s].
    """
    windows = cut(drives, horizon_s)
    if len(windows.begin) < FEWEST:
        return None
    label, counts = _label_repeats(drives, windows)
    kept = counts[label] > 1
    if len(np.unique(windows.window[kept])) < FEWEST:
        return None
    apart = _scatter_of_repeats(measured_motion(drives, windows)[:, :2], label, counts)
    missed = pose_errors(drives, theta, windows)[:, 0] ** 2
    first = np.flatnonzero(np.diff(windows.window, prepend=-1))
    share = ratio(apart[kept], missed[kept], label[first][windows.window][kept])
    return Repeated(share, float(np.sqrt(apart[kept].mean())), float(kept.mean()))


def _label_repeats(drives: Drives, windows: Windows) -> tuple[Whole, Whole]:
    """Label each compared pose by what it repeats (M,), and count how often each of those was driven.

    A pose is a repeat if its window began at the same time and all commands before it were the same, not all zero.
    """
    begin, end = drives.first[windows.begin][windows.window], drives.last[windows.increment]
    past = _histories(drives)[drives.episode[windows.increment], end - 1]
    alone = np.where(past == 0, np.arange(len(past)) + 1, 0)
    _, label, counts = np.unique(np.stack((past, begin, end, alone)), axis=1, return_inverse=True, return_counts=True)
    return label.ravel(), counts


def _histories(drives: Drives) -> Whole:
    """A number for all commands up to each tick (E, T): equal ones have the same, and no commands have 0."""
    rounded = np.round(drives.duties / ALIKE).astype(np.int64)
    weights = np.random.default_rng(1).integers(1, 2**62, size=rounded.shape[1:])
    return np.asarray(np.cumsum((rounded * weights).sum(axis=-1), axis=1))


def _scatter_of_repeats(moved: Floats, label: Whole, counts: Whole) -> Floats:
    """Squared distance [m²] of each motion (M, 2) from the mean of its repeats, as if that were known without error."""
    mean = sum_by(label, moved, len(counts)) / counts[:, None]
    share = np.maximum(1, counts - 1)[label] / counts[label]
    return np.asarray(np.square(moved - mean[label]).sum(axis=1) / share)
