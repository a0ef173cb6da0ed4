"""Measured logs of a car with a hidden effect: a kinematic bicycle, written without proxytune's own.

The car: throttle and steering → delay → bent commands → first-order motor (0.10 s) and servo (0.10 s) → speed of the
rear axle and angle of the front wheels → pose, in steps of 1/200 s. Speed and angle are fractions of full ones. A
hidden effect is a function of the signal of one stage.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from proxytune.logs import Log, LogEpisode

ROBOT = "car"
ROWS_HZ, PER_ROW = 20, 10
STEPS_HZ = ROWS_HZ * PER_ROW
WHEELBASE, LOCK, FULL_SPEED, LAG_S = 0.33, np.radians(24.0), 3.0, 0.10
WHITE_NOISE = (0.002, 0.002, 0.005)  # of a measured pose [m], [m], [rad]
MOTION_NOISE, TURN_PER_METRE, CORRELATION_S = (0.02, 0.004, 0.02), 0.02, 0.25
LEVELS = {"normal": 1.0, "double": 2.0}

Array = NDArray[np.float64]
Figures = Mapping[str, float]


@dataclass(frozen=True)
class Case:
    """A car that one log is measured of."""

    name: str  # what it is
    effects: tuple[tuple[str, Figures], ...]  # what is hidden: names of functions here with their figures
    noise: str  # key of LEVELS
    seed: int  # seed of the drives and of everything random
    offset: float  # of its steering, as a fraction of full lock
    delay: float  # its delay [s]
    right: tuple[tuple[str, ...], ...] = ()  # for every hidden effect, the catalogue's names that count as right
    depends_on: str = ""  # the signal that an effect outside of any catalogue depends on


class Scene(NamedTuple):
    """What an effect may look at: commands that arrived (E, T, 2) and times (T,) [s]."""

    arrived: Array
    times: Array


def make_log(case: Case, *, episodes: int = 12, seconds: float = 60.0, noiseless: bool = False) -> Log:
    """What would have been measured of this car, 20 rows per second, from rest."""
    rows = round(seconds * ROWS_HZ)
    commands, starts = car_drives(case.seed, episodes, rows)
    level = 0.0 if noiseless else LEVELS[case.noise]
    twists = disturbed(car_twists(case, commands), case, level)
    poses = tracked(_walked(twists, starts, case), case, level)
    times = np.arange(rows) / ROWS_HZ
    drives = tuple(LogEpisode(f"{e:02d}", times, commands[e], poses[e], None) for e in range(episodes))
    return Log(case.name, ROBOT, "ackermann", float(ROWS_HZ), {}, drives)


def car_drives(seed: int, episodes: int, rows: int) -> tuple[Array, Array]:
    """Throttle and steering (episodes, rows, 2), and starts (episodes, 3); the last sixth repeats the first drives."""
    random = np.random.default_rng([seed, 1])
    order = [WAYS[w] for _ in range(2 * episodes) for w in random.permutation(len(WAYS))]
    commands = np.empty((episodes, rows, 2))
    for episode in range(episodes):
        ends = np.linspace(0, rows, int(random.integers(2, 4)) + 1).astype(int)
        for first, last in pairwise(ends):
            commands[episode, first:last] = order.pop()(random, last - first)
    starts = random.uniform((-1.0, -1.0, -np.pi), (1.0, 1.0, np.pi), (episodes, 3))
    again = episodes // 6
    if again:
        commands[-again:], starts[-again:] = commands[:again], starts[:again]
    return np.clip(commands, -1.0, 1.0), starts


def _held(
    random: np.random.Generator, rows: int, shortest_s: float, longest_s: float, low: float, high: float
) -> Array:
    """Values drawn evenly, each held for a time drawn evenly."""
    count = int(rows / (shortest_s * ROWS_HZ)) + 2
    ends = np.cumsum(random.uniform(shortest_s, longest_s, count) * ROWS_HZ)
    held: Array = random.uniform(low, high, count)[np.searchsorted(ends, np.arange(rows), side="right")]
    return held


def _both(throttle: Array, steering: Array) -> Array:
    return np.stack((throttle, steering), axis=-1)


def circling(random: np.random.Generator, rows: int) -> Array:
    """Circles and speeds, each held for some seconds."""
    return _both(_held(random, rows, 2.0, 4.0, 0.15, 0.9), _held(random, rows, 2.0, 4.0, -1.0, 1.0))


def ramping(random: np.random.Generator, rows: int) -> Array:
    """Throttle from nothing to much and back, steering held."""
    phase = np.arange(rows) / ROWS_HZ / random.uniform(5.0, 9.0)
    return _both(random.uniform(0.5, 1.0) * np.abs(2.0 * (phase % 1.0) - 1.0), _held(random, rows, 5.0, 9.0, -0.8, 0.8))


def slalom(random: np.random.Generator, rows: int) -> Array:
    """Steering swings, slower and faster."""
    swing = np.sin(2.0 * np.pi * np.cumsum(_held(random, rows, 3.0, 6.0, 0.15, 1.0)) / ROWS_HZ)
    return _both(_held(random, rows, 3.0, 6.0, 0.2, 0.7), random.uniform(0.3, 1.0) * swing)


def stopping(random: np.random.Generator, rows: int) -> Array:
    """Throttle on and off, some of it in reverse."""
    throttle = _held(random, rows, 0.6, 1.8, -0.6, 1.0)
    return _both(np.where(np.abs(throttle) < 0.25, 0.0, throttle), _held(random, rows, 1.0, 3.0, -0.4, 0.4))


def steering_steps(random: np.random.Generator, rows: int) -> Array:
    """Steering jumps at a steady speed, small and large."""
    jumps = _held(random, rows, 0.4, 1.5, -1.0, 1.0)
    return _both(_held(random, rows, 4.0, 8.0, 0.2, 0.6), jumps * np.abs(jumps))


def by_hand(random: np.random.Generator, rows: int) -> Array:
    """As a driver's thumbs: both smooth."""
    raw = np.stack((_held(random, rows, 0.5, 2.0, 0.0, 0.9), _held(random, rows, 0.5, 2.0, -1.0, 1.0)), axis=-1)
    smooth: Array = lfilter([0.2], [1.0, -0.8], raw, axis=0)
    return smooth


WAYS = (circling, ramping, slalom, stopping, steering_steps, by_hand)


def car_twists(case: Case, commands: Array) -> Array:
    """Forward, sideways [m/s] and turn rate [rad/s] (E, T, 3) of the middle of the rear axle."""
    late = round(case.delay * STEPS_HZ)
    arrived = np.repeat(_through("sent", case, commands, None), PER_ROW, axis=1)
    arrived = np.concatenate((np.zeros_like(arrived[:, :late]), arrived), axis=1)[:, : commands.shape[1] * PER_ROW]
    scene = Scene(arrived, np.arange(arrived.shape[1]) / STEPS_HZ)
    throttle = _through("throttle", case, arrived[..., 0], scene)
    speed = _through("speed", case, _lagged(throttle, _figure(case, "motor", LAG_S)), scene)
    steering = _through("steering", case, arrived[..., 1], scene)
    angle = _lagged(steering, _figure(case, "servo", LAG_S)) + case.offset
    angle = LOCK * _through("angle", case, angle, scene)
    forward = FULL_SPEED * speed * (1.0 - _figure(case, "scrubbing", 0.0) * np.abs(angle) / LOCK)
    twists = np.stack((forward, np.zeros_like(forward), forward * np.tan(angle) / WHEELBASE), axis=-1)
    return _through("twist", case, twists, scene)


def disturbed(twists: Array, case: Case, level: float) -> Array:
    """Twists with noise that grows with motion and remembers itself for a quarter of a second."""
    random, kept = _random(case, "motion"), np.exp(-1.0 / (CORRELATION_S * STEPS_HZ))
    noise = lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], random.standard_normal(twists.shape), axis=1)
    size = np.abs(twists[..., [0, 0, 2]]) * MOTION_NOISE + np.abs(twists[..., :1]) * (0.0, 0.0, TURN_PER_METRE)
    return np.asarray(twists + level * size * noise)


def tracked(poses: Array, case: Case, level: float) -> Array:
    """Poses of the tracker's marker, with white noise."""
    white = _random(case, "poses").standard_normal(poses.shape)
    return _through("marker", case, poses, None) + level * white * WHITE_NOISE


def _walked(twists: Array, starts: Array, case: Case) -> Array:
    """Poses at the rows (E, rows, 3)."""
    pose, rows = starts.copy(), np.empty((*twists.shape[:1], twists.shape[1] // PER_ROW, 3))
    places = [(PLACES[name], figures) for name, figures in case.effects if name in PLACES]
    for step in range(twists.shape[1]):
        if step % PER_ROW == 0:
            rows[:, step // PER_ROW] = pose
        twist = twists[:, step]
        for effect, figures in places:
            twist = effect(twist, pose, **figures)
        heading = pose[:, 2] + twist[:, 2] / STEPS_HZ / 2.0
        along = (twist[:, 0] + 1j * twist[:, 1]) * np.exp(1j * heading) / STEPS_HZ
        pose = pose + np.stack((along.real, along.imag, twist[:, 2] / STEPS_HZ), axis=-1)
    return rows


def _random(case: Case, what: str) -> np.random.Generator:
    return np.random.default_rng([case.seed, crc32(what.encode())])


def _through(stage: str, case: Case, signal: Array, scene: Scene | None) -> Array:
    for name, figures in case.effects:
        if name in STAGES[stage]:
            signal = STAGES[stage][name](signal, scene, **figures)
    return signal


def _figure(case: Case, name: str, plain: float) -> float:
    return dict(case.effects).get(name, {"figure": plain})["figure"]


def _lagged(signal: Array, time_constant: float) -> Array:
    kept = np.exp(-1.0 / (time_constant * STEPS_HZ))
    lagged: Array = lfilter([1.0 - kept], [1.0, -kept], signal, axis=1)
    return lagged


def _shrunk(signal: Array, width: float) -> Array:
    return np.sign(signal) * np.maximum(0.0, np.abs(signal) - width)


def _ramped(signal: Array, rise: float) -> Array:
    """A signal that goes from rest to full in `rise` seconds at best."""
    now, ramped = np.zeros_like(signal[:, 0]), np.empty_like(signal)
    for step in range(signal.shape[1]):
        now = now + np.clip(signal[:, step] - now, -1.0 / (rise * STEPS_HZ), 1.0 / (rise * STEPS_HZ))
        ramped[:, step] = now
    return ramped


def _played(signal: Array, gap: float) -> Array:
    """What is taken along within a gap, from its middle."""
    now, played = np.zeros_like(signal[:, 0]), np.empty_like(signal)
    for step in range(signal.shape[1]):
        now = np.clip(now, signal[:, step] - gap / 2.0, signal[:, step] + gap / 2.0)
        played[:, step] = now
    return played


def _sticking(throttle: Array, breakaway: float) -> Array:
    size, order = np.abs(throttle), np.arange(1, throttle.shape[1] + 1)
    went = np.maximum.accumulate(np.where(size >= breakaway, order, 0), axis=1)
    stopped = np.maximum.accumulate(np.where(size < 0.5 * breakaway, order, 0), axis=1)
    return np.where(went > stopped, throttle, 0.0)


def _bent(angle: Array, left: float, right: float, bend: float) -> Array:
    curve = np.tanh(bend * angle) / np.tanh(bend) if bend else angle
    return np.where(angle > 0.0, left, right) * curve / np.degrees(LOCK)


def _held_back(twist: Array, most: float) -> Array:
    asked = np.maximum(1e-9, np.abs(twist[..., 0] * twist[..., 2]))
    return twist * np.stack((np.ones_like(asked), np.ones_like(asked), most * np.tanh(asked / most) / asked), axis=-1)


def _slid(twist: Array, slip: float) -> Array:
    side = slip * np.abs(twist[..., 0]) * twist[..., 0] * twist[..., 2]
    return twist - np.stack((np.zeros_like(side), side, np.zeros_like(side)), axis=-1)


def _marked(poses: Array, ahead: float, left: float) -> Array:
    shift = (ahead + 1j * left) * np.exp(1j * poses[..., 2])
    return poses + np.stack((shift.real, shift.imag, np.zeros_like(shift.real)), axis=-1)


def _load(scene: Scene) -> Array:
    return np.abs(scene.arrived[..., 0])


STAGES: Mapping[str, Mapping[str, Callable[..., Array]]] = {
    "sent": {
        "throttle_steps": lambda u, s, step: np.stack((step * np.round(u[..., 0] / step), u[..., 1]), axis=-1),
        "steering_steps": lambda u, s, step: np.stack((u[..., 0], step * np.round(u[..., 1] / step)), axis=-1),
    },
    "throttle": {
        "dead_band": lambda u, s, width: _shrunk(u, width),
        "saturation": lambda u, s, limit: np.clip(u, -limit, limit),
        "stiction": lambda u, s, breakaway: _sticking(u, breakaway),
        "slew_rate": lambda u, s, rise: _ramped(u, rise),
        "gain": lambda u, s, factor: factor * u,
        "sag": lambda u, s, load: u * (1.0 - load * _load(s)),
        "fade": lambda u, s, rate: u * np.exp(-rate * np.cumsum(_load(s), axis=1) / STEPS_HZ / 60.0),
        "dead_zone_that_jumps": lambda u, s, width: np.where(np.abs(u) > width, u, 0.0),
        "smooth_saturation": lambda u, s, limit: limit * np.tanh(u / limit),
        "loose_plug": lambda u, s, factor, after: np.where(s.times > after, factor * u, u),
        "weak_reverse": lambda u, s, factor: np.where(u < 0.0, factor * u, u),
    },
    "speed": {"second_lag": lambda v, s, time_constant: _lagged(v, time_constant)},
    "steering": {
        "steering_dead_band": lambda u, s, width: _shrunk(u, width),
        "steering_saturation": lambda u, s, limit: np.clip(u, -limit, limit),
        "steering_slew_rate": lambda u, s, rise: _ramped(u, rise),
    },
    "angle": {
        "steering_gain": lambda a, s, factor: factor * a,
        "steering_curve": lambda a, s, left, right, bend=0.0: _bent(a, left, right, bend),
        "steering_backlash": lambda a, s, gap: _played(a, gap),
        "steering_that_tires": lambda a, s, rate: a * np.exp(-rate * s.times / 60.0),
        "cubic_steering": lambda a, s, bend: a - bend * a**3,
    },
    "twist": {
        "understeer": lambda m, s, gain: m / (1.0 + (0.0, 0.0, gain) * m[..., :1] ** 2),
        "grip": lambda m, s, most: _held_back(m, most),
        "rear_slip": lambda m, s, slip: _slid(m, slip),
        "yaw_lag": lambda m, s, time_constant: np.concatenate(
            (m[..., :2], _lagged(m[..., 2:], time_constant)), axis=-1
        ),
        "turn_slip": lambda m, s, gain: m * (1.0 - (gain, 0.0, 0.0) * np.abs(m[..., 2:])),
    },
    "marker": {
        "marker_offset": lambda p, s, ahead=0.0, left=0.0: _marked(p, ahead, left),
        "heading_offset": lambda p, s, degrees: p + (0.0, 0.0, np.radians(degrees)),
    },
}

PLACES: Mapping[str, Callable[..., Array]] = {
    "carpet": lambda m, p, factor, beyond: m * np.where(p[:, :1] > beyond, factor, 1.0),
    "bent_floor": lambda m, p, gain, waves: m + (0.0, 0.0, gain) * (m[:, :1] * np.sin(waves * p[:, :1])),
}


def car_case(kind: type[Any], name: str, *effects: tuple[str, Figures], noise: str = "normal", **more: Any) -> Any:
    """A case whose seed, steering offset and delay follow from its name."""
    seed = crc32(name.encode())
    offset, delay = np.random.default_rng(seed).uniform((-0.1, 0.08), (0.1, 0.2))
    return kind(name, effects, noise, seed, float(offset), round(float(delay) * STEPS_HZ) / STEPS_HZ, **more)


def _sized(known: str, effect: str, figure: str, *sizes: float, **fixed: float) -> tuple[Case, ...]:
    names = tuple(known.split())
    return tuple(
        car_case(Case, f"car {effect} {figure} {size:g}", (effect, {figure: size, **fixed}), right=(names,))
        for size in sizes
    )


IN_FORM: tuple[Case, ...] = (
    *_sized("dead_band", "dead_band", "width", 0.05, 0.12),
    *_sized("saturation", "saturation", "limit", 0.7, 0.5),
    *_sized("stiction", "stiction", "breakaway", 0.15, 0.25),
    *_sized("slew_rate", "slew_rate", "rise", 0.4, 1.2),
    *_sized("wheel_gain", "gain", "factor", 0.9, 1.15),
    *_sized("battery_sag", "sag", "load", 0.15, 0.3),
    *_sized("battery_sag", "fade", "rate", 0.15, 0.4),
    *_sized("motor_lag rolling", "motor", "figure", 0.2, 0.4),
    *_sized("steering_lag", "servo", "figure", 0.2, 0.35),
    *_sized("steering_friction", "scrubbing", "figure", 0.15, 0.35),
    *_sized("command_quantisation", "throttle_steps", "step", 0.2),
    *_sized("steering_quantisation", "steering_steps", "step", 0.25),
    *_sized("steering_dead_band", "steering_dead_band", "width", 0.06, 0.15),
    *_sized("steering_saturation", "steering_saturation", "limit", 0.75, 0.5),
    *_sized("steering_slew_rate", "steering_slew_rate", "rise", 0.3, 0.7),
    *_sized("steering_gain steering_curve", "steering_gain", "factor", 0.85, 1.15),
    *_sized("steering_curve", "steering_curve", "left", 20.0, 28.0, right=24.0),
    *_sized("steering_curve", "steering_curve", "bend", 1.2, left=22.0, right=26.0),
    *_sized("steering_backlash", "steering_backlash", "gap", 0.1, 0.25),
    *_sized("tyres", "understeer", "gain", 0.03, 0.1),
    *_sized("tyres", "grip", "most", 5.0, 2.5),
    *_sized("tyres", "rear_slip", "slip", 0.02, 0.06),
    *_sized("yaw_lag", "yaw_lag", "time_constant", 0.1, 0.25),
    *_sized("turn_slip steering_friction", "turn_slip", "gain", 0.05, 0.12),
    *_sized("marker_offset", "marker_offset", "ahead", 0.04, 0.12),
    *_sized("marker_offset", "marker_offset", "left", 0.03),
    *_sized("heading_offset", "heading_offset", "degrees", 2.0, -5.0),
)
"""Effects of the catalogue's own form, small to large."""

OTHER_FORM: tuple[Case, ...] = tuple(
    car_case(Case, f"car {effect}", (effect, figures), right=(right,))
    for effect, figures, right in (
        ("dead_zone_that_jumps", {"width": 0.15}, ("dead_band", "stiction")),
        ("smooth_saturation", {"limit": 0.8}, ("saturation", "battery_sag")),
        ("second_lag", {"time_constant": 0.2}, ("motor_lag", "rolling")),
        ("cubic_steering", {"bend": 0.25}, ("steering_curve", "steering_saturation")),
    )
)
"""The same physics in another formula than the catalogue's."""

PAIRS: tuple[Case, ...] = tuple(
    car_case(Case, f"car {first[0]} and {second[0]}", first, second, right=right)
    for first, second, right in (
        (("dead_band", {"width": 0.1}), ("servo", {"figure": 0.3}), (("dead_band",), ("steering_lag",))),
        (("motor", {"figure": 0.4}), ("understeer", {"gain": 0.08}), (("motor_lag", "rolling"), ("tyres",))),
        (("marker_offset", {"ahead": 0.12}), ("dead_band", {"width": 0.1}), (("marker_offset",), ("dead_band",))),
        (("scrubbing", {"figure": 0.3}), ("steering_backlash", {"gap": 0.2}),
         (("steering_friction", "turn_slip"), ("steering_backlash",))),
    )
)  # fmt: skip
"""Two effects that leave different traces."""

OUTSIDE: tuple[Case, ...] = tuple(
    car_case(Case, f"car {effect}", (effect, figures), depends_on=signal)
    for effect, figures, signal in (
        ("carpet", {"factor": 0.8, "beyond": 0.0}, "position x"),
        ("bent_floor", {"gain": 0.5, "waves": 2.0}, "position x"),
        ("loose_plug", {"factor": 0.8, "after": 30.0}, "time in log"),
        ("weak_reverse", {"factor": 0.7}, "sign of the throttle"),
        ("steering_that_tires", {"rate": 0.5}, "time in log"),
    )
)
"""Effects that no catalogue has."""

CLEAN: tuple[Case, ...] = tuple(
    car_case(Case, f"clean car {n} {noise}", noise=noise) for noise in LEVELS for n in range(6)
)
"""Nothing is hidden."""
