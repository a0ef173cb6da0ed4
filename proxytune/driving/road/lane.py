"""The lanes of a loop road as geometry: how far along, how far aside and how askew a robot is."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.road.maps import LoopMap

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


class _Projection(NamedTuple):
    """The nearest point of the road's centre line, which lies half a tile around the square of the inner tiles.

    Attributes:
        normal: Direction that points out of the loop there, from 0 to 2π [rad].
        edges: Way along that square's edges from where the normal is 0 [m], counter-clockwise.
        outside: Signed distance from the road's centre line, outside the loop positive [m].
    """

    normal: Values
    edges: Values
    outside: Values


def lane_length(road: LoopMap, counter_clockwise: Flags | bool) -> Values:
    """Length of one lap along the centre line of the outer (counter-clockwise) or inner (clockwise) lane [m]."""
    edges = 4.0 * (road.tiles - 2) * road.tile
    return np.asarray(edges + 2.0 * np.pi * _corner_radius(road, counter_clockwise))


def lane_pose(road: LoopMap, positions: Values, headings: Values) -> LanePose:
    """See poses from the lane whose direction agrees with their heading.

    What counts is the centre line's nearest point, so every finite pose has a finite answer, off the map too.
    The deviation from either lane is continuous everywhere; along and heading error jump only
    where two sides are equally near: on the diagonals of the square that the road encloses.

    Args:
        road: The map.
        positions: x and y [m], shape (…, 2).
        headings: Counter-clockwise from the x axis [rad], shape (…).
    """
    normal, edges, outside = _project(road, positions)
    outer = np.sin(headings - normal) >= 0.0
    sense = np.where(outer, 1.0, -1.0)
    way = sense * (edges + _corner_radius(road, outer) * normal)
    turned = headings - normal - sense * np.pi / 2.0
    return LanePose(
        counter_clockwise=outer,
        along=np.mod(way, lane_length(road, outer)),
        deviation=road.lane_offset - sense * outside,
        heading_error=np.arctan2(np.sin(turned), np.cos(turned)),
    )


def lane_point(road: LoopMap, counter_clockwise: Flags | bool, along: Values | float) -> Values:
    """Where on the map a lane's centre line is after so much of a lap: `lane_pose` the other way round.

    Args:
        road: The map.
        counter_clockwise: Whether it is the outer lane, else the inner one.
        along: Arc length in the lane's direction [m], shape (…); whole laps make no difference.

    Returns:
        x and y [m], shape (…, 2).
    """
    edge, radius = (road.tiles - 2) * road.tile, _corner_radius(road, counter_clockwise)
    quarter = edge + radius * np.pi / 2.0
    side, past = np.divmod(np.where(counter_clockwise, along, -np.asarray(along)), quarter)
    turned = np.clip(past - edge, 0.0, None) / radius
    out = edge / 2.0 + radius * np.cos(turned)
    up = np.minimum(past, edge) - edge / 2.0 + radius * np.sin(turned)
    cosine, sine = np.cos(side * np.pi / 2.0), np.sin(side * np.pi / 2.0)
    return np.stack((cosine * out - sine * up, sine * out + cosine * up), axis=-1) + road.side / 2.0


def off_map(road: LoopMap, x: float, y: float) -> bool:
    """Whether a point [m] lies beyond the map's edge; a point that is not a number does."""
    return not (0.0 <= x <= road.side and 0.0 <= y <= road.side)


def _corner_radius(road: LoopMap, counter_clockwise: Flags | bool) -> Values:
    return road.tile / 2.0 + np.where(counter_clockwise, road.lane_offset, -road.lane_offset)


def _project(road: LoopMap, positions: Values) -> _Projection:
    half = (road.tiles - 2) * road.tile / 2.0
    x, y = np.moveaxis(np.asarray(positions, dtype=float) - road.side / 2.0, -1, 0)
    out_x, out_y = x - np.clip(x, -half, half), y - np.clip(y, -half, half)
    enclosed = (out_x == 0.0) & (out_y == 0.0)
    sideways = np.abs(x) >= np.abs(y)
    out_x = np.where(enclosed & sideways, np.copysign(1.0, x), out_x)
    out_y = np.where(enclosed & ~sideways, np.copysign(1.0, y), out_y)
    normal = np.mod(np.arctan2(out_y, out_x), 2.0 * np.pi)
    side = np.floor(normal / (np.pi / 2.0))  # 0 right, 1 top, 2 left, 3 bottom; a corner belongs to the side before it
    past = np.choose(side.astype(int) % 4, (y, -x, -y, x))
    edges = 2.0 * half * side + np.clip(past, -half, half) + half
    distance = np.where(enclosed, np.maximum(np.abs(x), np.abs(y)) - half, np.hypot(out_x, out_y))
    return _Projection(normal, edges, distance - road.tile / 2.0)
