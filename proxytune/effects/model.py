"""A domain instance as a file: robot, plant, and the effects with their values."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from proxytune.effects.catalogue import CATALOGUE, PARAMETERS, theta_names
from proxytune.effects.learnt.effect import Learnt
from proxytune.effects.learnt.table import learnt_text, read_learnt
from proxytune.logs import GEOMETRY
from proxytune.settings import Section, nearest, read_settings


@dataclass(frozen=True)
class Model:
    """What model.toml says.

    Attributes:
        robot: Name of the robot.
        plant: Name of the plant, or None where the reader chooses.
        theta: Values of the effects' parameters by their names in θ.
        intervals: The interval of each value that has one.
        geometry: Figures of a robot without a folder: wheel_radius, effective_baseline [m], full_speed [m/s].
    """

    robot: str
    plant: str | None
    theta: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    geometry: Mapping[str, float] = field(default_factory=dict)


def read_model(path: Path) -> Model:
    """Read a model.toml.

    Raises:
        SettingsError: With file, key and remedy.
    """
    settings = read_settings(path)
    settings.only(("format", "robot", "plant", "geometry", "effects"))
    settings.whole("format", 1, low=1, high=1)
    plant = settings.text("plant") if "plant" in settings.values else None
    theta, intervals = read_effects(settings.section("effects"))
    return Model(settings.text("robot"), plant, theta, intervals, _read_geometry(settings.section("geometry")))


def _read_geometry(section: Section) -> dict[str, float]:
    section.only(GEOMETRY)
    return {figure: section.number(key, low=0.0) for key, figure in GEOMETRY.items() if key in section.values}


def model_text(model: Model, comments: Iterable[str] = ()) -> str:
    """A model.toml that reads back as this model."""
    lines = [f"# {comment}" for comment in comments]
    lines += ["format = 1", f'robot = "{model.robot}"']
    lines += [f'plant = "{model.plant}"'] if model.plant else []
    keys = {figure: key for key, figure in GEOMETRY.items()}
    lines += ["\n[geometry]"] if model.geometry else []
    lines += [f"{keys[figure]} = {value!r}" for figure, value in model.geometry.items()]
    return "\n".join(lines) + "\n" + effects_table(model.theta, model.intervals)


def read_effects(section: Section) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Values and intervals from `[effects.NAME]` tables: a parameter is a number, or a table with `value`."""
    theta: dict[str, float] = {}
    intervals: dict[str, tuple[float, float]] = {}
    for effect in section.values:
        if effect == Learnt.name:
            theta |= read_learnt(section.section(effect))
            continue
        if effect not in CATALOGUE:
            raise section.error(effect, f"no such effect; {nearest(effect, (*CATALOGUE, Learnt.name))}")
        known = [parameter.name for parameter in CATALOGUE[effect].parameters]
        table = section.section(effect)
        table.only(known)
        for name, parameter in zip(theta_names(CATALOGUE[effect]), known, strict=True):
            if parameter in table.values:
                _read_parameter(table, parameter, name, theta, intervals)
    return theta, intervals


def _read_parameter(
    table: Section, key: str, name: str, theta: dict[str, float], intervals: dict[str, tuple[float, float]]
) -> None:
    low, high = PARAMETERS[name].low, PARAMETERS[name].high
    if not isinstance(table.values[key], dict):
        theta[name] = table.number(key, low=low, high=high)
        return
    detail = table.section(key)
    detail.only(("value", "interval", "unit", "source"))
    theta[name] = detail.number("value", low=low, high=high)
    if "interval" in detail.values:
        intervals[name] = detail.bounds("interval")
    unit = detail.text("unit", PARAMETERS[name].unit)
    if unit != PARAMETERS[name].unit:
        raise detail.error("unit", f"must be '{PARAMETERS[name].unit}', got '{unit}'")


def effects_table(theta: Mapping[str, float], intervals: Mapping[str, tuple[float, float]]) -> str:
    """The `[effects.NAME]` tables that read back as these values and intervals."""
    lines: list[str] = []
    for effect, kind in CATALOGUE.items():
        pairs = list(zip(theta_names(kind), kind.parameters, strict=True))
        named = [(name, parameter) for name, parameter in pairs if name in theta]
        lines += [f"\n[effects.{effect}]"] if named else []
        for name, parameter in named:
            interval = intervals.get(name)
            finite = interval is not None and interval[0] < interval[1] and all(map(math.isfinite, interval))
            bounds = f", interval = [{interval[0]!r}, {interval[1]!r}]" if interval and finite else ""
            lines.append(f'{parameter.name} = {{ value = {theta[name]!r}{bounds}, unit = "{parameter.unit}" }}')
    return "\n".join(lines) + "\n" + learnt_text(theta)
