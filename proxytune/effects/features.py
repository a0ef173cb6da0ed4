"""What a learnt effect looks at: causal features of the motion that is asked for, each 0 where the robot stands."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from proxytune.effects.effect import Signal
from proxytune.effects.floor import REST_SPEED

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
        rolled: How far each wheel has rolled since it last turned the other way [m] (2, …, time).
        started: Since each wheel last stood [s] (2, …, time).
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


class Channel(NamedTuple):
    """Where a group's curves go: to the body's `forward`, `sideways` or `yaw`, or to the `left` or `right` wheel."""

    to: str
    unit: str
    basis: Callable[[Asked, Knots], Signal]


class Group(NamedTuple):
    """Curves over one signal.

    Attributes:
        title: What people call the signal.
        unit: The unit of the knots.
        channels: What the curves add, by name.
        low: The lowest knot that makes sense, or None where knots may be negative.
    """

    title: str
    unit: str
    channels: Mapping[str, Channel]
    low: float | None = None


def hats(signal: Signal, knots: Knots) -> Signal:
    """Piecewise-linear functions (…, knots): each 1 at its knot, 0 at all others and at 0, level beyond the last."""
    corners = np.sort(np.array([0.0, *knots], dtype=float))
    rows = np.eye(len(corners))[corners != 0.0]
    return np.stack([np.interp(signal, corners, row) for row in rows], axis=-1)


def _grid(asked: Asked, knots: Knots) -> Signal:
    """Products of hats over speed and yaw rate (…, knots), 0 where both are 0."""
    pairs = np.asarray(knots, dtype=float)
    parts = []
    for signal, values in zip((asked.forward, asked.yaw), pairs.T, strict=True):
        corners = np.unique(np.append(values, 0.0))
        rows = np.stack([np.interp(signal, corners, row) for row in np.eye(len(corners))], axis=-1)
        parts.append(rows[..., np.searchsorted(corners, values)])
    return np.asarray(parts[0] * parts[1])


def _sign(asked: Asked, wheel: int) -> Signal:
    return np.asarray(np.clip(asked.wheels[wheel][..., None] / REST_SPEED, -1.0, 1.0))


def _moving(asked: Asked) -> Signal:
    return np.minimum(1.0, np.abs(asked.forward) / REST_SPEED)


def _backwards(asked: Asked, knots: Knots) -> Signal:
    return hats(np.clip(asked.forward / REST_SPEED, -1.0, 1.0), knots)


def _level(asked: Asked, knots: Knots, wheel: int) -> Signal:
    """A wheel's speed as it is, whatever the knots."""
    return np.asarray(asked.wheels[wheel][..., None] * np.ones(len(knots)))


def _slowing(asked: Asked, knots: Knots, wheel: int) -> Signal:
    """The bands of a wheel that is slower than it has been of late, 0 while it speeds up."""
    bands = asked.bands[wheel]
    slow = asked.wheels[wheel][..., None] - np.cumsum(bands, axis=-1)
    return np.where(bands * slow < 0.0, bands, 0.0)


def _stopping(asked: Asked, knots: Knots, wheel: int) -> Signal:
    """The bands of a wheel that is to stand and was moving of late."""
    bands = asked.bands[wheel]
    speed = asked.wheels[wheel][..., None]
    return np.where(np.abs(speed) < STANDS * np.abs(speed - np.cumsum(bands, axis=-1)), bands, 0.0)


def _started(asked: Asked, knots: Knots, wheel: int) -> Signal:
    """1 when a wheel starts to move, fading with time."""
    return np.asarray(np.exp(-asked.started[wheel][..., None] / np.asarray(knots)))


def _after_reversal(asked: Asked, knots: Knots, wheel: int) -> Signal:
    """A wheel's speed, fading with the way since it last turned the other way."""
    way = np.abs(asked.rolled[wheel])[..., None]
    return np.asarray(asked.wheels[wheel][..., None] * np.exp(-way / np.asarray(knots)))


def _waves(wave: Callable[[Signal], Signal]) -> Callable[[Asked, Knots], Signal]:
    """Harmonics of the heading while the robot moves."""
    return lambda a, k: wave(a.heading[..., None] * np.asarray(k)) * _moving(a)[..., None]


def _of_wheels(unit: str, basis: Callable[[Asked, Knots, int], Signal]) -> dict[str, Channel]:
    """One channel a wheel."""
    return {
        "left": Channel("left", unit, lambda a, k: basis(a, k, 0)),
        "right": Channel("right", unit, lambda a, k: basis(a, k, 1)),
    }


STANDS = 0.1
"""A wheel is to stand where it is asked to go slower than this share of its speed of late."""

LEVEL = "level"
"""The one group that is no curve: beside others it takes back what fitted gains and trim have taken of theirs."""

HEADING = "heading"
"""The one group that looks at where the robot points."""

GROUPS: Mapping[str, Group] = MappingProxyType(
    {
        LEVEL: Group("level", "", _of_wheels("of its speed", _level), 1e-3),
        "wheel_speed": Group("wheel speed", "m/s", _of_wheels("m/s", lambda a, k, wheel: hats(a.wheels[wheel], k))),
        "turn_rate": Group(
            "turn rate",
            "rad/s",
            {
                "forward": Channel("forward", "of the speed", lambda a, k: hats(a.yaw, k) * a.forward[..., None]),
                "sideways": Channel("sideways", "of the speed", lambda a, k: hats(a.yaw, k) * a.forward[..., None]),
                "yaw": Channel("yaw", "rad/s", lambda a, k: hats(a.yaw, k)),
            },
        ),
        "speed_and_turn": Group(
            "speed and turn rate together",
            "m/s, rad/s",
            {
                "forward": Channel("forward", "m/s", _grid),
                "sideways": Channel("sideways", "m/s", _grid),
                "yaw": Channel("yaw", "rad/s", _grid),
            },
        ),
        "transients": Group(
            "changes of wheel speed",
            "s",
            {
                **_of_wheels("of the change", lambda a, k, wheel: a.bands[wheel]),
                "left_slowing": Channel("left", "of the change", lambda a, k: _slowing(a, k, 0)),
                "right_slowing": Channel("right", "of the change", lambda a, k: _slowing(a, k, 1)),
                "left_stopping": Channel("left", "of the change", lambda a, k: _stopping(a, k, 0)),
                "right_stopping": Channel("right", "of the change", lambda a, k: _stopping(a, k, 1)),
            },
            1e-3,
        ),
        "start": Group(
            "time since it stood",
            "s",
            {
                **_of_wheels("of its speed", lambda a, k, wheel: a.wheels[wheel][..., None] * _started(a, k, wheel)),
                "left_push": Channel("left", "m/s", lambda a, k: _sign(a, 0) * _started(a, k, 0)),
                "right_push": Channel("right", "m/s", lambda a, k: _sign(a, 1) * _started(a, k, 1)),
            },
            1e-3,
        ),
        "reversal": Group("way since reversal", "m", _of_wheels("of its speed", _after_reversal), 1e-3),
        "direction": Group(
            "direction of travel",
            "sign",
            {
                "forward": Channel("forward", "of the speed", lambda a, k: _backwards(a, k) * a.forward[..., None]),
                "yaw": Channel("yaw", "of the yaw rate", lambda a, k: _backwards(a, k) * a.yaw[..., None]),
                "veer": Channel("yaw", "rad/m", lambda a, k: _backwards(a, k) * a.forward[..., None]),
            },
        ),
        "time": Group(
            "time in the episode",
            "s",
            _of_wheels("of its speed", lambda a, k, wheel: hats(a.seconds, k) * a.wheels[wheel][..., None]),
            1e-3,
        ),
        "use": Group(
            "cumulated use",
            "min at full speed",
            _of_wheels("of its speed", lambda a, k, wheel: hats(a.use, k) * a.wheels[wheel][..., None]),
            1e-6,
        ),
        "load": Group(
            "recent load",
            "s",
            _of_wheels("of its speed", lambda a, k, wheel: a.loads * a.wheels[wheel][..., None]),
            1e-3,
        ),
        HEADING: Group(
            "heading",
            "turns a turn",
            {
                "forward_cos": Channel("forward", "m/s", _waves(np.cos)),
                "forward_sin": Channel("forward", "m/s", _waves(np.sin)),
                "sideways_cos": Channel("sideways", "m/s", _waves(np.cos)),
                "sideways_sin": Channel("sideways", "m/s", _waves(np.sin)),
            },
            1.0,
        ),
    }
)
"""Every group that a learnt effect can have. Where the robot is and how its wheels are turned are no groups: a study's
proxy starts elsewhere than the drives did, and its wheels at another angle."""
