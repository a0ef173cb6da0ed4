"""Where the points of a picture look: a camera's rays, written without the package's own lens and mount.

In the camera's frame a ray goes 1 forward, u to the right and v down; in the robot's frame x forward, y to the left and
down. Every figure of Sight has the meaning that CameraFigures gives it.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from camera_truth.sight import COLUMNS, ROWS, Bend, Sight

Values = NDArray[np.float64]


def rays(sight: Sight, columns: Values, rows: Values) -> Values:
    """Directions (…, 3) in the robot's frame, x forward, y left and down, of points of the picture [pixel]."""
    u, v = _straightened(sight, columns, rows)
    roll, pitch, yaw = np.radians((sight.camera_roll, sight.camera_pitch, sight.camera_yaw))
    right = u * np.cos(roll) - v * np.sin(roll)
    down = u * np.sin(roll) + v * np.cos(roll)
    forward = np.cos(pitch) - down * np.sin(pitch)
    down = np.sin(pitch) + down * np.cos(pitch)
    x = forward * np.cos(yaw) + right * np.sin(yaw)
    y = forward * np.sin(yaw) - right * np.cos(yaw)
    return np.stack((x, y, down), axis=-1)


def _straightened(sight: Sight, columns: Values, rows: Values) -> tuple[Values, Values]:
    """Slopes u and v of the rays through points of the picture."""
    if sight.bend is not None:
        away = _moved(sight.bend, columns, rows) * _scale(sight.bend)
        columns, rows = columns + away[0], rows + away[1]
    u = (columns - COLUMNS / 2.0 - sight.centre_right * ROWS) / (sight.focal_px * sight.pixel_aspect)
    v = (rows - ROWS / 2.0 - sight.centre_down * ROWS) / sight.focal_px
    square = sight.lens_distortion * (u**2 + v**2)
    stretch = 1.0 - square + 3.0 * square**2
    return u * stretch, v * stretch


def _sixth_power(right: Values, down: Values, turn: float) -> tuple[Values, Values]:
    size = (right**2 + down**2) ** 3 * np.sign(np.cos(turn))
    return right * size, down * size


def _tangential(right: Values, down: Values, turn: float) -> tuple[Values, Values]:
    p, q, square = np.cos(turn), np.sin(turn), right**2 + down**2
    return 2.0 * p * right * down + q * (square + 2.0 * right**2), p * (square + 2.0 * down**2) + 2.0 * q * right * down


def _waves(right: Values, down: Values, turn: float) -> tuple[Values, Values]:
    return np.sin(7.0 * down + turn), np.sin(5.0 * right + 2.0 * turn)


def _one_sided(right: Values, down: Values, turn: float) -> tuple[Values, Values]:
    side = np.maximum(np.sign(np.cos(turn)) * right, 0.0) ** 2
    return side * np.cos(turn), side * np.sin(turn)


BENDS: Mapping[str, Callable[[Values, Values, float], tuple[Values, Values]]] = {
    "sixth_power": _sixth_power,
    "tangential": _tangential,
    "waves": _waves,
    "one_sided": _one_sided,
}
"""How points move, to the right and down, by their place from the middle in heights of the picture."""


def _moved(bend: Bend, columns: Values, rows: Values) -> Values:
    return np.stack(BENDS[bend.form]((columns - COLUMNS / 2) / ROWS, (rows - ROWS / 2) / ROWS, bend.turn_rad))


def _scale(bend: Bend) -> float:
    """What makes the bend as large as it says."""
    columns, rows = np.meshgrid(np.arange(COLUMNS) + 0.5, np.arange(ROWS // 2, ROWS) + 0.5)
    return bend.size_px / float(np.quantile(np.hypot(*_moved(bend, columns, rows)), 0.95))
