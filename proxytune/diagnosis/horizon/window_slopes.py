"""The errors of windows, and how each weight of a learnt effect would move them."""

from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.horizon.windows import Windows, cut, length_of, motion_in, select_windows
from proxytune.diagnosis.measured.drives import Drives, Floats, Whole, relative
from proxytune.diagnosis.model.replay import tracked_paths, window_features, window_twists
from proxytune.driving.planar import integrate
from proxytune.effects.learnt.effect import Learnt
from proxytune.effects.learnt.table import is_learnt
from proxytune.space import Theta

FITTED_S = 2.0
"""What is learnt is fitted to windows of this length [s]."""

POSES = 8
"""No more poses are compared in a window."""

MOST_WINDOWS = 600
"""No more windows are fitted, spread evenly over the drives."""


class Slopes(NamedTuple):
    """Windows' poses as they are compared, in metres.

    Attributes:
        left: Measured less predicted (M, 3): forward, left, and heading times the median way.
        columns: Change of the prediction per weight (M, 3, weights), curve by curve.
        block: The block of each pose (M,).
    """

    left: Floats
    columns: Floats
    block: Whole


def choose_windows(drives: Drives) -> Windows:
    """Choose the windows and poses that are fitted: few enough, and evenly spread."""
    windows = cut(drives, FITTED_S)
    step = int(np.ceil(len(windows.begin) / MOST_WINDOWS))
    windows = select_windows(windows, np.arange(len(windows.begin)) % step == 0)
    tick = drives.last[windows.increment] - drives.first[windows.begin][windows.window]
    part = windows.window * POSES + np.minimum(POSES - 1, tick * POSES // (FITTED_S * drives.tick_hz)).astype(int)
    last = np.concatenate((part[1:] != part[:-1], [True]))
    return Windows(windows.begin, windows.window[last], windows.increment[last])


def slopes_of(drives: Drives, theta: Theta, offered: Learnt) -> Slopes:
    """Linearise windows in the weights of learnt curves, around a model that may have a learnt effect itself.

    Args:
        drives: What is fitted.
        theta: The model.
        offered: The curves whose weights may change.
    """
    windows = choose_windows(drives)
    begin, window = windows.begin, windows.window
    tick = drives.last[windows.increment] - drives.first[begin][window]
    length = length_of(drives, windows)
    named = {name: value for name, value in theta.items() if not is_learnt(name)}
    twists = window_twists(drives, theta, begin, length)
    walked = tracked_paths(drives, theta, twists)
    predicted = motion_in(drives, walked, windows)
    measured = relative(drives.poses[begin[window], 0], drives.poses[windows.increment, 1])
    way = float(np.median(np.hypot(measured[:, 0], measured[:, 1])))
    features = window_features(drives, named, offered, begin, length)
    parts = [_pose_slopes(drives, twists, walked, basis, unit)[window, tick - 1] for basis, unit in features]
    turn = walked[window, 0, 2]
    columns = _turn_frames(np.concatenate(parts, axis=-1), -turn)
    scale = np.array((1.0, 1.0, way))
    return Slopes((measured - predicted) * scale, columns * scale[:, None], drives.block[begin[window]])


def _pose_slopes(drives: Drives, twists: Floats, walked: Floats, basis: Floats, unit: Floats) -> Floats:
    """Change of the poses after each tick (W, length, 3, knots) per weight of a curve, to first order."""
    tick_s = 1.0 / drives.tick_hz
    poses = integrate(np.zeros((len(twists), 3)), twists, tick_s)
    turn = poses[..., 2] - twists[..., 2] * tick_s / 2.0
    axle = poses[..., :2] - 0.5 * np.diff(poses[..., :2], axis=1, prepend=0.0)
    along = unit[0] * np.exp(1j * turn) + unit[1] * 1j * np.exp(1j * turn)
    about = unit[2] * 1j
    place = along - about * (axle[..., 0] + 1j * axle[..., 1])
    turned = np.cumsum(basis, axis=1) * tick_s
    shifted = np.cumsum(place[..., None] * basis, axis=1) * tick_s
    shifted += about * (walked[:, 1:, 0] + 1j * walked[:, 1:, 1])[..., None] * turned
    return np.stack((shifted.real, shifted.imag, unit[2] * turned), axis=2)


def _turn_frames(changes: Floats, angle: Floats) -> Floats:
    """Changes of poses (M, 3, knots) seen from frames turned by minus an angle (M,)."""
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x = cosine * changes[:, 0] - sine * changes[:, 1]
    y = sine * changes[:, 0] + cosine * changes[:, 1]
    return np.stack((x, y, changes[:, 2]), axis=1)
