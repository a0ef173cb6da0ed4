"""Robots as their robot.toml describes them."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from proxytune.driving.cameras import CameraFigures
from proxytune.effects import read_effects
from proxytune.errors import SettingsError
from proxytune.settings import Section, nearest, read_settings
from proxytune.shipped import shipped

UNITS: Mapping[str, str] = MappingProxyType(
    {
        "wheel_radius": "m",
        "wheel_distance": "m",
        "effective_baseline": "m",
        "full_speed": "m/s",
        "motor_time_constant": "s",
        "wheel_torque": "N m",
        "mass": "kg",
        "length": "m",
        "width": "m",
        "height": "m",
        "control_rate": "Hz",
        "camera_rate": "Hz",
        "camera_columns": "pixel",
        "camera_rows": "pixel",
        "camera_forward": "m",
        "camera_height": "m",
        "camera_pitch": "deg",
        "field_of_view": "deg",
    }
)
"""Every figure that a robot.toml must state, with its unit."""


@dataclass(frozen=True)
class Robot:
    """A robot's nominal figures and effects.

    Attributes:
        name: Name of its folder.
        description: What it is, in one line.
        figures: Nominal figures by name, in the units of UNITS.
        theta: Values of the effects that every instance of it has.
        urdf: Its body for the bullet plant.
    """

    name: str
    description: str
    figures: Mapping[str, float]
    theta: Mapping[str, float]
    urdf: Path

    def camera_figures(self) -> CameraFigures:
        """The nominal camera: level, straight ahead, without distortion."""
        figures = self.figures
        return CameraFigures(
            columns=int(figures["camera_columns"]),
            rows=int(figures["camera_rows"]),
            forward_m=figures["camera_forward"],
            pitch_deg=figures["camera_pitch"],
            roll_deg=0.0,
            yaw_deg=0.0,
            height_m=figures["camera_height"],
            field_of_view_deg=figures["field_of_view"],
            k1=0.0,
        )


def robot_names() -> tuple[str, ...]:
    """The robots that travel with the package."""
    return tuple(sorted(path.parent.name for path in shipped("robots").glob("*/robot.toml")))


@functools.lru_cache
def read_robot(name: str) -> Robot:
    """Read a robot by name.

    Raises:
        SettingsError: If there is no such robot or its robot.toml is not complete.
    """
    if name not in robot_names():
        raise SettingsError(f"robot '{name}' is unknown; {nearest(name, robot_names())}")
    settings = read_settings(shipped("robots") / name / "robot.toml")
    settings.only(("format", "name", "description", "urdf", "figures", "effects"))
    settings.whole("format", low=1, high=1)
    theta, _ = read_effects(settings.section("effects"))
    urdf = settings.path.parent / settings.text("urdf")
    if not urdf.is_file():
        raise settings.error("urdf", f"no such file: {urdf.name}; add it beside robot.toml")
    figures = _read_figures(settings.section("figures"))
    return Robot(settings.text("name"), settings.text("description"), figures, MappingProxyType(theta), urdf)


def _read_figures(section: Section) -> Mapping[str, float]:
    section.only(UNITS)
    figures = {}
    for name, unit in UNITS.items():
        figure = section.section(name)
        if not figure.values:
            raise section.error(name, "is missing; add { value, unit, source }")
        figure.only(("value", "unit", "source"))
        figure.text("unit", choices=(unit,))
        figure.text("source")
        figures[name] = figure.number("value", low=0.0)
    return MappingProxyType(figures)
