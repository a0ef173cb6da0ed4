"""Where a pose lies in its lane, to the last bit as the closed form had it that scored the first studies."""

from typing import NamedTuple

import numpy as np
import pytest

from proxytune.driving import lane_length, lane_point, lane_pose, off_map, shipped_map

ROAD = shipped_map("small_loop")
TILES, TILE, LANE_OFFSET = 3, 0.585, 0.22 * 0.585
SIDE = TILES * TILE


class Projection(NamedTuple):
    """The nearest point of the road's centre line, which lies half a tile around the square of the inner tiles."""

    normal: np.ndarray
    edges: np.ndarray
    outside: np.ndarray


def published_length(counter_clockwise):
    """Length of one lap along the centre line of the outer (counter-clockwise) or inner (clockwise) lane [m]."""
    edges = 4.0 * (TILES - 2) * TILE
    return np.asarray(edges + 2.0 * np.pi * corner_radius(counter_clockwise))


def published_pose(positions, headings):
    """See poses from the lane whose direction agrees with their heading."""
    normal, edges, outside = project(positions)
    outer = np.sin(headings - normal) >= 0.0
    sense = np.where(outer, 1.0, -1.0)
    way = sense * (edges + corner_radius(outer) * normal)
    turned = headings - normal - sense * np.pi / 2.0
    return (
        outer,
        np.mod(way, published_length(outer)),
        LANE_OFFSET - sense * outside,
        np.arctan2(np.sin(turned), np.cos(turned)),
    )


def published_point(counter_clockwise, along):
    """Where on the map a lane's centre line is after so much of a lap: `published_pose` the other way round."""
    edge, radius = (TILES - 2) * TILE, corner_radius(counter_clockwise)
    quarter = edge + radius * np.pi / 2.0
    side, past = np.divmod(np.where(counter_clockwise, along, -np.asarray(along)), quarter)
    turned = np.clip(past - edge, 0.0, None) / radius
    out = edge / 2.0 + radius * np.cos(turned)
    up = np.minimum(past, edge) - edge / 2.0 + radius * np.sin(turned)
    cosine, sine = np.cos(side * np.pi / 2.0), np.sin(side * np.pi / 2.0)
    return np.stack((cosine * out - sine * up, sine * out + cosine * up), axis=-1) + TILES * TILE / 2.0


def corner_radius(counter_clockwise):
    return TILE / 2.0 + np.where(counter_clockwise, LANE_OFFSET, -LANE_OFFSET)


def project(positions):
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
    return Projection(normal, edges, distance - TILE / 2.0)


def poses():
    """On the map and up to a metre off it; also on its diagonals, tiles' edges and the first numbers beside them."""
    random = np.random.default_rng(7)
    edges = np.array([0.0, 0.2925, 0.585, 0.8775, 1.17, 1.4625, 1.755])
    beside = (edges[:, None] + np.arange(-8, 9) * 2.0**-53).ravel()
    diagonal = random.uniform(-0.4, 0.4, 2000)
    positions = np.concatenate(
        (
            random.uniform(-0.5, 2.3, (30000, 2)),
            random.choice(beside, (5000, 2)),
            np.stack((random.uniform(-1.0, 2.8, 5000), random.choice(beside, 5000)), axis=1),
            np.stack((random.choice(beside, 5000), random.uniform(-1.0, 2.8, 5000)), axis=1),
            0.8775 + np.stack((diagonal, diagonal), axis=1),
            0.8775 + np.stack((diagonal, -diagonal), axis=1),
        )
    )
    headings = random.uniform(-10.0, 10.0, len(positions))
    headings[::5] = np.rint(headings[::5]) * np.pi / 2
    return positions, headings


def test_every_pose_is_seen_as_the_published_closed_form_sees_it_to_the_last_bit():
    positions, headings = poses()
    for ours, published in zip(lane_pose(ROAD, positions, headings), published_pose(positions, headings), strict=True):
        np.testing.assert_array_equal(ours, published)


def test_every_point_of_a_lane_is_the_published_closed_forms_to_the_last_bit():
    random = np.random.default_rng(8)
    along, outer = random.uniform(-12.0, 12.0, 20000), random.random(20000) < 0.5
    np.testing.assert_array_equal(lane_point(ROAD, outer, along), published_point(outer, along))
    assert [float(lane_length(ROAD, outer)) for outer in (True, False)] == [4.986477651384041, 3.369185753316016]
    assert [float(published_length(outer)) for outer in (True, False)] == [4.986477651384041, 3.369185753316016]


def test_a_hair_below_the_first_side_the_way_round_closes():
    y = TILE + np.arange(-20, 21) * 2.0**-53
    places = np.column_stack((np.full(y.size, 2.5 * TILE + LANE_OFFSET), y))
    pose, lap = lane_pose(ROAD, places, np.full(y.size, np.pi / 2)), lane_length(ROAD, True)
    assert np.mod(pose.along + lap / 2, lap) - lap / 2 == pytest.approx(0, abs=1e-12)
    assert pose.deviation == pytest.approx(0, abs=1e-12)


def test_points_of_many_lanes_and_ways_may_be_asked_for_at_once():
    outer, along = np.array([[True], [False]]), np.linspace(-1, 6, 5)
    together = lane_point(ROAD, outer, along)
    apart = [[lane_point(ROAD, bool(lane), float(way)) for way in along] for lane in outer]
    assert together == pytest.approx(np.array(apart), abs=1e-12)
    assert together.shape == (2, 5, 2)


def test_the_maps_middle_has_a_finite_answer():
    assert np.isfinite([*lane_pose(ROAD, np.full(2, SIDE / 2), np.array(0.3))[1:]]).all()


def test_poses_may_have_any_shape():
    positions, headings = (part[:60] for part in poses())
    flat = lane_pose(ROAD, positions, headings)
    folded = lane_pose(ROAD, positions.reshape(3, 4, 5, 2), headings.reshape(3, 4, 5))
    assert all(
        (one == other.ravel()).all() and other.shape == (3, 4, 5) for one, other in zip(flat, folded, strict=True)
    )


@pytest.mark.parametrize(
    ("x", "y", "off"),
    [
        (0.0, 0.0, False),
        (SIDE, SIDE, False),
        (-1e-9, 0.5, True),
        (0.5, -1e-9, True),
        (SIDE + 1e-9, 0.5, True),
        (0.5, SIDE + 1e-9, True),
        (float("nan"), 0.5, True),
        (0.5, float("nan"), True),
    ],
)
def test_off_the_map_is_beyond_its_edge_or_nowhere(x, y, off):
    assert off_map(ROAD, x, y) is off
