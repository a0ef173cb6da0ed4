"""What was published on small_loop stays to the last bit: values taken before roads were lists of segments."""

import hashlib

import numpy as np
import pytest
import square_loop

from proxytune.driving.road.lane import lane_length, lane_point, lane_pose, off_map
from proxytune.driving.road.reading import shipped_map
from proxytune.driving.road.texture import draw_floor
from proxytune.driving.task import driving_score, score_trajectory

ROAD = shipped_map("small_loop")
POSES = (
    ((1.5912, 0.702, 93.0), (True, 0.11699999999999999, -5.551115123125783e-17, 0.05235987755982996)),
    ((0.4237, 0.702, 104.3), (False, 1.2165928766580083, -0.0025000000000000577, 0.24958208303518914)),
    ((1.62, 1.63, 140.0), (True, 0.9204380915521725, -0.22230602172784691, 0.07627789391698281)),
    ((0.15, 0.12, -40.0), (True, 3.4230833355789434, -0.21554955830373373, 0.05394546672146941)),
    ((1.2, 1.31, -50.0), (False, 2.561466402968898, -0.020621789367236354, -0.6615712927744184)),
    ((0.7, 0.9, 20.0), (False, 1.414592876658008, -0.2788, -1.2217304763960306)),
    ((2.1, -0.3, 1000.0), (False, 0.12458789398039238, 1.119993207646777, 0.9351427785595816)),
    ((1.0, 0.2, -2.0), (True, 4.154858238538031, 0.036199999999999954, -0.03490658503988595)),
)
POINTS = (
    ((True, 0.3), (1.5912, 0.885)),
    ((True, 1.0), (1.402767608562042, 1.5210394285608213)),
    ((True, 4.1), (0.9451417614619689, 0.16379999999999995)),
    ((True, 5.2), (1.5912, 0.7985223486159592)),
    ((False, 0.2), (1.226135132764508, 0.43111924464212215)),
    ((False, 0.9), (0.5284825718673798, 0.43125924314849323)),
    ((False, 2.7), (1.3126382149516254, 1.2505281294667514)),
    ((False, 3.6), (1.1963669750278436, 0.4233360812429655)),
)
SCORES = {
    "distance": 3.9058582540263966,
    "survival_time": 20.0,
    "time_out_of_lane": 6.25,
    "deviation": 0.08287315944351115,
    "early_distance": 1.0403709678201967,
    "early_offset": 0.07155488347606542,
    "speed": 0.29058951168201647,
}
SAME = {"rel": 1e-14, "abs": 1e-15}
"""Processors round sines differently in the last bit; the closed form, below, is compared on one and the same."""


def wobble():
    time = np.arange(1201) / 60
    x = 0.8775 + 0.7 * np.cos(0.4 * time) * (1 + 0.1 * np.sin(3 * time))
    return np.column_stack((x, 0.8775 + 0.68 * np.sin(0.4 * time), 0.4 * time + np.pi / 2 + 0.2 * np.sin(time)))


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
    for ours, published in zip(
        lane_pose(ROAD, positions, headings), square_loop.lane_pose(positions, headings), strict=True
    ):
        np.testing.assert_array_equal(ours, published)


def test_every_point_of_a_lane_is_the_published_closed_forms_to_the_last_bit():
    random = np.random.default_rng(8)
    along, outer = random.uniform(-12.0, 12.0, 20000), random.random(20000) < 0.5
    np.testing.assert_array_equal(lane_point(ROAD, outer, along), square_loop.lane_point(outer, along))
    for lane in (True, False):
        assert lane_length(ROAD, lane) == square_loop.lane_length(lane)


@pytest.mark.parametrize(("pose", "seen"), POSES)
def test_poses_are_seen_as_they_were(pose, seen):
    assert tuple(lane_pose(ROAD, np.array(pose[:2]), np.radians(pose[2]))) == pytest.approx(seen, **SAME)


@pytest.mark.parametrize(("way", "point"), POINTS)
def test_points_of_the_lanes_are_where_they_were(way, point):
    assert tuple(lane_point(ROAD, *way)) == pytest.approx(point, **SAME)


def test_laps_are_as_long_as_they_were():
    assert float(lane_length(ROAD, True)) == 4.986477651384041
    assert float(lane_length(ROAD, False)) == 3.369185753316016


def test_a_drive_is_scored_as_it_was():
    assert score_trajectory(ROAD, wobble(), tick_s=1 / 60, seconds=20.0) == pytest.approx(SCORES, rel=1e-13)
    worth = driving_score(ROAD, wobble(), wheel_distance=0.1, tick_s=1 / 60, seconds=20.0)
    assert worth == pytest.approx(6.066666666666666, rel=1e-13)


def test_the_floor_is_drawn_as_it_was_to_the_last_byte():
    floor = draw_floor(ROAD)
    digest = hashlib.sha256(floor.pixels.tobytes()).hexdigest()
    assert digest == "e347d735d4b196fd72756c4ccd6e92f0cd26dedf7df020c7f7af0014d9228700"
    assert (floor.pixels.shape, floor.origin) == ((832, 832, 3), -0.1625000000000001)


def test_the_map_ends_where_it_did():
    assert not off_map(ROAD, 3 * 0.585, 3 * 0.585)
    assert off_map(ROAD, np.nextafter(3 * 0.585, 2.0), 0.5)
