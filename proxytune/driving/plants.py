"""Plants: what moves, from the motion that wheels ask for to poses.

`Drivetrain` makes twists of duties, and both plants share it. The planar plant is kinematics over whole arrays of time,
exact for twists that hold over a tick. What a URDF says of a robot on two wheels is read here too: the bullet plant
drives it.
"""

import re
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, Protocol, Self

import numpy as np

from proxytune.arrays import Floats
from proxytune.driving.optics import rotation
from proxytune.driving.robot import Robot
from proxytune.effects import CHANNELS, Chain, Effect, FilterContext, Memory, Signal, Stage, stage_chain
from proxytune.errors import SettingsError
from proxytune.settings import read_text


class Plant(Protocol):
    """One robot on a floor, from its starting pose on; a context manager, closed when the episode ends."""

    def move(self, twists: Signal) -> tuple[Signal, bool]:
        """Follow twists (time, 3), each for one tick.

        Returns:
            The poses after each tick, (time, 3): x [m], y [m] of the middle of the axle, heading [rad, unwrapped];
            and whether the robot has hit something or fallen over.
        """

    def __enter__(self) -> Self: ...

    def __exit__(self, *problem: object) -> None: ...


STEEPEST = np.radians(75.0)
"""No wheel turns farther, whatever effects ask for [rad]."""


class DrivetrainState(NamedTuple):
    """Memories of the three stages."""

    command: Memory
    actuation: Memory
    motion: Memory


@dataclass(frozen=True)
class Drivetrain:
    """Command, actuation and motion effects with the robot's kinematics; itself a causal filter.

    Takes duties (…, time, 2), left and right in [−1, 1], of a car throttle and steering; gives twists (…, time, 3):
    forward and sideways speed [m/s] and yaw rate [rad/s], each the mean over its sample interval.
    """

    robot: Robot
    command: Chain
    actuation: Chain
    motion: Chain

    def begin(self, context: FilterContext) -> DrivetrainState:
        """Begin as if the resting command of `context` had been given for ever."""
        motion = self.motion.begin(replace(context, rest=self.resting_twist(context)))
        return DrivetrainState(self.command.begin(context), self.actuation.begin(context), motion)

    def resting_twist(self, context: FilterContext) -> Signal:
        """The twist (…, 3) that wheels ask for under the resting command of `context`."""
        still = np.zeros((*np.shape(context.rest)[:-1], len(CHANNELS[Stage.MOTION])))
        if not np.any(context.rest):
            return still
        arrived, _ = self.command.apply(np.asarray(context.rest)[..., None, :], self.command.begin(context))
        wheels, _ = self.actuation.apply(self.within_range(arrived), self.actuation.begin(context))
        return self.ideal(wheels)[..., 0, :]

    def apply(self, signal: Signal, memory: DrivetrainState) -> tuple[Signal, DrivetrainState]:
        """The twists that the next chunk of duties leads to."""
        arrived, command = self.command.apply(signal, memory.command)
        wheels, actuation = self.actuation.apply(self.within_range(arrived), memory.actuation)
        twists, motion = self.motion.apply(self.ideal(wheels), memory.motion)
        return twists, DrivetrainState(command, actuation, motion)

    def within_range(self, arrived: Signal) -> Signal:
        """Commands cut to what motors and servos take: −1 to 1, throttle from 0 on where there is no reverse."""
        least = -1.0 if self.robot.reverse else np.array((0.0, -1.0))
        return np.minimum(np.maximum(arrived, least), 1.0)

    def ideal(self, wheels: Signal) -> Signal:
        """The twists of the middle of the (rear) axle that wheels (…, time, 2) ask for, nothing slipping.

        Wheels are the speeds of the left and the right one, of a car the speed and the angle of those that steer, all
        as fractions of the full ones.
        """
        figures, left, right = self.robot.figures, wheels[..., 0], wheels[..., 1]
        twists = np.zeros((*left.shape, 3))
        if self.robot.drive == "ackermann":
            twists[..., 0] = left * figures["full_speed"]
            angle = np.clip(right * np.radians(figures["wheel_angle"]), -STEEPEST, STEEPEST)
            twists[..., 2] = twists[..., 0] * np.tan(angle) / figures["wheelbase"]
            return twists
        full_speed, baseline = figures["full_speed"], figures["effective_baseline"]
        twists[..., 0] = (left + right) * (full_speed / 2.0)
        twists[..., 2] = (right - left) * (full_speed / baseline)
        return twists


def drivetrain(robot: Robot, effects: Iterable[Effect]) -> Drivetrain:
    """A robot's drivetrain with these effects."""
    chosen = tuple(effects)
    stages = (Stage.COMMAND, Stage.ACTUATION, Stage.MOTION)
    return Drivetrain(robot, *(stage_chain(chosen, stage) for stage in stages))


AXLES = ("axle_left", "axle_right")
"""How the bullet plant calls the joints that it drives."""
STEERS = ("steer_left", "steer_right")
"""How it calls those that it turns the front wheels of a car by."""
AGREES = 0.01
"""How far, relatively, a URDF may be from robot.toml."""
ACROSS = 0.9
"""An axle points to the left, or to the right, by so much of its length."""


@dataclass(frozen=True)
class Wheel:
    """A driven wheel."""

    joint: str  # name of its joint
    centre: Floats  # where it is in the root link's frame (3,) [m]
    axis: Floats  # direction of its axle there (3,)
    radius_m: float | None  # its radius [m]; None where its geometry is a mesh
    effort: float  # the most that its motor gives [N m]; 0 where that is not said


@dataclass(frozen=True)
class Body:
    """A URDF's two driven wheels, its mass and its camera."""

    left: Wheel  # the left wheel
    right: Wheel  # the right wheel
    mass_kg: float  # of all its links [kg]
    camera: Floats | None  # the pose of a link called camera in the root link's frame (4, 4); None where there is none

    @property
    def wheel_distance(self) -> float:
        """Between the wheels' centres, across the robot [m]."""
        return float(self.left.centre[1] - self.right.centre[1])


def parse_urdf(path: Path) -> ET.Element:
    """The root element of a URDF; a SettingsError if it cannot be read or is no URDF."""
    try:
        root = ET.fromstring(read_text(path))
    except (OSError, UnicodeDecodeError) as problem:
        raise SettingsError(f"{path}: cannot be read ({problem}); check the path") from None
    except ET.ParseError as problem:
        raise SettingsError(f"{path}: is not XML ({problem}); of a .xacro file make a URDF first") from None
    if root.tag != "robot" or root.find("link") is None:
        raise SettingsError(f"{path}: is no URDF: it needs <robot> with links; got <{root.tag}>")
    return root


def read_body(root: ET.Element, path: Path) -> Body:
    """Read a URDF's wheels, mass and camera; a SettingsError if its driven wheels or a number cannot be told."""
    with sound_urdf(path):
        wheels = [_wheel(root, joint) for joint in root.iter("joint") if joint.get("type") == "continuous"]
        across = [wheel for wheel in wheels if abs(wheel.axis[1]) > ACROSS]
        named = [wheel for wheel in across if wheel.joint in AXLES]
        pair = sorted(named or across, key=lambda wheel: -wheel.centre[1])
        if len(pair) != 2 or pair[0].centre[1] <= pair[1].centre[1]:
            found = ", ".join(wheel.joint for wheel in across) or "none"
            remedy = f"found {found}; call the two driven joints {' and '.join(AXLES)}"
            raise SettingsError(f"{path}: the axles must be two continuous joints, left and right; {remedy}")
        masses = (float(mass.get("value", 0.0)) for mass in root.findall("link/inertial/mass"))
        names = (link.get("name", "") for link in root.iter("link"))
        camera = next((name for name in names if "camera" in name and "optical" not in name), None)
        return Body(pair[0], pair[1], sum(masses), link_pose(root, camera) if camera else None)


@contextmanager
def sound_urdf(path: Path) -> Iterator[None]:
    """Whatever is read or changed of a URDF; a SettingsError if a number in it is none, or joints go in a circle."""
    try:
        yield
    except (ValueError, RecursionError) as problem:
        raise SettingsError(f"{path}: is no sound URDF ({problem}); correct it") from None


def links_called(root: ET.Element, name: str) -> list[ET.Element]:
    """The links of a name, whatever characters it has."""
    return [link for link in root.findall("link") if link.get("name") == name]


def link_pose(root: ET.Element, link: str) -> Floats:
    """Pose (4, 4) of a link in the root link's frame, every joint at 0."""
    for joint in root.iter("joint"):
        child, parent = joint.find("child"), joint.find("parent")
        if child is not None and parent is not None and child.get("link") == link:
            return link_pose(root, parent.get("link", "")) @ origin_of(joint)
    return np.eye(4)


def add_little_mass(link: ET.Element) -> None:
    """Give a link without mass a gram: PyBullet would give it a kilogram."""
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "mass", value="0.001")
    ET.SubElement(inertial, "inertia", ixx="1e-7", ixy="0", ixz="0", iyy="1e-7", iyz="0", izz="1e-7")


def origin_of(element: ET.Element) -> Floats:
    """The transform (4, 4) of an element's <origin>, roll first, then pitch, then yaw."""
    origin = element.find("origin")
    xyz, rpy = ((origin.get(key, "0 0 0") if origin is not None else "0 0 0").split() for key in ("xyz", "rpy"))
    pose, (roll, pitch, yaw) = np.eye(4), (float(angle) for angle in rpy)
    pose[:3, :3], pose[:3, 3] = rotation(roll, pitch, yaw), [float(value) for value in xyz]
    return pose


def check_body(robot: Robot) -> None:
    """Refuse a URDF whose wheels are not those of robot.toml: the bullet plant would drive at another speed."""
    path = robot.body()
    root = parse_urdf(path)
    body = read_body(root, path)
    _check_files(root, path)
    stated = [("wheel_distance", body.wheel_distance)]
    if robot.drive == "ackermann":
        stated.append(("wheelbase", wheelbase_of(root, body, path)))
    for wheel, name in zip((body.left, body.right), AXLES, strict=True):
        if wheel.joint != name or wheel.axis[1] < 0.0:
            said = f"joint '{wheel.joint}' must be called {name}"
            raise SettingsError(f"{path.name}: {said}, and its axis must point to the left (0 1 0)")
    radii = [wheel.radius_m for wheel in (body.left, body.right) if wheel.radius_m is not None]
    for figure, value in (*(("wheel_radius", radius) for radius in radii), *stated):
        if abs(value - robot.figures[figure]) > AGREES * robot.figures[figure]:
            said = f"has the {figure} {value:g} m, robot.toml says {robot.figures[figure]:g} m"
            raise SettingsError(f"{path.name}: {said}; correct the one that is wrong")


def wheelbase_of(root: ET.Element, body: Body, path: Path) -> float:
    """How far the front wheels, which have to steer, are ahead of the driven ones [m].

    Raises:
        SettingsError: If they do not hang on two joints called as the bullet plant calls them.
    """
    steers = {joint.get("name"): joint for joint in root.iter("joint") if joint.get("type") == "revolute"}
    missing = [name for name in STEERS if name not in steers]
    if missing:
        remedy = "the front wheels of a car hang on two revolute joints of these names, axis 0 0 1"
        raise SettingsError(f"{path.name}: has no joint {' and '.join(missing)}; {remedy}")
    children = [child.get("link", "") for name in STEERS if (child := steers[name].find("child")) is not None]
    ahead = [link_pose(root, child)[0, 3] - body.left.centre[0] for child in children]
    return float(np.mean(ahead))


SCHEMES = re.compile(r"(file|package|model)://")
NAMED_IN = {".obj": "mtllib", ".mtl": "map_"}
"""Files of meshes that name others, and how their lines begin that do."""


def _check_files(root: ET.Element, path: Path) -> None:
    """Refuse what a URDF names and is no file: PyBullet would wait for a pipe for ever."""
    collides = {id(one) for part in root.iter("collision") for one in part.iter()}
    for element in root.iter():
        name = element.get("filename")
        if name is None:
            continue
        # PyBullet looks here, then beside the URDF and above
        plain = SCHEMES.sub("", name)
        places = (Path(plain), *(folder / plain for folder in path.resolve().parents))
        found = next((place for place in places if place.exists()), None)
        if found is not None:
            _check_file(found, f"{path}: names {name}")
        elif id(element) in collides:
            raise SettingsError(f"{path}: names {name}, which is not there; add it beside the URDF")


def _check_file(path: Path, where: str) -> None:
    if not path.is_file():
        raise SettingsError(f"{where}, which is a folder, a device or a pipe; put the file itself there")
    begins = NAMED_IN.get(path.suffix.lower())
    if begins is None:
        return
    with path.open(encoding="utf-8", errors="replace") as lines:
        named = [line.split()[-1] for line in lines if line.lstrip().startswith(begins)]
    for name in named:
        if (path.parent / name).exists():
            _check_file(path.parent / name, f"{where}, which names {name}")


def _wheel(root: ET.Element, joint: ET.Element) -> Wheel:
    child, axis, limit = joint.find("child"), joint.find("axis"), joint.find("limit")
    link = child.get("link", "") if child is not None else ""
    direction = np.array([float(v) for v in (axis.get("xyz", "1 0 0") if axis is not None else "1 0 0").split()])
    pose = link_pose(root, link)
    effort = float(limit.get("effort", 0.0)) if limit is not None else 0.0
    turned = pose[:3, :3] @ (direction / np.linalg.norm(direction))
    return Wheel(joint.get("name", ""), pose[:3, 3], turned, _radius(root, link), effort)


def _radius(root: ET.Element, link: str) -> float | None:
    """Radius of what the wheel collides as, else of what it looks like."""
    shapes = (f"{part}/geometry/{shape}" for part in ("collision", "visual") for shape in ("sphere", "cylinder"))
    for shape in shapes:
        for element in links_called(root, link):
            found = element.find(shape)
            if found is not None:
                return float(found.get("radius", 0.0))
    return None


def integrate(start: Signal, twists: Signal, tick_s: float) -> Signal:
    """The poses (…, time, 3) after ticks so long [s] from a start (…, 3), each with a twist; headings unwrapped."""
    turns = twists[..., 2] * tick_s
    headings = start[..., None, 2] + turns.cumsum(axis=-1)
    middles = headings - turns / 2.0
    half = np.pi * (turns / (2.0 * np.pi))
    half[half == 0.0] = sys.float_info.epsilon
    chord = tick_s * (np.sin(half) / half)
    forward, sideways = twists[..., 0] * chord, twists[..., 1] * chord
    cosine, sine = np.cos(middles), np.sin(middles)
    poses = np.empty((*headings.shape, 3))
    poses[..., 0], poses[..., 1] = forward * cosine - sideways * sine, forward * sine + sideways * cosine
    poses[..., :2] = start[..., None, :2] + poses[..., :2].cumsum(axis=-2)
    poses[..., 2] = headings
    return poses


class PlanarPlant:
    """One robot that moves exactly as its wheels ask; it never hits anything."""

    def __init__(self, start: Signal, tick_s: float) -> None:
        self._pose = np.asarray(start, dtype=float)
        self._tick_s = tick_s

    def move(self, twists: Signal) -> tuple[Signal, bool]:
        """Follow twists, each for one tick."""
        poses = integrate(self._pose, twists, self._tick_s)
        self._pose = poses[-1]
        return poses, False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *problem: object) -> None:
        return None


class PlanarFleet:
    """Robots side by side, each as a PlanarPlant."""

    def __init__(self, starts: Signal, tick_s: float) -> None:
        self._poses = np.array(starts, dtype=float)
        self._tick_s = tick_s

    def move(self, twists: Signal, robots: Sequence[int]) -> tuple[Signal, Sequence[bool]]:
        """Let some robots follow their twists (robots, time, 3), each for one tick."""
        here = slice(None) if len(robots) == len(self._poses) else list(robots)
        poses = integrate(self._poses[here], twists, self._tick_s)
        self._poses[here] = poses[:, -1]
        return poses, [False] * len(robots)
