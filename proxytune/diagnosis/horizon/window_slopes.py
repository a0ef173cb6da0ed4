"""The errors of windows, and how each weight of a learnt effect would move them."""

from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.horizon.windows import Windows, cut, length_of, motion_in, select_windows
from proxytune.diagnosis.measured.angles import cosine_and_sine
from proxytune.diagnosis.measured.drives import Drives, Floats, Whole, relative
from proxytune.diagnosis.model.replay import tracked_paths, window_features, window_twists
from proxytune.diagnosis.model.walk import walk
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
    lever = _lever(twists, walked, 1.0 / drives.tick_hz)
    parts = [_pose_slopes(lever, basis, unit, (window, tick - 1)) for basis, unit in features]
    turn = walked[window, 0, 2]
    columns = _turn_frames(np.concatenate(parts, axis=-1), -turn)
    scale = np.array((1.0, 1.0, way))
    return Slopes((measured - predicted) * scale, columns * scale[:, None], drives.block[begin[window]])


class _Lever(NamedTuple):
    """What a twist added in one tick does to the places that come after, as complex numbers (W, length).

    Attributes:
        along: The way of forward motion at 1 m/s within the tick [m].
        about: How far a turn at 1 rad/s within the tick moves places, less what the next says [m].
        after: How far a turn by 1 rad moves the tracked place after the tick, seen from the origin [m].
        tick_s: Length of a tick [s].
    """

    along: Floats
    about: Floats
    after: Floats
    tick_s: float


def _lever(twists: Floats, walked: Floats, tick_s: float) -> _Lever:
    """The lever of twists (W, length, 3), along which the tracked places (W, length + 1, 3) are."""
    poses = walk(twists, tick_s)
    cosine, sine = cosine_and_sine(poses[:, 1:, 2] - twists[..., 2] * (tick_s / 2.0))
    axle = 0.5 * (poses[:, 1:] + poses[:, :-1])
    about = (axle[..., 1] - 1j * axle[..., 0]) * tick_s
    return _Lever((cosine + 1j * sine) * tick_s, about, 1j * walked[:, 1:, 0] - walked[:, 1:, 1], tick_s)


def _pose_slopes(lever: _Lever, basis: Floats, unit: Floats, at: tuple[Whole, Whole]) -> Floats:
    """Change of compared poses (M, 3, knots) per weight of a curve, to first order.

    Args:
        lever: That of the windows.
        basis: What each weight adds in each tick (W, length, knots), in this unit.
        unit: The unit, a twist (3,).
        at: Window and tick after which each pose is compared, (M,) each.
    """
    place = (unit[0] + 1j * unit[1]) * lever.along + unit[2] * lever.about
    turned = np.cumsum(basis, axis=1)[at] * (unit[2] * lever.tick_s)
    moved = np.cumsum(place[..., None] * basis, axis=1)[at] + lever.after[at][:, None] * turned
    return np.stack((moved.real, moved.imag, turned), axis=1)


def _turn_frames(changes: Floats, angle: Floats) -> Floats:
    """Changes of poses (M, 3, knots) seen from frames turned by minus an angle (M,)."""
    cosine, sine = (part[:, None] for part in cosine_and_sine(angle))
    x = cosine * changes[:, 0] - sine * changes[:, 1]
    y = sine * changes[:, 0] + cosine * changes[:, 1]
    return np.stack((x, y, changes[:, 2]), axis=1)
