"""Lane drives are filmed as an agent would see them: every start, both lanes, all image effects, true instants."""

from dataclasses import replace

import numpy as np
import pytest

from proxytune.diagnosis import film, record, recording as filming
from proxytune.diagnosis.motion.diagnose import diagnose
from proxytune.driving import LaneFollowing, drive, lane_pose, read_robot, shipped_map
from proxytune.driving.family import with_columns
from proxytune.effects import FilterContext
from proxytune.errors import EpisodeError, SettingsError
from proxytune.files import shipped

ROAD = shipped_map("small_loop")


@pytest.fixture
def family(tmp_path):
    return LaneFollowing("duckiebot", "planar", "ground_plane", ROAD, 60.0, 0.01, 2.0, (("blur", 0.07),), tmp_path)


@pytest.fixture
def exact(monkeypatch):
    monkeypatch.setattr(filming, "tracked", lambda poses, random: poses)


@pytest.mark.parametrize("frames", [7, pytest.param(47, marks=pytest.mark.slow)])
def test_there_are_as_many_pictures_as_asked_for_each_at_an_instant_of_its_own(family, monkeypatch, frames):
    monkeypatch.setattr(filming, "SHORTEST_S", 0.5)
    drives = list(film(family, frames, 1))
    assert sum(len(drive.pictures) for drive in drives) == frames
    assert len({drive.episode.name for drive in drives}) == len(drives) == min(frames, 20)
    for episode, times, pictures in drives:
        assert len(times) == len(pictures)
        assert (np.diff(times) > 0).all()
        assert episode.times[0] < times[0]
        assert times[-1] <= episode.times[-1]


@pytest.mark.parametrize("name", ["small_loop", pytest.param("horseshoe", marks=pytest.mark.slow)])
def test_every_start_is_driven_from_in_both_lanes(family, exact, monkeypatch, name):
    monkeypatch.setattr(filming, "SHORTEST_S", 0.5)
    road = shipped_map(name)
    begins = np.array([drive.episode.poses[0] for drive in film(replace(family, map=road), 20, 1)])
    lanes = lane_pose(road, begins[:, :2], begins[:, 2])
    assert np.abs(begins[:10, :2] - np.array(road.starts)[:, :2]).max() < 0.05
    assert (lanes.counter_clockwise[:10] != lanes.counter_clockwise[10:]).all()
    np.testing.assert_allclose(lanes.deviation[10:], 0.0, atol=1e-9)
    turned = begins[10:, 2] - begins[:10, 2] - np.pi
    assert len(set(turned.round(9))) == 10, "drives from one start share their placement noise"


@pytest.mark.slow
def test_most_pictures_are_taken_in_the_lane_on_straights_and_in_bends(family, exact):
    drives = list(film(family, 60, 1))
    each = ([np.interp(one.times, one.episode.times, column) for column in one.episode.poses.T] for one in drives)
    poses = np.concatenate([np.transpose(columns) for columns in each])
    assert 0.2 < (np.floor(poses[:, :2] / (ROAD.size[0] / 3)) != 1).all(axis=1).mean() < 0.8
    assert (np.abs(lane_pose(ROAD, poses[:, :2], poses[:, 2]).deviation) < ROAD.lane_width / 2).mean() > 0.75


def test_more_pictures_make_no_drive_longer_and_are_wider_than_an_agents_with_all_else_the_same(family, monkeypatch):
    monkeypatch.setattr(filming, "_film_drive", lambda family, instance, lap, seed: lap)
    for frames in (120, 800, 801, 10_000):
        laps = list(film(family, frames, 1))
        assert sum(lap.frames for lap in laps) == frames
        assert max(lap.frames for lap in laps) <= 40
        assert len({(lap.start, lap.turned) for lap in laps}) == 20
    robot, wider = family.instance({}).robot, family.instance({}, columns=160).robot
    assert (wider.camera_figures().columns, wider.camera_figures().rows) == (160, 120)
    assert replace(wider, figures=robot.figures) == robot
    assert robot.camera_figures().columns == 64
    size = {"camera_columns", "camera_rows"}
    assert {name for name in robot.figures if robot.figures[name] != wider.figures[name]} == size
    assert with_columns(wider, 80) == wider


def test_a_picture_is_the_one_that_an_agent_is_shown_when_it_is_finished(family, monkeypatch):
    """Blur over 0.07 s and all: the same as rendering every tick of the drive and filtering it in one go."""
    driven = []
    monkeypatch.setattr(filming.driving, "drive", lambda *given: driven.append(drive(*given)) or driven[-1])
    (taken,) = film(family, 1, 3)
    instance = family.instance({}, columns=160)
    ticks = instance.camera.render(driven[0].poses)
    shape, signal = ticks.shape[1:], ticks.reshape(len(ticks), -1).astype(np.float32)
    memory = instance.image.begin(FilterContext(60, ticks[0].reshape(-1), instance.robot.figures))
    filtered = np.rint(instance.image.apply(signal, memory)[0])
    (picture,), tick = taken.pictures, round((float(taken.times[0]) + 0.07 / 2) * 60)
    np.testing.assert_array_equal(picture, filtered[tick].reshape(shape))
    assert (picture != ticks[tick]).mean() > 0.05


def test_the_renderer_takes_pictures_too(family, monkeypatch):
    monkeypatch.setattr(filming, "SHORTEST_S", 0.5)
    monkeypatch.setattr(filming, "COLUMNS", 64)
    rendered, plain = (next(film(replace(family, camera=name), 1, 3)) for name in ("renderer", "ground_plane"))
    assert rendered.pictures.shape == plain.pictures.shape == (1, 48, 64, 3)
    np.testing.assert_array_equal(rendered.episode.poses, plain.episode.poses)
    assert 0.0 < np.abs(rendered.pictures.astype(float) - plain.pictures).mean() < 8.0


def test_the_same_seed_gives_the_same_drives_and_a_drive_that_ends_early_is_told_with_its_start(family, monkeypatch):
    one, again, other = (next(film(family, 1, seed)) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one.pictures, again.pictures)
    np.testing.assert_array_equal(one.episode.poses, again.episode.poses)
    assert (one.episode.commands != other.episode.commands).any()
    monkeypatch.setattr(filming.driving, "off_map", lambda road, x, y: True)
    with pytest.raises(EpisodeError, match=r"^lane drive from start 0 ended after 0\.05 s with 0 of 1 pictures; "):
        list(film(family, 1, 1))


def test_a_robot_without_a_camera_or_an_expert_is_refused_before_anything_is_driven(family, tmp_path):
    with pytest.raises(SettingsError, match="has no camera"):
        film(replace(family, robot="irobot_create"), 1, 1)
    described = (shipped("robots") / "duckiebot" / "robot.toml").read_text(encoding="utf-8")
    kept = [line for line in described.splitlines() if not line.startswith(("expert_", "urdf"))]
    (tmp_path / "novice").mkdir()
    (tmp_path / "novice" / "robot.toml").write_text("\n".join(kept).replace('"duckiebot"', '"novice"'))
    with pytest.raises(SettingsError, match="'novice' has no expert"):
        film(replace(family, robot="novice"), 1, 1)


HIDDEN = (("dead_band", 0.08), ("steering_lag", 0.25), ("steering_offset", 0.05), ("delay", 0.12))


@pytest.mark.slow
def test_what_a_recorded_car_lacks_is_named_with_its_value(tmp_path):
    family = LaneFollowing("car", "planar", "ground_plane", ROAD, 60.0, 0.0, 0.0, HIDDEN, tmp_path)
    log = record(family, name="car", repeats=1, seconds=20.0, seed=1)
    assert log.command == "ackermann"
    found = diagnose(log, read_robot("car"), ("steering_offset", "delay"))
    assert (found.verdict, {one.effect for one in found.effects}) == ("explained", {"dead_band", "steering_lag"})
    for name, value in HIDDEN:
        assert found.theta[name].value == pytest.approx(value, abs=0.002), name
