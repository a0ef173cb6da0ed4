"""Manoeuvres that were driven twice from the same commands: what differs between them no model can predict."""

import numpy as np

from proxytune.diagnosis.drives import Drives, Floats, Whole, sum_by
from proxytune.diagnosis.windows import Rmse, Windows, cut, measured_since, ratio, strays
from proxytune.space import Theta

FEWEST = 10
"""With fewer windows that were driven again nothing is said of them."""

ALIKE = 1e-6
"""Commands that differ by less than this [duty] are the same."""


def repeated_share(drives: Drives, theta: Theta, horizon_s: float) -> Rmse | None:
    """What drives do not repeat, by a model's error over the same windows; None where too little was driven twice.

    At 1 the model predicts all that repeats. Of windows driven n times the mean is taken off, and n/(n − 1) gives back
    what that takes: for two drives, √(½ mean square of their difference).

    Args:
        drives: All drives of a log.
        theta: The model.
        horizon_s: Length of the windows [s].
    """
    windows = cut(drives, horizon_s)
    if len(windows.begin) == 0:
        return None
    label, counts = _again(drives, windows)
    kept = counts[label] > 1
    if len(np.unique(label[kept])) == 0 or len(np.unique(windows.window[kept])) < 2 * FEWEST:
        return None
    apart = _apart(measured_since(drives, windows)[:, :2], label, counts)
    missed = strays(drives, theta, windows)[:, 0] ** 2
    place = (
        drives.first[windows.begin][windows.window] + drives.duties.shape[1] * _alike(drives)[_episode(drives, windows)]
    )
    return ratio(apart[kept], missed[kept], place[kept])


def _again(drives: Drives, windows: Windows) -> tuple[Whole, Whole]:
    """For each compared pose what it is a repeat of (M,), and how often each of those was driven."""
    kind = _alike(drives)[_episode(drives, windows)]
    begin, end = drives.first[windows.begin][windows.window], drives.last[windows.increment]
    _, label, counts = np.unique(np.stack((kind, begin, end)), axis=1, return_inverse=True, return_counts=True)
    return label.ravel(), counts


def _episode(drives: Drives, windows: Windows) -> Whole:
    return np.asarray(drives.episode[windows.increment])


def _alike(drives: Drives) -> Whole:
    """Episodes with the same commands have the same number (E,)."""
    rounded = np.round(drives.duties.reshape(len(drives.duties), -1) / ALIKE)
    _, kind = np.unique(rounded, axis=0, return_inverse=True)
    return np.asarray(kind).ravel()


def _apart(moved: Floats, label: Whole, counts: Whole) -> Floats:
    """Squared distance [m²] of each motion (M, 2) from the mean of its repeats, as if that were known without error."""
    mean = sum_by(label, moved, len(counts)) / counts[:, None]
    share = np.maximum(1, counts - 1)[label] / counts[label]
    return np.asarray(np.square(moved - mean[label]).sum(axis=1) / share)
