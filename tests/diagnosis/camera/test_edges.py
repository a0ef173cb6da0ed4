"""What a camera's fit is given: edges of markings, views of a log's frames, where the robot was, a camera in θ."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from one_line import complaint_of
from pictured import PICTURES, ROBOT, lane_poses, pictures, write_pictures, write_still_frames
from viewed import NEUTRAL, OPTICS, stood

from proxytune.diagnosis.camera import edges as gathering
from proxytune.diagnosis.camera.edges import Tape, find_edges, gather_views, read_road, track_frames
from proxytune.driving import COLOURS, LINES, robot_from_geometry
from proxytune.driving.optics import SKY
from proxytune.errors import LogError, SettingsError
from proxytune.files import shipped
from proxytune.logs import Frames, Log, LogEpisode, read_log

ROWS, COLUMNS, FINE = 60, 80, 6
FLOOR, WHITE, YELLOW = (np.array(COLOURS[name], dtype=float) for name in ("asphalt", "white", "yellow"))


def striped(angle, offset, paint=WHITE, half_width=6.0):
    """Floor with a stripe of paint across: its normal's direction [rad], its middle beside the picture's [pixel]."""
    normal = np.array((np.cos(angle), np.sin(angle)))
    down, right = np.mgrid[: ROWS * FINE, : COLUMNS * FINE] / FINE + 0.5 / FINE
    away = (right - COLUMNS / 2.0) * normal[0] + (down - ROWS / 2.0) * normal[1] - offset
    fine = np.clip(0.5 + (half_width - np.abs(away)) * FINE, 0.0, 1.0)
    cover = fine.reshape(ROWS, FINE, COLUMNS, FINE).mean(axis=(1, 3))
    return np.rint(FLOOR + cover[..., None] * (paint - FLOOR)).astype(np.uint8)[None]


def yellow_striped(angle, offset):
    """A yellow stripe, and something white in a corner: whiteness is what yellow is measured by."""
    shown = striped(angle, offset, YELLOW)
    shown[:, :9, :9] = WHITE
    return shown


def along_normal(edges, angle, offset):
    """How far each edge point lies from the stripe's middle, and how much its normal points away from there."""
    normal = np.array((np.cos(angle), np.sin(angle)))
    place = np.stack((edges.column - COLUMNS / 2.0, edges.row - ROWS / 2.0), axis=-1)
    return place @ normal - offset, edges.normal @ normal


ANGLES, OFFSETS = st.floats(0.0, 2.0 * np.pi), st.floats(-4.0, 4.0)


@settings(max_examples=15)
@given(ANGLES, OFFSETS)
def test_a_straight_edge_is_found_within_a_tenth_of_a_pixel_at_any_angle(angle, offset):
    """Standard deviation, largest at 45°; the whole edge lies within a twentieth, single points within a fifth."""
    edges = find_edges(striped(angle, offset))
    away, _ = along_normal(edges, angle, offset)
    off = np.abs(away) - 6.0
    assert edges.white.all()
    assert len(away) > 80
    assert abs(off.mean()) < 0.06
    assert off.std() < 0.125
    assert np.abs(off).max() < 0.2


@settings(max_examples=15)
@given(ANGLES, OFFSETS, st.booleans())
def test_normals_are_unit_vectors_from_the_floor_into_the_marking(angle, offset, white):
    edges = find_edges(striped(angle, offset) if white else yellow_striped(angle, offset))
    edges = edges.only((edges.white == white) & (np.maximum(edges.column, edges.row) > 12.0))
    away, outward = along_normal(edges, angle, offset)
    assert len(away) > 80
    np.testing.assert_allclose(np.linalg.norm(edges.normal, axis=1), 1.0, atol=1e-6)
    assert (-np.sign(away) * outward > np.cos(np.radians(8.0))).all()


def test_yellow_edges_are_told_by_their_colour_on_either_side():
    """Strong yellow is not clipped, which would move its edges outwards by 0.2 pixels and make the tape look wider."""
    edges = find_edges(yellow_striped(0.3, 1.0))
    away, _ = along_normal(edges.only(~edges.white), 0.3, 1.0)
    assert len(away) > 80
    sides = [np.abs(away[way * away > 0.0]).mean() - 6.0 for way in (-1.0, 1.0)]
    assert sides == pytest.approx([0.0, 0.0], abs=0.03)
    assert sides[0] == pytest.approx(sides[1], abs=0.03)

    shown = pictures({}, lane_poses(6))
    right, swapped = find_edges(shown), find_edges(np.ascontiguousarray(shown[..., ::-1]))
    floor_only = swapped.only(swapped.row > 50)
    assert (~right.only(right.row > 50).white).sum() > 100
    assert (~floor_only.white).sum() == 0
    white = right.only(right.white & (right.row > 50))
    known = {(int(f), round(float(c), 1), round(float(r), 1)) for f, _, c, r, _ in zip(*white, strict=True)}
    again = {(int(f), round(float(c), 1), round(float(r), 1)) for f, _, c, r, _ in zip(*floor_only, strict=True)}
    assert len(known & again) > 0.6 * len(known)


@pytest.mark.parametrize("colour", [0, 20, 128, 255, SKY], ids=str)
def test_nothing_is_found_in_a_flat_picture_nor_in_one_of_nothing_but_sky(colour):
    assert [len(field) for field in find_edges(np.full((2, ROWS, COLUMNS, 3), colour, dtype=np.uint8))] == [0] * 5


def test_noise_sky_and_border_have_no_edges_and_points_are_sorted_by_picture_whatever_brightness():
    noise = np.random.default_rng(1).normal(0.0, 2.0, (1, ROWS, COLUMNS, 3))
    shown = np.clip(striped(0.3, 0.0) + noise, 0, 255).astype(np.uint8)
    away, _ = along_normal(find_edges(shown), 0.3, 0.0)
    assert np.abs(np.abs(away) - 6.0).max() < 0.4

    shown = striped(0.0, 0.0)
    shown[:, :20] = SKY
    edges = find_edges(shown)
    assert len(edges.row) > 60
    assert edges.row.min() > 20 + gathering.SKY_MARGIN
    away, outward = along_normal(edges, 0.0, 0.0)
    assert np.abs(np.abs(away) - 6.0).max() < 0.1
    assert (np.abs(outward) > 0.99).all()

    edges = find_edges(striped(np.pi / 2.0, -27.0, half_width=2.5))
    assert edges.row.min() >= gathering.BORDER
    assert len(find_edges(striped(0.0, -COLUMNS / 2.0, half_width=1.0)).row) == 0
    shown = pictures({}, lane_poses(4), columns=96)
    edges = find_edges(shown)
    assert (np.diff(edges.frame) >= 0).all()
    assert set(edges.frame) == {0, 1, 2, 3}
    alone, own = find_edges(shown[2:3]), edges.only(edges.frame == 2)
    np.testing.assert_array_equal(alone.column, own.column)
    np.testing.assert_array_equal(alone.white, own.white)
    shown = striped(0.4, 1.0)
    away, _ = along_normal(find_edges((shown * 0.4).astype(np.uint8)), 0.4, 1.0)
    assert len(away) > 80
    assert np.abs(np.abs(away) - 6.0).max() < 0.2


RATE, RADIUS, SPEED = 20.0, 0.8, 0.3


def circle(times, turn=SPEED / RADIUS):
    angle = turn * np.asarray(times)
    return np.column_stack((RADIUS * np.cos(angle), RADIUS * np.sin(angle), angle + np.pi / 2.0))


def episode(seconds=10.0, begin=0.0, noise=0.0, seed=0):
    times = begin + np.arange(0.0, seconds, 1.0 / RATE)
    poses = circle(times) + np.random.default_rng(seed).normal(0.0, 1.0, (len(times), 3)) * noise
    return LogEpisode("drive", times, np.zeros((len(times), 2)), poses, None)


def log_of(*episodes, rate=RATE):
    return Log("log", "duckiebot", "duty" if rate else "none", rate, {}, episodes)


def frames_at(times, drives=None):
    times = np.asarray(times, dtype=float)
    return Frames((), np.zeros(len(times), dtype=int) if drives is None else np.array(drives), times, "small_loop")


def test_a_drive_is_looked_up_smoothed_at_its_latency_each_frame_in_its_own_across_a_missing_pose():
    times = np.linspace(1.0, 8.0, 30)
    tracks, numbers = track_frames(log_of(episode()), frames_at(times))
    poses, rates = tracks.at(0.0)
    np.testing.assert_array_equal(numbers, np.arange(30))
    np.testing.assert_allclose(poses, circle(times), atol=5e-4)
    heading = circle(times)[:, 2]
    course = np.column_stack((SPEED * np.cos(heading), SPEED * np.sin(heading), np.full(30, SPEED / RADIUS)))
    np.testing.assert_allclose(rates, course, atol=2e-3)
    assert tracks.moving

    times = np.arange(1.0, 9.0, 0.5)
    drives = (log_of(episode(noise=0.01, seed=seed)) for seed in range(40))
    errors = [track_frames(drive, frames_at(times))[0].at(0.0)[0] - circle(times) for drive in drives]
    share = track_frames(log_of(episode()), frames_at(times))[0].share
    assert share < 0.6
    assert np.std(errors) == pytest.approx(0.01 * share, rel=0.1)

    times = np.linspace(2.0, 8.0, 20)
    tracks, _ = track_frames(log_of(episode()), frames_at(times))
    np.testing.assert_allclose(tracks.at(0.13)[0], circle(times - 0.13), atol=6e-4)
    late, now = tracks.at(0.13)[0], tracks.at(0.0)[0]
    np.testing.assert_allclose(np.linalg.norm((now - late)[:, :2], axis=1), SPEED * 0.13, rtol=0.02)
    drive = episode()
    drive.poses[80] = np.nan
    tracks, numbers = track_frames(log_of(drive), frames_at([4.0]))
    assert len(numbers) == 1
    np.testing.assert_allclose(tracks.at(0.0)[0], circle([4.0]), atol=1e-3)

    first, second = episode(), episode(begin=100.0)
    tracks, _ = track_frames(log_of(first, second), frames_at([5.0, 105.0, 5.5], [0, 1, 0]))
    np.testing.assert_allclose(tracks.at(0.0)[0], circle([5.0, 105.0, 5.5]), atol=1e-3)

    empty = episode()
    empty.poses[:] = np.nan
    tracks, numbers = track_frames(log_of(empty, episode()), frames_at([5.0, 5.0], [0, 1]))
    np.testing.assert_array_equal(numbers, [1])
    np.testing.assert_allclose(tracks.at(0.0)[0], circle([5.0]), atol=1e-3)


def test_frames_standing_still_keep_their_poses_and_those_in_a_long_gap_or_of_another_clock_are_left_out():
    times = np.arange(25.0)
    poses = np.random.default_rng(3).normal(size=(25, 3))
    still = LogEpisode("stills", times, np.zeros((25, 0)), poses, None)
    tracks, numbers = track_frames(log_of(still, rate=0.0), frames_at(times[::2]))
    np.testing.assert_array_equal(tracks.at(0.0)[0], poses[::2])
    assert (tracks.share, tracks.moving, len(numbers)) == (1.0, False, 13)

    times = 0.1 * np.arange(25.0)
    still = LogEpisode("stills", times, np.zeros((25, 0)), circle(times), None)
    _, numbers = track_frames(log_of(still, rate=0.0), frames_at([0.3, 0.35, 0.4]))
    np.testing.assert_array_equal(numbers, [0, 2])

    drive = episode()
    gap = (drive.times > 4.0) & (drive.times < 4.0 + 2.0 * gathering.LONGEST_GAP_S)
    drive.poses[gap] = np.nan
    _, numbers = track_frames(log_of(drive), frames_at([3.9, 4.2, 4.3, 4.6, -0.2, 12.0]))
    np.testing.assert_array_equal(numbers, [0, 3])
    with pytest.raises(LogError, match="no frame has a pose near its time; check that times are on the poses' clock"):
        track_frames(log_of(episode()), frames_at([1000.0, 1001.0]))


PARAMETERS = OPTICS.robot.catalogue.parameters
MOUNTING = st.sampled_from(OPTICS.mounting)


def test_neutral_values_are_the_nominal_camera_in_the_log_s_size():
    figures = OPTICS.figures(NEUTRAL)
    nominal = OPTICS.robot.camera_figures()
    assert (figures.rows, figures.columns) == (120, 160)
    assert figures.channels().tolist() == nominal.channels().tolist()


@given(MOUNTING, st.floats(0.05, 0.95))
def test_every_parameter_of_the_mounting_changes_the_camera(name, share):
    parameter = PARAMETERS[name]
    value = parameter.low + share * (parameter.high - parameter.low)
    assert (OPTICS.figures({**NEUTRAL, name: value}) == OPTICS.figures(NEUTRAL)) == (value == OPTICS.neutral(name))


@given(st.floats(0.0, 0.5), st.floats(0.0, 0.2))
def test_what_is_not_of_the_mounting_leaves_the_camera_alone(latency, blur):
    assert OPTICS.figures({**NEUTRAL, "camera_latency": latency, "blur": blur}) == OPTICS.figures(NEUTRAL)
    assert not {"camera_latency", "rolling_shutter", "blur", "trim"} & set(OPTICS.mounting)


@given(MOUNTING, st.floats(-1e3, 1e3))
def test_values_are_clipped_to_the_nearest_bound(name, value):
    parameter = PARAMETERS[name]
    clipped = OPTICS.clipped(name, value)
    assert parameter.low <= clipped <= parameter.high
    assert clipped == value or clipped in (parameter.low, parameter.high)


@given(MOUNTING, st.floats(0.0, 1.0))
def test_a_step_never_leaves_the_bounds(name, share):
    """A camera cannot be made beyond them."""
    parameter = PARAMETERS[name]
    value = OPTICS.clipped(name, parameter.low + share * (parameter.high - parameter.low))
    assert parameter.low <= value + OPTICS.step(name, value) <= parameter.high


@given(st.integers(1, 40))
def test_every_error_of_the_tape_has_a_place_of_its_own(stretches):
    tape = Tape(stretches)
    stretch, line = (each.ravel() for each in np.meshgrid(np.arange(stretches), np.arange(len(LINES))))
    shifts = tape.shift(stretch, line)
    tilts = tape.tilt(stretch[line < gathering.TILTED], line[line < gathering.TILTED])
    white, yellow = np.array([True, False, False]), np.array([0, 2, 3])
    assert sorted(np.concatenate((shifts, tilts, tape.width(white, yellow))).tolist()) == list(range(tape.size))
    # Both white lines have one width
    assert tape.width(np.array([True]), np.array([0])) == tape.width(np.array([True]), np.array([1]))


def test_a_tracker_and_a_map_are_never_trusted_beyond_their_least():
    """Another scatter leaves all else alone."""
    before = stood(count=1)
    views = replace(before, position_m=0.0, heading_rad=0.0)
    assert views.edges is before.edges
    assert (views.count, len(views.tape_scatter)) == (1, Tape(views.markings.stretches).size)
    np.testing.assert_allclose(views.pose_scatter, (gathering.LEAST_SCATTER[0], *gathering.LEAST_SCATTER))
    assert (views.tape_scatter >= gathering.LEAST_TAPE_M).all()
    np.testing.assert_allclose(replace(views, position_m=0.01, heading_rad=0.02).pose_scatter, (0.01, 0.01, 0.02))


COUNT = 24


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_still_frames(tmp_path_factory.mktemp("stills") / "log", {}, lane_poses(COUNT), columns=96)


@pytest.fixture(scope="module")
def log(folder):
    return read_log(folder)


def test_too_few_markings_are_refused_and_of_many_frames_some_spread_evenly_with_a_stated_scatter(
    log, tmp_path, monkeypatch
):
    pictures = gather_views(log, log.frames, ROBOT).pictures.copy()
    pictures[3:10] = 60
    write_pictures(tmp_path, pictures)
    frames = replace(log.frames, paths=tuple(tmp_path / (PICTURES % number) for number in range(COUNT)))
    problem = "17 of 24 frames show markings; the camera needs 20: drive nearer to the lines, or check the map"
    assert complaint_of(gather_views, log, frames, ROBOT) == f"{log.name}: frames: {problem}"
    gathered = gather_views(log, log.frames, ROBOT)
    views = gathered.views
    np.testing.assert_array_equal(gathered.numbers, np.arange(COUNT))
    np.testing.assert_allclose(views.tracks.at(0.0)[0][:, :2], lane_poses(COUNT)[:, :2], atol=1e-9)
    assert gathered.pictures.shape == (COUNT, 72, 96, 3)
    assert (views.optics.rows, views.optics.columns) == (72, 96)
    assert (views.position_m, views.heading_rad) == pytest.approx((0.002, np.radians(0.3)))
    assert views.tape_m == views.markings.road.paint.tape_m == 0.005
    views = gather_views(log, replace(log.frames, position_m=None, heading_deg=None), ROBOT).views
    assert (views.position_m, views.heading_rad) == pytest.approx((0.005, np.radians(1.0)))
    monkeypatch.setattr(gathering, "MOST_FRAMES", 21)
    numbers = gather_views(log, log.frames, ROBOT).numbers
    assert (len(numbers), numbers[0], numbers[-1]) == (21, 0, COUNT - 1)
    assert set(np.diff(numbers)) <= {1, 2}


def test_of_fewer_frames_than_a_camera_needs_more_are_to_be_taken_however_well_they_show_the_lines(log):
    own = log.frames
    few = replace(own, paths=own.paths[:19], drives=own.drives[:19], times=own.times[:19])
    problem = "19 of 19 frames show markings; the camera needs 20: take more that show them"
    assert complaint_of(gather_views, log, few, ROBOT) == f"{log.name}: frames: {problem}"


def test_pictures_without_any_colour_are_told_to_be_grey(log, tmp_path):
    gathered = gather_views(log, log.frames, ROBOT)
    assert gathered.notes == ()
    write_pictures(tmp_path, gathered.pictures[..., 1:2].repeat(3, axis=-1))
    frames = replace(log.frames, paths=tuple(tmp_path / (PICTURES % number) for number in range(COUNT)))
    gathered = gather_views(log, frames, ROBOT)
    said = "beware: the pictures are grey, so that yellow markings are hardly seen; colour pictures tell more"
    assert gathered.notes == (said,)


def test_a_robot_without_a_camera_is_refused_beforehand_and_a_map_is_a_shipped_one_or_a_file(log):
    geometry = {"wheel_radius": 0.03, "effective_baseline": 0.16, "full_speed": 0.6}
    frames = replace(log.frames, paths=(Path("nowhere.png"),) * COUNT)
    with pytest.raises(SettingsError, match="camera"):
        gather_views(log, frames, robot_from_geometry("cart", geometry, 20.0))
    file = shipped("robots") / "maps" / "horseshoe.toml"
    assert read_road(str(file)).segments == read_road("horseshoe").segments
    with pytest.raises(SettingsError):
        read_road("nowhere")


def test_a_value_is_at_an_end_of_its_range_within_a_hundredth_of_it_unless_that_end_is_neutral():
    assert [OPTICS.at_end("pixel_aspect", value) for value in (0.7, 0.72, 1.38, 1.395)] == [True, False, False, True]
    assert not OPTICS.at_end("camera_latency", 0.0)
    assert OPTICS.at_end("camera_latency", 0.5)
