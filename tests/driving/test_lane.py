"""Where a pose lies in its lane, whatever the shape of what is asked, and what is off the map."""

import numpy as np
import pytest

from proxytune.driving import lane_length, lane_point, lane_pose, off_map, shipped_map

ROAD = shipped_map("small_loop")
TILE, SIDE = 0.585, 1.755


def test_poses_and_lanes_may_have_any_shape_and_the_maps_middle_has_an_answer():
    outer, along = np.array([[True], [False]]), np.linspace(-1, 6, 5)
    together = lane_point(ROAD, outer, along)
    apart = [[lane_point(ROAD, bool(lane), float(way)) for way in along] for lane in outer]
    assert together == pytest.approx(np.array(apart), abs=1e-12)
    assert together.shape == (2, 5, 2)

    random = np.random.default_rng(7)
    positions, headings = random.uniform(-0.5, 2.3, (60, 2)), random.uniform(-10.0, 10.0, 60)
    flat = lane_pose(ROAD, positions, headings)
    folded = lane_pose(ROAD, positions.reshape(3, 4, 5, 2), headings.reshape(3, 4, 5))
    for one, other in zip(flat, folded, strict=True):
        np.testing.assert_array_equal(one.reshape(3, 4, 5), other)

    assert np.isfinite([*lane_pose(ROAD, np.full(2, SIDE / 2), np.array(0.3))[1:]]).all()

    y = TILE + np.arange(-20, 21) * 2.0**-53
    places = np.column_stack((np.full(y.size, 2.5 * TILE + ROAD.lane_offset), y))
    pose, lap = lane_pose(ROAD, places, np.full(y.size, np.pi / 2)), lane_length(ROAD, True)
    assert np.mod(pose.along + lap / 2, lap) - lap / 2 == pytest.approx(0, abs=1e-12)
    assert pose.deviation == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("beyond", [-1e-9, SIDE + 1e-9, np.nan])
def test_off_the_map_is_beyond_its_edge_or_nowhere(beyond):
    assert off_map(ROAD, beyond, 0.5) is off_map(ROAD, 0.5, beyond) is True
    assert off_map(ROAD, 0.0, 0.0) is off_map(ROAD, SIDE, SIDE) is False
