"""On every map the road that is scored, the one that is followed and the one that is drawn are one and the same."""

import dataclasses
import functools
from math import pi
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.driving.episode import TICK_HZ, Course, Sight, drive
from proxytune.driving.expert import Expert
from proxytune.driving.family import lane_following
from proxytune.driving.road.lane import lane_length, lane_point, lane_pose, off_map
from proxytune.driving.road.layout import corners
from proxytune.driving.road.maps import Paint, Road
from proxytune.driving.road.reading import map_names, shipped_map
from proxytune.driving.road.segments import Arc, Straight, length
from proxytune.driving.road.texture import COLOURS, draw_floor
from proxytune.driving.robot import read_robot
from proxytune.driving.task import driving_score, score_trajectory
from proxytune.effects import Stage, stage_chain
from proxytune.settings import Section

HEXAGON = (Straight(0.4), Arc(0.3, 60.0), Straight(0.2)) * 6


def uneven():
    """Bends of four radii to both sides, two straights in a row, one after the last bend."""
    s_bend = (Arc(0.4, -45.0), Arc(0.4, 45.0))
    open_end = (Straight(0.8), Straight(0.4), Arc(0.6, 90.0), Straight(0.4), Arc(0.35, 90.0), *s_bend)
    x, y = corners((0.0, 0.0, 0.0), (*open_end, Arc(0.3, 90.0), Arc(0.25, 90.0)))[-1]
    return (*open_end, Straight(x + 0.3), Arc(0.3, 90.0), Straight(y), Arc(0.25, 90.0), Straight(0.3))


def plain(name, begin, segments):
    paint = Paint(white_width=0.02, yellow_width=0.02, bend_radius=None, straight_dash=0.05, bend_dash=0.05)
    return Road(name, "", (3.0, 2.5), begin, segments, 0.4, 0.1, 0.15, paint, ((*begin[:2], begin[2]),))


SHIPPED = [shipped_map(name) for name in map_names()]
ROADS = [*SHIPPED, plain("hexagon", (1.1, 0.4, 0.0), HEXAGON), plain("uneven", (0.9, 0.4, 0.0), uneven())]
every_road = pytest.mark.parametrize("road", ROADS, ids=lambda road: road.name)
every_shipped = pytest.mark.parametrize("road", SHIPPED, ids=lambda road: road.name)
both_lanes = pytest.mark.parametrize("outer", [True, False], ids=("outer", "inner"))
quick = settings(derandomize=True, max_examples=60, deadline=None)
coordinates = st.floats(-0.5, 3.5)
points = st.tuples(coordinates, coordinates)
ways = st.floats(-12.0, 20.0)


def wrapped(way, lap):
    return np.mod(way + lap / 2, lap) - lap / 2


def lane(road, outer, spacing=0.002):
    """Points, and headings from each to the next, of a lane's centre line."""
    lap = float(lane_length(road, outer))
    line = lane_point(road, outer, np.linspace(0.0, lap, round(lap / spacing) + 1))
    return line, np.arctan2(*np.diff(line, axis=0).T[::-1])


@every_road
def test_the_road_closes(road):
    np.testing.assert_allclose(corners(road.begin, road.segments)[-1], road.begin[:2], atol=1e-12)


@every_road
@quick
@given(outer=st.booleans(), along=ways)
def test_the_point_so_far_along_a_lane_is_seen_so_far_along_it(road, outer, along):
    behind, here, ahead = lane_point(road, outer, along + np.array([-1e-5, 0.0, 1e-5]))
    pose = lane_pose(road, here, np.arctan2(*(ahead - behind)[::-1]))
    assert pose.counter_clockwise == outer
    assert pose.deviation == pytest.approx(0, abs=1e-11)
    assert pose.heading_error == pytest.approx(0, abs=1e-4)
    assert wrapped(pose.along - along, lane_length(road, outer)) == pytest.approx(0, abs=1e-9)


@every_road
@quick
@given(point=points, heading=st.floats(-10, 10))
def test_a_pose_lies_its_deviation_to_the_left_of_the_point_so_far_along(road, point, heading):
    pose = lane_pose(road, np.array(point), np.array(heading))
    direction = heading - pose.heading_error
    left = np.array((-np.sin(direction), np.cos(direction)))
    expected = lane_point(road, pose.counter_clockwise, pose.along) + pose.deviation * left
    np.testing.assert_allclose(point, expected, atol=1e-9)
    assert 0 <= pose.along <= lane_length(road, pose.counter_clockwise)


@every_road
@quick
@given(here=points, there=points, heading=st.floats(-10, 10))
def test_deviation_never_changes_by_more_than_the_robot_moves(road, here, there, heading):
    pose = lane_pose(road, np.array([here, there]), np.array([heading, heading + pi]))
    of_outer = np.where(pose.counter_clockwise, pose.deviation, 2 * road.lane_offset - pose.deviation)
    assert abs(of_outer[0] - of_outer[1]) <= np.hypot(*np.subtract(here, there)) + 1e-9


@every_road
@quick
@given(point=points, heading=st.floats(-10, 10))
def test_no_point_of_the_lane_is_nearer_than_the_deviation(road, point, heading):
    pose = lane_pose(road, np.array(point), np.array(heading))
    line, _ = lane(road, bool(pose.counter_clockwise))
    assert np.hypot(*(line - point).T).min() == pytest.approx(abs(pose.deviation), abs=0.002)


@every_road
@both_lanes
def test_a_lane_is_as_long_as_its_points_are_apart(road, outer):
    line, _ = lane(road, outer)
    assert lane_length(road, outer) == pytest.approx(np.hypot(*np.diff(line, axis=0).T).sum(), abs=1e-4)


@every_road
def test_the_outer_lap_is_longer_and_the_inner_one_shorter_by_one_full_turn_of_the_lanes_offset(road):
    turn = 2 * pi * road.lane_offset
    assert lane_length(road, True) == pytest.approx(length(road.segments) + turn)
    assert lane_length(road, False) == pytest.approx(length(road.segments) - turn)


@every_road
@both_lanes
def test_the_outer_lane_goes_round_counter_clockwise_and_the_inner_one_clockwise(road, outer):
    _, headings = lane(road, outer)
    assert np.unwrap(headings)[-1] - headings[0] == pytest.approx(2 * pi if outer else -2 * pi, abs=0.02)


def test_the_horseshoe_turns_to_both_sides_and_the_small_loop_to_one():
    sides = {road.name: np.sign(np.round(np.diff(np.unwrap(lane(road, True)[1])), 6)) for road in SHIPPED}
    assert set(sides["horseshoe"]) == {-1.0, 0.0, 1.0}
    assert set(sides["small_loop"]) == {0.0, 1.0}


@functools.cache
def floor_as_driven(road):
    """The floor with bends that are painted where the road is scored."""
    return draw_floor(dataclasses.replace(road, paint=dataclasses.replace(road.paint, bend_radius=None)))


def painted(road, offset, outer=True):
    """Colours along the line that runs so far right of the road's centre line [m]."""
    floor, (line, _) = floor_as_driven(road), lane(dataclasses.replace(road, lane_offset=offset), outer)
    columns, rows = ((line - floor.origin) * floor.pixels_per_metre).astype(int).T
    return floor.pixels[rows, columns]


@pytest.mark.slow
@every_road
@both_lanes
def test_the_edge_lines_and_the_lanes_are_drawn_where_they_are_scored(road, outer):
    edge = (road.width - road.paint.white_width) / 2
    assert (painted(road, edge, outer) == COLOURS["white"]).all()
    assert (painted(road, road.lane_offset, outer) == COLOURS["asphalt"]).all()


@every_road
def test_the_centre_line_is_dashed_all_the_way_round(road):
    yellow = (painted(road, 1e-6) == COLOURS["yellow"]).all(axis=1)
    assert 0.5 < yellow.mean() < 0.7
    changes = np.flatnonzero(np.diff(yellow.astype(int)))
    assert np.diff(changes).max() * 0.002 < 2.5 * max(road.paint.straight_dash, road.paint.bend_dash)


def test_a_map_that_is_not_square_ends_where_its_own_sides_do():
    road = shipped_map("horseshoe")
    wide, high = road.size
    assert wide > high
    assert not off_map(road, wide, high)
    assert off_map(road, wide + 1e-9, high)
    assert off_map(road, wide, high + 1e-9)
    floor = draw_floor(road)
    row, column = (int((where - floor.origin) * floor.pixels_per_metre) for where in (high + 0.01, wide / 2))
    assert tuple(floor.pixels[row, column]) == COLOURS["off_map"]


@every_shipped
def test_ten_starts_lie_in_their_lanes_some_in_either(road):
    starts = np.array(road.starts)
    pose = lane_pose(road, starts[:, :2], np.radians(starts[:, 2]))
    assert len(set(road.starts)) == 10
    assert (np.abs(pose.deviation) < road.lane_width / 2).all()
    assert (np.abs(pose.heading_error) < pi / 4).all()
    assert set(pose.counter_clockwise) == {True, False}


class Dark:
    """A camera that costs nothing: the expert does not look."""

    def render(self, poses):
        return np.zeros((len(poses), 1, 1, 3), dtype=np.uint8)


@pytest.mark.slow
@every_shipped
@both_lanes
@pytest.mark.parametrize("plant", ["planar", "bullet"])
def test_the_expert_drives_a_lap_with_both_wheels_in_the_lane(road, outer, plant):
    robot = read_robot("duckiebot")
    look_ahead, speed, gain, _ = robot.expert_figures()
    line, headings = lane(road, outer)
    start, seconds = np.array((*line[0], headings[0])), 1.02 * float(lane_length(road, outer)) / speed
    family = lane_following(Section(Path("study.toml"), "domain.", {"plant": plant, "map": road.name}), model=None)
    instance = dataclasses.replace(family.instance({}), camera=Dark(), image=stage_chain((), Stage.IMAGE))
    course = Course(start, seconds, 0, functools.partial(off_map, road))
    with family.plant_at(robot, start) as world:
        poses = drive(instance, world, Expert(road, look_ahead, speed, gain, 0.0, 0), course, Sight).poses
    figures = {"tick_s": 1 / TICK_HZ, "seconds": seconds}
    assert score_trajectory(road, poses, **figures)["distance"] > lane_length(road, outer)
    assert driving_score(road, poses, wheel_distance=robot.wheel_distance(), **figures) > seconds - 0.1
