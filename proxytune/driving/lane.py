"""Where on the road a robot is: which lane it should be in, how far along it, and how far beside its centre."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.maps import LoopMap

Numbers = NDArray[np.floating[Any]]


class LanePosition(NamedTuple):
    """Positions in the lanes that their headings belong to, each of shape (…,).

    Attributes:
        outer: Whether the lane is the outer one, which runs counter-clockwise; the inner one runs clockwise.
        along: Arc length along the lane's centre line in its direction [m], from 0 to the lap's length.
        deviation: Distance from the lane's centre line [m], positive to the left of its direction.
        heading_error: Heading less the lane's direction [rad], within ±π/2.
        lap: Length of the lane's centre line [m].
    """

    outer: NDArray[np.bool_]
    along: Numbers
    deviation: Numbers
    heading_error: Numbers
    lap: Numbers


def lap_length(road: LoopMap, *, outer: bool) -> float:
    """Length of a lane's centre line [m]: four straights and four quarter circles."""
    radius = road.tile / 2.0 + (road.lane_offset if outer else -road.lane_offset)
    return 4.0 * _straight(road) + 2.0 * np.pi * radius


def lane_position(road: LoopMap, poses: Numbers) -> LanePosition:
    """Find poses (…, 3) of x [m], y [m], heading [rad] in the lane whose direction agrees with the heading.

    The road's centre line lies half a tile outside the square that the loop runs round; every point is projected on
    it, whether on the road or not.
    """
    direction, edge, turned, outward = _around(road, np.asarray(poses, dtype=float))
    error = np.remainder(poses[..., 2] - direction + np.pi, 2.0 * np.pi) - np.pi
    outer = np.abs(error) <= np.pi / 2.0
    radius = road.tile / 2.0 + np.where(outer, road.lane_offset, -road.lane_offset)
    lap = 4.0 * _straight(road) + 2.0 * np.pi * radius
    anticlockwise = edge + radius * turned
    return LanePosition(
        outer,
        np.remainder(np.where(outer, anticlockwise, lap - anticlockwise), lap),
        np.where(outer, road.lane_offset - outward, road.lane_offset + outward),
        np.where(outer, error, error - np.sign(error) * np.pi),
        lap,
    )


def _straight(road: LoopMap) -> float:
    return (road.tiles - 2) * road.tile


def _around(road: LoopMap, poses: Numbers) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Counter-clockwise round the inner square: direction [rad], straights passed [m], angle turned [rad], and
    distance outwards from the road's centre line [m]."""
    side, half = _straight(road), _straight(road) / 2.0
    x, y = poses[..., 0] - road.side / 2.0, poses[..., 1] - road.side / 2.0
    over_x, over_y = np.abs(x) - half, np.abs(y) - half
    corner = (over_x > 0.0) & (over_y > 0.0)
    vertical = over_x > over_y  # nearest to the east or west edge
    normal = np.where(vertical, np.where(x > 0.0, 0.0, np.pi), np.where(y > 0.0, np.pi / 2.0, -np.pi / 2.0))
    across = np.arctan2(np.maximum(over_y, 0.0) * np.sign(y), np.maximum(over_x, 0.0) * np.sign(x))
    normal = np.where(corner, across, normal)
    outward = np.where(corner, np.hypot(over_x, over_y), np.maximum(over_x, over_y)) - road.tile / 2.0
    turned = np.remainder(normal + np.pi / 2.0, 2.0 * np.pi)  # from the southern edge on
    quarters = turned / (np.pi / 2.0)
    passed = np.where(corner, np.floor(quarters), np.rint(quarters))
    ahead = np.select(
        [corner, vertical & (x > 0.0), vertical, y > 0.0],
        [np.full_like(x, side), y + half, half - y, half - x],
        x + half,
    )
    return normal + np.pi / 2.0, passed * side + np.clip(ahead, 0.0, side), turned, outward
