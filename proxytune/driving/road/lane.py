"""The lanes of a road as geometry: how far along, how far aside and how askew a robot is."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.road.centre_line import bend_radius, find_nearest, way_round
from proxytune.driving.road.layout import Layout, lay_out
from proxytune.driving.road.maps import Road

Values = NDArray[np.float64]
Flags = NDArray[np.bool_]


class LanePose(NamedTuple):
    """Poses as seen from the lanes they are in, each field of shape (…).

    Attributes:
        counter_clockwise: Whether it is the outer lane (right-hand traffic), else the inner, clockwise one.
        along: Arc length along that lane's centre line in its direction [m], from 0 to its length.
        deviation: Distance from that centre line [m], positive to the left of travel.
        heading_error: Heading less the lane's direction [rad], from −π/2 to π/2, positive to the left.
    """

    counter_clockwise: Flags
    along: Values
    deviation: Values
    heading_error: Values


def lane_length(road: Road, counter_clockwise: Flags | bool) -> Values:
    """Length of one lap along the centre line of the outer (counter-clockwise) or inner (clockwise) lane [m]."""
    layout = lay_out(road.begin, road.segments)
    return _way_to_end(layout, len(layout.side) - 1, _offset(road, counter_clockwise))


def lane_pose(road: Road, positions: Values, headings: Values) -> LanePose:
    """See poses from the lane whose direction agrees with their heading.

    What counts is the centre line's nearest point, so every finite pose has a finite answer, off the map too.
    The deviation from either lane is continuous everywhere; along and heading error jump only
    where two parts of the road are equally near.

    Args:
        road: The map.
        positions: x and y [m], shape (…, 2).
        headings: Counter-clockwise from the x axis [rad], shape (…).
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


def lane_point(road: Road, counter_clockwise: Flags | bool, along: Values | float) -> Values:
    """Where on the map a lane's centre line is after so much of a lap: `lane_pose` the other way round.

    Args:
        road: The map.
        counter_clockwise: Whether it is the outer lane, else the inner one.
        along: Arc length in the lane's direction [m], shape (…); whole laps make no difference.

    Returns:
        x and y [m], shape (…, 2).
    """
    layout, offset = lay_out(road.begin, road.segments), _offset(road, counter_clockwise)
    part = len(layout.side) // layout.repeats
    repeat, past = np.divmod(
        np.where(counter_clockwise, along, -np.asarray(along)), _way_to_end(layout, part - 1, offset)
    )
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
    """Whether a point [m] lies beyond the map's edge; a point that is not a number does."""
    return not (0.0 <= x <= road.size[0] and 0.0 <= y <= road.size[1])


def _offset(road: Road, counter_clockwise: Flags | bool) -> Values:
    """How far right of the road's centre line, seen counter-clockwise, a lane's is [m]."""
    return np.where(counter_clockwise, road.lane_offset, -road.lane_offset)


def _way_to_end(layout: Layout, section: int, offset: Values) -> Values:
    """How far round the map a section ends, counter-clockwise [m]."""
    number = np.asarray(section)
    return way_round(layout, number, layout.last[number], layout.turn[number], offset)
