"""Whether a map can be driven: its road closes, keeps to the map and clear of itself, and starts lie in lanes."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.road.centre_line import find_nearest
from proxytune.driving.road.lane import lane_length, lane_point, lane_pose
from proxytune.driving.road.layout import corners, lay_out
from proxytune.driving.road.maps import Road
from proxytune.driving.road.segments import Arc
from proxytune.settings import Section

LARGEST_M = 10.0
"""Longest side of a map [m]: its floor is drawn at 2.5 mm a pixel."""

STEP_M = 0.01
"""How far apart the points of the road's edges are that are looked at [m]."""

TOLERANCE = 1e-4
"""How far off a road may be from where it should be [m]."""


def check_road(road: Road, settings: Section) -> None:
    """Refuse a map that cannot be driven.

    Args:
        road: As its file describes it.
        settings: The file.

    Raises:
        SettingsError: With file, key and remedy.
    """
    _check_size(road, settings)
    _check_lanes(road, settings.section("road"))
    _check_bends(road, settings)
    _check_closed(road, settings.section("road"))
    _check_edges(road, settings.section("road"))
    _check_starts(road, settings)


def _check_size(road: Road, settings: Section) -> None:
    if not 0.0 < min(road.size) <= max(road.size) <= LARGEST_M:
        given = f"{road.size[0]:g} m × {road.size[1]:g} m"
        raise settings.error("size", f"each side must be above 0 and at most {LARGEST_M:g} m, got {given}")


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
    points = np.concatenate([_points(edges, outer) for outer in (True, False)])
    clear = np.abs(find_nearest(lay_out(road.begin, road.segments), points).outside) > half - TOLERANCE
    if not clear.all():
        x, y = points[int(np.argmin(clear))]
        raise section.error("segments", f"the road overlaps itself at ({x:.2f}, {y:.2f}); lay its parts farther apart")
    beside = np.any((points < -TOLERANCE) | (points > np.array(road.size) + TOLERANCE), axis=1)
    if beside.any():
        x, y = points[int(np.argmax(beside))]
        problem = f"the road leaves the map at ({x:.2f}, {y:.2f}); move begin or make size larger"
        raise section.error("segments", problem)


def _points(road: Road, outer: bool) -> NDArray[np.float64]:
    """A lane's centre line point by point."""
    return lane_point(road, outer, np.arange(0.0, float(lane_length(road, outer)), STEP_M))


def _check_starts(road: Road, settings: Section) -> None:
    poses = np.array(road.starts)
    aside = np.abs(lane_pose(road, poses[:, :2], np.radians(poses[:, 2])).deviation)
    for number in np.flatnonzero(aside > road.lane_width / 2.0):
        limit = f"move or turn it: at most {road.lane_width / 2.0:g} m"
        problem = f"lies {aside[number]:.3f} m beside the lane that runs its way; {limit}"
        raise settings.error(f"starts[{number}]", problem)
