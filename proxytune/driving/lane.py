"""The lanes of a road as geometry: how far along, how far aside and how askew a robot is.

A road is laid out by sections, a straight and the bend that ends it. Both share a pivot, the centre of the bend: beside
the straight the centre line is the bend's radius away from the line through the pivot, round the bend from the pivot
itself. On that rest the nearest point of the centre line, the way round the map, and the lanes on either side.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from proxytune.arrays import Flags, Floats
from proxytune.driving.road import Road, RoadSection, Segment, repeats_of, road_sections

Begin = tuple[float, float, float]

PICOMETRE = 12
"""Decimals to which a layout is rounded [m]: figures that are written in decimals stay what was written."""


class RoadLayout(NamedTuple):
    """The sections of a road in their order, one in each entry of the arrays."""

    normal: Floats  # direction away from the pivot along the straight, from 0 to 2π [rad]
    side: Floats  # 1 where the bend is to the left, −1 where it is to the right
    radius: Floats  # of the bend [m], 0 where there is none
    turn: Floats  # of the bend, positive to either side [rad]
    pivot: Floats  # how far the pivot lies from the origin in the direction of `normal` [m]
    first: Floats  # how far the straight's beginning lies from the origin in the straight's direction [m]
    last: Floats  # how far its end does [m]
    straights: Floats  # length of the straights of earlier sections [m]
    turned: Floats  # turn of the earlier bends that are as this section's [rad]: one product, whose length rounds once
    other_arcs: Floats  # length of the other earlier bends [m]
    other_turns: Floats  # their signed turn [rad]
    across: Floats  # unit vectors of `normal`, (sections, 2)
    along: Floats  # unit vectors of the straights' directions, (sections, 2)
    origin: Floats  # point of the map that repeats of the road turn about, x and y [m]
    repeats: int  # how many times the road repeats its first sections to close, 1 where it does not


@functools.lru_cache
def lay_out(begin: Begin, segments: tuple[Segment, ...]) -> RoadLayout:
    """Lay a closed road out, whose first segment begins at x [m], y [m], heading [deg]."""
    lap = tuple(road_sections(segments))
    repeats = repeats_of(lap)
    starts = corners(begin, segments)[:-1]
    origin = np.round(starts[:: len(lap) // repeats].mean(axis=0), PICOMETRE)
    rows = [(*_place(begin, lap, number, starts[number] - origin), *_before(lap, number)) for number in range(len(lap))]
    figures = np.array(rows).T
    across, side = unit(figures[0]), figures[1]
    along = side[:, None] * np.stack((-across[:, 1], across[:, 0]), axis=-1)
    return RoadLayout._make((*figures, across, along, origin, repeats))


def corners(begin: Begin, segments: tuple[Segment, ...]) -> Floats:
    """Places where each section begins and the last one ends, (sections + 1, 2) [m]."""
    lap, places = tuple(road_sections(segments)), [np.array(begin[:2])]
    for number, section in enumerate(lap):
        here = math.radians(begin[2]) + _turn(lap[:number])
        left = math.copysign(section.radius, section.turn)
        bend = left * (unit(here + math.pi / 2.0) - unit(here + section.turn + math.pi / 2.0))
        places.append(places[-1] + section.straight * unit(here) + bend)
    return np.array(places)


def unit(angle: ArrayLike) -> Floats:
    """Unit vectors (…, 2) in these directions [rad]; those along an axis are exact."""
    return np.round(np.stack((np.cos(angle), np.sin(angle)), axis=-1), 15) + 0.0


def _place(begin: Begin, lap: tuple[RoadSection, ...], number: int, start: Floats) -> tuple[float, ...]:
    """The fields from `normal` to `last` of a section that starts there, as seen from the origin [m]."""
    section = lap[number]
    side = math.copysign(1.0, section.turn)
    normal = (math.radians(begin[2]) - side * math.pi / 2.0 + _turn(lap[:number])) % (2.0 * math.pi)
    across = unit(normal)
    pivot = round(float(start @ across) - section.radius, PICOMETRE)
    first = round(float(start @ (-across[1], across[0])) * side, PICOMETRE)
    last = round(first + section.straight, PICOMETRE)
    return normal, side, section.radius, abs(section.turn), pivot, first, last


def _before(lap: tuple[RoadSection, ...], number: int) -> tuple[float, ...]:
    """The fields from `straights` on of a section."""
    earlier, bend = lap[:number], (lap[number].radius, lap[number].turn > 0.0)
    others = [section for section in earlier if (section.radius, section.turn > 0.0) != bend]
    alike = [section for section in earlier if (section.radius, section.turn > 0.0) == bend]
    arcs = math.fsum(section.radius * abs(section.turn) for section in others)
    return math.fsum(section.straight for section in earlier), abs(_turn(alike)), arcs, _turn(others)


def _turn(part: tuple[RoadSection, ...] | list[RoadSection]) -> float:
    return math.fsum(section.turn for section in part)


Numbers = NDArray[np.intp]

BEYOND = 1e-12
"""A point beyond a section's end counts as so much farther away [m]: rounding must not take it for the next one's."""


class NearestPoints(NamedTuple):
    """The nearest points of the centre line, each field of shape (…)."""

    section: Numbers  # number of the section it lies on
    straight: Floats  # how far from the origin it lies in the direction of the section's straight [m]
    turned: Floats  # how much of the section's bend lies behind it [rad]
    normal: Floats  # direction away from the section's pivot there [rad]
    outside: Floats  # signed distance from the centre line, away from the pivot positive [m]


def find_nearest(layout: RoadLayout, positions: Floats) -> NearestPoints:
    """Find the centre line's points that are nearest to x and y [m], (…, 2)."""
    places = np.asarray(positions, dtype=float) - layout.origin
    section = _nearest_section(layout, places)
    view = _view(layout, section, places)
    away = view.out[..., None] * layout.across[section] + view.past[..., None] * layout.along[section]
    direction = np.mod(np.arctan2(away[..., 1], away[..., 0]), 2.0 * np.pi)
    normal = np.where(view.in_bend, direction, layout.normal[section])
    turned = layout.side[section] * (normal - layout.normal[section])
    turned -= 2.0 * np.pi * np.rint(turned / (2.0 * np.pi))
    return NearestPoints(section, view.straight, turned, normal, view.outside)


def way_round(layout: RoadLayout, section: Numbers, straight: Floats, turned: Floats, offset: Floats) -> Floats:
    """Way round the map, counter-clockwise [m], to a point of the line that is `offset` right of the centre line [m].

    Section, straight and turned are that point's as `NearestPoints` has them.
    """
    edges = layout.straights[section] + straight - layout.first[section]
    others = layout.other_arcs[section] + offset * layout.other_turns[section]
    return edges + others + bend_radius(layout, section, offset) * (layout.turned[section] + turned)


def bend_radius(layout: RoadLayout, section: Numbers, offset: Floats) -> Floats:
    """Radius of a section's bend on a line so far right of the centre line [m]."""
    return layout.radius[section] + layout.side[section] * offset


class _View(NamedTuple):
    """Places as seen from a section's pivot, each field of shape (…)."""

    out: Floats  # how far they are from the pivot across the straight [m]
    straight: Floats  # how far from the origin the straight's nearest point lies in its direction [m]
    past: Floats  # how far they are ahead of that point in the same direction [m]
    in_bend: Flags  # whether the bend is nearer than the straight
    outside: Floats  # signed distance from the section gone on with past its ends, away from the pivot positive [m]


def _view(layout: RoadLayout, section: Numbers, places: Floats) -> _View:
    """See places (…, 2), relative to the origin [m], from one section each or from all."""
    x, y = places[..., 0], places[..., 1]
    across, along = layout.across[section], layout.along[section]
    out = x * across[..., 0] + y * across[..., 1] - layout.pivot[section]
    way = x * along[..., 0] + y * along[..., 1]
    straight = np.minimum(np.maximum(way, layout.first[section]), layout.last[section])
    past = way - straight
    in_bend = (past > 0.0) & (layout.turn[section] > 0.0)
    outside = np.where(in_bend, np.hypot(out, past), out) - layout.radius[section]
    return _View(out, straight, past, in_bend, outside)


def _nearest_section(layout: RoadLayout, places: Floats) -> Numbers:
    """Number of the nearest section; among equally near ones the one whose straight runs most north and south."""
    order = np.argsort(-np.abs(layout.across[:, 0]), kind="stable")
    view = _view(layout, order, places[..., None, :])
    over = np.maximum(np.arctan2(view.past, view.out) - layout.turn[order], 0.0)
    beyond = np.where(view.in_bend, layout.radius[order] * over, np.abs(view.past))
    distance = np.abs(view.outside) + beyond + BEYOND * (beyond > 0.0)
    return np.asarray(order[np.argmin(distance, axis=-1)])


class LanePose(NamedTuple):
    """Poses as seen from the lanes they are in, each field of shape (…)."""

    counter_clockwise: Flags  # whether it is the outer lane (right-hand traffic), else the inner, clockwise one
    along: Floats  # arc length along that lane's centre line in its direction [m], from 0 to its length
    deviation: Floats  # distance from that centre line [m], positive to the left of travel
    heading_error: Floats  # heading less the lane's direction [rad], from −π/2 to π/2, positive to the left


def lane_length(road: Road, counter_clockwise: Flags | bool) -> Floats:
    """Length of one lap along the centre line of the outer (counter-clockwise) or inner (clockwise) lane [m]."""
    layout = lay_out(road.begin, road.segments)
    return _way_to_end(layout, len(layout.side) - 1, _offset(road, counter_clockwise))


def lane_pose(road: Road, positions: Floats, headings: Floats) -> LanePose:
    """See poses from the lane whose direction agrees with their heading.

    What counts is the centre line's nearest point, so every finite pose has a finite answer, off the map too.
    The deviation from either lane is continuous everywhere; along and heading error jump only
    where two parts of the road are equally near. Positions are x and y [m] (…, 2), headings counter-clockwise from the
    x axis [rad] (…).
    """
    layout = lay_out(road.begin, road.segments)
    near = find_nearest(layout, positions)
    side = layout.side[near.section]
    outer = side * np.sin(headings - near.normal) >= 0.0
    sense = np.where(outer, side, -side)
    way = way_round(layout, near.section, near.straight, near.turned, _offset(road, outer))
    turned = headings - near.normal - sense * np.pi / 2.0
    return LanePose(
        counter_clockwise=outer,
        along=np.mod(np.where(outer, way, -way), lane_length(road, outer)),
        deviation=road.lane_offset - sense * near.outside,
        heading_error=np.arctan2(np.sin(turned), np.cos(turned)),
    )


def lane_point(road: Road, counter_clockwise: Flags | bool, along: Floats | float) -> Floats:
    """Point of a lane's centre line after so much of a lap, x and y [m] (…, 2): `lane_pose` the other way round.

    It is `along` the outer lane, or the inner one, in its direction [m] (…); whole laps make no difference.
    """
    layout, offset = lay_out(road.begin, road.segments), _offset(road, counter_clockwise)
    part = len(layout.side) // layout.repeats
    way = np.where(counter_clockwise, along, -np.asarray(along))
    repeat, past = np.divmod(way, _way_to_end(layout, part - 1, offset))
    section = np.sum([past >= _way_to_end(layout, number, offset) for number in range(part - 1)], axis=0, dtype=int)
    past = past - way_round(layout, section, layout.first[section], np.zeros(()), offset)
    radius, straight = bend_radius(layout, section, offset), layout.last[section] - layout.first[section]
    turned = np.clip(past - straight, 0.0, None) / radius
    out = layout.pivot[section] + radius * np.cos(turned)
    up = layout.side[section] * (np.minimum(past, straight) + layout.first[section] + radius * np.sin(turned))
    angle = layout.normal[section] + repeat * (2.0 * np.pi / layout.repeats)
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack((cosine * out - sine * up, sine * out + cosine * up), axis=-1) + layout.origin


def off_map(road: Road, x: float, y: float) -> bool:
    """Tell whether a point [m] lies beyond the map's edge; a point that is not a number does."""
    return not (0.0 <= x <= road.size[0] and 0.0 <= y <= road.size[1])


def _offset(road: Road, counter_clockwise: Flags | bool) -> Floats:
    """Distance of a lane's centre line to the right of the road's, seen counter-clockwise [m]."""
    return np.where(counter_clockwise, road.lane_offset, -road.lane_offset)


def _way_to_end(layout: RoadLayout, section: int, offset: Floats) -> Floats:
    """Way round the map to a section's end, counter-clockwise [m]."""
    number = np.asarray(section)
    return way_round(layout, number, layout.last[number], layout.turn[number], offset)
