"""Orientations as headings: quaternions of any length, checked."""

import numpy as np

from proxytune.errors import LogError
from proxytune.importing.source import Floats

LEAST_NORM = 1e-3
"""A shorter quaternion is no orientation: drivers publish zeros before they know one."""


def headings_and_tilts(quaternions: Floats, where: str) -> tuple[Floats, Floats]:
    """Headings about the upward axis and tilts away from it, (N,) each [rad].

    Args:
        quaternions: Orientations in the world (N, 4): x, y, z, w.
        where: What they come from, for a complaint.

    Raises:
        LogError: If one is not finite or of length zero.
    """
    norms = np.linalg.norm(quaternions, axis=1)
    bad = ~(np.isfinite(norms) & (norms > LEAST_NORM))
    if bad.any():
        number = int(np.argmax(bad))
        values = ", ".join(f"{value:g}" for value in quaternions[number])
        raise LogError(
            f"{where}: orientation {number + 1} is the quaternion ({values}), which is no rotation; "
            "record poses whose orientation is set"
        )
    x, y, z, w = (quaternions / norms[:, None]).T
    headings = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    tilts = np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0))
    return headings, tilts
