"""Where a pose lies in its lane, held against centre lines laid out point by point."""

import functools
from math import pi

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from proxytune.driving import lane_length, lane_point, lane_pose, off_map, shipped_map

ROAD = shipped_map("small_loop")
SIDE, TILE = ROAD.size[0], ROAD.width
MIDDLE = np.array([SIDE / 2, SIDE / 2])
quick = settings(max_examples=50)
coordinates = st.floats(-0.5, SIDE + 0.5)
points = st.tuples(coordinates, coordinates)
headings = st.floats(-10, 10)


def turned(points, quarters):
    cosine, sine = round(np.cos(quarters * pi / 2)), round(np.sin(quarters * pi / 2))
    return MIDDLE + (np.asarray(points) - MIDDLE) @ np.array([[cosine, sine], [-sine, cosine]])


def lap(counter_clockwise, spacing=0.001):
    """A lane's centre line from the lower end of the right side's straight: points and headings."""
    radius = TILE / 2 + ROAD.lane_offset * (1 if counter_clockwise else -1)
    straight = np.arange(0, TILE, spacing)
    angle = np.arange(0, pi / 2, spacing / radius)
    x = np.concatenate((np.full(straight.size, 2 * TILE + radius), 2 * TILE + radius * np.cos(angle)))
    y = np.concatenate((TILE + straight, 2 * TILE + radius * np.sin(angle)))
    heading = np.concatenate((np.full(straight.size, pi / 2), pi / 2 + angle))
    quarter = np.column_stack((x, y))
    line = np.concatenate([turned(quarter, quarters) for quarters in range(4)])
    directions = np.concatenate([heading + quarters * pi / 2 for quarters in range(4)])
    return (line, directions) if counter_clockwise else (line[::-1], directions[::-1] + pi)


LAPS = {True: lap(True), False: lap(False)}
both_lanes = pytest.mark.parametrize("counter_clockwise", [True, False], ids=("outer", "inner"))


def wrapped(way, length):
    return np.mod(way + length / 2, length) - length / 2


@pytest.mark.parametrize(("counter_clockwise", "length"), [(True, 4.99), (False, 3.37)])
def test_laps_are_as_long_as_the_design_says(counter_clockwise, length):
    assert lane_length(ROAD, counter_clockwise) == pytest.approx(length, abs=0.005)


@both_lanes
def test_a_robot_on_the_centre_line_deviates_by_nothing_and_gains_what_it_drives(counter_clockwise):
    line, directions = LAPS[counter_clockwise]
    pose = lane_pose(ROAD, line, directions)
    length = lane_length(ROAD, counter_clockwise)
    assert (pose.counter_clockwise == counter_clockwise).all()
    assert pose.deviation == pytest.approx(0, abs=1e-12)
    assert pose.heading_error == pytest.approx(0, abs=1e-12)
    driven = np.hypot(*np.diff(line, axis=0).T)
    assert wrapped(np.diff(pose.along), length) == pytest.approx(driven, abs=1e-6)
    assert ((pose.along >= 0) & (pose.along <= length)).all()


@both_lanes
@pytest.mark.parametrize("left", [-0.1, 0.03, 0.1])
def test_deviation_is_positive_to_the_left_of_travel(counter_clockwise, left):
    line, directions = LAPS[counter_clockwise]
    aside = line + left * np.column_stack((-np.sin(directions), np.cos(directions)))
    assert lane_pose(ROAD, aside, directions).deviation == pytest.approx(left, abs=1e-12)


@both_lanes
@pytest.mark.parametrize("error", [-1.5, -0.2, 0.7, 1.5])
def test_heading_error_is_positive_to_the_left_whatever_full_turns_the_heading_has(counter_clockwise, error):
    line, directions = LAPS[counter_clockwise]
    pose = lane_pose(ROAD, line, directions + error - 6 * pi)
    assert (pose.counter_clockwise == counter_clockwise).all()
    assert pose.heading_error == pytest.approx(error, abs=1e-12)


@both_lanes
def test_a_robot_against_the_direction_of_its_lane_is_seen_from_the_other_one(counter_clockwise):
    line, directions = LAPS[counter_clockwise]
    pose = lane_pose(ROAD, line, directions + pi)
    assert (pose.counter_clockwise != counter_clockwise).all()
    assert pose.deviation == pytest.approx(2 * ROAD.lane_offset, abs=1e-12)


@functools.lru_cache
def lap_along(counter_clockwise):
    return lane_pose(ROAD, *LAPS[counter_clockwise]).along


def nearest_point(pose):
    outer = bool(pose.counter_clockwise)
    return LAPS[outer][0][np.argmin(np.abs(wrapped(lap_along(outer) - pose.along, lane_length(ROAD, outer))))]


@quick
@given(points, headings)
def test_the_centre_lines_nearest_point_counts_wherever_the_robot_is(point, heading):
    pose = lane_pose(ROAD, np.array(point), np.array(heading))
    shortest = np.hypot(*(LAPS[bool(pose.counter_clockwise)][0] - point).T).min()
    assert abs(pose.deviation) == pytest.approx(shortest, abs=0.001)
    assert np.hypot(*(nearest_point(pose) - point)) == pytest.approx(shortest, abs=0.002)


@quick
@given(points, points, headings)
def test_deviation_never_changes_by_more_than_the_robot_moves(here, there, heading):
    poses = lane_pose(ROAD, np.array([[here, there]] * 2), np.array([[heading], [heading + pi]]))
    for outer in (True, False):
        first, second = (poses.deviation[:, k][poses.counter_clockwise[:, k] == outer] for k in (0, 1))
        assert abs(first[0] - second[0]) <= np.hypot(*np.subtract(here, there)) + 1e-12


@quick
@given(points, headings, st.integers(1, 3))
def test_quarter_turns_of_the_map_change_neither_lane_nor_deviation_nor_heading_error(point, heading, quarters):
    here = lane_pose(ROAD, np.array(point), np.array(heading))
    assume(abs(np.subtract(*np.abs(point - MIDDLE))) > 1e-6 and abs(here.heading_error) < pi / 2 - 1e-6)
    there = lane_pose(ROAD, turned(point, quarters), np.array(heading + quarters * pi / 2))
    gained = there.along - here.along
    length = lane_length(ROAD, here.counter_clockwise)
    assert there.counter_clockwise == here.counter_clockwise
    assert there.deviation == pytest.approx(here.deviation, abs=1e-12)
    assert there.heading_error == pytest.approx(here.heading_error, abs=1e-12)
    quarter = quarters / 4 * (1 if here.counter_clockwise else -1) * length
    assert wrapped(gained - quarter, length) == pytest.approx(0, abs=1e-9)


def test_a_hair_below_the_first_side_the_way_round_closes():
    y = TILE + np.arange(-20, 21) * 2.0**-53
    x = np.full(y.size, 2.5 * TILE + ROAD.lane_offset)
    pose = lane_pose(ROAD, np.column_stack((x, y)), np.full(y.size, pi / 2))
    assert wrapped(pose.along, lane_length(ROAD, True)) == pytest.approx(0, abs=1e-12)
    assert pose.deviation == pytest.approx(0, abs=1e-12)


ways = st.floats(-12, 12)


@both_lanes
def test_points_along_a_lane_are_those_of_its_centre_line(counter_clockwise):
    line, directions = LAPS[counter_clockwise]
    along = lane_pose(ROAD, line, directions).along
    assert lane_point(ROAD, counter_clockwise, along) == pytest.approx(line, abs=1e-9)


def tangent(counter_clockwise, along, step=1e-5):
    """Heading of the lane's centre line."""
    behind, ahead = (lane_point(ROAD, counter_clockwise, along + way) for way in (-step, step))
    return np.arctan2(*(ahead - behind)[::-1])


@quick
@given(st.booleans(), ways)
def test_the_point_so_far_along_a_lane_is_seen_so_far_along_it_on_its_centre_line(counter_clockwise, along):
    heading = tangent(counter_clockwise, along)
    pose = lane_pose(ROAD, lane_point(ROAD, counter_clockwise, along), heading)
    assert pose.counter_clockwise == counter_clockwise
    assert pose.deviation == pytest.approx(0, abs=1e-12)
    assert pose.heading_error == pytest.approx(0, abs=1e-4)
    assert wrapped(pose.along - along, lane_length(ROAD, counter_clockwise)) == pytest.approx(0, abs=1e-9)


@quick
@given(points, headings)
def test_a_pose_lies_its_deviation_to_the_left_of_the_point_so_far_along(point, heading):
    pose = lane_pose(ROAD, np.array(point), np.array(heading))
    outer = bool(pose.counter_clockwise)
    apart = np.array(point) - lane_point(ROAD, outer, pose.along)
    assert np.hypot(*apart) == pytest.approx(abs(pose.deviation), abs=1e-9)


@quick
@given(st.booleans(), ways, st.integers(-3, 3))
def test_whole_laps_make_no_difference_to_a_point(counter_clockwise, along, laps):
    further = along + laps * lane_length(ROAD, counter_clockwise)
    here = lane_point(ROAD, counter_clockwise, along)
    assert lane_point(ROAD, counter_clockwise, further) == pytest.approx(here, abs=1e-9)


@quick
@given(st.booleans(), ways, st.floats(0, 0.3))
def test_going_on_along_a_lane_goes_no_further_than_that(counter_clockwise, along, way):
    here, there = (lane_point(ROAD, counter_clockwise, along + further) for further in (0.0, way))
    assert np.hypot(*(there - here)) <= way + 1e-12


def test_points_of_many_lanes_and_ways_may_be_asked_for_at_once():
    outer, along = np.array([[True], [False]]), np.linspace(-1, 6, 5)
    together = lane_point(ROAD, outer, along)
    apart = [[lane_point(ROAD, bool(lane), float(way)) for way in along] for lane in outer]
    assert together == pytest.approx(np.array(apart), abs=1e-12)
    assert together.shape == (2, 5, 2)


def test_the_maps_middle_has_a_finite_answer():
    assert np.isfinite([*lane_pose(ROAD, MIDDLE, np.array(0.3))[1:]]).all()


def test_poses_may_have_any_shape():
    line, directions = LAPS[True]
    flat = lane_pose(ROAD, line[:60], directions[:60])
    folded = lane_pose(ROAD, line[:60].reshape(3, 4, 5, 2), directions[:60].reshape(3, 4, 5))
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
