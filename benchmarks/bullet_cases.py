"""Measured logs of the bullet plant whose own physics has been changed: a missing effect that is nobody's formula."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import cos, radians, sin

import numpy as np
import pybullet
from hidden_cases import LEVELS, Array, Case, disturbed, measured
from manoeuvres import RATE_HZ, make_drives

from proxytune.driving import BulletPlant, drivetrain, read_robot
from proxytune.effects import FilterContext, effects_from
from proxytune.logs import Log, LogEpisode

TICKS_PER_ROW = 3
TICK_HZ = RATE_HZ * TICKS_PER_ROW
GRAVITY = 9.81


@dataclass(frozen=True)
class BulletCase:
    """A bullet robot whose physics is not the nominal one."""

    name: str  # what it is
    changes: Mapping[str, float]  # names of CHANGES, or "left_wheel", each with its size
    seed: int  # seed of the manoeuvres and of the noise
    trim: float = 0.04
    delay: float = 0.12  # its delay [s]
    noise: str = "normal"  # key of LEVELS


def make_bullet_log(case: BulletCase, *, episodes: int = 6, seconds: float = 30.0, noiseless: bool = False) -> Log:
    """What would have been measured of this robot, 20 rows per second, from rest."""
    drives = make_drives(case.seed, episodes, round(seconds * RATE_HZ))
    level = 0.0 if noiseless else LEVELS[case.noise]
    noise = Case(case.name, (), case.noise, case.seed, case.trim, case.delay)
    twists = disturbed(_twists(case, drives.duties), noise, level, TICK_HZ)
    poses = np.stack([_driven(case, start, own) for start, own in zip(drives.starts, twists, strict=True)])
    seen, times = measured(poses, noise, level), np.arange(poses.shape[1]) / RATE_HZ
    rows = (LogEpisode(f"{e:02d}", times, drives.duties[e], seen[e], None) for e in range(episodes))
    return Log(f"bullet {case.name}", "duckiebot", "duty", float(RATE_HZ), {}, tuple(rows))


def _twists(case: BulletCase, duties: Array) -> Array:
    """What the nominal drivetrain asks of the body (episodes, ticks, 3), up to the last row."""
    robot = read_robot("duckiebot")
    theta = {**robot.theta, "trim": case.trim, "delay": case.delay}
    train = drivetrain(robot, effects_from(theta, robot.figures))
    memory = train.begin(FilterContext(TICK_HZ, np.zeros((len(duties), 2)), robot.figures))
    twists, _ = train.apply(np.repeat(duties[:, :-1], TICKS_PER_ROW, axis=1), memory)
    return _left_wheel(twists, case.changes.get("left_wheel", 1.0), robot.figures["wheel_distance"])


def _left_wheel(twists: Array, size: float, distance: float) -> Array:
    """As if the left wheel were `size` times as large: its rim is driven faster, and so past the tyres' scrub."""
    more = (size - 1.0) * (twists[..., :1] - twists[..., 2:] * distance / 2.0)
    return twists + more * (0.5, 0.0, -1.0 / distance)


def _driven(case: BulletCase, start: Array, twists: Array) -> Array:
    """Poses (rows, 3) of a robot in a changed world."""
    with BulletPlant(read_robot("duckiebot"), start, 1.0 / TICK_HZ) as plant:
        for change, size in case.changes.items():
            if change in CHANGES:
                CHANGES[change](plant, size)
        poses, crashed = plant.move(twists)
    assert not crashed, f"{case.name}: the chassis touched the floor; make the change smaller"
    return np.concatenate((start[None], poses))[::TICKS_PER_ROW]


def _friction(plant: BulletPlant, coefficient: float) -> None:
    for wheel in plant._wheels:
        pybullet.changeDynamics(plant._body, wheel, lateralFriction=coefficient, physicsClientId=plant._world)


def _tail_mass(plant: BulletPlant, mass: float) -> None:
    """Moves the centre of mass back, onto the caster [kg]."""
    joints = range(pybullet.getNumJoints(plant._body, physicsClientId=plant._world))
    names = [pybullet.getJointInfo(plant._body, j, physicsClientId=plant._world)[12].decode() for j in joints]
    pybullet.changeDynamics(plant._body, names.index("caster"), mass=mass, physicsClientId=plant._world)


def _tilt(plant: BulletPlant, degrees: float) -> None:
    """The floor rises along x."""
    down, back = GRAVITY * cos(radians(degrees)), GRAVITY * sin(radians(degrees))
    pybullet.setGravity(-back, 0.0, -down, physicsClientId=plant._world)


def _torque(plant: BulletPlant, torque: float) -> None:
    plant._torques = [torque] * 2


CHANGES: Mapping[str, Callable[[BulletPlant, float], None]] = {
    "friction": _friction,
    "tail_mass": _tail_mass,
    "tilt": _tilt,
    "torque": _torque,
}

BULLET: tuple[BulletCase, ...] = (
    BulletCase("nominal", {}, 11),
    BulletCase("slippery wheels", {"friction": 0.2}, 12),
    BulletCase("large left wheel", {"left_wheel": 1.06}, 13),
    BulletCase("heavy tail", {"tail_mass": 1.0}, 14),
    BulletCase("tilted floor", {"tilt": 10.0}, 15),
    BulletCase("tilted slippery floor", {"tilt": 6.0, "friction": 0.4}, 16),
    BulletCase("weak motors", {"torque": 0.008}, 17),
)
"""Logs of the bullet plant, the first with nothing hidden."""
