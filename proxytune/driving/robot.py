"""Robots as their robot.toml describes them."""

import functools
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from proxytune.driving.optics import CameraFigures
from proxytune.effects import DRIVES, SHIPPED, Catalogue, Model, read_effects, read_model
from proxytune.errors import ExtensionError, SettingsError
from proxytune.extensions import load, plugins
from proxytune.files import shipped
from proxytune.settings import Section, nearest, read_settings

UNITS: Mapping[str, str] = MappingProxyType(
    {
        "wheel_radius": "m",
        "wheel_distance": "m",
        "effective_baseline": "m",
        "full_speed": "m/s",
        "motor_time_constant": "s",
        "wheelbase": "m",
        "wheel_angle": "deg",
        "wheel_torque": "N m",
        "mass": "kg",
        "length": "m",
        "width": "m",
        "height": "m",
        "control_rate": "Hz",
        "lane_width": "m",
        "camera_rate": "Hz",
        "camera_columns": "pixel",
        "camera_rows": "pixel",
        "camera_forward": "m",
        "camera_height": "m",
        "camera_pitch": "deg",
        "field_of_view": "deg",
        "expert_look_ahead": "m",
        "expert_speed": "m/s",
        "expert_gain": "",
        "expert_disturbance": "duty",
    }
)
"""Every figure that a robot.toml may state, with its unit."""
REQUIRED = {
    "differential": ("wheel_radius", "effective_baseline", "full_speed", "motor_time_constant", "control_rate"),
    "ackermann": ("wheel_radius", "wheelbase", "wheel_angle", "full_speed", "motor_time_constant", "control_rate"),
}
"""What every robot states by how it drives: enough to drive a log on the planar plant."""
COLUMNS = {"differential": ("left", "right"), "ackermann": ("throttle", "steering")}
"""What the two columns of commands are by how the robot drives, both from −1 to 1; steering is positive to the left."""
BODY = ("wheel_distance", "wheel_torque")
"""What the bullet plant needs besides the URDF."""
CAMERA = (
    "camera_rate",
    "camera_columns",
    "camera_rows",
    "camera_forward",
    "camera_height",
    "camera_pitch",
    "field_of_view",
)
"""What an agent's view needs."""
EXPERT = ("expert_look_ahead", "expert_speed", "expert_gain", "expert_disturbance")
"""What the expert that teaches to drive it needs."""
WITHOUT_BODY = 'use plant = "planar"'


@dataclass(frozen=True)
class Robot:
    """A robot's nominal figures and effects."""

    name: str  # name of its folder
    description: str  # what it is, in one line
    # those nominal figures that are known, by name, in the units of UNITS; those REQUIRED are among them
    figures: Mapping[str, float]
    theta: Mapping[str, float]  # values of the effects that every instance of it has
    urdf: Path | None  # its body for the bullet plant, or None
    catalogue: Catalogue = SHIPPED  # the effects that it may have, and how it drives
    reverse: bool = True  # whether it drives backwards too

    @property
    def drive(self) -> str:
        """How it drives: "differential", on two wheels of their own speed, or "ackermann", on wheels that steer."""
        return self.catalogue.drive

    @property
    def columns(self) -> tuple[str, str]:
        """What the two columns of its commands are."""
        return COLUMNS[self.drive]

    @property
    def least_radius(self) -> float:
        """Radius of the tightest circle of the middle of its rear axle [m]; 0 where it turns on the spot."""
        if self.drive == "differential":
            return 0.0
        return self.figures["wheelbase"] / math.tan(math.radians(self.figures["wheel_angle"]))

    def body(self) -> Path:
        """The URDF for the bullet plant; refused if the robot has none."""
        if self.urdf is None:
            raise SettingsError(f"robot '{self.name}' has no body: its robot.toml names no urdf; {WITHOUT_BODY}")
        self._need(BODY, "body", WITHOUT_BODY)
        return self.urdf

    def camera_figures(self) -> CameraFigures:
        """The nominal camera: level, straight ahead, without distortion; refused if the robot has none."""
        self._need(CAMERA, "camera", "choose a robot that has one")
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

    def expert_figures(self) -> tuple[float, float, float, float]:
        """Look-ahead [m], speed [m/s], gain and disturbance [duty] of the robot's expert; refused if it has none."""
        self._need(EXPERT, "expert", "add them, or teach with a robot that has one")
        look_ahead, speed, gain, disturbance = (self.figures[name] for name in EXPERT)
        return look_ahead, speed, gain, disturbance

    def wheel_distance(self) -> float:
        """Distance between the wheels [m], by which a driving examination is scored; refused if it is not stated."""
        self._need(("wheel_distance",), "stated wheel distance", "add it")
        return self.figures["wheel_distance"]

    def _need(self, names: tuple[str, ...], part: str, otherwise: str) -> None:
        missing = [name for name in names if name not in self.figures]
        if missing:
            lacks = f"its robot.toml states no {', '.join(missing)}"
            raise SettingsError(f"robot '{self.name}' has no {part}: {lacks}; {otherwise}")


def robot_names(folder: Path | None = None) -> tuple[str, ...]:
    """The robots of a user's folder and of the one above it, of plug-ins, and those shipped."""
    names = {path.parent.name for home in _homes(folder) for path in home.glob("*/robot.toml")}
    return tuple(sorted(names | set(plugins("robot"))))


def is_robot(name: str, folder: Path | None = None) -> bool:
    """True if one of `robot_names` is called so."""
    return _folder_of(name, folder) is not None or name in plugins("robot")


def _folder_of(name: str, folder: Path | None) -> Path | None:
    one_folder = name.strip(".") and name == Path(name).name
    places = (home / name for home in _homes(folder) if one_folder)
    return next((place for place in places if os.path.isfile(place / "robot.toml")), None)


def robot_home(name: str, folder: Path | None = None) -> Path:
    """The folder of a robot: in the study's folder first, then beside it, then shipped, then what a plug-in names.

    A SettingsError if there is no such robot, an ExtensionError if its plug-in cannot be used.
    """
    if own := _folder_of(name, folder):
        return own
    if name not in plugins("robot"):
        hint = nearest(name, robot_names(folder))
        raise SettingsError(f"robot '{name}' is unknown (your own is a folder {name} with robot.toml); {hint}")
    found = load(name, kind="robot")
    if not isinstance(found, str | Path):
        raise ExtensionError(f"robot '{name}': its plug-in must be the path of its folder, got {type(found).__name__}")
    return Path(found)


@functools.lru_cache
def read_robot(name: str, folder: Path | None = None) -> Robot:
    """Read a robot by its folder's name; robots and modules of effects in a user's folder come before shipped ones.

    Raises:
        SettingsError: If there is no such robot or its robot.toml is not complete.
    """
    settings = read_settings(robot_home(name, folder) / "robot.toml")
    settings.only(("format", "name", "description", "drive", "reverse", "urdf", "figures", "effects"))
    settings.whole("format", low=1, high=1)
    catalogue = Catalogue(folder, drive=settings.text("drive", "differential", choices=tuple(DRIVES)))
    reverse = settings.flag("reverse", True)
    if not reverse and catalogue.drive == "differential":
        raise settings.error("reverse", 'is for drive = "ackermann"; leave it out')
    settings.text("name", choices=(name,))
    theta, _ = read_effects(settings.section("effects"), catalogue)
    figures = _read_figures(settings.section("figures"), catalogue.drive)
    description = settings.text("description")
    return Robot(name, description, figures, MappingProxyType(theta), _urdf(settings), catalogue, reverse)


def catalogue_of(robot: str, folder: Path | None, own: tuple[str, ...] = ()) -> Catalogue:
    """The effects that a robot of this name may have, or one on two wheels where none is known by it.

    A user's folder comes before what is shipped; `own` are effects that a diagnosis is to try beside.
    """
    known = is_robot(robot, folder)
    return replace(read_robot(robot, folder).catalogue if known else Catalogue(folder), folder=folder, own=own)


def read_model_of(path: Path, folder: Path | None) -> Model:
    """Read a model.toml with the effects that its robot may have; a SettingsError tells file, key and remedy."""
    named = read_settings(path).values.get("robot")
    return read_model(path, catalogue_of(named if isinstance(named, str) else "", folder))


def robot_from_geometry(name: str, geometry: Mapping[str, float], control_rate: float) -> Robot:
    """A robot without a folder, as its log describes it: it obeys at once and has no effects.

    Its geometry is wheel_radius and effective_baseline [m] and full_speed [m/s], the rate that of its commands [Hz].

    Raises:
        SettingsError: If the log leaves one of them out.
    """
    missing = [figure for figure in ("wheel_radius", "effective_baseline", "full_speed") if figure not in geometry]
    if missing:
        remedy = "add wheel_radius_m, baseline_m and full_speed_m_s to log.toml"
        raise SettingsError(f"robot '{name}' is unknown and its log states no {', '.join(missing)}; {remedy}")
    figures = {**geometry, "motor_time_constant": 0.0, "control_rate": control_rate}
    return Robot(name, "as its log describes it", MappingProxyType(figures), MappingProxyType({}), None)


def _homes(folder: Path | None) -> list[Path]:
    """Folders in which robots are looked for, in this order."""
    own = [folder, folder.resolve().parent] if folder else []
    return [*own, shipped("robots")]


def _urdf(settings: Section) -> Path | None:
    if "urdf" not in settings.values:
        return None
    urdf = settings.file("urdf")
    if not urdf.is_file():
        raise settings.error("urdf", f"no such file: {urdf.name}; add it beside robot.toml")
    return urdf


LARGEST_DEG = 60.0
"""Greatest angle of a steered wheel."""


def _read_figures(section: Section, drive: str) -> Mapping[str, float]:
    section.only(UNITS)
    required = REQUIRED[drive]
    for name in required:
        if name not in section.values:
            other = next((kind for kind, names in REQUIRED.items() if set(names) <= section.values.keys()), None)
            hint = f', or state drive = "{other}", for which all figures are there' if other else ""
            raise section.error(name, f"is missing; add {{ value, unit, source }}{hint}")
    figures = {}
    for name in section.values:
        figure = section.section(name)
        figure.only(("value", "unit", "source"))
        figure.text("unit", choices=(UNITS[name],))
        figure.text("source")
        divides = name in required and name != "motor_time_constant"
        most = {"high": LARGEST_DEG} if name == "wheel_angle" else {}
        figures[name] = figure.number("value", low=1e-6 if divides else 0.0, **most)
    return MappingProxyType(figures)
