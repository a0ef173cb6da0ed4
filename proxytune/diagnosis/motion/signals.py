"""Curves over signals: the most that any dependence on one signal of the drives can explain of a residual.

`signal_groups` offers motion as basis functions of each signal: the command level, time, heading, place and so on.
`fit_curves` fits their weights by ridge regression on the innovations, beside the model's free parameters, with the
ridge that gains most on blocks that are left out. These curves have no name and no physics: they judge the named
effects (`evidence.exceeds_names`) and say what a residual depends on.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.motion.drives import Drives, Floats, lagged
from proxytune.diagnosis.motion.fitting import (
    Fit,
    derivatives_by_block,
    evaluate,
    held_out_innovations,
    held_out_log_likelihood,
)
from proxytune.diagnosis.motion.innovations import (
    HUBER,
    arrived_commands,
    disturbed_increments,
    fit_noise,
    huber,
    increments,
    increments_of_twists,
    spans,
    theta_at,
    twists_of,
    values_at,
    wheel_speeds,
)
from proxytune.driving import drivetrain
from proxytune.effects import Cue, track_of
from proxytune.space import Theta

KNOTS = 6
"""Corners of a curve over a signal."""
PATCH_M = 0.3
MOST_PATCHES = 14
"""Over a position, corners lie this far apart [m], but there are no more than so many."""
_Signal = tuple[Cue, Floats, str, Floats]
"""A signal (E, T), its unit, and the motion that depends on it, per basis function (E, T, 3, columns)."""


@dataclass(frozen=True)
class SignalGroup:
    """Flexible motion that depends on one signal (E, T); `make` makes it: of long drives it is too large to keep."""

    name: Cue
    signal: Floats
    unit: str
    make: Callable[[], _Signal]

    @property
    def twists(self) -> Floats:
        """Motion added to that of the model, per basis function (E, T, 3, columns): [m/s], [m/s], [rad/s]."""
        return self.make()[-1]


@dataclass(frozen=True)
class _Motion:
    """The motion that basis functions are made of, all (E, T)."""

    drives: Drives
    sides: tuple[Floats, Floats]  # speeds of the left and the right wheel [m/s]
    forward: Floats
    yaw: Floats
    commands: Floats


def signal_groups(fitted: Fit) -> Iterator[tuple[SignalGroup, Floats]]:
    """Every signal group of these drives, seen with the fitted model, with its twists, as it is asked for."""
    motion = _motion(fitted)
    of_wheels = (
        _wheel_difference,
        partial(_wheel_angle, side=0, name=Cue.LEFT_ANGLE),
        partial(_wheel_angle, side=1, name=Cue.RIGHT_ANGLE),
    )
    both = (_command_level, _transients, _after_reversal, _time, _use, _turning, _heading, _position, _direction)
    for maker in (*both, *((_steering,) if fitted.drives.robot.drive == "ackermann" else of_wheels)):
        name, signal, unit, twists = maker(motion)
        if np.abs(twists).max() > 1e-9:
            yield SignalGroup(name, signal, unit, partial(maker, motion)), twists


def _motion(fitted: Fit) -> _Motion:
    drives, figures = fitted.drives, fitted.drives.robot.figures
    wheels, commands = wheel_speeds(drives, fitted.theta), arrived_commands(drives, fitted.theta)
    if drives.robot.drive == "ackermann":
        forward, _, yaw = np.moveaxis(drivetrain(drives.robot, ()).ideal(wheels), -1, 0)
        turn = yaw * track_of(drives.robot.figures) / 2.0
        return _Motion(drives, (forward - turn, forward + turn), forward, yaw, commands)
    left, right = np.moveaxis(wheels * figures["full_speed"], -1, 0)
    yaw = (right - left) / figures["effective_baseline"]
    return _Motion(drives, (left, right), (left + right) / 2.0, yaw, commands)


def hats(signal: Floats, knots: int = KNOTS) -> Floats:
    """Piecewise-linear functions of a signal (…, columns), corners at its quantiles; together they are 1."""
    corners = np.unique(np.quantile(signal, np.linspace(0.0, 1.0, knots)))
    if len(corners) < 2:
        return np.ones((*signal.shape, 1))
    return np.stack([np.interp(signal, corners, row) for row in np.eye(len(corners))], axis=-1)


def _twists(forward: Floats | None = None, sideways: Floats | None = None, yaw: Floats | None = None) -> Floats:
    """Columns of forward, sideways and yaw motion side by side (E, T, 3, columns)."""
    channels = [{channel: columns} for channel, columns in enumerate((forward, sideways, yaw)) if columns is not None]
    return _side_by_side(channels)


def _of_wheels(motion: _Motion, left: Floats | None, right: Floats | None) -> Floats:
    """Motion that extra speeds of the wheels [m/s] make (E, T, 3, columns)."""
    baseline = track_of(motion.drives.robot.figures)
    wheels = [(columns, side) for columns, side in ((left, -1.0), (right, 1.0)) if columns is not None]
    return _side_by_side([{0: columns / 2.0, 2: side * columns / baseline} for columns, side in wheels])


def _side_by_side(parts: Sequence[Mapping[int, Floats]]) -> Floats:
    """Columns (E, T, columns) of parts, by the channel they go to, as (E, T, 3, columns): each lies in one piece."""
    sizes = [next(iter(part.values())).shape for part in parts]
    whole = np.zeros((sum(size[-1] for size in sizes), *sizes[0][:-1], 3))
    for part, end in zip(parts, np.cumsum([size[-1] for size in sizes]), strict=True):
        for channel, columns in part.items():
            whole[end - columns.shape[-1] : end, ..., channel] = np.moveaxis(columns, -1, 0)
    return np.moveaxis(whole, 0, -1)


def _command_level(motion: _Motion) -> _Signal:
    full = motion.drives.robot.figures["full_speed"]
    levels = [speed / full for speed in motion.sides]
    return Cue.WHEEL_COMMAND, levels[0], "duty", _of_wheels(motion, *(hats(level, 9) * full for level in levels))


def _wheel_difference(motion: _Motion) -> _Signal:
    signal = motion.commands[..., 1] - motion.commands[..., 0]
    columns = hats(signal)
    return Cue.COMMAND_DIFFERENCE, signal, "duty", _twists(columns, yaw=columns)


def _steering(motion: _Motion) -> _Signal:
    signal = motion.commands[..., 1]
    columns = hats(signal, 9) * motion.forward[..., None]
    return Cue.STEERING, signal, "full lock", _twists(columns, yaw=columns)


def _transients(motion: _Motion) -> _Signal:
    parts = []
    for side in range(2):
        command = motion.commands[..., side]
        slow = [lagged(command, seconds * motion.drives.tick_hz) for seconds in (0.05, 0.15, 0.45, 1.2)]
        parts.append(np.stack([command - slow[0]] + [a - b for a, b in pairwise(slow)], axis=-1))
    full = motion.drives.robot.figures["full_speed"]
    signal = parts[0].sum(axis=-1)
    if motion.drives.robot.drive == "ackermann":
        twists = _twists(parts[0] * full, yaw=parts[1] * motion.forward[..., None])
    else:
        twists = _of_wheels(motion, *(p * full for p in parts))
    return Cue.TRANSIENTS, signal, "duty", twists


def _after_reversal(motion: _Motion) -> _Signal:
    gone = [_since_reversal(speed) / motion.drives.tick_hz for speed in motion.sides]
    fading = (np.stack([np.exp(-way / reach) for reach in (0.005, 0.015, 0.04, 0.12)], axis=-1) for way in gone)
    columns = (fades * speed[..., None] for fades, speed in zip(fading, motion.sides, strict=True))
    return Cue.REVERSAL, gone[0], "m", _of_wheels(motion, *columns)


def _since_reversal(speed: Floats) -> Floats:
    """Distance since the wheel last changed direction, times ticks per second (E, T)."""
    sign = np.sign(np.where(np.abs(speed) < 1e-3, 0.0, speed))
    index = np.arange(speed.shape[1])
    moving = np.maximum.accumulate(np.where(sign != 0, index, 0), axis=1)
    held = np.take_along_axis(sign, moving, axis=1)
    turned = np.concatenate((np.ones((len(speed), 1), bool), held[:, 1:] != held[:, :-1]), axis=1)
    way = np.cumsum(np.abs(speed), axis=1)
    start = np.maximum.accumulate(np.where(turned, index, 0), axis=1)
    return np.asarray(way - np.take_along_axis(way, start, axis=1))


def _time(motion: _Motion) -> _Signal:
    signal = np.broadcast_to(np.arange(motion.yaw.shape[1]) / motion.drives.tick_hz, motion.yaw.shape)
    columns = hats(signal)[..., 1:]
    return Cue.TIME, signal, "s", _of_wheels(motion, *(columns * speed[..., None] for speed in motion.sides))


def _use(motion: _Motion) -> _Signal:
    use = np.cumsum(np.abs(motion.commands).mean(axis=-1), axis=1) / motion.drives.tick_hz
    columns = hats(use)[..., 1:]
    twists = _twists(columns * motion.forward[..., None], yaw=columns * motion.yaw[..., None])
    return Cue.USE, use, "s at full duty", twists


def _turning(motion: _Motion) -> _Signal:
    columns = hats(motion.yaw)
    bend = hats(motion.forward * motion.yaw)
    sideways = np.concatenate((bend[..., :-1] - bend[..., 1:], columns), axis=-1)
    twists = _twists(columns * motion.forward[..., None], sideways, columns)
    return Cue.TURN_RATE, motion.yaw, "rad/s", twists


def _heading(motion: _Motion) -> _Signal:
    angle = motion.drives.headings
    waves = np.stack([wave(k * angle) for k in (1, 2) for wave in (np.cos, np.sin)], axis=-1)
    moving = np.minimum(1.0, np.abs(motion.forward) / 0.02)[..., None]
    twists = _twists(waves * moving, waves * motion.forward[..., None], waves * np.abs(motion.forward)[..., None])
    return Cue.HEADING, np.mod(angle, 2.0 * np.pi), "rad", twists


def _position(motion: _Motion) -> _Signal:
    places = motion.drives.places
    parts = []
    for signal in (places[..., 0], places[..., 1]):
        # Hats a patch apart over the whole range of the coordinate, the first left out.
        low, high = float(signal.min()), float(signal.max())
        corners = np.linspace(low, high, int(np.clip(np.ceil((high - low) / PATCH_M), 1, MOST_PATCHES)) + 1)
        parts.append(np.stack([np.interp(signal, corners, row) for row in np.eye(len(corners))[1:]], axis=-1))
    columns = np.concatenate(parts, axis=-1)
    forward, yaw = columns * motion.forward[..., None], columns * motion.yaw[..., None]
    twists = _twists(forward, yaw=np.concatenate((yaw, columns * np.abs(motion.forward)[..., None]), axis=-1))
    return Cue.POSITION, places[..., 0], "m", twists


def _wheel_angle(motion: _Motion, side: int, name: Cue) -> _Signal:
    angle = motion.drives.angles[..., side]
    waves = np.stack([wave(k * angle) for k in (1, 2) for wave in (np.cos, np.sin)], axis=-1)
    columns = waves * motion.sides[side][..., None]
    left, right = (columns, None) if side == 0 else (None, columns)
    return name, np.mod(angle, 2.0 * np.pi), "rad", _of_wheels(motion, left, right)


def _direction(motion: _Motion) -> _Signal:
    back = (motion.forward < 0.0)[..., None]
    twists = _twists(
        back * motion.forward[..., None], yaw=np.concatenate((back * motion.yaw[..., None], back), axis=-1)
    )
    return Cue.DIRECTION, np.sign(motion.forward), "", twists


RIDGES = (1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0)
"""Pulls towards no curve at all that are tried, as fractions of what a basis function's weight is held by."""
REFITTED = 3
"""How many groups are fitted again."""


class SignalCurve(NamedTuple):
    """Curves over one signal, fitted to what a model leaves over."""

    group: SignalGroup
    gain: float  # its gain in log-likelihood on blocks that it was not fitted to [nats]
    weights: Floats  # weight of each of its basis functions


def fit_curves(fitted: Fit) -> list[SignalCurve]:
    """Fit every signal group to what the model leaves over, best first."""
    plain = float(held_out_log_likelihood(fitted).sum())
    found = [_fit_curve(fitted, group, _columns(fitted, added), plain) for group, added in signal_groups(fitted)]
    found.sort(key=lambda curve: -curve.gain)
    # The best are fitted again with the noise that they leave: a candidate's noise is fitted too.
    promising = [curve for curve in found[:REFITTED] if curve.gain > 0.0]
    again = [_fit_with_own_noise(fitted, curve, plain) for curve in promising]
    return sorted(again + found[len(promising) :], key=lambda curve: -curve.gain)


def _fit_with_own_noise(fitted: Fit, curve: SignalCurve, plain: float) -> SignalCurve:
    changes = _columns(fitted, curve.group.twists)
    errors = fitted.drives.measured - increments(fitted.drives, fitted.theta) + changes @ curve.weights
    noise = fit_noise(fitted.drives, errors, fitted.noise)
    quieter = evaluate(fitted.drives, fitted.theta, fitted.free, noise)
    better = _fit_curve(quieter, curve.group, changes, plain)
    return better if better.gain > curve.gain else curve


def _fit_curve(fitted: Fit, group: SignalGroup, changes: Floats, plain: float) -> SignalCurve:
    both = np.concatenate((fitted.slopes, fitted.whiten.whiten(changes)), axis=1)
    size = np.sqrt((both**2).sum(axis=0)) + 1e-12
    unit = both / size
    sums = derivatives_by_block(fitted, unit)
    flexible = np.arange(both.shape[1]) >= fitted.slopes.shape[1]
    fits = [_ridge(fitted, unit, sums, flexible * ridge) for ridge in RIDGES]
    gain, weights = max(fits, key=lambda found: found[0])
    return SignalCurve(group, gain - plain, (weights / size)[flexible])


def _columns(fitted: Fit, added: Floats) -> Floats:
    """Change of the errors (N, 3, columns) per weight of each basis function, motion (E, T, 3, columns)."""
    drives, theta = fitted.drives, fitted.theta
    twists = twists_of(drives, theta)
    here = increments_of_twists(drives, theta, twists)
    parts = (added[..., column] for column in range(added.shape[-1]))
    return np.stack([here - increments_of_twists(drives, theta, twists + part) for part in parts], axis=-1)


def _ridge(fitted: Fit, unit: Floats, sums: tuple[Floats, Floats], ridge: Floats) -> tuple[float, Floats]:
    """The predictive log-likelihood with a ridge on each weight, and the weights."""
    penalty = np.diag(ridge + 1e-9)
    gradient, hessian = sums
    weights = -np.linalg.solve(hessian.sum(axis=0) + penalty, gradient.sum(axis=0))
    loss = huber(held_out_innovations(fitted, unit, sums, penalty)).sum() + fitted.whiten.log_determinant.sum()
    return -float(loss), weights


def refit_beside_curve(declared: Fit, curve: SignalCurve) -> Theta:
    """The declared parameters as they are fitted together with a flexible curve: one step of least squares."""
    drives, theta = declared.drives, declared.theta
    if not declared.free:
        return theta
    moved = disturbed_increments(drives, theta, curve.group.twists @ curve.weights) - increments(drives, theta)
    left = declared.innovations - declared.whiten.whiten(moved)
    inner = np.abs(left) < HUBER
    step = -np.linalg.lstsq(declared.slopes[inner], left[inner], rcond=None)[0]
    low, high = spans(declared.free, drives)
    moved = values_at(theta, declared.free) + step * (high - low)
    return theta_at(theta, declared.free, np.clip(moved, low, high))
