"""Functions of the motion that is asked for, of which learnt curves are made: each 0 where the robot stands."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from proxytune.effects.body.floor import REST_SPEED
from proxytune.effects.effect import Signal

Knot = float | tuple[float, float]
Knots = tuple[Knot, ...]


class Asked(NamedTuple):
    """The motion asked for, held within what was seen, and its past, (…, time) where nothing else is said.

    Attributes:
        forward: Forward speed [m/s].
        yaw: Yaw rate [rad/s].
        wheels: Speeds of the left and the right wheel over the floor [m/s] (2, …, time).
        seconds: Since the start [s].
        use: Integral of the mean wheel speed's size, as a fraction of full speed, since the start [min].
        heading: Heading [rad].
        bands: Of each wheel's speed, the part between neighbouring low-passes [m/s] (2, …, time, time constants).
        loads: Low-passes of the mean wheel speed's size, as a fraction of full speed (…, time, time constants).
        rolled: How far each wheel, and the robot, has gone since it last turned the other way [m] (3, …, time).
        started: Since each wheel last stood [s] (2, …, time).
        rings: Damped swings, complex, that each change of a wheel's speed sets off [m/s] (2, …, time, frequencies).
        played: Each wheel's speed through plays of some widths [m/s] (2, …, time, widths).
    """

    forward: Signal
    yaw: Signal
    wheels: Signal
    seconds: Signal
    use: Signal
    heading: Signal
    bands: Signal
    loads: Signal
    rolled: Signal
    started: Signal
    rings: Signal
    played: Signal


STANDS = 0.1
"""A wheel is to stand where it is asked to go slower than this share of its speed of late."""


def hats(signal: Signal, knots: Knots) -> Signal:
    """Piecewise-linear functions (…, knots): each 1 at its knot, 0 at all others and at 0, level beyond the last."""
    corners = np.sort(np.array([0.0, *knots], dtype=float))
    rows = np.eye(len(corners))[corners != 0.0]
    return np.stack([np.interp(signal, corners, row) for row in rows], axis=-1)


def grid(asked: Asked, knots: Knots) -> Signal:
    """Products of hats over speed and yaw rate (…, knots), 0 where both are 0."""
    pairs = np.asarray(knots, dtype=float)
    parts = []
    for signal, values in zip((asked.forward, asked.yaw), pairs.T, strict=True):
        corners = np.unique(np.append(values, 0.0))
        rows = np.stack([np.interp(signal, corners, row) for row in np.eye(len(corners))], axis=-1)
        parts.append(rows[..., np.searchsorted(corners, values)])
    return np.asarray(parts[0] * parts[1])


def sign(asked: Asked, wheel: int) -> Signal:
    """Which way a wheel turns: from −1 to 1, 0 where it stands (…, time, 1)."""
    return np.asarray(np.clip(asked.wheels[wheel][..., None] / REST_SPEED, -1.0, 1.0))


def moving(asked: Asked) -> Signal:
    """1 while the robot moves, 0 where it stands (…, time)."""
    return np.minimum(1.0, np.abs(asked.forward) / REST_SPEED)


def backwards(asked: Asked, knots: Knots) -> Signal:
    """Whether the robot moves backwards, for a knot of −1."""
    return hats(np.clip(asked.forward / REST_SPEED, -1.0, 1.0), knots)


def level(asked: Asked, knots: Knots, wheel: int) -> Signal:
    """A wheel's speed as it is, whatever the knots."""
    return np.asarray(asked.wheels[wheel][..., None] * np.ones(len(knots)))


def slowing(asked: Asked, knots: Knots, wheel: int) -> Signal:
    """The bands of a wheel that is slower than it has been of late, 0 while it speeds up."""
    bands = asked.bands[wheel]
    slow = asked.wheels[wheel][..., None] - np.cumsum(bands, axis=-1)
    return np.where(bands * slow < 0.0, bands, 0.0)


def stopping(asked: Asked, knots: Knots, wheel: int) -> Signal:
    """The bands of a wheel that is to stand and was moving of late."""
    bands = asked.bands[wheel]
    speed = asked.wheels[wheel][..., None]
    return np.where(np.abs(speed) < STANDS * np.abs(speed - np.cumsum(bands, axis=-1)), bands, 0.0)


def started(asked: Asked, knots: Knots, wheel: int) -> Signal:
    """1 when a wheel starts to move, fading with time."""
    return np.asarray(np.exp(-asked.started[wheel][..., None] / np.asarray(knots)))


def played(asked: Asked, knots: Knots, wheel: int) -> Signal:
    """By how much a wheel lags behind within its play, while it moves."""
    speed = asked.wheels[wheel][..., None]
    return np.asarray((asked.played[wheel] - speed) * np.abs(sign(asked, wheel)))


def after_reversal(asked: Asked, knots: Knots, wheel: int) -> Signal:
    """A wheel's speed, fading with the way since it last turned the other way."""
    way = np.abs(asked.rolled[wheel])[..., None]
    return np.asarray(asked.wheels[wheel][..., None] * np.exp(-way / np.asarray(knots)))


def body_after_reversal(asked: Asked, knots: Knots) -> Signal:
    """The forward speed, fading with the way since the robot last drove the other way."""
    return np.asarray(asked.forward[..., None] * np.exp(-np.abs(asked.rolled[2])[..., None] / np.asarray(knots)))


def waves(wave: Callable[[Signal], Signal]) -> Callable[[Asked, Knots], Signal]:
    """Harmonics of the heading while the robot moves."""
    return lambda a, k: wave(a.heading[..., None] * np.asarray(k)) * moving(a)[..., None]
