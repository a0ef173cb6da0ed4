"""Orientations as headings: quaternions of any length, checked."""

import numpy as np
from numpy.typing import NDArray

from proxytune.errors import LogError
from proxytune.importing.source import Floats

LEAST_NORM = 1e-3
"""A shorter quaternion is no orientation: drivers publish zeros before they know one."""

MOST_LACKING = 0.1
"""A tracker that loses its markers now and then lacks no more of its poses than this share."""


def headings_and_tilts(quaternions: Floats, where: str) -> tuple[Floats, Floats]:
    """Headings about the upward axis and tilts away from it, (N,) each [rad]; NaN where a few are no rotation.

    Args:
        quaternions: Orientations in the world (N, 4): x, y, z, w.
        where: What they come from, for a complaint.

    Raises:
        LogError: If more than a few are not finite or of length zero.
    """
    wrong = no_rotation(quaternions)
    if wrong.mean() > MOST_LACKING:
        raise complaint(quaternions, wrong, where)
    known = np.where(wrong[:, None], np.nan, quaternions)
    x, y, z, w = (known / np.linalg.norm(known, axis=1, keepdims=True)).T
    headings = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    tilts = np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0))
    return headings, tilts


def no_rotation(quaternions: Floats) -> NDArray[np.bool_]:
    """Which quaternions are not finite or of length zero (N,)."""
    norms = np.linalg.norm(quaternions, axis=1)
    return np.asarray(~(np.isfinite(norms) & (norms > LEAST_NORM)))


def complaint(quaternions: Floats, wrong: NDArray[np.bool_], where: str) -> LogError:
    """What is wrong with the first of them."""
    number = int(np.argmax(wrong))
    values = ", ".join(f"{value:g}" for value in quaternions[number])
    return LogError(
        f"{where}: orientation {number + 1} is the quaternion ({values}), which is no rotation, and so are "
        f"{wrong.sum()} of {len(wrong)}; record poses whose orientation is set"
    )
