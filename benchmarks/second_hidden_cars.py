"""Measured logs of a car with a hidden effect, on tyres that carry load: nothing of it is shared with hidden_cars.py.

The car: wanted speed and wheel angle → delay → servo (0.10 s) and speed loop (0.10 s) → a car of one track whose axles
share load, more of it behind when it speeds up. Each axle's slip angle is what its tyres need for their share of the
lateral force; where tyres are stiff the car goes where its wheels point. Steps of 2.5 ms by Euler's rule. Driving makes
the pose walk at random; measured poses have heavy-tailed noise.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from proxytune.logs import Log, LogEpisode

ROBOT = "car"
ROW_S, STEPS = 0.05, 20
STEP_S = ROW_S / STEPS
FULL_SPEED, FULL_ANGLE, AXLES_APART = 3.0, np.radians(24.0), 0.33
TO_REAR, TO_FRONT, HEIGHT = 0.17, 0.16, 0.07
"""From the centre of mass to the axles, and its height [m]."""
GRAVITY, STIFF, SERVO_S, SPEED_LOOP_S = 9.81, 1e6, 0.10, 0.10
POSE_NOISE = (0.002, 0.002, 0.004)
WALK = (0.006, 0.001, 0.012)
"""How far a pose has walked at random after a metre: forward, sideways [m], round [rad]."""

Array = NDArray[np.float64]
Figures = Mapping[str, float]

PLAIN: Figures = {
    "dead_band": 0.0, "drop": 0.0, "step": 0.0, "ceiling": 9.0, "factor": 1.0, "fade": 0.0, "sag": 0.0, "lag": 0.0,
    "inertia": 0.0, "friction": 0.0, "servo": SERVO_S, "servo_rate": 1e9, "play": 0.0, "steering_band": 0.0,
    "steering_step": 0.0, "stop": 9.0, "left_side": 1.0, "right_side": 1.0, "scrub": 0.0, "front": STIFF, "rear": STIFF,
    "grip": 1e3, "transfer": 0.0, "yaw_s": 0.0, "ahead": 0.0, "aside": 0.0, "skew": 0.0, "slope": 0.0, "wall": 9e9,
    "one_way": 1.0,
}  # fmt: skip
"""Every figure that a case may change, as it changes nothing; what steers is in shares of full lock."""


@dataclass(frozen=True)
class Case:
    """A car that one log is measured of."""

    name: str  # what it is
    changed: tuple[tuple[str, float], ...]  # figures of PLAIN that are others
    noise: str  # its size: "normal" or "small"
    seed: int  # of the drives and of everything random
    offset: float  # of its steering, as a share of full lock
    delay: float  # its delay [s]
    right: tuple[tuple[str, ...], ...] = ()  # for every hidden effect, the catalogue's names that count as right
    depends_on: str = ""  # what an effect outside of the catalogue depends on

    @property
    def figures(self) -> Figures:
        """All figures."""
        return {**PLAIN, **dict(self.changed)}


def make_log(case: Case, *, episodes: int = 12, seconds: float = 60.0, noiseless: bool = False) -> Log:
    """What would have been measured of this car, 20 rows per second, from rest: wanted speeds and wheel angles."""
    rows = round(seconds / ROW_S)
    random = np.random.default_rng([case.seed, crc32(b"drives")])
    wanted = np.stack([_drive(random, rows) for _ in range(episodes)])
    starts = random.normal(0.0, 1.0, (episodes, 3))
    for again in range(max(1, episodes // 6) if episodes > 1 else 0):
        wanted[again - 2], starts[again - 2] = wanted[again], starts[again]
    level = 0.0 if noiseless else {"normal": 1.0, "small": 0.5}[case.noise]
    poses = _measured(case, _driven(case, wanted, starts, level), level)
    times = np.arange(rows) * ROW_S
    asked = wanted * (FULL_SPEED, FULL_ANGLE)
    drives = tuple(LogEpisode(f"run {e + 1}", times, asked[e], poses[e], None) for e in range(episodes))
    return Log(case.name, ROBOT, "speed_steering", 1.0 / ROW_S, {}, drives)


def _drive(random: np.random.Generator, rows: int) -> Array:
    """Shares of full speed and full lock (rows, 2): bursts, stairs, bends and weaving, some seconds of each."""
    out, row = np.empty((rows, 2)), 0
    while row < rows:
        length = min(int(random.uniform(5.0, 10.0) / ROW_S), rows - row)
        time = np.arange(length) * ROW_S
        kind = random.integers(5)
        base, sign = random.uniform(0.25, 0.75), random.choice((-1.0, 1.0))
        if kind == 0:  # bursts from rest, nearly straight
            on = np.sin(2.0 * np.pi * time / random.uniform(1.5, 3.5)) > random.uniform(-0.5, 0.3)
            piece = np.stack((on * random.uniform(0.3, 1.0), random.uniform(-0.2, 0.2) + 0.0 * time), axis=-1)
        elif kind == 1:  # stairs of speed in one bend
            stairs = np.floor(time / random.uniform(0.8, 1.5)) % 7
            piece = np.stack((0.1 + 0.13 * stairs, sign * random.uniform(0.2, 1.0) + 0.0 * time), axis=-1)
        elif kind == 2:  # steering swept ever faster
            phase = 2.0 * np.pi * (0.15 * time + 0.06 * time**2)
            piece = np.stack((base + 0.0 * time, random.uniform(0.2, 0.9) * np.sin(phase)), axis=-1)
        elif kind == 3:  # bends of random length, the speed wandering
            bends = random.uniform(-1.0, 1.0, 30)[(time / random.uniform(0.5, 1.2)).astype(int)]
            wander = np.clip(base + np.cumsum(random.normal(0.0, 0.03, length)), 0.1, 1.0)
            piece = np.stack((wander, bends), axis=-1)
        else:  # back and forth
            way = np.sign(np.sin(2.0 * np.pi * time / random.uniform(2.5, 5.0)))
            piece = np.stack((way * base, sign * random.uniform(0.0, 0.7) * np.cos(time)), axis=-1)
        out[row : row + length], row = piece, row + length
    return np.clip(out, -1.0, 1.0)


def _banded(signal: Array, width: float) -> Array:
    return signal - np.clip(signal, -width, width)


def _commands(case: Case, wanted: Array) -> Array:
    """Shares as they arrive at each step (E, T, 2)."""
    f = case.figures
    sent = wanted.copy()
    for column, step in enumerate((f["step"], f["steering_step"])):
        if step:
            sent[..., column] = step * np.rint(sent[..., column] / step)
    if f["drop"]:
        random = np.random.default_rng([case.seed, crc32(b"radio")])
        for row in range(1, sent.shape[1]):
            lost = random.random(len(sent)) < f["drop"]
            sent[lost, row] = sent[lost, row - 1]
    late = np.maximum(-1, ((np.arange(sent.shape[1] * STEPS) * STEP_S - case.delay + 1e-9) // ROW_S).astype(int))
    return np.where(late[:, None] < 0, 0.0, sent[:, late])


def _driven(case: Case, wanted: Array, starts: Array, level: float) -> Array:
    """Poses of the middle of the rear axle at the rows (E, rows, 3)."""
    f, random = case.figures, np.random.default_rng([case.seed, crc32(b"walk")])
    arrived = _commands(case, wanted)
    count, steps = arrived.shape[:2]
    pose, rows = starts.copy(), np.empty((count, steps // STEPS, 3))
    loop, speed, servo, wheels, turn, work, pull = (np.zeros(count) for _ in range(7))
    for step in range(steps):
        if step % STEPS == 0:
            rows[:, step // STEPS] = pose
        wish, bend = arrived[:, step].T
        throttle = np.clip(_banded(wish, f["dead_band"]), -f["ceiling"], f["ceiling"]) * f["factor"]
        work = work + np.abs(wish) * STEP_S / 60.0
        throttle = throttle * np.exp(-f["fade"] * work) * (1.0 - f["sag"] * np.abs(wish))
        throttle = np.where(throttle < 0.0, f["one_way"] * throttle, throttle)
        bend = np.clip(_banded(bend, f["steering_band"]), -f["stop"], f["stop"])
        servo = servo + np.clip(
            (bend - servo) * (1.0 - np.exp(-STEP_S / f["servo"])), -f["servo_rate"] * STEP_S, f["servo_rate"] * STEP_S
        )
        wheels = np.clip(wheels, servo - f["play"] / 2.0, servo + f["play"] / 2.0)
        angle = FULL_ANGLE * (wheels + case.offset)
        angle = angle * np.where(angle > 0.0, f["left_side"], f["right_side"])
        before = speed
        loop = loop + (throttle - loop) * (1.0 - np.exp(-STEP_S / (SPEED_LOOP_S + f["lag"])))
        goal = loop * FULL_SPEED * (1.0 - f["scrub"] * np.abs(angle) / FULL_ANGLE)
        if f["inertia"]:
            held = np.minimum(np.abs(speed) / STEP_S, f["friction"])
            speed = speed + STEP_S * ((goal - speed) / f["inertia"] - np.sign(speed) * held)
        else:
            speed = goal
        pull = pull + ((speed - before) / STEP_S - pull) * 0.1
        turn = turn + (_bend_rate(f, speed, angle, pull, turn) - turn) * (1.0 - np.exp(-STEP_S / max(1e-9, f["yaw_s"])))
        lateral = speed * turn
        outwards = -np.abs(speed) * _slip(lateral * TO_FRONT / AXLES_APART, f["rear"], f["grip"], 1.0)
        along = speed - f["slope"] * np.sin(pose[:, 0]) * np.abs(speed)
        along = np.where(pose[:, 0] > f["wall"], 0.8 * along, along)
        walked = np.abs(along)[:, None] * STEP_S
        noise = level * random.standard_normal((count, 3)) * WALK * np.sqrt(walked)
        ahead, left, round_ = (np.stack((along, outwards, turn), axis=-1) * STEP_S + noise).T
        middle = pose[:, 2] + round_ / 2.0
        pose = pose + np.stack(
            (ahead * np.cos(middle) - left * np.sin(middle), ahead * np.sin(middle) + left * np.cos(middle), round_),
            axis=-1,
        )
    return rows


def _slip(share: Array, stiffness: float, grip: float, load: Array | float) -> Array:
    """Slip angle that tyres need for a share of the lateral acceleration [m/s²]: the more, the nearer to their grip."""
    limit = grip * np.maximum(0.2, load)
    used = np.clip(share / limit, -0.98, 0.98)
    return limit / (stiffness * np.maximum(0.2, load)) * np.arctanh(used)


def _bend_rate(f: Figures, speed: Array, angle: Array, pull: Array, turn: Array) -> Array:
    """Turn rate [rad/s] that a wheel angle leads to, the axles slipping for the bend driven now."""
    shift = f["transfer"] * HEIGHT * pull / (GRAVITY * AXLES_APART)
    wanted = speed * np.tan(angle) / AXLES_APART
    low, high = np.minimum(0.0, wanted), np.maximum(0.0, wanted)
    for _ in range(24 if f["front"] < STIFF or f["rear"] < STIFF else 0):
        rate = (low + high) / 2.0
        front = _slip(speed * rate * TO_REAR / AXLES_APART, f["front"], f["grip"], 1.0 - shift)
        rear = _slip(speed * rate * TO_FRONT / AXLES_APART, f["rear"], f["grip"], 1.0 + shift)
        less = speed * np.tan(angle - front * np.sign(speed) + rear * np.sign(speed)) / AXLES_APART > rate
        low, high = np.where(less, rate, low), np.where(less, high, rate)
    return (low + high) / 2.0 if f["front"] < STIFF or f["rear"] < STIFF else wanted


def _measured(case: Case, poses: Array, level: float) -> Array:
    """Poses of the marker, with heavy-tailed noise."""
    f, random = case.figures, np.random.default_rng([case.seed, crc32(b"tracker")])
    cosine, sine = np.cos(poses[..., 2]), np.sin(poses[..., 2])
    seen = poses + np.stack(
        (
            f["ahead"] * cosine - f["aside"] * sine,
            f["ahead"] * sine + f["aside"] * cosine,
            0 * cosine + np.radians(f["skew"]),
        ),
        axis=-1,
    )
    return seen + level * random.standard_t(4, poses.shape) / np.sqrt(2.0) * POSE_NOISE


def _case(name: str, right: str = "", noise: str = "normal", depends_on: str = "", **changed: float) -> Case:
    """A case whose seed, offset and delay follow from its name; hidden effects apart by +, rivals by spaces."""
    seed = crc32(name.encode())
    offset, delay = np.random.default_rng(seed).uniform((-0.1, 0.08), (0.1, 0.2))
    names = tuple(tuple(one.split()) for one in right.split("+")) if right else ()
    return Case(name, tuple(changed.items()), noise, seed, float(offset), round(float(delay), 3), names, depends_on)


def _sized(right: str, figure: str, *sizes: float, **fixed: float) -> tuple[Case, ...]:
    return tuple(_case(f"second car {figure} {size:g}", right, **{figure: size}, **fixed) for size in sizes)


IN_FORM: tuple[Case, ...] = (
    *_sized("dead_band", "dead_band", 0.08, 0.15),
    *_sized("dropped_commands", "drop", 0.3),
    *_sized("command_quantisation", "step", 0.23),
    *_sized("saturation", "ceiling", 0.6),
    *_sized("wheel_gain", "factor", 0.85),
    *_sized("battery_sag", "fade", 0.3),
    *_sized("battery_sag", "sag", 0.2),
    *_sized("motor_lag rolling", "lag", 0.15, 0.3),
    *_sized("rolling", "inertia", 0.5, friction=0.5),
    *_sized("steering_lag", "servo", 0.2, 0.3),
    *_sized("steering_slew_rate", "servo_rate", 3.0, servo=0.10),
    *_sized("steering_backlash", "play", 0.15, 0.3),
    *_sized("steering_dead_band", "steering_band", 0.1),
    *_sized("steering_quantisation", "steering_step", 0.3),
    *_sized("steering_saturation", "stop", 0.6),
    *_sized("steering_curve", "left_side", 0.8, 1.2),
    *_sized("steering_friction turn_slip", "scrub", 0.2, 0.4),
    *_sized("yaw_lag", "yaw_s", 0.15),
    *_sized("marker_offset", "ahead", 0.05, 0.15),
    *_sized("marker_offset", "aside", 0.04),
    *_sized("heading_offset", "skew", 3.0),
)
"""Effects of the catalogue's own form."""

OTHER_FORM: tuple[Case, ...] = (
    *_sized("tyres", "front", 60.0, 120.0),
    *_sized("tyres", "grip", 5.0, front=60.0, rear=80.0, transfer=1.0),
    *_sized("tyres", "rear", 60.0, front=60.0, transfer=1.0),
)
"""Tyres by another formula than the catalogue's, on which load shifts."""

PAIRS: tuple[Case, ...] = (
    _case("second car band and tyres", "dead_band+tyres", dead_band=0.1, front=60.0),
    _case("second car lag and marker", "motor_lag rolling+marker_offset", lag=0.25, ahead=0.1),
    _case("second car servo and fade", "steering_lag+battery_sag", servo=0.3, fade=0.3),
)
"""Two effects that leave different traces."""

OUTSIDE: tuple[Case, ...] = (
    _case("second car wavy floor", depends_on="position x", slope=0.3),
    _case("second car wall", depends_on="position x", wall=0.0),
    _case("second car weak reverse", depends_on="sign of the throttle", one_way=0.7),
)
"""Effects that no catalogue has."""

CLEAN: tuple[Case, ...] = tuple(
    _case(f"second clean car {n} {noise}", noise=noise) for noise in ("normal", "small") for n in range(5)
)
"""Nothing is hidden."""
