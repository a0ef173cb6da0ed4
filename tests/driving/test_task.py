"""Trajectories made by hand are worth what the definitions say."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.driving.lane import lap_length
from proxytune.driving.maps import SMALL_LOOP as ROAD
from proxytune.driving.task import METRICS, off_map, score_trajectory, start_pose

T = ROAD.tile
TICK_S = 1 / 60
EAST_X, WEST_X = 2.5 * T + ROAD.lane_offset, 0.5 * T - ROAD.lane_offset


def score(poses, seconds=60.0, tick_s=TICK_S):
    return score_trajectory(ROAD, np.asarray(poses, dtype=float), tick_s=tick_s, seconds=seconds)


def line(x, y, heading, end, count=121):
    return np.stack((np.linspace(x, end[0], count), np.linspace(y, end[1], count), np.full(count, heading)), axis=1)


def arc(centre, radius, first, last, *, count=601, clockwise=False):
    angle = np.linspace(first, last, count)
    heading = angle - np.pi / 2 if clockwise else angle + np.pi / 2
    return np.stack((centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle), heading), axis=1)


def test_every_metric_has_a_unit_and_is_scored():
    assert set(score(line(EAST_X, T, np.pi / 2, (EAST_X, 2 * T)))) == set(METRICS)


def test_a_straight_in_lane_is_worth_its_length():
    result = score(line(EAST_X, T, np.pi / 2, (EAST_X, 2 * T)))
    assert result["distance"] == pytest.approx(T, abs=1e-9)
    assert result["survival_time"] == pytest.approx(2.0)
    assert result["time_out_of_lane"] == 0.0
    assert result["deviation"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("outer", [True, False])
def test_a_curve_on_the_centre_line_is_worth_its_arc(outer):
    radius = T / 2 + (ROAD.lane_offset if outer else -ROAD.lane_offset)
    first, last = (0.0, np.pi / 2) if outer else (np.pi / 2, 0.0)
    result = score(arc((2 * T, 2 * T), radius, first, last, clockwise=not outer))
    assert result["distance"] == pytest.approx(radius * np.pi / 2, abs=1e-9)
    assert result["time_out_of_lane"] == 0.0


@pytest.mark.parametrize("outer", [True, False])
def test_a_lap_is_worth_its_length_wherever_it_begins(outer):
    radius = T / 2 + (ROAD.lane_offset if outer else -ROAD.lane_offset)
    far = T / 2 + radius
    middle, h = 1.5 * T, T / 2
    if outer:
        lap = [
            line(middle + far, middle, np.pi / 2, (middle + far, 2 * T)),
            arc((2 * T, 2 * T), radius, 0, np.pi / 2),
            line(2 * T, middle + far, np.pi, (T, middle + far)),
            arc((T, 2 * T), radius, np.pi / 2, np.pi),
            line(middle - far, 2 * T, 3 * np.pi / 2, (middle - far, T)),
            arc((T, T), radius, np.pi, 3 * np.pi / 2),
            line(T, middle - far, 2 * np.pi, (2 * T, middle - far)),
            arc((2 * T, T), radius, 3 * np.pi / 2, 2 * np.pi),
            line(middle + far, T, 5 * np.pi / 2, (middle + far, middle)),
        ]
        poses = np.concatenate(lap)
    else:
        lap = [
            line(middle + far, middle, -np.pi / 2, (middle + far, middle - h)),
            arc((2 * T, T), radius, 0, -np.pi / 2, clockwise=True),
            line(2 * T, middle - far, -np.pi, (T, middle - far)),
            arc((T, T), radius, -np.pi / 2, -np.pi, clockwise=True),
            line(middle - far, T, -3 * np.pi / 2, (middle - far, 2 * T)),
            arc((T, 2 * T), radius, -np.pi, -3 * np.pi / 2, clockwise=True),
            line(T, middle + far, -2 * np.pi, (2 * T, middle + far)),
            arc((2 * T, 2 * T), radius, -3 * np.pi / 2, -2 * np.pi, clockwise=True),
            line(middle + far, 2 * T, -5 * np.pi / 2, (middle + far, middle)),
        ]
        poses = np.concatenate(lap)
    assert score(poses)["distance"] == pytest.approx(lap_length(ROAD, outer=outer), abs=1e-3)


def test_the_wrong_way_is_worth_nothing_and_all_of_it_is_out_of_lane():
    result = score(line(EAST_X, 2 * T, -np.pi / 2, (EAST_X, T)))
    assert result["distance"] == 0.0
    assert result["time_out_of_lane"] == pytest.approx(2.0)
    assert result["deviation"] == pytest.approx(2 * ROAD.lane_offset)


def test_backing_up_in_lane_counts_against_the_distance():
    forth = line(EAST_X, T, np.pi / 2, (EAST_X, 1.8 * T))
    back = line(EAST_X, 1.8 * T, np.pi / 2, (EAST_X, 1.5 * T))
    assert score(np.concatenate((forth, back)))["distance"] == pytest.approx(0.5 * T, abs=1e-9)


def test_standing_still_survives_and_goes_nowhere():
    result = score(np.tile((EAST_X, T, np.pi / 2), (301, 1)))
    assert (result["distance"], result["time_out_of_lane"]) == (0.0, 0.0)
    assert result["survival_time"] == pytest.approx(5.0)


def test_an_episode_is_over_when_the_map_is_left():
    result = score(line(EAST_X, 1.5 * T, 0.0, (EAST_X + 1.0, 1.5 * T), count=601))
    to_the_edge = (ROAD.side - EAST_X) * 10.0
    assert result["survival_time"] == pytest.approx(to_the_edge, abs=2 * TICK_S)


def test_what_comes_after_leaving_the_map_counts_for_nothing():
    away = line(EAST_X, 2 * T, 0.1, (ROAD.side + 0.1, 2 * T))
    home = line(EAST_X, T, np.pi / 2, (EAST_X, 2 * T))
    assert score(np.concatenate((away, home))) == score(away)


def test_outside_the_lane_there_is_no_progress():
    beside = EAST_X + 0.6 * ROAD.lane_width
    result = score(line(beside, T, np.pi / 2, (beside, 2 * T)))
    assert result["distance"] == 0.0
    assert result["time_out_of_lane"] == pytest.approx(2.0)


def test_a_zig_zag_within_the_lane_is_worth_its_progress_only():
    y = np.linspace(T, 2 * T, 600)
    poses = np.stack((EAST_X + 0.08 * np.sin(40 * y), y, np.full(600, np.pi / 2)), axis=1)
    result = score(poses)
    assert result["distance"] == pytest.approx(T, abs=1e-9)
    assert result["deviation"] > 0.04


def test_a_u_turn_is_no_leap_forward():
    count = 60
    heading = np.linspace(np.pi / 2, -np.pi / 2, count)
    spin = np.stack((np.full(count, 2.5 * T), np.full(count, 1.5 * T), heading), axis=1)
    assert abs(score(spin)["distance"]) < 1e-9


def test_the_sample_rate_hardly_matters():
    fine = arc((2 * T, 2 * T), T / 2 + ROAD.lane_offset, 0.0, np.pi / 2, count=1201)
    slow = score(fine[::4], tick_s=4 * TICK_S)
    for name, value in score(fine).items():
        assert slow[name] == pytest.approx(value, abs=1e-3)


@given(cut=st.integers(1, 599))
@settings(max_examples=20, derandomize=True, deadline=None)
def test_the_parts_of_a_trajectory_add_up(cut):
    y = np.linspace(0.4 * T, 2.6 * T, 601)
    poses = np.stack((EAST_X + 0.15 * np.sin(20 * y), y, np.pi / 2 + 0.3 * np.cos(20 * y)), axis=1)
    whole, first, second = score(poses), score(poses[: cut + 1]), score(poses[cut:])
    for name in ("distance", "survival_time", "time_out_of_lane"):
        assert first[name] + second[name] == pytest.approx(whole[name], abs=1e-9)


def test_the_edge_of_the_map_is_on_it_and_beyond_is_off():
    assert not off_map(ROAD, 0.0, ROAD.side)
    assert off_map(ROAD, -0.001, 0.5)
    assert off_map(ROAD, 0.5, ROAD.side + 0.001)


def test_a_start_without_noise_is_the_maps_own():
    pose = start_pose(ROAD, 3, seed=9, position_noise_m=0.0, heading_noise_deg=0.0)
    np.testing.assert_allclose(pose, (1.5755, 0.702, np.radians(101.3)))


def test_the_noise_of_a_start_follows_from_seed_and_index_alone_and_is_as_wide_as_asked():
    def one(seed, index=3):
        return start_pose(ROAD, index, seed=seed, position_noise_m=0.01, heading_noise_deg=2.0)

    np.testing.assert_array_equal(one(1), one(1))
    assert not np.array_equal(one(1), one(2))
    spread = np.std([one(seed) for seed in range(400)], axis=0)
    np.testing.assert_allclose(spread, (0.01, 0.01, np.radians(2.0)), rtol=0.15)
