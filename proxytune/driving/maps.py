"""Maps from their files: those that travel with the package, and a user's own beside the study.

A map that cannot be driven is refused: its road must close, keep to the map and clear of itself, and starts lie in
lanes.
"""

import functools
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from proxytune.driving.lane import corners, find_nearest, lane_length, lane_point, lane_pose, lay_out
from proxytune.driving.road import Arc, Paint, Road, Segment, Straight
from proxytune.errors import SettingsError
from proxytune.files import shipped
from proxytune.settings import Section, is_finite, nearest, read_settings

LARGEST_M = 10.0
"""Longest side of a map [m]: its floor is drawn at 2.5 mm a pixel."""
STEP_M = 0.01
"""How far apart the points of the road's edges are that are looked at [m]."""
TOLERANCE = 1e-4
"""How far off a road may be from where it should be [m]."""


def check_road(road: Road, settings: Section) -> None:
    """Refuse a map that cannot be driven, as its file describes it."""
    if not 0.0 < min(road.size) <= max(road.size) <= LARGEST_M:
        given = f"{road.size[0]:g} m × {road.size[1]:g} m"
        raise settings.error("size", f"each side must be above 0 and at most {LARGEST_M:g} m, got {given}")
    _check_lanes(road, settings.section("road"))
    _check_bends(road, settings)
    _check_closed(road, settings.section("road"))
    _check_edges(road, settings.section("road"))
    _check_starts(road, settings)


def _check_lanes(road: Road, section: Section) -> None:
    if road.lane_width > 2.0 * road.lane_offset:
        most = f"at most {2.0 * road.lane_offset:g} m, twice lane_offset"
        raise section.error("lane_width", f"the two lanes overlap at {road.lane_width:g} m; {most}")
    need = 2.0 * road.lane_offset + road.lane_width
    if road.width < need:
        raise section.error("width", f"{road.width:g} m has no room for two lanes; at least {need:g} m")


def _check_bends(road: Road, settings: Section) -> None:
    radii = {number: s.radius for number, s in enumerate(road.segments) if isinstance(s, Arc)}
    for number, radius in radii.items():
        if radius < road.width / 2.0:
            least = f"at least {road.width / 2.0:g} m"
            problem = f"{radius:g} m is too tight a bend for a road {road.width:g} m wide; {least}"
            raise settings.section("road").error(f"segments[{number}].radius", problem)
    tight = road.paint.bend_radius
    if tight is not None and radii and tight > min(radii.values()):
        most = f"at most {min(radii.values()):g} m, the tightest bend's radius"
        raise settings.section("paint").error("bend_radius", f"{tight:g} m is wider than a bend; {most}")


def _check_closed(road: Road, section: Section) -> None:
    turn = math.fsum(s.turn_deg for s in road.segments if isinstance(s, Arc))
    if abs(turn + 360.0) < TOLERANCE:
        raise section.error("segments", "the road runs clockwise; lay it counter-clockwise, left turns above 0")
    if abs(turn - 360.0) > TOLERANCE:
        raise section.error("segments", f"the road does not close: its turns add up to {turn:g}°; make it 360°")
    end = corners(road.begin, road.segments)[-1]
    gap = math.dist(end, road.begin[:2])
    if gap > TOLERANCE:
        where = f"it ends at ({end[0]:.3f}, {end[1]:.3f}), {gap:.3f} m from where it begins"
        raise section.error("segments", f"the road does not close: {where}; change the straights' lengths")


def _check_edges(road: Road, section: Section) -> None:
    half = road.width / 2.0 * (1.0 - 1e-6)
    edges = replace(road, lane_offset=half)
    ways = {outer: np.arange(0.0, float(lane_length(edges, outer)), STEP_M) for outer in (True, False)}
    points = np.concatenate([lane_point(edges, outer, along) for outer, along in ways.items()])
    clear = np.abs(find_nearest(lay_out(road.begin, road.segments), points).outside) > half - TOLERANCE
    if not clear.all():
        x, y = points[int(np.argmin(clear))]
        raise section.error("segments", f"the road overlaps itself at ({x:.2f}, {y:.2f}); lay its parts farther apart")
    beside = np.any((points < -TOLERANCE) | (points > np.array(road.size) + TOLERANCE), axis=1)
    if beside.any():
        x, y = points[int(np.argmax(beside))]
        problem = f"the road leaves the map at ({x:.2f}, {y:.2f}); move begin or make size larger"
        raise section.error("segments", problem)


def _check_starts(road: Road, settings: Section) -> None:
    poses = np.array(road.starts)
    aside = np.abs(lane_pose(road, poses[:, :2], np.radians(poses[:, 2])).deviation)
    for number in np.flatnonzero(aside > road.lane_width / 2.0):
        limit = f"move or turn it: at most {road.lane_width / 2.0:g} m"
        problem = f"lies {aside[number]:.3f} m beside the lane that runs its way; {limit}"
        raise settings.error(f"starts[{number}]", problem)


SHORTEST_M = 0.001
"""Shortest length that a map may state [m]."""
MOST_DEG = 90.0
"""Farthest that one arc turns [deg]."""


def map_names() -> tuple[str, ...]:
    """The maps that travel with the package."""
    return tuple(sorted(path.stem for path in (shipped("robots") / "maps").glob("*.toml")))


@functools.lru_cache
def shipped_map(name: str) -> Road:
    """A map that travels with the package; a SettingsError if there is none of this name."""
    if name not in map_names():
        raise SettingsError(f"map '{name}' is unknown; {nearest(name, map_names())}")
    return read_map(shipped("robots") / "maps" / f"{name}.toml")


def chosen_map(section: Section) -> Road:
    """The map that a `[domain]` table names: one of the package's, or a .toml file beside the study."""
    name = section.text("map", "small_loop")
    if name.endswith(".toml"):
        return read_map(section.file("map"))
    if name not in map_names():
        hint = f"{nearest(name, map_names())} (a map file of your own ends in .toml)"
        raise section.error("map", f"unknown value '{name}'; {hint}")
    return shipped_map(name)


def read_map(path: Path) -> Road:
    """Read a map from its file; a SettingsError if a key is wrong, or the road is none that can be driven."""
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
    sound = [isinstance(one, int | float) and not isinstance(one, bool) and is_finite(one) for one in numbers]
    if len(numbers) != count or not all(sound):
        raise section.error(key, f"must be a list of {count} finite numbers, got {value!r}")
    return [float(number) for number in numbers]
