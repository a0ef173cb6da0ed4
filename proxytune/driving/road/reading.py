"""Maps as their files describe them: those that travel with the package, and a user's own beside the study."""

import functools
from pathlib import Path
from typing import Any

from proxytune.driving.road.checks import LARGEST_M, check_road
from proxytune.driving.road.maps import Paint, Road
from proxytune.driving.road.segments import Arc, Segment, Straight
from proxytune.errors import SettingsError
from proxytune.settings import Section, is_finite, nearest, read_settings
from proxytune.shipped import shipped

SHORTEST_M = 0.001
"""Shortest length that a map may state [m]."""

MOST_DEG = 90.0
"""Farthest that one arc turns [deg]."""


def map_names() -> tuple[str, ...]:
    """The maps that travel with the package."""
    return tuple(sorted(path.stem for path in (shipped("robots") / "maps").glob("*.toml")))


@functools.lru_cache
def shipped_map(name: str) -> Road:
    """A map that travels with the package.

    Raises:
        SettingsError: If there is no such map.
    """
    if name not in map_names():
        raise SettingsError(f"map '{name}' is unknown; {nearest(name, map_names())}")
    return read_map(shipped("robots") / "maps" / f"{name}.toml")


def chosen_map(section: Section) -> Road:
    """The map that a `[domain]` table names: one of the package's, or a .toml file beside the study.

    Raises:
        SettingsError: With file, key and remedy.
    """
    name = section.text("map", "small_loop")
    if name.endswith(".toml"):
        return read_map(section.file("map"))
    if name not in map_names():
        hint = f"{nearest(name, map_names())} (a map file of your own ends in .toml)"
        raise section.error("map", f"unknown value '{name}'; {hint}")
    return shipped_map(name)


def read_map(path: Path) -> Road:
    """Read a map from its file.

    Raises:
        SettingsError: If a key is missing, unknown or impossible, or the road is none that can be driven.
    """
    settings = read_settings(path)
    settings.only(("format", "description", "size", "starts", "road", "paint"))
    settings.whole("format", low=1, high=1)
    section = settings.section("road")
    section.only(("width", "lane_offset", "lane_width", "begin", "segments"))
    width, height = _numbers(settings, "size", 2)
    x, y, heading = _numbers(section, "begin", 3)
    road = Road(
        name=path.stem,
        description=settings.text("description"),
        size=(width, height),
        begin=(x, y, heading),
        segments=tuple(_segment(section, number, row) for number, row in enumerate(_list(section, "segments"))),
        width=_length(section, "width"),
        lane_offset=_length(section, "lane_offset"),
        lane_width=_length(section, "lane_width"),
        paint=_paint(settings.section("paint")),
        starts=_starts(settings),
    )
    check_road(road, settings)
    return road


def _paint(section: Section) -> Paint:
    section.only(("white_width", "yellow_width", "bend_radius", "straight_dash", "bend_dash", "tape_m"))
    return Paint(
        white_width=_length(section, "white_width"),
        yellow_width=_length(section, "yellow_width"),
        bend_radius=_length(section, "bend_radius") if "bend_radius" in section.values else None,
        straight_dash=_length(section, "straight_dash"),
        bend_dash=_length(section, "bend_dash"),
        tape_m=section.number("tape_m", 0.005, low=0.0, high=0.1),
    )


def _segment(road: Section, number: int, row: Any) -> Segment:
    if not isinstance(row, dict):
        problem = f"must be {{ straight = M }} or {{ radius = M, turn = DEG }}, got {row!r}"
        raise road.error(f"segments[{number}]", problem)
    section = Section(road.path, f"{road.name}segments[{number}].", row)
    if "straight" in row:
        section.only(("straight",))
        return Straight(_length(section, "straight"))
    section.only(("straight", "radius", "turn"))
    turn = section.number("turn", low=-MOST_DEG, high=MOST_DEG)
    if turn == 0.0:
        raise section.error("turn", "must not be 0; write { straight = M }")
    return Arc(_length(section, "radius"), turn)


def _starts(settings: Section) -> tuple[tuple[float, float, float], ...]:
    rows = {f"starts[{number}]": row for number, row in enumerate(_list(settings, "starts"))}
    section = Section(settings.path, "", rows)
    return tuple((x, y, heading) for x, y, heading in (_numbers(section, key, 3) for key in rows))


def _length(section: Section, key: str) -> float:
    return section.number(key, low=SHORTEST_M, high=LARGEST_M)


def _list(section: Section, key: str) -> list[Any]:
    value = section.values.get(key)
    if not isinstance(value, list) or not value:
        raise section.error(key, f"must be a list with something in it, got {value!r}")
    return value


def _numbers(section: Section, key: str, count: int) -> list[float]:
    value = section.values.get(key)
    numbers = value if isinstance(value, list) else []
    if len(numbers) != count or not all(_is_number(number) for number in numbers):
        raise section.error(key, f"must be a list of {count} finite numbers, got {value!r}")
    return [float(number) for number in numbers]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and is_finite(value)
