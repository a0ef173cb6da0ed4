"""Causal features of the motion that is asked for, in groups: what curves of unnamed motion are fitted over.

`AskedMotion` is that motion with its past. A group of `MOTION_GROUPS` names the signal, and for each channel of the
body or of a wheel the basis functions over it, each 0 where the robot stands. The filters that make the past come last.
"""

import functools
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from proxytune.effects.effect import Signal, fastest, lfilter
from proxytune.effects.motion import REST_SPEED

Knot = float | tuple[float, float]
Knots = tuple[Knot, ...]


class AskedMotion(NamedTuple):
    """The motion asked for, held within what was seen, and its past, (…, time) where nothing else is said."""

    forward: Signal  # forward speed [m/s]
    yaw: Signal  # yaw rate [rad/s]
    wheels: Signal  # speeds of the left and the right wheel over the floor [m/s] (2, …, time)
    seconds: Signal  # since the start [s]
    use: Signal  # integral of the mean wheel speed's size, as a fraction of full speed, since the start [min]
    heading: Signal  # heading [rad]
    place: Signal  # place on the floor [m] (…, time, 2)
    bands: Signal  # of each wheel's speed, the part between neighbouring low-passes [m/s] (2, …, time, time constants)
    loads: Signal  # low-passes of the mean wheel speed's size, as a fraction of full speed (…, time, time constants)
    rolled: Signal  # how far each wheel, and the robot, has gone since it last turned the other way [m] (3, …, time)
    started: Signal  # since each wheel last stood [s] (2, …, time)
    rings: Signal  # damped complex swings that each change of a wheel's speed sets off [m/s] (2, …, time, frequencies)
    played: Signal  # each wheel's speed through plays of some widths [m/s] (2, …, time, widths)


WIDEST_MESH_M = 2.0
"""The knots of a map of the floor lie on a lattice, no wider than this."""
STANDS = 0.1
"""A wheel is to stand where it is asked to go slower than this share of its speed of late."""


def hats(signal: Signal, knots: Knots, height: Signal | float = 1.0) -> Signal:
    """Piecewise-linear functions (…, knots): each 1, or so high, at its knot, 0 at others and at 0, level beyond."""
    corners = np.sort(np.array([0.0, *knots], dtype=float))
    signal, height = np.broadcast_arrays(signal, height)
    flat = signal.ravel()
    # All but the two next to the signal are 0 there: linear between these, level beyond the ends.
    below = np.clip(np.searchsorted(corners, flat, side="right") - 1, 0, len(corners) - 2)
    low, high = corners[below], corners[below + 1]
    share = np.where(flat >= high, 1.0, 1.0 / (high - low) * np.maximum(flat - low, 0.0))
    number, out = np.cumsum(corners != 0.0) - 1, np.zeros((flat.size, len(knots)))
    for corner, value in ((below, (1.0 - share) * height.ravel()), (below + 1, share * height.ravel())):
        own = np.flatnonzero(corners[corner])
        out[own, number[corner[own]]] = value[own]
    return out.reshape(*signal.shape, len(knots))


def grid(asked: AskedMotion, knots: Knots) -> Signal:
    """Products of hats over speed and yaw rate (…, knots), 0 where both are 0."""
    pairs = np.asarray(knots, dtype=float)
    parts = []
    for signal, values in zip((asked.forward, asked.yaw), pairs.T, strict=True):
        corners = np.unique(np.append(values, 0.0))
        rows = np.stack([np.interp(signal, corners, row) for row in np.eye(len(corners))], axis=-1)
        parts.append(rows[..., np.searchsorted(corners, values)])
    return np.asarray(parts[0] * parts[1])


def floor_map(asked: AskedMotion, knots: Knots, axes: slice = slice(None)) -> Signal:
    """Products of hats over x and y, or one of them (…, knots): each 1 at its knot, 0 a mesh away and where none is."""
    places = np.reshape(np.asarray(knots, dtype=float), (len(knots), -1))
    gaps = np.diff(np.sort(places, axis=0), axis=0)
    mesh = float(gaps[gaps > 0.0].min(initial=WIDEST_MESH_M))
    pairs = zip(np.moveaxis(asked.place[..., axes], -1, 0), places.T, strict=True)
    # Many knots have an x or y in common.
    lines = ((here, *np.unique(at, return_inverse=True)) for here, at in pairs)
    parts = (np.maximum(0.0, 1.0 - np.abs(here[..., None] - at) / mesh)[..., own] for here, at, own in lines)
    return np.asarray(functools.reduce(np.multiply, parts))


def stretched(asked: AskedMotion, knots: Knots, axis: int, *, aside: bool) -> Signal:
    """The motion forward, or aside, that a tracker adds whose map is stretched along an axis (…, knots)."""
    to_axis, from_side = np.cos(asked.heading), -np.sin(asked.heading)
    if axis:
        to_axis, from_side = -from_side, to_axis
    added = to_axis * (from_side if aside else to_axis) * asked.forward
    return np.asarray(floor_map(asked, knots, slice(axis, axis + 1)) * added[..., None])


def sign(asked: AskedMotion, wheel: int) -> Signal:
    """Sign of a wheel's speed: from −1 to 1, 0 where it stands (…, time, 1)."""
    return np.asarray(np.clip(asked.wheels[wheel][..., None] / REST_SPEED, -1.0, 1.0))


def fast(asked: AskedMotion, wheel: int) -> Signal:
    """Size of a wheel's speed (…, time, 1)."""
    return np.asarray(np.abs(asked.wheels[wheel])[..., None])


def moving(asked: AskedMotion) -> Signal:
    """1 while the robot moves, 0 where it stands (…, time)."""
    return np.minimum(1.0, np.abs(asked.forward) / REST_SPEED)


def backwards(asked: AskedMotion, knots: Knots) -> Signal:
    """Indicator of moving backwards, for a knot of −1."""
    return hats(np.clip(asked.forward / REST_SPEED, -1.0, 1.0), knots)


def level(asked: AskedMotion, knots: Knots, wheel: int) -> Signal:
    """A wheel's speed as it is, whatever the knots."""
    return np.asarray(asked.wheels[wheel][..., None] * np.ones(len(knots)))


def slowing(asked: AskedMotion, knots: Knots, wheel: int) -> Signal:
    """The bands of a wheel that is slower than it has been of late, 0 while it speeds up."""
    bands = asked.bands[wheel]
    slow = asked.wheels[wheel][..., None] - np.cumsum(bands, axis=-1)
    return np.where(bands * slow < 0.0, bands, 0.0)


def stopping(asked: AskedMotion, knots: Knots, wheel: int) -> Signal:
    """The bands of a wheel that is to stand and was moving of late."""
    bands = asked.bands[wheel]
    speed = asked.wheels[wheel][..., None]
    return np.where(np.abs(speed) < STANDS * np.abs(speed - np.cumsum(bands, axis=-1)), bands, 0.0)


def started(asked: AskedMotion, knots: Knots, wheel: int) -> Signal:
    """1 when a wheel starts to move, fading with time."""
    return np.asarray(np.exp(-asked.started[wheel][..., None] / np.asarray(knots)))


def played(asked: AskedMotion, knots: Knots, wheel: int) -> Signal:
    """By how much a wheel lags behind within its play, while it moves."""
    speed = asked.wheels[wheel][..., None]
    return np.asarray((asked.played[wheel] - speed) * np.abs(sign(asked, wheel)))


def after_reversal(asked: AskedMotion, knots: Knots, wheel: int) -> Signal:
    """A wheel's speed, fading with the way since it last turned the other way."""
    way = np.abs(asked.rolled[wheel])[..., None]
    return np.asarray(asked.wheels[wheel][..., None] * np.exp(-way / np.asarray(knots)))


def body_after_reversal(asked: AskedMotion, knots: Knots) -> Signal:
    """The forward speed, fading with the way since the robot last drove the other way."""
    return np.asarray(asked.forward[..., None] * np.exp(-np.abs(asked.rolled[2])[..., None] / np.asarray(knots)))


Part = Callable[[AskedMotion], Signal]
"""A signal of the motion that is asked for."""


def waves(wave: Callable[[Signal], Signal], share_of: Part | None = None) -> Callable[[AskedMotion, Knots], Signal]:
    """Harmonics of the heading while the robot moves, as shares of something or as they are."""

    def basis(asked: AskedMotion, knots: Knots) -> Signal:
        plain = wave(asked.heading[..., None] * np.asarray(knots)) * moving(asked)[..., None]
        return plain * share_of(asked)[..., None] if share_of else plain

    return basis


class Channel(NamedTuple):
    """What curves add to: the body's `forward`, `sideways` or `yaw`, the `left` or `right` wheel, or either `duty`."""

    to: str
    unit: str
    basis: Callable[[Any, Knots], Signal]


class LearntCurve(NamedTuple):
    """One channel of one group: a weight for each of its knots, in their order."""

    group: str
    channel: str
    knots: Knots
    weights: tuple[float, ...]


class Group(NamedTuple):
    """Curves over one signal."""

    title: str  # what people call the signal
    unit: str  # the unit of the knots
    channels: Mapping[str, Channel]  # what the curves add, by name
    low: float | None = None  # the lowest knot that makes sense, or None where knots may be negative


def _of_wheels(unit: str, basis: Callable[[AskedMotion, Knots, int], Signal], ending: str = "") -> dict[str, Channel]:
    """One channel a wheel, called after it, with an ending."""
    return {
        f"left{ending}": Channel("left", unit, lambda a, k: basis(a, k, 0)),
        f"right{ending}": Channel("right", unit, lambda a, k: basis(a, k, 1)),
    }


def _of_heading(name: str, to: str, unit: str, share_of: Part | None = None) -> dict[str, Channel]:
    """A channel of cosines and one of sines."""
    return {f"{name}_{wave.__name__}": Channel(to, unit, waves(wave, share_of)) for wave in (np.cos, np.sin)}


LEVEL = "level"
"""The one group that is no curve: beside others it takes back what fitted gains and trim have taken of theirs."""


def _of_place(unit: str, axes: slice) -> Group:
    """Curves over where the robot is."""
    channels = {
        "forward": Channel("forward", "of the speed", lambda a, k: floor_map(a, k, axes) * a.forward[..., None]),
        "yaw": Channel("yaw", "of the yaw rate", lambda a, k: floor_map(a, k, axes) * a.yaw[..., None]),
        "veer": Channel("yaw", "rad/m", lambda a, k: floor_map(a, k, axes) * np.abs(a.forward)[..., None]),
    }
    return Group(f"{'place' if ',' in unit else 'xy'[axes.start]} on the floor", unit, channels)


def _of_tracker(axis: int) -> Group:
    """Curves over how far a tracker's map is stretched along an axis."""
    channels = {
        "forward": Channel("forward", "of the speed", lambda a, k: stretched(a, k, axis, aside=False)),
        "sideways": Channel("sideways", "of the speed", lambda a, k: stretched(a, k, axis, aside=True)),
    }
    return Group(f"the tracker's {'xy'[axis]}", "m", channels)


def _group(title: str, unit: str, low: float | None = None, **channels: Channel) -> Group:
    return Group(title, unit, channels, low)


HEADING, PLACE = "heading", "place"
OF_PLACE = (PLACE, "x", "y", "tracker_x", "tracker_y")
"""The groups that look at where the robot points, and at where it is."""
MOTION_GROUPS: Mapping[str, Group] = MappingProxyType(
    {
        LEVEL: Group("level", "at all speeds", _of_wheels("of its speed", level), 1e-3),
        "wheel_speed": Group("wheel speed", "m/s", _of_wheels("m/s", lambda a, k, wheel: hats(a.wheels[wheel], k))),
        "other_wheel": Group(
            "speed of the other wheel", "m/s", _of_wheels("m/s", lambda a, k, wheel: hats(a.wheels[1 - wheel], k))
        ),
        "turn_rate": _group(
            "turn rate",
            "rad/s",
            forward=Channel("forward", "of the speed", lambda a, k: hats(a.yaw, k, a.forward)),
            sideways=Channel("sideways", "of the speed", lambda a, k: hats(a.yaw, k, a.forward)),
            yaw=Channel("yaw", "rad/s", lambda a, k: hats(a.yaw, k)),
        ),
        "speed_and_turn": _group(
            "speed and turn rate together",
            "m/s, rad/s",
            forward=Channel("forward", "m/s", grid),
            sideways=Channel("sideways", "m/s", grid),
            yaw=Channel("yaw", "rad/s", grid),
        ),
        "transients": _group(
            "changes of wheel speed",
            "s",
            1e-3,
            **_of_wheels("of the change", lambda a, k, wheel: a.bands[wheel]),
            **_of_wheels("of the change", slowing, "_slowing"),
            **_of_wheels("of the change", stopping, "_stopping"),
            sideways=Channel("sideways", "of the change", lambda a, k: a.bands.mean(axis=0)),
            veer=Channel("yaw", "rad/m", lambda a, k: a.bands.mean(axis=0)),
        ),
        "changes": _group(
            "changes of either wheel's speed, by speed and direction",
            "s",
            1e-3,
            **_of_wheels("s/m of the change", lambda a, k, wheel: a.bands[wheel] * fast(a, wheel), "_fast"),
            **_of_wheels("of the change", lambda a, k, wheel: a.bands[wheel] * (sign(a, wheel) < 0.0), "_backwards"),
            **_of_wheels("of the change", lambda a, k, wheel: a.bands[1 - wheel], "_crossed"),
        ),
        "ringing": _group(
            "swings after changes of wheel speed",
            "Hz",
            1e-3,
            **_of_wheels("of the change", lambda a, k, wheel: a.rings[wheel].real),
            **_of_wheels("of the change", lambda a, k, wheel: a.rings[wheel].imag, "_later"),
        ),
        "play": Group("way in which wheel speed changes", "m/s", _of_wheels("of the play", played), 1e-3),
        "start": _group(
            "time since it stood",
            "s",
            1e-3,
            **_of_wheels("of its speed", lambda a, k, wheel: a.wheels[wheel][..., None] * started(a, k, wheel)),
            **_of_wheels("m/s", lambda a, k, wheel: sign(a, wheel) * started(a, k, wheel), "_push"),
        ),
        "reversal": _group(
            "way since reversal",
            "m",
            1e-3,
            **_of_wheels("of its speed", after_reversal),
            forward=Channel("forward", "of the speed", body_after_reversal),
            veer=Channel("yaw", "rad/m", body_after_reversal),
        ),
        "direction": _group(
            "direction of travel",
            "sign",
            forward=Channel("forward", "of the speed", lambda a, k: backwards(a, k) * a.forward[..., None]),
            yaw=Channel("yaw", "of the yaw rate", lambda a, k: backwards(a, k) * a.yaw[..., None]),
            veer=Channel("yaw", "rad/m", lambda a, k: backwards(a, k) * a.forward[..., None]),
        ),
        "time": Group(
            "time in the episode",
            "s",
            _of_wheels("of its speed", lambda a, k, wheel: hats(a.seconds, k, a.wheels[wheel])),
            1e-3,
        ),
        "use": Group(
            "cumulated use",
            "min at full speed",
            _of_wheels("of its speed", lambda a, k, wheel: hats(a.use, k, a.wheels[wheel])),
            1e-6,
        ),
        "load": Group(
            "recent load",
            "s",
            _of_wheels("of its speed", lambda a, k, wheel: a.loads * a.wheels[wheel][..., None]),
            1e-3,
        ),
        HEADING: _group(
            "heading",
            "turns a turn",
            1.0,
            **_of_heading("forward", "forward", "m/s"),
            **_of_heading("sideways", "sideways", "m/s"),
            **_of_heading("veer", "yaw", "rad/m", lambda a: np.abs(a.forward)),
            **_of_heading("ahead", "forward", "of the speed", lambda a: a.forward),
            **_of_heading("aside", "sideways", "of the speed", lambda a: a.forward),
            **_of_heading("yaw", "yaw", "of the yaw rate", lambda a: a.yaw),
        ),
        PLACE: _of_place("m, m", slice(None)),
        "x": _of_place("m", slice(0, 1)),
        "y": _of_place("m", slice(1, 2)),
        "tracker_x": _of_tracker(0),
        "tracker_y": _of_tracker(1),
    }
)
"""Every group over the motion that is asked for. A map of the floor is 0 where the drives were not. How wheels are
turned is no group: a study's start at another angle."""
DAMPING = 0.25
"""Of the swings, as a share of critical damping."""


def low_passes(signal: Signal, slow: Signal, constants: Knots, rate_hz: float) -> Signal:
    """First-order low-passes of a signal (…, time), one for each time constant [s] (…, time, constants)."""
    out = np.empty((*signal.shape, len(constants)))
    for number, constant in enumerate(constants):
        kept = float(np.exp(-1.0 / (np.asarray(constant) * rate_hz)))
        start = kept * slow[..., number][..., None]
        out[..., number], _ = lfilter([1.0 - kept], [1.0, -kept], signal, axis=-1, zi=start)
    return out


def rings(change: Signal, before: Signal, frequencies_hz: Knots, rate_hz: float) -> Signal:
    """Damped swings that changes of a signal (…, time) set off, complex (…, time, frequencies)."""
    out = np.empty((*change.shape, len(frequencies_hz)), dtype=complex)
    for number, frequency in enumerate(frequencies_hz):
        turn = 2.0 * np.pi * np.asarray(frequency) / rate_hz
        kept = complex(np.exp(turn * (-DAMPING + 1j * np.sqrt(1.0 - DAMPING**2))))
        start = kept * before[..., number][..., None]
        out[..., number], _ = lfilter([1.0], [1.0, -kept], change.astype(complex), axis=-1, zi=start)
    return out


def play(signal: Signal, before: Signal, halves: Knots) -> Signal:
    """Value dragged along by a signal (…, time) through plays of these half widths (…, time, widths)."""
    out, now = np.empty((*signal.shape, len(halves))), before
    half = np.asarray(halves, dtype=float)
    if out.size and (compiled := fastest(out.size)):
        return compiled.play(signal, before, half, out)  # type: ignore[no-any-return]
    for step in range(signal.shape[-1] if len(halves) else 0):
        here = signal[..., step, None]
        now = np.minimum(np.maximum(now, here - half), here + half)
        out[..., step, :] = now
    return out


def ramp(signal: Signal, before: Signal, grows: Signal, shrinks: Signal) -> Signal:
    """Value that follows a signal (…, time) by at most so much a sample, as that is larger or not (…, time, limits)."""
    out, now = np.empty((*signal.shape, len(grows))), before
    if out.size and (compiled := fastest(out.size)):
        return compiled.ramp(signal, before, grows, shrinks, out)  # type: ignore[no-any-return]
    for step in range(signal.shape[-1] if len(grows) else 0):
        here = signal[..., step, None]
        most = np.where(np.abs(here) > np.abs(now), grows, shrinks)
        out[..., step, :] = now = now + np.clip(here - now, -most, most)
    return out


def moved_since(speed: Signal, before: Signal, rest_speed: float, rate_hz: float) -> Signal:
    """Time since a wheel last stood, slower than a rest speed [s] (…, time); `before` the first sample so long (…,)."""
    number = np.arange(1.0, speed.shape[-1] + 1.0)
    stood = np.where(np.abs(speed) < rest_speed, number, -before[..., None] * rate_hz)
    return np.asarray((number - np.maximum.accumulate(stood, axis=-1)) / rate_hz)


def newest_signs(signs: Signal) -> Signal:
    """Signs (…, time), each 0 replaced by the newest before it that is none."""
    place = np.where(signs != 0.0, np.arange(signs.shape[-1]), 0)
    return np.take_along_axis(signs, np.maximum.accumulate(place, axis=-1), axis=-1)


LONG_M = 10.0
"""A wheel that has not moved yet has rolled so far: a start is no reversal, for it may have gone either way before."""


def rolled_since(speed: Signal, before: Signal, rate_hz: float) -> Signal:
    """Way that a wheel has rolled since it last turned the other way [m] (…, time), negative backwards.

    Slower than REST_SPEED it turns no other way. `before` the first sample it had rolled so far (…,), 0 if not at all.
    """
    now = np.where(np.abs(speed) < REST_SPEED, 0.0, np.sign(speed))
    course = newest_signs(np.concatenate((np.sign(before)[..., None], now), axis=-1))
    start = np.where(before == 0.0, LONG_M, np.abs(before))
    way = np.concatenate((start[..., None], np.abs(speed) / rate_hz), axis=-1).cumsum(axis=-1)
    turned = course[..., 1:] * course[..., :-1] < 0.0
    since = np.maximum.accumulate(np.where(turned, way[..., :-1], 0.0), axis=-1)
    return np.asarray(course[..., 1:] * (way[..., 1:] - since))
