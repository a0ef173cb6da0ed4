"""Measured logs of a Duckiebot with a hidden effect: a second simulation, written without proxytune's own.

The robot: duty → delay → bent duty → wheel target speed with trim → first-order motor (0.20 s) → forward speed
(l + r)/2 · 0.6 m/s and yaw rate (r − l) · 0.6/0.16 rad/s → pose, in steps of 1/240 s. Wheel speeds are fractions of
full speed. A hidden effect is a function of the signal of one stage.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np
from manoeuvres import RATE_HZ, Drives, make_drives
from numpy.typing import NDArray
from scipy.signal import lfilter

from proxytune.logs import Log, LogEpisode

FINE_HZ, PER_ROW = 240, 12
FULL_SPEED, BASELINE, RADIUS, MOTOR_LAG = 0.6, 0.16, 0.0318, 0.20
WHITE_NOISE = (0.002, 0.002, 0.005)  # of a measured pose [m], [m], [rad]
MOTION_NOISE, YAW_PER_METRE, CORRELATION_S = (0.025, 0.006, 0.025), 0.10, 0.25
"""Coloured disturbance: forward and sideways per forward speed, yaw per yaw rate; yaw per forward speed [rad/m]."""
LEVELS = {"normal": 1.0, "double": 2.0}

Array = NDArray[np.float64]
Figures = Mapping[str, float]
Stage = Mapping[str, Callable[..., Array]]
"""Effects by name: functions of the signal, the Scene and the figures."""


@dataclass(frozen=True)
class Case:
    """A robot that one log is measured of."""

    name: str  # what it is
    effects: tuple[tuple[str, Figures], ...]  # what is hidden: names of functions here with their figures
    noise: str  # key of LEVELS
    seed: int  # seed of the manoeuvres and of everything random
    trim: float
    delay: float  # its delay [s]
    right: tuple[tuple[str, ...], ...] = ()  # for every hidden effect, the catalogue's names that count as right
    depends_on: str = ""  # the signal that an effect outside of any catalogue depends on


class Scene(NamedTuple):
    """What an effect may look at: its own random numbers, arrived duties (E, T, 2) and times (T,) [s]."""

    random: np.random.Generator
    duties: Array
    times: Array


def make_log(
    case: Case, *, episodes: int = 12, seconds: float = 60.0, noiseless: bool = False, late_s: Array | float = 0.0
) -> Log:
    """What would have been measured of this robot, 20 rows per second, from rest.

    Poses are stamped later than commands by `late_s`, which may differ between episodes and rows.
    """
    rows = round(seconds * RATE_HZ)
    drives = make_drives(case.seed, episodes, rows)
    level = 0.0 if noiseless else LEVELS[case.noise]
    late = np.broadcast_to(np.asarray(late_s, dtype=float), (episodes, rows))
    poses = measured(_stamped(fine_poses(case, drives, level), late), case, level)
    times = np.arange(rows) / RATE_HZ
    drives_measured = (LogEpisode(f"{e:02d}", times, drives.duties[e], poses[e], None) for e in range(episodes))
    return Log(case.name, "duckiebot", "duty", float(RATE_HZ), {}, tuple(drives_measured))


def true_poses(case: Case, drives: Drives, level: float) -> Array:
    """Poses (E, rows, 3) of the middle of the axle, with `level` times the normal disturbance of motion."""
    return fine_poses(case, drives, level)[:, ::PER_ROW]


def _stamped(poses: Array, late_s: Array) -> Array:
    """Fine poses as rows (E, rows, 3) that are stamped so much too late (E, rows); NaN where the drive had ended."""
    step = np.arange(late_s.shape[1]) * PER_ROW - np.rint(late_s * FINE_HZ).astype(int)
    there = (step >= 0) & (step < poses.shape[1])
    rows = poses[np.arange(len(poses))[:, None], np.clip(step, 0, poses.shape[1] - 1)]
    return np.where(there[..., None], rows, np.nan)


def fine_poses(case: Case, drives: Drives, level: float) -> Array:
    """The same at every fine step."""
    twists = disturbed(wheel_twists(case, drives.duties), case, level)
    places = [(PLACES[name], figures) for name, figures in case.effects if name in PLACES]
    return _stepped(twists, drives.starts, places) if places else _integrated(twists, drives.starts)


def wheel_twists(case: Case, messages: Array) -> Array:
    """Forward, sideways [m/s] and yaw rate [rad/s] (E, T, 3) that the wheels ask for, each the mean over a step."""
    arrived = _arrived(case, messages)
    scene = Scene(_random(case, "wheels"), arrived, np.arange(arrived.shape[1]) / FINE_HZ)
    target = _through(DUTY, case, arrived, scene) * (1.0 - case.trim, 1.0 + case.trim)
    target = _through(TARGET, case, target, scene)
    (name, figures), *_ = [e for e in case.effects if e[0] in MOTORS] or [("motor_lag", {"time_constant": MOTOR_LAG})]
    ends = MOTORS[name](target, scene, **figures)
    starts = np.concatenate((np.zeros_like(ends[:, :1]), ends[:, :-1]), axis=1)
    wheels = _through(WHEELS, case, (starts + ends) / 2.0, scene)
    forward = wheels.sum(axis=-1) * FULL_SPEED / 2.0
    yaw = (wheels[..., 1] - wheels[..., 0]) * FULL_SPEED / BASELINE
    return _through(TWIST, case, np.stack((forward, np.zeros_like(forward), yaw), axis=-1), scene)


def disturbed(twists: Array, case: Case, level: float, rate_hz: float = FINE_HZ) -> Array:
    """Twists with Ornstein-Uhlenbeck noise that grows with motion."""
    random, kept = _random(case, "motion"), np.exp(-1.0 / (CORRELATION_S * rate_hz))
    first, later = random.standard_normal(twists[:, :1].shape), random.standard_normal(twists.shape)
    noise, _ = lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], later, axis=1, zi=kept * first)
    size = np.abs(twists[..., [0, 0, 2]]) * MOTION_NOISE + np.abs(twists[..., :1]) * (0.0, 0.0, YAW_PER_METRE)
    return twists + level * size * noise


def measured(poses: Array, case: Case, level: float) -> Array:
    """Poses as a tracker sees them: of its marker, with white noise."""
    white = _random(case, "poses").standard_normal(poses.shape)
    return _through(MEASURED, case, poses) + level * white * WHITE_NOISE


def _random(case: Case, what: str) -> np.random.Generator:
    return np.random.default_rng([case.seed, crc32(what.encode())])


def _through(stage: Stage, case: Case, signal: Array, *scene: Scene) -> Array:
    for name, figures in case.effects:
        if name in stage:
            signal = stage[name](signal, *scene, **figures)
    return signal


def _arrived(case: Case, messages: Array) -> Array:
    """The duty in force at each fine step (E, T, 2): the newest message that has arrived."""
    episodes, rows, _ = messages.shape
    issued = np.broadcast_to(np.arange(rows) / RATE_HZ, (episodes, rows))
    scene = Scene(_random(case, "messages"), messages, issued)
    sent = _through(MESSAGES, case, messages, scene)
    steps = np.ceil(_through(ARRIVAL, case, issued + case.delay, scene) * FINE_HZ - 1e-6).astype(int)
    newest = np.zeros((episodes, (rows - 1) * PER_ROW + 1), dtype=int)
    episode, row = np.nonzero(steps < newest.shape[1])
    np.maximum.at(newest, (episode, steps[episode, row]), row + 1)
    newest = np.maximum.accumulate(newest, axis=1)[:, :-1]
    return np.concatenate((np.zeros((episodes, 1, 2)), sent), axis=1)[np.arange(episodes)[:, None], newest]


def _integrated(twists: Array, starts: Array) -> Array:
    """Poses (E, T + 1, 3) at the starts of the steps and the end of the last."""
    turns = twists[..., 2] / FINE_HZ
    heading = starts[:, None, 2] + np.cumsum(turns, axis=1)
    along = (twists[..., 0] + 1j * twists[..., 1]) * np.exp(1j * (heading - turns / 2.0))
    place = (starts[:, :1] + 1j * starts[:, 1:2]) + np.cumsum(along, axis=1) / FINE_HZ
    return np.concatenate((starts[:, None], np.stack((place.real, place.imag, heading), axis=-1)), axis=1)


def _stepped(twists: Array, starts: Array, places: list[tuple[Callable[..., Array], Figures]]) -> Array:
    """The same, step by step, where a twist depends on the pose."""
    poses = np.empty((twists.shape[0], twists.shape[1] + 1, 3))
    poses[:, 0] = starts
    for step in range(twists.shape[1]):
        pose, twist = poses[:, step], twists[:, step]
        for effect, figures in places:
            twist = effect(twist, pose, **figures)
        poses[:, step + 1] = _integrated(twist[:, None], pose)[:, 1]
    return poses


def _newest(signal: Array, valid: NDArray[np.bool_]) -> Array:
    """Along time, the newest valid value of signal (E, T, 2); zero before the first."""
    index = np.maximum.accumulate(np.where(valid, np.arange(1, signal.shape[1] + 1), 0), axis=1)
    return np.concatenate((np.zeros_like(signal[:, :1]), signal), axis=1)[np.arange(len(signal))[:, None], index]


MESSAGES: Stage = {  # messages (E, rows, 2) as they are sent
    "dropped_commands": lambda u, s, probability: _newest(u, s.random.random(u.shape[:2]) >= probability),
    "dropped_bursts": lambda u, s, rate, length: _newest(
        u, lfilter(np.ones(length), [1.0], s.random.random(u.shape[:2]) < rate, axis=1) == 0.0
    ),
    "command_quantisation": lambda u, s, step: step * np.round(u / step),
    "truncated_commands": lambda u, s, step: step * np.trunc(u / step),
}

ARRIVAL: Stage = {  # when messages arrive (E, rows) [s]; of those that have arrived the newest is in force
    "delay_jitter": lambda t, s, spread: np.maximum.accumulate(t + s.random.uniform(0.0, spread, t.shape), axis=1),
    "gaussian_jitter": lambda t, s, spread: t + np.abs(s.random.normal(0.0, spread, t.shape)),
    "overtaking_jitter": lambda t, s, spread: t + s.random.uniform(0.0, spread, t.shape),
}


def _on(bent: Array, plain: Array, *sides: float) -> Array:
    return np.where(np.array(sides) > 0.0, bent, plain)


def _shrunk(signal: Array, width: float) -> Array:
    return np.sign(signal) * np.maximum(0.0, np.abs(signal) - width)


def _sticking(duty: Array, breakaway: float, release: float) -> Array:
    """A wheel rests until |duty| ≥ breakaway and goes on until |duty| < release · breakaway."""
    size, order = np.abs(duty), np.arange(1, duty.shape[1] + 1)[:, None]
    went = np.maximum.accumulate(np.where(size >= breakaway, order, 0), axis=1)
    stopped = np.maximum.accumulate(np.where(size < release * breakaway, order, 0), axis=1)
    return np.where(went > stopped, duty, 0.0)


def _ramped(duty: Array, rise: float) -> Array:
    """Duties that go from rest to full in `rise` seconds at best."""
    now, ramped = np.zeros_like(duty[:, 0]), np.empty_like(duty)
    for step in range(duty.shape[1]):
        now = now + np.clip(duty[:, step] - now, -1.0 / (rise * FINE_HZ), 1.0 / (rise * FINE_HZ))
        ramped[:, step] = now
    return ramped


DUTY: Stage = {  # duties (E, T, 2) at the motors; left and right say which wheels have the effect
    "dead_band": lambda u, s, width, left=1, right=1: _on(_shrunk(u, width), u, left, right),
    "dead_zone_that_jumps": lambda u, s, width: np.where(np.abs(u) > width, u, 0.0),
    "saturation": lambda u, s, limit: np.clip(u, -limit, limit),
    "smooth_saturation": lambda u, s, limit: limit * np.tanh(u / limit),
    "stiction": lambda u, s, breakaway, release=0.5: _sticking(u, breakaway, release),
    "driver_map": lambda u, s, offset: np.sign(u) * np.where(np.abs(u) < 0.01, 0.0, offset + (1 - offset) * np.abs(u)),
    "slew_rate": lambda u, s, rise: _ramped(u, rise),
    "driver_curve": lambda u, s, power: np.sign(u) * np.abs(u) ** power,
}


def _load(scene: Scene) -> Array:
    return np.abs(scene.duties).mean(axis=-1, keepdims=True)


def _sagging(target: Array, load: Array, fade: float, drop: float) -> Array:
    """Weaker by `fade` per minute of full duty since the start, and by `drop` at full duty."""
    return target * np.exp(-fade / 60.0 / FINE_HZ * np.cumsum(load, axis=1)) * (1.0 - drop * load)


TARGET: Stage = {  # target speeds of the wheels (E, T, 2)
    "wheel_gain": lambda w, s, left, right: w * (left, right),
    "battery_sag": lambda w, s, fade=0.0, load=0.0: _sagging(w, _load(s), fade, load),
    "fading_with_time": lambda w, s, rate: w * np.exp(-rate * s.times[:, None] / 60.0),
    "thermal_fade": lambda w, s, loss, time_constant: w * (1.0 - loss * _lagged(_load(s), time_constant)),
    "sag_with_time": lambda w, s, rate: w * (1.0 - rate * s.times[:, None] / 60.0),
    "sag_with_square_of_load": lambda w, s, load: w * (1.0 - load * _load(s) ** 2),
    "slipping_hub": lambda w, s, factor, after: _on(np.where(s.times[:, None] < after, w, factor * w), w, 1, 0),
    "weak_reverse": lambda w, s, factor: np.where(w < 0.0, factor * w, w),
}


def _lagged(target: Array, time_constant: float = MOTOR_LAG) -> Array:
    kept = np.exp(-1.0 / (time_constant * FINE_HZ))
    return lfilter([1.0 - kept], [1.0, -kept], target, axis=1)


def _uneven(target: Array, rising: float, falling: float) -> Array:
    """Speeding up takes another time constant than slowing down."""
    up, down = (1.0 - np.exp(-1.0 / (tau * FINE_HZ)) for tau in (rising, falling))
    speed, ends = np.zeros_like(target[:, 0]), np.empty_like(target)
    for step in range(target.shape[1]):
        gap = target[:, step] - speed
        speed = speed + gap * np.where(gap * speed >= 0.0, up, down)
        ends[:, step] = speed
    return ends


MOTORS: Stage = {  # speeds of the wheels (E, T, 2) at the ends of the steps
    "motor_lag": lambda w, s, time_constant, left=1, right=1: _on(_lagged(w, time_constant), _lagged(w), left, right),
    "second_order_motor": lambda w, s, first, second: _lagged(_lagged(w, first), second),
    "uneven_motor": lambda w, s, rising, falling: _uneven(w, rising, falling),
}


def _angles(speeds: Array) -> Array:
    return np.cumsum(speeds, axis=1) * (FULL_SPEED / RADIUS / FINE_HZ)


def _played(speeds: Array, gap: float, passed: float) -> Array:
    """A wheel lags its shaft by a play of `gap` [rad], from its middle; within it, `passed` of the speed passes."""
    shaft, half = _angles(speeds), gap / 2.0
    wheel, last, wheels = np.zeros_like(shaft[:, 0]), np.zeros_like(shaft[:, 0]), np.empty_like(shaft)
    for step, now in enumerate(np.moveaxis(shaft, 1, 0)):
        wheel = np.minimum(np.maximum(wheel + passed * (now - last), now - half), now + half)
        wheels[:, step], last = wheel, now
    return np.diff(wheels, axis=1, prepend=0.0) * (RADIUS / FULL_SPEED * FINE_HZ)


WHEELS: Stage = {  # speeds of the wheels (E, T, 2)
    "backlash": lambda w, s, gap, passed=0.0: _played(w, gap, passed),
    "eccentric_wheel": lambda w, s, ripple: w * (1.0 + ripple * np.sin(_angles(w)) * (1.0, 0.0)),
    "wheel_ripple": lambda w, s, left, right, ahead: w * (1.0 + np.array((left, right)) * np.sin(_angles(w) + ahead)),
}

TWIST: Stage = {  # twists (E, T, 3): forward, sideways [m/s], yaw rate [rad/s]
    "yaw_scrub": lambda m, s, baseline: m * (1.0, 1.0, BASELINE / baseline),
    "scrub_with_speed": lambda m, s, gain: m / (1.0 + (0.0, 0.0, gain) * np.abs(m[..., :1])),
    "turn_slip": lambda m, s, gain: m * (1.0 - (gain, 0.0, 0.0) * np.abs(m[..., 2:])),
    "turn_slip_with_square": lambda m, s, gain: m / (1.0 + (gain, 0.0, 0.0) * m[..., 2:] ** 2),
    "lateral_slip": lambda m, s, gain: m - (0.0, gain, 0.0) * (m[..., :1] * m[..., 2:]),
    "lateral_slip_with_square": lambda m, s, gain: m - (0, gain, 0) * (m[..., :1] * np.abs(m[..., :1]) * m[..., 2:]),
    "cross_coupling": lambda m, s, forward=0.0, turn=0.0: (
        m + forward * m[..., 2:] ** 2 * (1.0, 0.0, 0.0) + turn * np.abs(m[..., :1]) * (0.0, 0.0, 1.0)
    ),
    "understeer": lambda m, s, gain: m / (1.0 + (0.0, 0.0, gain) * np.abs(m[..., :1])),
    "yaw_lag": lambda m, s, time_constant: _on(_lagged(m, time_constant), m, 0, 0, 1),
    "yaw_friction": lambda m, s, width: _on(_shrunk(m, width), m, 0, 0, 1),
}


def _climb(pose: Array, x: float, y: float) -> Array:
    return np.array((1.0, 0.0, 0.0)) * (x * np.cos(pose[:, 2:]) + y * np.sin(pose[:, 2:]))


def _across(pose: Array, x: float, y: float) -> Array:
    return np.array((0.0, 1.0, 0.0)) * (x * np.sin(pose[:, 2:]) - y * np.cos(pose[:, 2:]))


def _in_patch(pose: Array, x: float, y: float, radius: float) -> NDArray[np.bool_]:
    return np.hypot(pose[:, :1] - x, pose[:, 1:2] - y) < radius


PLACES: Stage = {  # twists (E, 3) at poses (E, 3)
    "floor_slope": lambda m, p, x, y: m - (np.abs(m[:, :1]) > 0.02) * _climb(p, x, y),
    "sliding_slope": lambda m, p, x, y, push: (
        m - (np.abs(m[:, :1]) > 0.02) * (_climb(p, x, y) - push * _across(p, x, y))
    ),
    "slippery_patch": lambda m, p, loss, x, y, radius: m * np.where(_in_patch(p, x, y, radius), 1.0 - loss, 1.0),
    "gradual_slope": lambda m, p, x, y: m - np.tanh(np.abs(m[:, :1]) / 0.1) * _climb(p, x, y),
    "carpet": lambda m, p, factor, beyond: m * np.where(p[:, :1] > beyond, factor, 1.0),
    "bent_floor": lambda m, p, gain, waves: m + (0.0, 0.0, gain) * (m[:, :1] * np.sin(waves * p[:, :1])),
}


def _marked(poses: Array, ahead: float, left: float) -> Array:
    shift = (ahead + 1j * left) * np.exp(1j * poses[..., 2])
    return poses + np.stack((shift.real, shift.imag, np.zeros_like(shift.real)), axis=-1)


MEASURED: Stage = {  # poses (E, rows, 3) of the marker that the tracker follows
    "marker_offset": lambda p, forward=0.0, left=0.0: _marked(p, forward, left),
    "heading_offset": lambda p, degrees: p + (0.0, 0.0, np.radians(degrees)),
}


def _case(name: str, *effects: tuple[str, Figures], noise: str = "normal", **more: Any) -> Case:
    """A case whose seed, trim and delay follow from its name."""
    seed = crc32(name.encode())
    trim, delay = np.random.default_rng(seed).uniform((-0.1, 0.08), (0.1, 0.2)).tolist()
    right = more.pop("right", tuple((effect,) for effect, _ in effects))
    return Case(name, effects, noise, seed, trim, delay, right, **more)


def _sized(effect: str, figure: str, *sizes: float, **fixed: float) -> tuple[Case, ...]:
    known = "".join(f" {key}" for key, value in fixed.items() if value == 1.0)
    return tuple(_case(f"{effect} {figure} {size:g}{known}", (effect, {figure: size, **fixed})) for size in sizes)


IN_FORM: tuple[Case, ...] = (
    *_sized("dead_band", "width", 0.03, 0.06, 0.12),
    *_sized("dead_band", "width", 0.06, 0.12, left=1.0, right=0.0),
    *_sized("saturation", "limit", 0.85, 0.7, 0.5),
    *_sized("motor_lag", "time_constant", 0.05, 0.12, 0.35),
    *_sized("motor_lag", "time_constant", 0.05, 0.35, left=1.0, right=0.0),
    *_sized("battery_sag", "fade", 0.1, 0.25, 0.5),
    *_sized("battery_sag", "load", 0.1, 0.2, 0.35),
    *_sized("stiction", "breakaway", 0.08, 0.14, 0.22),
    *_sized("backlash", "gap", 0.2, 0.4, 0.6),
    *(_case(f"wheel_gain {g:g}", ("wheel_gain", {"left": g, "right": g})) for g in (0.95, 0.9, 1.15)),
    *_sized("driver_map", "offset", 0.05, 0.12, 0.235),
    *_sized("yaw_scrub", "baseline", 0.15, 0.13, 0.20),
    *_sized("turn_slip", "gain", 0.03, 0.07, 0.15),
    *_sized("lateral_slip", "gain", 0.02, 0.06, 0.15),
    *_sized("floor_slope", "x", 0.01, y=0.0),
    *_sized("floor_slope", "x", 0.02, -0.045, y=0.02),
    *_sized("marker_offset", "forward", 0.01, 0.02, 0.05),
    *_sized("marker_offset", "left", 0.01, 0.03),
    *_sized("heading_offset", "degrees", 1.0, -3.0, 6.0),
    *_sized("delay_jitter", "spread", 0.05, 0.1, 0.2),
    *_sized("dropped_commands", "probability", 0.1, 0.2, 0.4),
    *_sized("command_quantisation", "step", 0.1, 0.2, 0.3),
    *_sized("command_quantisation", "step", 0.137, 0.0655, 0.231),
    *_sized("slew_rate", "rise", 0.4, 0.8, 1.6),
    *_sized("thermal_fade", "loss", 0.3, 0.6, time_constant=5.0),
    *_sized("cross_coupling", "forward", 0.008, 0.02, turn=0.1),
    *_sized("cross_coupling", "turn", 0.3, 0.8),
    *_sized("understeer", "gain", 0.2, 0.5, 1.2),
    *_sized("yaw_lag", "time_constant", 0.05, 0.1, 0.25),
    *_sized("wheel_ripple", "left", 0.1, 0.25, right=0.15, ahead=0.7),
    *_sized("slippery_patch", "loss", 0.3, 0.6, x=0.4, y=-0.2, radius=0.7),
    *(
        _case(f"fading_with_time rate {rate:g}", ("fading_with_time", {"rate": rate}), right=(("battery_sag",),))
        for rate in (0.15, 0.4)
    ),
    *(
        _case(f"sliding_slope x {x:g}", ("sliding_slope", {"x": x, "y": 0.01, "push": 0.8}), right=(("floor_slope",),))
        for x in (0.015, -0.04)
    ),
    *_sized("stiction", "breakaway", 0.12, 0.2, release=0.8),
)
"""Effects of the catalogue's own form, small to large."""

OTHER_FORM: tuple[Case, ...] = tuple(
    _case(effect, (effect.split()[0], figures), right=(right,))
    for effect, figures, right in (
        ("dead_zone_that_jumps", {"width": 0.1}, ("dead_band", "stiction")),
        ("smooth_saturation", {"limit": 0.8}, ("saturation",)),
        ("second_order_motor", {"first": 0.25, "second": 0.12}, ("motor_lag",)),
        ("uneven_motor", {"rising": 0.4, "falling": 0.1}, ("motor_lag",)),
        ("sag_with_time", {"rate": 0.2}, ("battery_sag",)),
        ("sag_with_square_of_load", {"load": 0.3}, ("battery_sag",)),
        ("stiction that releases late", {"breakaway": 0.15, "release": 0.85}, ("stiction",)),
        ("backlash that passes a third", {"gap": 0.6, "passed": 0.33}, ("backlash",)),
        ("driver_curve", {"power": 0.75}, ("driver_map",)),
        ("scrub_with_speed", {"gain": 0.5}, ("understeer", "yaw_scrub")),
        ("turn_slip_with_square", {"gain": 0.05}, ("turn_slip",)),
        ("lateral_slip_with_square", {"gain": 0.25}, ("lateral_slip",)),
        ("gradual_slope", {"x": 0.02, "y": 0.02}, ("floor_slope",)),
        ("gaussian_jitter", {"spread": 0.08}, ("delay_jitter",)),
        ("overtaking_jitter", {"spread": 0.2}, ("delay_jitter",)),
        ("dropped_bursts", {"rate": 0.06, "length": 4}, ("dropped_commands",)),
        ("eccentric_wheel", {"ripple": 0.25}, ("wheel_ripple",)),
        ("truncated_commands", {"step": 0.15}, ("command_quantisation",)),
    )
)
"""The same physics in another formula than the catalogue's."""

PAIRS: tuple[Case, ...] = tuple(
    _case(f"{first[0]} and {second[0]}", first, second)
    for first, second in (
        (("dead_band", {"width": 0.08}), ("motor_lag", {"time_constant": 0.35})),
        (("saturation", {"limit": 0.6}), ("marker_offset", {"forward": 0.03})),
        (("wheel_gain", {"left": 0.9, "right": 0.9}), ("lateral_slip", {"gain": 0.08})),
        (("yaw_scrub", {"baseline": 0.19}), ("motor_lag", {"time_constant": 0.08})),
        (("stiction", {"breakaway": 0.15}), ("yaw_scrub", {"baseline": 0.135})),
        (("backlash", {"gap": 0.5}), ("heading_offset", {"degrees": 4.0})),
        (("battery_sag", {"load": 0.25}), ("lateral_slip", {"gain": 0.08})),
        (("floor_slope", {"x": 0.03, "y": 0.0}), ("dead_band", {"width": 0.08})),
        (("turn_slip", {"gain": 0.1}), ("heading_offset", {"degrees": 4.0})),
        (("dropped_commands", {"probability": 0.3}), ("yaw_scrub", {"baseline": 0.19})),
        (("command_quantisation", {"step": 0.25}), ("motor_lag", {"time_constant": 0.35})),
    )
)
"""Two effects that leave different traces."""

OUTSIDE: tuple[Case, ...] = tuple(
    _case(effect, (effect, figures), right=(), depends_on=signal)
    for effect, figures, signal in (
        ("carpet", {"factor": 0.8, "beyond": 0.0}, "position x"),
        ("bent_floor", {"gain": 1.0, "waves": 4.0}, "position x"),
        ("slipping_hub", {"factor": 0.85, "after": 30.0}, "time in log"),
        ("weak_reverse", {"factor": 0.8}, "sign of the wheel command"),
        ("yaw_friction", {"width": 0.25}, "turn rate"),
    )
)
"""Effects that no catalogue has."""

CLEAN: tuple[Case, ...] = tuple(_case(f"clean {n} {noise}", noise=noise) for noise in LEVELS for n in range(20))
"""Nothing is hidden."""
