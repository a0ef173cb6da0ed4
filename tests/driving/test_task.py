"""Lane following scores hand-made drives as its definitions say."""

import dataclasses
import math
from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.driving.road.lane import lane_length, lane_pose, off_map
from proxytune.driving.road.reading import shipped_map
from proxytune.driving.task import METRICS, driving_score, score_trajectory, start_pose
from proxytune.errors import EpisodeError

ROAD = shipped_map("small_loop")
SIDE, TILE, OFFSET, MIDDLE = ROAD.size[0], ROAD.width, ROAD.lane_offset, ROAD.size[0] / 2
OUTER = (SIDE - TILE / 2 + OFFSET, TILE, pi / 2)  # lower end of the right side's straight, going up
INNER = (SIDE - TILE / 2 - OFFSET, 2 * TILE, -pi / 2)  # its upper end, going down
OUTER_RADIUS, INNER_RADIUS = TILE / 2 + OFFSET, TILE / 2 - OFFSET
OUTER_LAP = ((TILE, 0.0), (OUTER_RADIUS * pi / 2, 1 / OUTER_RADIUS)) * 4
INNER_LAP = ((TILE, 0.0), (INNER_RADIUS * pi / 2, -1 / INNER_RADIUS)) * 4
SPEED = 0.3
quick = settings(derandomize=True, max_examples=30, deadline=None)


def drive(start, pieces, rate=60.0):
    """Poses at SPEED over pieces of (length [m], curvature [1/m]), backwards where the length is negative."""
    poses = [np.array(start)[None]]
    for length, curvature in pieces:
        x, y, heading = poses[-1][-1]
        way = np.linspace(0, length, max(1, round(abs(length) / SPEED * rate)) + 1)[1:]
        turn = curvature * way
        chord = way * np.sinc(turn / 2 / pi)
        ahead = heading + turn / 2
        poses.append(np.column_stack((x + chord * np.cos(ahead), y + chord * np.sin(ahead), heading + turn)))
    return np.concatenate(poses)


def score(poses, rate=60.0, seconds=60.0):
    return score_trajectory(ROAD, poses, tick_s=1 / rate, seconds=seconds)


def moved_left(pose, left):
    x, y, heading = pose
    return x - left * math.sin(heading), y + left * math.cos(heading), heading


def wandering(seed, samples=400):
    """A smooth drive at random near a start of the map, in and out of lanes."""
    rng = np.random.default_rng(seed)
    x, y, degrees = ROAD.starts[rng.integers(len(ROAD.starts))]
    heading = math.radians(degrees) + np.cumsum(rng.normal(0, 0.12, samples))
    way = rng.uniform(-0.01, 0.03) * np.column_stack((np.cos(heading), np.sin(heading)))
    return np.column_stack(((x, y) + np.cumsum(way, axis=0), heading))


def test_a_drive_is_scored_by_every_metric_in_order():
    assert list(score(drive(OUTER, OUTER_LAP))) == list(METRICS)
    early = {"early_distance": "m", "early_offset": "m", "speed": "m/s"}
    assert {"distance": "m", "survival_time": "s", "time_out_of_lane": "s", "deviation": "m"} | early == METRICS


def test_early_metrics_are_those_of_the_first_five_seconds_whatever_comes_after():
    short = drive(moved_left(OUTER, 0.03), [(0.4, 0.0)])
    still = np.repeat(short[-1:], 60 * 20, axis=0)
    whole = np.concatenate((short, still))
    first = score(whole[: 5 * 60 + 1])
    result = score(whole)
    assert result["early_distance"] == first["distance"] == pytest.approx(0.4)
    assert result["early_offset"] == pytest.approx(0.03)
    assert result["speed"] == pytest.approx(0.4 / (len(whole) - 1) * 60)


@pytest.mark.parametrize("start", [OUTER, INNER], ids=("outer", "inner"))
def test_straight_on_in_the_lane_distance_is_what_was_driven(start):
    result = score(drive(start, [(0.5, 0.0)]))
    assert result["distance"] == pytest.approx(0.5, abs=1e-9)
    assert result["survival_time"] == pytest.approx(0.5 / SPEED)
    assert result["time_out_of_lane"] == 0
    assert result["deviation"] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("start", "lap", "outer"), [(OUTER, OUTER_LAP, True), (INNER, INNER_LAP, False)], ids=("outer", "inner")
)
@pytest.mark.parametrize("laps", [1, 3])
def test_laps_on_the_centre_line_count_their_length_to_a_millimetre(start, lap, outer, laps):
    result = score(drive(start, lap * laps))
    assert result["distance"] == pytest.approx(laps * lane_length(ROAD, outer), abs=0.001)
    assert result["time_out_of_lane"] == 0
    assert result["deviation"] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("left", [-0.08, 0.08])
def test_a_lap_beside_the_centre_line_counts_the_centre_lines_length(left):
    radius = OUTER_RADIUS - left
    beside = ((TILE, 0.0), (radius * pi / 2, 1 / radius)) * 4
    result = score(drive(moved_left(OUTER, left), beside))
    assert result["distance"] == pytest.approx(lane_length(ROAD, True), abs=0.001)
    assert result["deviation"] == pytest.approx(0.08, abs=1e-6)


@pytest.mark.parametrize(("start", "lap"), [(OUTER, OUTER_LAP), (INNER, INNER_LAP)], ids=("outer", "inner"))
def test_the_wrong_way_round_counts_nothing_and_is_all_out_of_lane(start, lap):
    wrong = drive(start, lap)[::-1] + (0, 0, pi)
    result = score(wrong)
    assert result["distance"] == 0
    assert result["time_out_of_lane"] == pytest.approx(result["survival_time"])
    assert result["deviation"] == pytest.approx(2 * OFFSET, abs=1e-6)


@pytest.mark.parametrize(
    ("start", "lap", "outer"), [(OUTER, OUTER_LAP, True), (INNER, INNER_LAP, False)], ids=("outer", "inner")
)
def test_driving_backwards_in_the_lane_counts_negative(start, lap, outer):
    backwards = [(-length, curvature) for length, curvature in reversed(lap)]
    result = score(drive(start, backwards))
    assert result["distance"] == pytest.approx(-lane_length(ROAD, outer), abs=0.001)
    assert result["time_out_of_lane"] == 0


def test_back_and_forth_counts_the_net_way():
    there_and_back = [(0.4, 0.0), (-0.3, 0.0)] * 2
    assert score(drive(OUTER, there_and_back))["distance"] == pytest.approx(0.2, abs=1e-9)


def test_a_stopped_robot_survives_and_gets_nowhere():
    result = score(np.tile(moved_left(OUTER, 0.05), (3601, 1)))
    assert result == {
        "distance": 0,
        "survival_time": 60,
        "time_out_of_lane": 0,
        "deviation": pytest.approx(0.05),
        "early_distance": 0,
        "early_offset": pytest.approx(0.05),
        "speed": 0,
    }


def test_a_robot_stopped_outside_the_lane_is_out_of_it_all_the_time():
    result = score(np.tile(moved_left(OUTER, ROAD.lane_width / 2 + 0.001), (601, 1)))
    assert result["time_out_of_lane"] == result["survival_time"] == pytest.approx(10)


def test_survival_ends_at_the_first_pose_off_the_map():
    x, y, _ = OUTER
    out = drive((x, y, 0.0), [(3.0, 0.0)])
    first = next(k for k, pose in enumerate(out) if off_map(ROAD, pose[0], pose[1]))
    result = score(out)
    assert result["survival_time"] == pytest.approx(first / 60)
    assert result["survival_time"] == pytest.approx((SIDE - x) / SPEED, abs=1.5 / 60)


@pytest.mark.parametrize("heading", [0.0, pi / 2, pi, -pi / 2])
def test_what_comes_after_leaving_the_map_is_not_scored(heading):
    out = drive((MIDDLE, MIDDLE, heading), [(1.0, 0.0)])
    gone = next(k for k, pose in enumerate(out) if off_map(ROAD, pose[0], pose[1])) + 1
    assert score(np.vstack((out[:gone], drive(OUTER, OUTER_LAP)))) == score(out[:gone])


def test_nothing_after_the_time_limit_is_scored():
    poses = drive(OUTER, OUTER_LAP * 6)
    assert len(poses) > 3601
    assert score(poses) == score(poses[:3601])
    assert score(poses)["survival_time"] == 60


@pytest.mark.parametrize("rate", [20.0, 30.0, 60.0, 100.0])
@pytest.mark.parametrize("seconds", [0.3, 0.7, 1.1, 60.0])
def test_a_survivor_survives_for_the_whole_duration(rate, seconds):
    still = np.tile(OUTER, (round(seconds * rate) + 5, 1))
    assert score(still, rate, seconds)["survival_time"] == pytest.approx(seconds)


def test_an_episode_that_ends_at_once_has_survived_for_no_time():
    result = score(np.array([moved_left(OUTER, 0.05)]))
    nothing = dict.fromkeys(("distance", "survival_time", "time_out_of_lane", "early_distance", "speed"), 0)
    assert result == nothing | {"deviation": pytest.approx(0.05), "early_offset": pytest.approx(0.05)}


def zig_zag(amplitude):
    """Ten seconds up the outer lane's right side, a sine aside."""
    y = np.linspace(TILE, 2 * TILE, 601)
    x = OUTER[0] - amplitude * np.sin((y - TILE) / TILE * 4 * pi)
    return np.column_stack((x, y, np.arctan2(np.gradient(y), np.gradient(x))))


def test_a_zig_zag_in_the_lane_counts_only_its_way_along_the_lane():
    result = score(zig_zag(0.1))
    assert result["distance"] == pytest.approx(TILE, abs=1e-9)
    assert result["time_out_of_lane"] == 0
    assert result["deviation"] == pytest.approx(0.1 * 2 / pi, abs=0.001)


def test_a_zig_zag_across_the_lanes_edges_counts_only_what_is_in_it():
    result = score(zig_zag(0.15))
    inside = 1 - 2 / pi * math.acos(ROAD.lane_width / 2 / 0.15)
    assert result["distance"] == pytest.approx(inside * TILE, abs=0.002)
    assert result["time_out_of_lane"] == pytest.approx((1 - inside) * 10, abs=0.04)
    assert result["deviation"] == pytest.approx(0.15 * 2 / pi, abs=0.001)


@pytest.mark.parametrize("order", [1, -1], ids=("leaving", "entering"))
def test_a_step_across_the_lanes_edge_counts_half(order):
    x, y, heading = OUTER
    poses = np.array([(x + 0.10, y + 0.2, heading), (x + 0.12, y + 0.2 + 0.02 * order, heading)])[::order]
    assert score(poses) == {
        "distance": pytest.approx(0.01),
        "survival_time": pytest.approx(1 / 60),
        "time_out_of_lane": pytest.approx(0.5 / 60),
        "deviation": pytest.approx(0.11),
        "early_distance": pytest.approx(0.01),
        "early_offset": pytest.approx(-0.11),
        "speed": pytest.approx(60 * math.hypot(0.02, 0.02)),
    }


def test_a_u_turn_counts_the_way_in_either_lane_and_no_jump():
    poses = drive(OUTER, [(0.3, 0.0), (OFFSET * pi, 1 / OFFSET), (0.2, 0.0)], rate=600)
    result = score(poses, rate=600)
    leaves = math.acos(1 - ROAD.lane_width / 2 / OFFSET)
    assert result["distance"] == pytest.approx(0.5 + 2 * OFFSET * math.sin(leaves), abs=0.001)
    assert result["time_out_of_lane"] == pytest.approx((pi - 2 * leaves) * OFFSET / SPEED, abs=0.005)


def test_turning_on_the_spot_counts_nothing():
    heading = np.linspace(0, 40 * pi, 3601)
    poses = np.column_stack((np.full(3601, OUTER[0]), np.full(3601, TILE * 1.3), heading))
    assert score(poses)["distance"] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("middle", [0.0, 0.1])
def test_crossing_the_middle_of_the_map_counts_nothing_there(middle):
    way = np.linspace(TILE + 0.01, 2 * TILE - 0.01, 200)
    poses = np.column_stack((way, np.full(200, MIDDLE + middle), np.zeros(200)))
    assert score(poses)["distance"] == 0
    assert score(poses)["time_out_of_lane"] == score(poses)["survival_time"]


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("rate", [20, 30])
def test_the_sampling_rate_hardly_matters(seed, rate):
    curvatures = 1 / OUTER_RADIUS * np.array([0, 0, 0, 1, 1, 1, 1] * 8) + np.random.default_rng(seed).normal(0, 2, 56)
    fine = drive(OUTER, [(0.2, float(curvature)) for curvature in curvatures])
    coarse = fine[:: 60 // rate]
    for metric, bound in (("distance", 0.02), ("survival_time", 0.06), ("time_out_of_lane", 0.1), ("deviation", 0.002)):
        assert score(coarse, rate)[metric] == pytest.approx(score(fine)[metric], abs=bound), metric


@quick
@given(st.integers(0, 10**6), st.integers(1, 3))
def test_a_quarter_turn_of_the_map_changes_no_score(seed, quarters):
    poses = wandering(seed)
    angle = quarters * pi / 2
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    turned = np.column_stack(((poses[:, :2] - MIDDLE) @ turn + MIDDLE, poses[:, 2] + angle))
    assert score(turned) == pytest.approx(score(poses), abs=1e-9)


@quick
@given(st.integers(0, 10**6), st.floats(0, 1))
def test_the_parts_of_a_drive_add_up(seed, share):
    poses = wandering(seed)
    survived = round(score(poses)["survival_time"] * 60)
    cut = round(share * survived)
    whole, first, second = score(poses), score(poses[: cut + 1]), score(poses[cut:])
    for metric in ("distance", "survival_time", "time_out_of_lane"):
        assert first[metric] + second[metric] == pytest.approx(whole[metric], abs=1e-9), metric
    areas = [part["deviation"] * part["survival_time"] for part in (first, second, whole)]
    assert areas[0] + areas[1] == pytest.approx(areas[2], abs=1e-9)


@quick
@given(st.integers(0, 10**6))
def test_scores_are_finite_and_time_out_of_lane_lies_within_survival(seed):
    result = score(wandering(seed), seconds=4.0)
    assert all(map(math.isfinite, result.values()))
    assert 0 <= result["time_out_of_lane"] <= result["survival_time"] <= 4
    assert result["deviation"] >= 0


@pytest.mark.parametrize("column", range(3))
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_pose_that_is_not_finite_is_refused_with_its_time(column, value):
    poses = drive(OUTER, OUTER_LAP)
    poses[30:, column] = value
    with pytest.raises(EpisodeError, match=r"not finite at 0\.50 s"):
        score(poses)


WHEELS = 0.1  # between the wheels [m]
BOTH_IN, ONE_OUT, BOTH_OUT = 0.0, ROAD.lane_width / 2 - 0.01, ROAD.lane_width / 2 + 0.052


def worth(poses, rate=60.0, seconds=60.0, wheels=WHEELS):
    return driving_score(ROAD, poses, wheel_distance=wheels, tick_s=1 / rate, seconds=seconds)


@pytest.mark.parametrize(("start", "lap"), [(OUTER, OUTER_LAP), (INNER, INNER_LAP)], ids=("outer", "inner"))
def test_every_second_in_the_lane_is_worth_one(start, lap):
    poses = drive(start, lap)
    assert worth(poses) == pytest.approx((len(poses) - 1) / 60)


@pytest.mark.parametrize("start", [OUTER, INNER], ids=("outer", "inner"))
@pytest.mark.parametrize("side", [-1, 1], ids=("right", "left"))
@pytest.mark.parametrize(("left", "each_second"), [(BOTH_IN, 1.0), (ONE_OUT, 0.0), (BOTH_OUT, -1.0)])
def test_each_second_a_wheel_out_of_the_lane_takes_one_and_both_take_two(start, side, left, each_second):
    poses = drive(moved_left(start, side * left), [(0.5, 0.0)])
    assert worth(poses) == pytest.approx(each_second * 0.5 / SPEED, abs=1e-9)


def test_a_wheel_may_be_out_while_the_axles_middle_is_in():
    poses = drive(moved_left(OUTER, ONE_OUT), [(0.5, 0.0)])
    assert score(poses)["time_out_of_lane"] == 0
    assert worth(poses) == pytest.approx(0, abs=1e-9)
    assert worth(poses, wheels=0.015) == pytest.approx(0.5 / SPEED)


def test_where_the_wheels_are_depends_on_the_heading():
    x, y, heading = moved_left(OUTER, ONE_OUT)
    askew = np.tile((x, y + 0.2, heading + 1.55), (61, 1))
    straight = np.tile((x, y + 0.2, heading), (61, 1))
    assert (worth(askew), worth(straight)) == (pytest.approx(1.0), pytest.approx(0.0))


def test_the_wrong_way_round_both_wheels_are_out_of_the_lane():
    wrong = drive(OUTER, OUTER_LAP)[::-1] + (0, 0, pi)
    assert worth(wrong) == pytest.approx(-(len(wrong) - 1) / 60)


@pytest.mark.parametrize(("left", "each_second"), [(BOTH_IN, 1.0), (ONE_OUT, 0.0), (BOTH_OUT, -1.0)])
def test_standing_counts_as_driving(left, each_second):
    x, y, heading = moved_left(OUTER, left)
    assert worth(np.tile((x, y + 0.2, heading), (3601, 1))) == pytest.approx(60.0 * each_second)


def test_half_a_step_across_the_lanes_edge_counts_for_either_side():
    poses = np.array([moved_left(OUTER, BOTH_IN), moved_left(OUTER, BOTH_OUT)])
    assert worth(poses) == pytest.approx(0.0)
    assert worth(poses[[0, 0, 1]]) == pytest.approx(1 / 60)


def test_a_drive_is_worth_nothing_more_once_it_has_left_the_map():
    out = drive((OUTER[0], OUTER[1], 0.0), [(1.0, 0.0)])
    gone = next(k for k, pose in enumerate(out) if off_map(ROAD, pose[0], pose[1])) + 1
    assert gone < len(out)
    assert worth(np.vstack((out[:gone], drive(OUTER, OUTER_LAP)))) == worth(out[:gone])
    assert worth(out[:gone]) < (gone - 1) / 60


def test_a_drive_is_worth_nothing_more_once_time_is_over():
    poses = drive(OUTER, OUTER_LAP * 5)
    assert worth(poses, seconds=10.0) == pytest.approx(10.0)
    assert worth(poses[:1]) == 0.0


@quick
@given(st.integers(0, 10**6), st.floats(0.0, 0.3), st.floats(0.5, 8.0))
def test_a_drive_is_worth_between_less_and_more_than_its_seconds(seed, wheels, seconds):
    poses = wandering(seed)
    driven = score(poses, seconds=seconds)["survival_time"]
    assert -driven - 1e-9 <= worth(poses, seconds=seconds, wheels=wheels) <= driven + 1e-9
    assert driven <= seconds


@quick
@given(st.integers(0, 10**6))
def test_without_a_distance_between_them_both_wheels_are_out_when_the_axles_middle_is(seed):
    result = score(wandering(seed))
    expected = result["survival_time"] - 2.0 * result["time_out_of_lane"]
    assert worth(wandering(seed), wheels=0.0) == pytest.approx(expected, abs=1e-9)


def test_a_drive_with_a_pose_that_is_not_finite_is_worth_nothing_but_an_error():
    poses = drive(OUTER, OUTER_LAP)
    poses[30:, 2] = math.nan
    with pytest.raises(EpisodeError, match=r"not finite at 0\.50 s"):
        worth(poses)


def exact_start(index, **noise):
    return start_pose(ROAD, index, **{"seed": 1, "position_noise_m": 0.0, "heading_noise_deg": 0.0, **noise})


def test_without_noise_a_start_is_the_papers():
    for index, (x, y, degrees) in enumerate(ROAD.starts):
        assert exact_start(index) == pytest.approx((x, y, math.radians(degrees)))


def test_the_papers_ten_starts_are_in_their_lanes_eight_outer_two_inner():
    starts = np.array([exact_start(index) for index in range(len(ROAD.starts))])
    pose = lane_pose(ROAD, starts[:, :2], starts[:, 2])
    assert (np.abs(pose.deviation) <= ROAD.lane_width / 2).all()
    assert np.flatnonzero(~pose.counter_clockwise).tolist() == [0, 8]
    assert len(starts) == 10


def test_the_same_seed_and_index_put_the_robot_down_alike_and_others_elsewhere():
    noise = {"position_noise_m": 0.01, "heading_noise_deg": 2.0}
    assert exact_start(3, **noise) == exact_start(3, **noise)
    assert exact_start(3, **noise) != exact_start(3, **noise, seed=2)
    twice = dataclasses.replace(ROAD, starts=ROAD.starts[:1] * 2)
    first, second = (start_pose(twice, index, seed=1, **noise) for index in (0, 1))
    assert all(one != other for one, other in zip(first, second, strict=True))


def test_placement_noise_has_the_spread_it_was_given():
    noise = {"position_noise_m": 0.02, "heading_noise_deg": 3.0}
    x, y, degrees = ROAD.starts[5]
    errors = np.array([exact_start(5, **noise, seed=seed) for seed in range(500)]) - (x, y, math.radians(degrees))
    assert errors.std(axis=0) == pytest.approx((0.02, 0.02, math.radians(3.0)), rel=0.1)
    assert errors.mean(axis=0) == pytest.approx((0, 0, 0), abs=0.006)
    assert np.corrcoef(errors.T) == pytest.approx(np.eye(3), abs=0.15)
