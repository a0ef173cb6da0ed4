"""The closed form of a square loop's lanes by which the first studies were scored: the oracle of small_loop."""

from typing import NamedTuple

import numpy as np

TILES, TILE, LANE_OFFSET = 3, 0.585, 0.22 * 0.585


class _Projection(NamedTuple):
    """The nearest point of the road's centre line, which lies half a tile around the square of the inner tiles."""

    normal: np.ndarray
    edges: np.ndarray
    outside: np.ndarray


def lane_length(counter_clockwise):
    """Length of one lap along the centre line of the outer (counter-clockwise) or inner (clockwise) lane [m]."""
    edges = 4.0 * (TILES - 2) * TILE
    return np.asarray(edges + 2.0 * np.pi * _corner_radius(counter_clockwise))


def lane_pose(positions, headings):
    """See poses from the lane whose direction agrees with their heading."""
    normal, edges, outside = _project(positions)
    outer = np.sin(headings - normal) >= 0.0
    sense = np.where(outer, 1.0, -1.0)
    way = sense * (edges + _corner_radius(outer) * normal)
    turned = headings - normal - sense * np.pi / 2.0
    return (
        outer,
        np.mod(way, lane_length(outer)),
        LANE_OFFSET - sense * outside,
        np.arctan2(np.sin(turned), np.cos(turned)),
    )


def lane_point(counter_clockwise, along):
    """Where on the map a lane's centre line is after so much of a lap: `lane_pose` the other way round."""
    edge, radius = (TILES - 2) * TILE, _corner_radius(counter_clockwise)
    quarter = edge + radius * np.pi / 2.0
    side, past = np.divmod(np.where(counter_clockwise, along, -np.asarray(along)), quarter)
    turned = np.clip(past - edge, 0.0, None) / radius
    out = edge / 2.0 + radius * np.cos(turned)
    up = np.minimum(past, edge) - edge / 2.0 + radius * np.sin(turned)
    cosine, sine = np.cos(side * np.pi / 2.0), np.sin(side * np.pi / 2.0)
    return np.stack((cosine * out - sine * up, sine * out + cosine * up), axis=-1) + TILES * TILE / 2.0


def _corner_radius(counter_clockwise):
    return TILE / 2.0 + np.where(counter_clockwise, LANE_OFFSET, -LANE_OFFSET)


def _project(positions):
    half = (TILES - 2) * TILE / 2.0
    x, y = np.moveaxis(np.asarray(positions, dtype=float) - TILES * TILE / 2.0, -1, 0)
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
    return _Projection(normal, edges, distance - TILE / 2.0)
