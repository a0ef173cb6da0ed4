"""On every map, also of one's own, the road that is scored, followed and drawn is one and the same."""

import dataclasses
import functools
import hashlib
import re
from math import pi, remainder
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from nominal_camera import Dark
from one_line import complaint_of

from proxytune.domain import make_episode
from proxytune.driving import COLOURS, TICK_HZ, Expert, Road, draw_floor, drive, lane_following, read_robot, robot_names
from proxytune.driving.episode import Course, Sight, driving_score, score_trajectory
from proxytune.driving.lane import corners, lane_length, lane_point, lane_pose, off_map
from proxytune.driving.maps import map_names, read_map, shipped_map
from proxytune.driving.road import Arc, Paint, Straight, length
from proxytune.effects import Stage, stage_chain
from proxytune.errors import SettingsError
from proxytune.files import shipped
from proxytune.settings import Section

HORSESHOE = (shipped("robots") / "maps" / "horseshoe.toml").read_text(encoding="utf-8")
LOOP = (shipped("robots") / "maps" / "small_loop.toml").read_text(encoding="utf-8")
LEFT = "{ radius = 0.2925, turn = 90.0 }"


def family(folder, name="mine.toml", **domain):
    values = {"plant": "planar", "map": name, "seconds": 1.0, **domain}
    return lane_following(Section(folder / "study.toml", "domain.", values), model=None)


def written(folder, text):
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def changed(text, old, new, times=1):
    assert old in text
    return text.replace(old, new, times)


def refusal(folder, text):
    """What is said of a map after its path, on one line."""
    path = written(folder, text)
    said = complaint_of(family, folder)
    assert said.startswith(f"{path}: ")
    return said.removeprefix(f"{path}: ")


def figure_eight():
    head, tail = LOOP.split("segments = [")
    eight = [LEFT] * 3 + ["{ straight = 0.6 }"] + ["{ radius = 0.2925, turn = -90.0 }"] * 3 + ["{ straight = 0.6 }"]
    return f"{head}segments = [{', '.join(eight)}]{tail.split(']', 1)[1]}"


def overlapping():
    """The horseshoe with its middle let down by 20 cm onto the way below."""
    before, after = HORSESHOE.split("    { radius = 0.2925, turn = -90.0 },\n", 1)
    middle, rest = after.split("    { radius = 0.2925, turn = -90.0 },\n", 1)
    bend, down = "    { radius = 0.2925, turn = -90.0 },\n", "    { straight = 0.2 },\n"
    return before + down + bend + middle + bend + down + rest


@pytest.mark.slow
def test_a_map_beside_the_study_is_driven(tmp_path):
    written(tmp_path, HORSESHOE)
    mine, theirs = family(tmp_path), family(tmp_path, "horseshoe")
    assert mine.map.name == "mine"
    assert mine.starts == 10
    episode = make_episode({}, agent="steady", start=2, seed=3)
    assert mine.run(episode) == theirs.run(episode)
    assert mine.run(episode) != family(tmp_path, "small_loop").run(episode)


def test_what_a_map_file_says_is_part_of_the_family_and_shipped_maps_are_no_robots(tmp_path):
    written(tmp_path, HORSESHOE)
    before, same = family(tmp_path), family(tmp_path)
    assert before == same
    assert before.identity == same.identity
    written(tmp_path, changed(HORSESHOE, "white_width = 0.048", "white_width = 0.047"))
    assert family(tmp_path) != before
    assert family(tmp_path).identity != before.identity
    assert set(map_names()) == {"car_loop", "horseshoe", "small_loop"}
    assert "maps" not in robot_names()


def test_segments_are_read_in_their_order_and_bends_painted_on_their_own_radius_where_the_file_says_nothing(tmp_path):
    loop = shipped_map("small_loop")
    assert loop.segments == (Straight(0.585), Arc(0.2925, 90.0)) * 4
    assert loop.paint.bend_radius == 0.17
    assert read_map(written(tmp_path, changed(LOOP, "bend_radius = 0.17\n", ""))).paint.bend_radius is None


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("size", "sise", "sise: unknown key; did you mean 'size'?"),
        ("lane_width", "lane_with", "road.lane_with: unknown key; did you mean 'lane_width'?"),
        ("white_width = 0.048\n", "", "paint.white_width: is missing; add it"),
        ("white_width", "withe_width", "paint.withe_width: unknown key"),
        ("format = 1", "format = 2", "format: must be between 1 and 1, got 2"),
        ("[1.755, 1.755]", "1.755", "size: must be a list of 2 finite numbers, got 1.755"),
        ("[1.755, 1.755]", "[1.755, true]", "size: must be a list of 2 finite numbers"),
        ("[1.755, 1.755]", f"[1.755, 1{'0' * 400}]", "size: must be a list of 2 finite numbers"),
        ("[1.755, 1.755]", "[1.755, 11.0]", "size: each side must be above 0 and at most 10 m"),
        ("{ straight = 0.585 }", "0.585", "road.segments[0]: must be { straight = M } or { radius = M"),
        ("straight =", "strait =", "road.segments[0].strait: unknown key; did you mean 'straight'?"),
        ("= 0.585 }", "= 0.585, turn = 3 }", "road.segments[0].turn: unknown key"),
        ("straight = 0.585", "straight = -1.0", "road.segments[0].straight: must be between 0.001 and"),
        ("turn = 90.0", "turn = 180.0", "road.segments[1].turn: must be between -90 and 90, got 180.0"),
        ("turn = 90.0", "turn = 0.0", "road.segments[1].turn: must not be 0; write { straight = M }"),
        ("radius = 0.2925, ", "", "road.segments[1].radius: is missing; add it"),
        ("radius = 0.2925", "radius = 0.2", "road.segments[1].radius: 0.2 m is too tight a bend for a road 0.585 m"),
        ("turn = 90.0", "turn = 80.0", "road.segments: the road does not close: its turns add up to 350°; make it"),
        ("1.4625, 0.585, 90.0", "1.5, 0.585, 90.0", "road.segments: the road leaves the map at (1.7"),
        ("lane_width = 0.22", "lane_width = 0.3", "road.lane_width: the two lanes overlap at 0.3 m"),
        ("width = 0.585", "width = 0.4", "road.width: 0.4 m has no room for two lanes; at least 0.4774 m"),
        ("bend_radius = 0.17", "bend_radius = 0.3", "paint.bend_radius: 0.3 m is wider than a bend; at most 0.2925"),
        ("[0.4237, 0.702", "[0.8775, 0.8775", "starts[0]: lies 0.714 m beside the lane that runs its way"),
        ("[0.4237, 0.702, 104.3]", "[0.4, 0.7]", "starts[0]: must be a list of 3 finite numbers, got"),
    ],
)
def test_a_mistake_in_a_map_file_is_one_line_with_file_and_key(tmp_path, old, new, says):
    assert refusal(tmp_path, changed(LOOP, old, new)).startswith(says)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (changed(LOOP, "straight = 0.585", "straight = 0.7"), "does not close: it ends at (1.462, 0.700), 0.115 m"),
        (changed(LOOP, "turn = 90.0", "turn = -90.0", 4), "runs clockwise; lay it counter-clockwise"),
        (figure_eight(), "does not close: its turns add up to 0°; make it 360°"),
        (overlapping(), "overlaps itself at ("),
    ],
)
def test_a_road_that_is_no_simple_loop_is_refused(tmp_path, text, says):
    assert refusal(tmp_path, text).startswith(f"road.segments: the road {says}")


def test_a_map_file_that_is_not_there_or_has_no_starts_is_refused(tmp_path):
    empty = re.sub(r"starts = \[\n.*?\n\]", "starts = []", LOOP, flags=re.DOTALL)
    assert refusal(tmp_path, empty) == "starts: must be a list with something in it, got []"
    with pytest.raises(SettingsError, match=r"gone\.toml: no such file; check the path"):
        family(tmp_path, "gone.toml")
    told = complaint_of(family, Path(), "horse")
    assert "domain.map: unknown value 'horse'; did you mean 'horseshoe'?" in told
    assert "ends in .toml" in told


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
quick = settings(max_examples=25)
coordinates = st.floats(-0.5, 3.5)
points = st.tuples(coordinates, coordinates)


def lane(road, outer, spacing=0.002):
    """Points, and headings from each to the next, of a lane's centre line."""
    lap = float(lane_length(road, outer))
    line = lane_point(road, outer, np.linspace(0.0, lap, round(lap / spacing) + 1))
    return line, np.arctan2(*np.diff(line, axis=0).T[::-1])


@every_road
def test_the_road_closes_and_its_lanes_are_longer_and_shorter_by_one_full_turn_of_their_offset(road):
    np.testing.assert_allclose(corners(road.begin, road.segments)[-1], road.begin[:2], atol=1e-12)
    turn = 2 * pi * road.lane_offset
    assert lane_length(road, True) == pytest.approx(length(road.segments) + turn)
    assert lane_length(road, False) == pytest.approx(length(road.segments) - turn)


@every_road
@quick
@given(outer=st.booleans(), along=st.floats(-12.0, 20.0))
def test_the_point_so_far_along_a_lane_is_seen_so_far_along_it(road, outer, along):
    behind, here, ahead = lane_point(road, outer, along + np.array([-1e-5, 0.0, 1e-5]))
    pose = lane_pose(road, here, np.arctan2(*(ahead - behind)[::-1]))
    assert pose.counter_clockwise == outer
    assert pose.deviation == pytest.approx(0, abs=1e-11)
    assert pose.heading_error == pytest.approx(0, abs=1e-4)
    assert remainder(pose.along - along, lane_length(road, outer)) == pytest.approx(0, abs=1e-9)


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
@given(point=points, heading=st.floats(-10, 10))
def test_no_point_of_the_lane_is_nearer_than_the_deviation(road, point, heading):
    pose = lane_pose(road, np.array(point), np.array(heading))
    line, _ = lane(road, bool(pose.counter_clockwise))
    assert np.hypot(*(line - point).T).min() == pytest.approx(abs(pose.deviation), abs=0.002)


@every_road
@both_lanes
def test_the_outer_lane_goes_round_counter_clockwise_and_the_inner_one_clockwise(road, outer):
    _, headings = lane(road, outer)
    assert np.unwrap(headings)[-1] - headings[0] == pytest.approx(2 * pi if outer else -2 * pi, abs=0.02)


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


@pytest.mark.slow
@pytest.mark.parametrize("road", ROADS)
def test_the_centre_line_is_dashed_all_the_way_round(road):
    yellow = (painted(road, 1e-6) == COLOURS["yellow"]).all(axis=1)
    assert 0.5 < yellow.mean() < 0.7
    changes = np.flatnonzero(np.diff(yellow.astype(int)))
    assert np.diff(changes).max() * 0.002 < 2.5 * max(road.paint.straight_dash, road.paint.bend_dash)


def test_a_map_that_is_not_square_ends_where_its_own_sides_do():
    road = ROADS[-1]
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


def test_the_floor_is_drawn_as_it_was_to_the_last_byte():
    floor = draw_floor(shipped_map("small_loop"))
    digest = hashlib.sha256(floor.pixels.tobytes()).hexdigest()
    assert digest == "e347d735d4b196fd72756c4ccd6e92f0cd26dedf7df020c7f7af0014d9228700"
    assert (floor.pixels.shape, floor.origin) == ((832, 832, 3), -0.1625000000000001)
