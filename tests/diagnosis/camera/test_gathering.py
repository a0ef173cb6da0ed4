"""A log's frames become views: spread over the log, thinned, and refused where too few show markings."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))
from pictured import PICTURES, ROBOT, lane_poses, write_pictures, write_still_frames

from proxytune.diagnosis.camera import gathering
from proxytune.diagnosis.camera.gathering import EVERY, gather_views, read_road
from proxytune.diagnosis.camera.measured.edges import find_edges
from proxytune.driving.robot import robot_from_geometry
from proxytune.errors import LogError, SettingsError
from proxytune.logs import read_log
from proxytune.shipped import shipped

COUNT = 24


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_still_frames(tmp_path_factory.mktemp("stills") / "log", {}, lane_poses(COUNT), columns=96)


@pytest.fixture(scope="module")
def log(folder):
    return read_log(folder)


def test_views_hold_what_the_log_says(log):
    gathered = gather_views(log, log.frames, ROBOT)
    views = gathered.views
    np.testing.assert_array_equal(gathered.numbers, np.arange(COUNT))
    np.testing.assert_allclose(views.tracks.at(0.0)[0][:, :2], lane_poses(COUNT)[:, :2], atol=1e-9)
    assert gathered.pictures.shape == (COUNT, 72, 96, 3)
    assert (views.optics.rows, views.optics.columns) == (72, 96)
    assert (views.position_m, views.heading_rad) == pytest.approx((0.002, np.radians(0.3)))
    assert views.tape_m == views.markings.road.paint.tape_m == 0.005


def test_every_second_edge_point_is_used_in_the_order_of_frames(log):
    gathered = gather_views(log, log.frames, ROBOT)
    edges, every = gathered.views.edges, find_edges(gathered.pictures)
    assert len(edges.row) == -(-len(every.row) // EVERY)
    np.testing.assert_array_equal(edges.column, every.column[::EVERY])
    assert (np.diff(edges.frame) >= 0).all()


def test_a_tracker_that_states_nothing_is_assumed_to_scatter_by_millimetres(log):
    frames = replace(log.frames, position_m=None, heading_deg=None)
    views = gather_views(log, frames, ROBOT).views
    assert (views.position_m, views.heading_rad) == pytest.approx((0.005, np.radians(1.0)))


def test_of_a_long_log_frames_are_spread_evenly(log, monkeypatch):
    monkeypatch.setattr(gathering, "MOST_FRAMES", 21)
    numbers = gather_views(log, log.frames, ROBOT).numbers
    assert (len(numbers), numbers[0], numbers[-1]) == (21, 0, COUNT - 1)
    assert set(np.diff(numbers)) <= {1, 2}


def test_too_few_markings_are_refused_in_one_line_with_the_count(log, tmp_path):
    pictures = gather_views(log, log.frames, ROBOT).pictures.copy()
    pictures[3:10] = 60
    write_pictures(tmp_path, pictures)
    frames = replace(log.frames, paths=tuple(tmp_path / (PICTURES % number) for number in range(COUNT)))
    with pytest.raises(LogError) as refusal:
        gather_views(log, frames, ROBOT)
    problem = "17 of 24 frames show markings; the camera needs 20: drive nearer to the lines, or check the map"
    assert str(refusal.value) == f"{log.name}: frames: {problem}"


def test_a_robot_without_a_camera_is_refused_before_pictures_are_read(log):
    geometry = {"wheel_radius": 0.03, "effective_baseline": 0.16, "full_speed": 0.6}
    frames = replace(log.frames, paths=(Path("nowhere.png"),) * COUNT)
    with pytest.raises(SettingsError, match="camera"):
        gather_views(log, frames, robot_from_geometry("cart", geometry, 20.0))


def test_a_map_is_one_of_the_package_s_or_a_file():
    file = shipped("robots") / "maps" / "horseshoe.toml"
    assert read_road(str(file)).segments == read_road("horseshoe").segments
    with pytest.raises(SettingsError):
        read_road("nowhere")
