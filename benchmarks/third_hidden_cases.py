"""Measured logs of robots stepped as masses, torques and tyres: the third generator. Nothing in it is an effect.

A body on two driven wheels and a castor; each wheel has a motor with back electromotive force on a battery, a gear and
a tyre that slips. The plain robot has what the model of a Duckiebot says: it answers to a duty with a lag of 0.2 s,
forwards and in turns alike. Every other one has figures of its own (`CHANGES`), alone or several at once; names that
fit them may or may not exist. What a diagnosis must never do is to call such a log explained where it is not.

Commands are the second generator's. Poses have white noise and walk at random with the way; a tracker may filter them,
and its clock may run at a rate of its own.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from zlib import crc32

import numpy as np
from numba import njit
from numpy.typing import NDArray
from second_hidden_cases import Course, log_of, plan

from proxytune.logs import Log

Array = NDArray[np.float64]
ROW_S, STEP_S = 0.05, 0.0001
FULL_SPEED, BASELINE, RADIUS, LAG_S = 0.6, 0.16, 0.0318, 0.2
GRAVITY = 9.81
LIMIT = 1.2
"""No motor gets more voltage, in units of what a duty of 1 asks for: with its trim the plain robot stays below."""
POSE_NOISE, PER_METRE, PER_RADIAN = (0.002, 0.002, 0.005), (0.006, 0.002, 0.02), (0.001, 0.001, 0.015)
"""Standard deviation of a pose [m], [m], [rad]; how far it has walked at random after a metre and after a radian."""

PLAIN: Mapping[str, float] = {
    "mass": 1.0,  # [kg]
    "yaw_inertia": 1.0,  # of what answers in turns as it does forwards
    "wheel_mass": 0.1,  # inertia of wheel, gear and motor over the radius squared [kg]
    "grip": 1.2,  # of a tyre: greatest force by load
    "slip_speed": 0.005,  # slip at which a tyre has three quarters of it [m/s]
    "drag": 0.0,  # of the body [N s/m]
    "turn_drag": 0.0,  # [N m s]
    "gear_friction": 0.0,  # at the rim [N]
    "gear_stiction": 0.0,  # beyond friction, from rest [N]
    "weak_motor": 0.0,  # the left motor's constant is smaller by this share
    "battery_ohm": 0.0,  # as a share of a motor's resistance
    "battery_fade": 0.0,  # share of the voltage lost in a minute
    "castor_friction": 0.0,  # against swivelling, at its wheel [N]
    "castor_rolling": 0.0,  # [N]
    "integral": 0.0,  # a speed loop's gain on the error's integral [1/s]; 0 for no loop
    "centre": 0.0,  # of mass ahead of the axle [m]
    "clock_rate": 0.0,  # the tracker's clock runs so much fast [s/s]
    "filter": 0.0,  # the tracker's second-order filter: time constant [s]
}
FIGURES = tuple(PLAIN)
CASTOR_M, TRAIL_M = -0.07, 0.02
"""The castor's pivot ahead of the axle, and from there to its contact."""


@dataclass(frozen=True)
class Case:
    """A robot that one log is measured of: what differs from PLAIN, its trim and delay [s], and a seed."""

    name: str
    changes: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0
    trim: float = 0.0
    delay: float = 0.15
    depends_on: str = ""


def make_log(case: Case, *, episodes: int = 12, seconds: float = 60.0, noiseless: bool = False) -> Log:
    """What would have been measured of this robot, 20 rows per second, from rest."""
    course = plan(case.seed, episodes, round(seconds / ROW_S))
    poses = seen(case, driven(case, course), course)
    if not noiseless:
        random = np.random.default_rng([case.seed, 1])
        poses = _walked(poses, random) + random.standard_normal(poses.shape) * POSE_NOISE
    return log_of(case.name, course, poses)


def driven(case: Case, course: Course) -> Array:
    """Poses (E, rows, 3) of the middle of the axle."""
    figures = {**PLAIN, **case.changes}
    return _drive(
        course.duties, course.starts, case.trim, round(case.delay / STEP_S), np.array([figures[k] for k in FIGURES])
    )


def seen(case: Case, poses: Array, course: Course) -> Array:
    """The same as the tracker's clock and filter show them."""
    figures = {**PLAIN, **case.changes}
    constant, rate = figures["filter"], figures["clock_rate"]
    if constant > 0.0:
        kept = np.exp(-ROW_S / constant)
        poses = poses.copy()
        for _ in range(2):
            for row in range(1, poses.shape[1]):
                poses[:, row] = kept * poses[:, row - 1] + (1.0 - kept) * poses[:, row]
    if rate != 0.0:
        times = np.arange(poses.shape[1]) * ROW_S
        late = times * (1.0 - rate)
        poses = np.stack([np.stack([np.interp(late, times, column) for column in one.T], axis=-1) for one in poses])
    return poses


def _walked(poses: Array, random: np.random.Generator) -> Array:
    """Poses that walk away at random, in the body's frame, with the way and the turn of each row."""
    steps = np.diff(poses, axis=1)
    way, turn = np.hypot(steps[..., :1], steps[..., 1:2]), np.abs(steps[..., 2:])
    size = np.sqrt(way * np.square(PER_METRE) + turn * np.square(PER_RADIAN))
    error = size * random.standard_normal(steps.shape)
    cosine, sine = np.cos(poses[:, :-1, 2]), np.sin(poses[:, :-1, 2])
    ahead, left = cosine * steps[..., 0] + sine * steps[..., 1], cosine * steps[..., 1] - sine * steps[..., 0]
    heading = poses[:, :1, 2] + np.cumsum(steps[..., 2] + error[..., 2], axis=1)
    before = np.concatenate((poses[:, :1, 2], heading[:, :-1]), axis=1)
    moved = (ahead + error[..., 0] + 1j * (left + error[..., 1])) * np.exp(1j * before)
    place = poses[:, :1, 0] + 1j * poses[:, :1, 1] + np.cumsum(moved, axis=1)
    return np.concatenate((poses[:, :1], np.stack((place.real, place.imag, heading), axis=-1)), axis=1)


@njit(cache=True)
def _drive(duties, starts, trim, late, figures):  # type: ignore[no-untyped-def]
    """Step every drive by the semi-implicit rule of Euler; `late` are the steps by which commands come late."""
    (mass, yaw_inertia, wheel_mass, grip, slip_speed, drag, turn_drag, friction, stiction, weak, ohm, fade) = figures[
        :12
    ]
    swivel, rolling, integral, centre = figures[12:16]
    half = BASELINE / 2.0
    inertia = yaw_inertia * mass * half**2 + (yaw_inertia - 1.0) * 2.0 * wheel_mass * half**2
    # At the rim: force = stall · (share of the voltage − speed / FULL_SPEED): a plain robot lags by LAG_S.
    stall = (0.5 + 0.1) * FULL_SPEED / LAG_S
    load, light = 0.4 * mass * GRAVITY, 0.2 * mass * GRAVITY
    episodes, rows = duties.shape[:2]
    per_row = round(ROW_S / STEP_S)
    poses = np.empty((episodes, rows, 3))
    for episode in range(episodes):
        x, y, heading = starts[episode]
        u = s = w = castor = 0.0
        rim, summed, drawn = np.zeros(2), np.zeros(2), np.zeros(2)
        for step in range(rows * per_row):
            if step % per_row == 0:
                poses[episode, step // per_row] = x, y, heading
            at = step - late
            there = (1.0 - fade * step * STEP_S / 60.0) * (1.0 - ohm * (drawn[0] + drawn[1]))
            push = np.zeros(2)
            aside = 0.0
            for wheel in range(2):
                side = -1.0 if wheel == 0 else 1.0
                asked = duties[episode, at // per_row, wheel] * (1.0 + side * trim) if at >= 0 else 0.0
                share = asked
                if integral > 0.0:
                    wrong = asked - rim[wheel] / FULL_SPEED
                    summed[wheel] = min(max(summed[wheel] + integral * wrong * STEP_S, -1.5), 1.5)
                    share = wrong + summed[wheel]
                share = min(max(share, -LIMIT), LIMIT)
                strength = 1.0 - weak if wheel == 0 else 1.0
                current = share * there - strength * rim[wheel] / FULL_SPEED
                drawn[wheel] = current * share
                torque = stall * strength * current
                speed = abs(rim[wheel])
                held = (friction + stiction * np.exp(-((speed / 0.02) ** 2))) * np.tanh(rim[wheel] / 0.004)
                ground = u + side * half * w
                along, across = rim[wheel] - ground, -s
                slip = np.sqrt(along**2 + across**2)
                force = grip * load * np.tanh(slip / slip_speed) / max(slip, 1e-9)
                push[wheel] = force * along
                aside += force * across
                rim[wheel] += STEP_S * (torque - held - push[wheel]) / wheel_mass
            # The castor's wheel trails behind its pivot, and turns over where the robot reverses.
            ahead, left = u, s + w * CASTOR_M
            turning = -(ahead * np.sin(castor) - left * np.cos(castor)) / TRAIL_M - w
            castor += STEP_S * turning
            drawn_aside = -swivel * light * np.tanh(turning / 0.5)
            drawn_back = -rolling * np.tanh((ahead * np.cos(castor) + left * np.sin(castor)) / 0.02)
            castor_x = drawn_back * np.cos(castor) - drawn_aside * np.sin(castor)
            castor_y = drawn_back * np.sin(castor) + drawn_aside * np.cos(castor)
            forward = push[0] + push[1] + castor_x - drag * u
            sideways = aside + castor_y
            moment = half * (push[1] - push[0]) + CASTOR_M * castor_y - turn_drag * w
            # About the middle of the axle, with the centre of mass ahead of it.
            du = forward / mass + s * w + centre * w**2
            dw = (moment - centre * sideways) / inertia
            ds = sideways / mass - u * w - centre * dw
            u, s, w = u + STEP_S * du, s + STEP_S * ds, w + STEP_S * dw
            heading += STEP_S * w
            x += STEP_S * (u * np.cos(heading) - s * np.sin(heading))
            y += STEP_S * (u * np.sin(heading) + s * np.cos(heading))
    return poses


CHANGES: Mapping[str, tuple[Mapping[str, float], Mapping[str, float]]] = {
    "heavy": ({"mass": 1.6}, {"mass": 2.5}),
    "inert in turns": ({"yaw_inertia": 1.8}, {"yaw_inertia": 3.0}),
    "smooth floor": ({"grip": 0.25}, {"grip": 0.15}),
    "soft tyres": ({"slip_speed": 0.05}, {"slip_speed": 0.15}),
    "drag": ({"drag": 1.0}, {"drag": 3.0, "turn_drag": 0.01}),
    "turns in treacle": ({"turn_drag": 0.006}, {"turn_drag": 0.02}),
    "gear friction": ({"gear_friction": 0.12}, {"gear_friction": 0.15, "gear_stiction": 0.2}),
    "weak motor": ({"weak_motor": 0.1}, {"weak_motor": 0.25}),
    "tired battery": ({"battery_ohm": 0.15}, {"battery_ohm": 0.3, "battery_fade": 0.15}),
    "stiff castor": ({"castor_friction": 0.15}, {"castor_friction": 0.3, "castor_rolling": 0.2}),
    "speed loop": ({"integral": 4.0}, {"integral": 12.0}),
    "nose heavy": ({"centre": 0.03}, {"centre": 0.05}),
    "clock": ({"clock_rate": 0.002}, {"clock_rate": -0.004}),
    "filtered poses": ({"filter": 0.04}, {"filter": 0.08}),
}
"""What a robot may have, in a small and a large measure: figures that differ from PLAIN."""


def _case(name: str, changes: Mapping[str, float]) -> Case:
    random = np.random.default_rng(crc32(name.encode()))
    trim, delay = float(random.uniform(-0.08, 0.08)), float(random.uniform(0.08, 0.2))
    return Case(name, changes, int(random.integers(2**31)), trim, delay)


def _several(number: int) -> Case:
    """Three of CHANGES at once."""
    random = np.random.default_rng([3, number])
    chosen = sorted(random.choice(len(CHANGES), 3, replace=False).tolist())
    names = [list(CHANGES)[place] for place in chosen]
    changes: dict[str, float] = {}
    for name in names:
        changes |= CHANGES[name][int(random.integers(2))]
    return _case(f"third {number}: {', '.join(names)}", changes)


IN_FORM = OTHER_FORM = PAIRS = OUTSIDE = ()
CLEAN = tuple(_case(f"third clean {n}", {}) for n in range(6))
PHYSICS = (
    *(
        _case(f"third {name} {size}", both[n])
        for name, both in CHANGES.items()
        for n, size in enumerate(("small", "large"))
    ),
    *(_several(number) for number in range(14)),
)
"""Robots of this kind: each of CHANGES in either measure, and fourteen with three at once."""
