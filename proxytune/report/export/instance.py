"""Domain instance in the figures that other simulators take, and where each effect goes in each format."""

import re
from collections.abc import Container, Mapping
from dataclasses import dataclass

import numpy as np

from proxytune.arrays import Floats
from proxytune.driving import CAMERA, CameraFigures, Robot, mounted_camera, orientation, rotation
from proxytune.effects import SHIPPED, SMALLEST_LIMIT, Effect, Stage, effect_of, effects_from
from proxytune.errors import InputError
from proxytune.files import package_table
from proxytune.space import Theta

Pair = tuple[float, float]


@dataclass(frozen=True)
class Instance:
    """A domain instance to be written, and where its values come from.

    θ has every value that is not nominal by definition: the robot's own effects, and what was found.
    """

    robot: Robot
    theta: Theta
    intervals: Mapping[str, Pair]
    source: str

    @property
    def effects(self) -> Mapping[str, Effect]:
        """The effects by name."""
        return {effect.name: effect for effect in effects_from(self.theta, self.robot.figures, self.robot.catalogue)}

    def value(self, effect: str, parameter: str, otherwise: float) -> float:
        """A parameter of an effect; otherwise where the instance does not have that effect."""
        found = self.effects.get(effect)
        return otherwise if found is None else float(getattr(found, parameter))

    def figure(self, name: str) -> float:
        """A figure that the robot states."""
        if name not in self.robot.figures:
            raise InputError(f"robot '{self.robot.name}' states no {name}; add it to its robot.toml")
        return self.robot.figures[name]

    @property
    def steers(self) -> bool:
        """Whether it is a car."""
        return self.robot.drive == "ackermann"

    @property
    def gains(self) -> Pair:
        """Speeds of the left and right driven wheels as multiples of the nominal."""
        if self.steers:
            return (self.value("wheel_gain", "gain", 1.0),) * 2
        trim = self.value("trim", "trim", 0.0)
        left, right = (self.value("wheel_gain", side, 1.0) for side in ("left", "right"))
        return left * (1.0 - trim), right * (1.0 + trim)

    @property
    def limits(self) -> Pair:
        """The duties beyond which the left and right wheels turn no faster."""
        lost, imbalance = 1.0 - self.value("saturation", "limit", 1.0), self.imbalance("saturation")
        left, right = (max(SMALLEST_LIMIT, 1.0 - lost * (1.0 + side * imbalance)) for side in (-1.0, 1.0))
        return left, right

    @property
    def lags_s(self) -> Pair:
        """Time constants of the left and right motors [s]."""
        time, imbalance = self.value("motor_lag", "time_constant", 0.0), self.imbalance("motor_lag")
        return time * (1.0 - imbalance), time * (1.0 + imbalance)

    def imbalance(self, effect: str) -> float:
        """How uneven an effect is on the wheels; a car's are alike."""
        return 0.0 if self.steers else self.value(effect, "imbalance", 0.0)

    @property
    def baseline_m(self) -> float:
        """Distance of the driven wheels, on a robot on two wheels as the turn rate shows it [m]."""
        if self.steers:
            return self.figure("wheel_distance")
        return self.value("yaw_scrub", "baseline", self.figure("effective_baseline"))

    @property
    def camera(self) -> CameraFigures | None:
        """The camera with all effects; None where the robot has none."""
        if not set(CAMERA) <= set(self.robot.figures):
            return None
        return mounted_camera(self.robot, self.effects.values())

    @property
    def tracked_point(self) -> tuple[float, float, float] | None:
        """Place of the tracked point ahead of the axle's middle and to its left [m], and its turn [rad]."""
        if not {"marker_offset", "heading_offset"} & set(self.effects):
            return None
        forward, left = (self.value("marker_offset", name, 0.0) for name in ("forward", "left"))
        return forward, left, float(np.radians(self.value("heading_offset", "angle", 0.0)))

    @property
    def mounts(self) -> Mapping[str, Floats]:
        """Poses (4, 4) of camera and tracked point, where there are such, from the middle of the axle on the floor."""
        poses = {}
        if (camera := self.camera) is not None:
            poses["camera"] = _pose(orientation(camera), (camera.forward_m, 0.0, camera.height_m))
        if (tracked := self.tracked_point) is not None:
            poses["tracked_point"] = _pose(rotation(0.0, 0.0, tracked[2]), (*tracked[:2], 0.0))
        return poses


def _pose(turned: Floats, place: tuple[float, float, float]) -> Floats:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turned, place
    return pose


@dataclass(frozen=True)
class ExportLine:
    """One value by its name in θ, with its interval if it has one, and the place where it went; empty: none."""

    name: str
    value: float
    interval: Pair | None
    unit: str
    place: str

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        interval = f" ({self.interval[0]:.4g} to {self.interval[1]:.4g})" if self.interval else ""
        return f"{self.name} {self.value:.4g}{unit}{interval}: {self.place or 'NO PLACE, not in this file'}"


def export_lines(instance: Instance, form: str, has: Container[str] = ()) -> list[ExportLine]:
    """Values with what becomes of each in a format, or in what has it already; those that are neutral need no place."""
    parameters = instance.robot.catalogue.parameters
    lines = []
    for name, value in sorted(instance.theta.items()):
        effect = effect_of(name)
        parameter = parameters.get(name)
        place = "in the file" if effect in has else place_of(effect, form, instance.robot.drive)
        if place or parameter is None or isinstance(parameter.neutral, str) or value != parameter.neutral:
            unit = parameter.unit if parameter else ""
            lines.append(ExportLine(name, value, instance.intervals.get(name), unit, place))
    return lines


def header(instance: Instance, form: str, has: Container[str] = ()) -> list[str]:
    """Lines of the head of a file: whose values they are, where each went, and what is not in it."""
    found = export_lines(instance, form, has)
    placed, left_out = [line for line in found if line.place], [line for line in found if not line.place]
    return [
        f"{instance.robot.name} as proxytune found it: {instance.source}",
        *(["Written into this file:"] if placed else []),
        *(f"  {line}" for line in placed),
        *(["NOT in this file, which has no place for it:"] if left_out else []),
        *(f"  {line}" for line in left_out),
    ]


def xml_comment(instance: Instance, form: str, columns: int) -> str:
    """The head of a file as an XML comment, indented so, in which no two hyphens may stand side by side."""
    return re.sub("-(?=-)", "- ", ("\n" + columns * " ").join(header(instance, form)))


FORMATS = ("urdf", "mjcf", "ros")
"""Formats that can be written, as `export --to` calls it."""
FILTER = "filter"
"""What `export --to` calls the ROS 2 node that bends commands as was found."""
IN_WHEELS = ("trim", "wheel_gain", "yaw_scrub")
"""Effects that a patched file has by its wheels' radii and distance; what such a file has is undone by a filter."""
_TABLES = package_table("report/templates/places.toml")
_MOUNTED = {effect: places for places in _TABLES.pop("mounted") for effect in places["effects"]}
PLACES: Mapping[str, Mapping[str, Mapping[str, str]]] = {drive: own | _MOUNTED for drive, own in _TABLES.items()}
"""By how the robot drives, the effects that have a place; a user's own and what was learnt have none."""
BENT = (Stage.COMMAND, Stage.ACTUATION, Stage.MOTION)
"""Effects on commands, wheels and motion: what a filter bends."""


def place_of(effect: str, form: str, drive: str = "differential") -> str:
    """Place of an effect of such robots in a format; empty where it has no place."""
    if form == FILTER:
        return "the filter" if effect not in SHIPPED.shipped or SHIPPED.effect(effect).stage in BENT else ""
    return PLACES[drive].get(effect, {}).get(form, "")
