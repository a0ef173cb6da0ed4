"""Hidden effects of the second generator on the body, the floor and the tracker that the catalogue names.

In the catalogue's own form or in another; each is a function of the signal of its stage, of what it may look at and of
its figures.
"""

import numpy as np
from scipy.signal import lfilter
from second_signals import BASELINE, ROW_S, Array, Run, Table, lagging, twist_change


def _twice_lagging(m: Array, run: Run, tau: float) -> Array:
    late = lagging(lagging(m[..., 2:], tau / 2.0, run), tau / 2.0, run)[..., 0]
    return twist_change(m, turn=late - m[..., 2])


TWIST: Table = {  # twists (E, T, 3)
    "yaw_scrub": lambda m, run, baseline: m * (1.0, 1.0, BASELINE / baseline),
    "scrub_when_slow": lambda m, run, share: m * (1.0 - np.exp(-np.abs(m[..., 2:]) / 1.5) * (0.0, 0.0, share)),
    "understeer": lambda m, run, gain: m / (1.0 + np.abs(m[..., :1]) * (0.0, 0.0, gain)),
    "understeer_with_square": lambda m, run, gain: m / (1.0 + m[..., :1] ** 2 * (0.0, 0.0, gain)),
    "yaw_lag": lambda m, run, tau: twist_change(m, turn=lagging(m[..., 2:], tau, run)[..., 0] - m[..., 2]),
    "yaw_lag_of_second_order": lambda m, run, tau: _twice_lagging(m, run, tau),
    "turn_slip": lambda m, run, loss: m * (1.0 - np.abs(m[..., 2:]) * (loss, 0.0, 0.0)).clip(0.0),
    "turn_slip_with_root": lambda m, run, loss: m * (1.0 - np.sqrt(np.abs(m[..., 2:])) * (loss, 0.0, 0.0)).clip(0.0),
    "lateral_slip": lambda m, run, slip: twist_change(m, aside=-slip * m[..., 0] * m[..., 2]),
    "slip_angle": lambda m, run, slip, most: twist_change(
        m, aside=-m[..., 0] * most * np.tanh(slip / most * m[..., 2])
    ),
    "cross_coupling": lambda m, run, ahead=0.0, turn=0.0: twist_change(
        m, ahead=ahead * m[..., 2] ** 2, turn=turn * np.abs(m[..., 0])
    ),
}


def _sloping(m: Array, pose: Array, x: float, y: float, push: float = 0.0) -> Array:
    """Slower uphill, pushed aside across the slope; little of it below 2 cm/s."""
    share = np.minimum(1.0, np.abs(m[..., 0]) / 0.02)
    east, north = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    return twist_change(m, -share * (x * east + y * north), share * push * (x * north - y * east))


def _far(pose: Array, x: float, y: float) -> Array:
    return np.hypot(pose[..., 0] - x, pose[..., 1] - y)[..., None]


PLACES: Table = {  # twists (E, 3) at poses (E, 3) and a time [s]
    "floor_slope": lambda m, pose, time, x, y, push=0.0: _sloping(m, pose, x, y, push),
    "hilly_floor": lambda m, pose, time, x, y: (
        m + (1.0 + 0.4 * np.sin(2.0 * pose[:, :1])) * (_sloping(m, pose, x, y) - m)
    ),
    "slippery_patch": lambda m, pose, time, loss, x, y, radius: (
        m * (1.0 - loss * ((radius - _far(pose, x, y)) / 0.1 + 0.5).clip(0.0, 1.0))
    ),
    "oil_that_thins_out": lambda m, pose, time, loss, x, y, radius: (
        m * (1.0 - loss * np.exp(-((_far(pose, x, y) / radius) ** 2)))
    ),
}


def _seen_from(p: Array, ahead: float, left: float) -> Array:
    east, north = np.cos(p[..., 2]), np.sin(p[..., 2])
    return twist_change(p, ahead * east - left * north, ahead * north + left * east)


def _smoothed(p: Array, tau: float) -> Array:
    """A tracker's own low-pass, row by row, from the first pose on."""
    kept = np.exp(-ROW_S / tau)
    return p[:, :1] + lfilter([1.0 - kept], [1.0, -kept], p - p[:, :1], axis=1)


TRACKED: Table = {  # poses (E, rows, 3) that a tracker reports
    "marker_offset": lambda p, ahead=0.0, left=0.0: _seen_from(p, ahead, left),
    "heading_offset": lambda p, degrees: twist_change(p, turn=np.radians(degrees)),
    "smoothed_poses": _smoothed,
}
