"""Measured logs of gym-duckietown's vehicle, and of variants of it: the fourth generator of differential robots.

Its motion is the model of a Duckiebot that gym-duckietown steps (Ercan and others, Duckiebot DB18): with V the voltages
that a driver makes of the duties, `delay` seconds late,

    dv/dt = −u1 v − u2 ω + u3 ω² + 1.5 (V_right + V_left)
    dω/dt = −w1 (1 + square v²) ω − w2 v − w3 v ω + 15 (V_right (1 + trim) − V_left (1 − trim))

gym-duckietown has u1 = 5, w1 = 4 and no other: it lags 0.20 s forwards, 0.25 s in turns. `square` is not its own: a
robot that turns the less, the faster it is. Commands are the second generator's; poses have white noise.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from second_hidden_cases import log_of, plan

from proxytune.logs import Log

Array = NDArray[np.float64]
ROW_S, STEPS = 0.05, 10
"""Time of a row [s], and how many steps it is driven in."""
POSE_NOISE = (0.002, 0.002, 0.005)
"""Standard deviation [m], [m], [rad]."""
OWN: Mapping[str, float] = {"u1": 5.0, "u2": 0.0, "u3": 0.0, "w1": 4.0, "w2": 0.0, "w3": 0.0, "square": 0.0}
DRIVER: Mapping[str, float] = {"slope": 1.0, "step": 0.0}
"""V = slope · duty + step · sign(duty), and never against the duty."""


@dataclass(frozen=True)
class Case:
    """A vehicle that one log is measured of: what differs from OWN and DRIVER, its trim and delay [s], and a seed."""

    name: str
    changes: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0
    trim: float = 0.0
    delay: float = 0.15
    depends_on: str = ""


def make_log(case: Case, *, episodes: int = 12, seconds: float = 60.0, noiseless: bool = False) -> Log:
    """What would have been measured of this vehicle, 20 rows per second, from rest."""
    course = plan(case.seed, episodes, round(seconds / ROW_S))
    poses = _driven(case, course.duties, course.starts)
    if not noiseless:
        poses = poses + np.random.default_rng([case.seed, 1]).standard_normal(poses.shape) * POSE_NOISE
    return log_of(case.name, course, poses)


def _driven(case: Case, duties: Array, starts: Array) -> Array:
    """Poses (episodes, rows, 3), by steps of Euler."""
    own = {**OWN, **DRIVER, **case.changes}
    left, right = np.moveaxis(_voltages(duties, own["slope"], own["step"]), 2, 0)
    step, late = ROW_S / STEPS, round(case.delay / ROW_S * STEPS)
    place, heading = starts[:, 0] + 1j * starts[:, 1], starts[:, 2]
    v, w = np.zeros_like(heading), np.zeros_like(heading)
    poses = []
    for count in range(duties.shape[1] * STEPS):
        if count % STEPS == 0:
            poses.append(np.stack((place.real, place.imag, heading), axis=-1))
        row = (count - late) // STEPS
        on_left, on_right = (left[:, row], right[:, row]) if row >= 0 else (0.0, 0.0)
        forward = -own["u1"] * v - own["u2"] * w + own["u3"] * w**2 + 1.5 * (on_right + on_left)
        turned = 15.0 * (on_right * (1.0 + case.trim) - on_left * (1.0 - case.trim))
        against = own["w1"] * (1.0 + own["square"] * v**2) * w + own["w2"] * v + own["w3"] * v * w
        v, w = v + step * forward, w + step * (turned - against)
        place, heading = place + step * v * np.exp(1j * heading), heading + step * w
    return np.stack(poses, axis=1)


def _voltages(duties: Array, slope: float, step: float) -> Array:
    size = np.maximum(slope * np.abs(duties) + step, 0.0)
    return np.where(duties == 0.0, 0.0, np.sign(duties) * size)


CHANGES: Mapping[str, tuple[Mapping[str, float], Mapping[str, float]]] = {
    "understeer with the square of speed": ({"square": 1.5}, {"square": 4.0}),
    "understeer with speed": ({"w3": 2.0}, {"w3": 6.0}),
    "turns slow it down": ({"u3": -0.01}, {"u3": -0.03}),
    "turns push it": ({"u2": 0.03}, {"u2": 0.1}),
    "speed turns it": ({"w2": 0.5}, {"w2": 1.5}),
    "eager driver": ({"slope": 0.95, "step": 0.05}, {"slope": 0.85, "step": 0.12}),
    "lazy driver": ({"slope": 1.0, "step": -0.05}, {"slope": 1.05, "step": -0.12}),
}
"""What a variant may have, in a small and a large measure."""


def _case(name: str, *changes: Mapping[str, float]) -> Case:
    random = np.random.default_rng(crc32(name.encode()))
    trim, delay = float(random.uniform(-0.08, 0.08)), float(random.uniform(0.08, 0.2))
    merged = {key: value for change in changes for key, value in change.items()}
    return Case(name, merged, int(random.integers(2**31)), trim, delay)


IN_FORM = OTHER_FORM = PAIRS = OUTSIDE = CLEAN = ()
_TOGETHER = ("understeer with the square of speed", "turns push it", "eager driver")
PHYSICS = (
    *(_case(f"gym own {n}") for n in range(3)),
    *(
        _case(f"gym {name} {size}", both[n])
        for name, both in CHANGES.items()
        for n, size in enumerate(("small", "large"))
    ),
    *(
        _case(f"gym three {size}", *(CHANGES[name][n] for name in _TOGETHER))
        for n, size in enumerate(("small", "large"))
    ),
)
"""The vehicle itself under three courses, every one of CHANGES in either measure, and three of them at once."""
