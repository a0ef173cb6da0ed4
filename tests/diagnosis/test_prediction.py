"""What a model says of a log, window by window."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from foreign_robot import FOREIGN_TRUTH, drive, write_own_times
from learnt_truth import MANY, TURNING
from planted import ROBOT, TRUTH, planted_log

from proxytune.diagnosis.horizon.prediction import agreement, predict
from proxytune.diagnosis.measured.vehicle import robot_of
from proxytune.errors import LogError
from proxytune.logs import read_log

COLUMNS = ["episode", "start_time", "time", "x", "y", "heading"]


@pytest.fixture(scope="module")
def log():
    return planted_log(TRUTH, episodes=2, seconds=10.0, noise=None)


def test_windows_follow_one_another_and_cover_every_row(log):
    table = predict(log, ROBOT, TRUTH, 2.0)
    assert list(table.columns) == COLUMNS
    for name, own in table.groupby("episode"):
        assert name in ("00", "01")
        assert sorted(own.start_time.unique()) == pytest.approx([0.0, 2.0, 4.0, 6.0, 8.0])
        assert sorted(own.time.unique()) == pytest.approx(np.arange(200) / 20.0)
        assert (own.groupby("start_time").time.count() <= 41).all()


def test_a_model_agrees_with_its_own_noiseless_log(log):
    found = agreement(predict(log, ROBOT, TRUTH, 2.0), log, 2.0)
    assert found.place < 1e-9
    assert found.turn < 1e-9
    assert (found.poses, found.windows) == (2 * 199, 10)


def test_a_stub_at_a_drives_end_is_not_counted_as_a_window(log):
    table = predict(log, ROBOT, {**TRUTH, "trim": 0.1}, 1.9)
    found = agreement(table, log, 1.9)
    ends = table.groupby(["episode", "start_time"]).time.max().reset_index()
    assert (ends.time - ends.start_time).min() < 0.5
    assert found.windows == 2 * 5
    assert found.poses == found.windows * 38
    whole = table[table.start_time < 9.0]
    assert agreement(whole, log, 1.9) == found


@pytest.mark.parametrize("extra", [TURNING, MANY], ids=["turning", "many"])
def test_learnt_motion_is_predicted_with_its_past_before_each_window(log, extra):
    driven = planted_log({**TRUTH, **extra}, episodes=2, seconds=10.0, noise=None)
    assert agreement(predict(driven, ROBOT, TRUTH, 2.0), driven, 2.0).place > 0.005
    found = agreement(predict(driven, ROBOT, {**TRUTH, **extra}, 2.0), driven, 2.0)
    assert found.place < 1e-9
    assert found.turn < 1e-9


def test_another_model_does_not(log):
    found = agreement(predict(log, ROBOT, {**TRUTH, "trim": 0.1}, 2.0), log, 2.0)
    assert found.place > 0.005
    assert found.turn > 0.02


def test_each_window_starts_from_the_measured_pose(log):
    table = predict(log, ROBOT, {**TRUTH, "trim": 0.1}, 1.0)
    starts = table[table.time == table.start_time]
    measured = {(e.name, time): pose for e in log.episodes for time, pose in zip(e.times, e.poses, strict=True)}
    for row in starts.itertuples():
        np.testing.assert_allclose((row.x, row.y, row.heading), measured[row.episode, row.time], atol=1e-12)


def test_headings_go_on_over_a_whole_turn(log):
    table = predict(log, ROBOT, TRUTH, 5.0)
    for _, window in table.groupby(["episode", "start_time"]):
        assert np.abs(np.diff(window.heading)).max() < 0.5
    far = planted_log(TRUTH, episodes=1, seconds=10.0, noise=None)
    turned = replace(far, episodes=tuple(replace(e, poses=e.poses + (0.0, 0.0, 40.0)) for e in far.episodes))
    assert predict(turned, ROBOT, TRUTH, 5.0).heading.iloc[0] == pytest.approx(turned.episodes[0].poses[0, 2])


def test_a_slope_is_predicted_exactly_whatever_the_heading():
    theta = {**TRUTH, "floor_slope.x": 0.04, "floor_slope.y": -0.02}
    log = planted_log(theta, episodes=3, seconds=10.0, noise=None)
    assert agreement(predict(log, ROBOT, theta, 2.0), log, 2.0).place < 1e-6
    assert agreement(predict(log, ROBOT, TRUTH, 2.0), log, 2.0).place > 0.01


def test_a_marker_is_predicted_exactly():
    theta = {**TRUTH, "marker_offset.forward": 0.05, "heading_offset": 3.0}
    plain = planted_log(TRUTH, episodes=2, seconds=10.0, noise=None)

    def seen(poses):
        out = poses.copy()
        out[:, :2] += 0.05 * np.stack((np.cos(poses[:, 2]), np.sin(poses[:, 2])), axis=1)
        out[:, 2] += np.radians(3.0)
        return out

    log = replace(plain, episodes=tuple(replace(e, poses=seen(e.poses)) for e in plain.episodes))
    assert agreement(predict(log, ROBOT, theta, 2.0), log, 2.0).place < 1e-6


def test_a_window_begins_at_the_first_measured_pose_after_the_one_before(log):
    first = log.episodes[0]
    poses = first.poses.copy()
    poses[:7] = np.nan
    poses[44:60] = np.nan
    broken = replace(log, episodes=(replace(first, poses=poses),))
    starts = predict(broken, ROBOT, TRUTH, 2.0).start_time.unique()
    assert list(starts) == pytest.approx([0.35, 3.0, 5.0, 7.0, 9.0])


def test_poses_that_were_not_measured_are_not_compared(log):
    first = log.episodes[0]
    poses = first.poses.copy()
    poses[50:60] = np.nan
    broken = replace(log, episodes=(replace(first, poses=poses),))
    assert agreement(predict(broken, ROBOT, TRUTH, 2.0), broken, 2.0).poses < 190


@pytest.mark.parametrize("horizon", [0.0, 0.04, -1.0, float("nan")])
def test_a_horizon_shorter_than_a_sample_is_refused(log, horizon):
    with pytest.raises(LogError, match="shorter than a sample"):
        predict(log, ROBOT, TRUTH, horizon)


def test_a_log_without_poses_is_refused(log):
    blind = replace(log, episodes=tuple(replace(e, poses=np.full_like(e.poses, np.nan)) for e in log.episodes))
    with pytest.raises(LogError, match="no two measured poses"):
        predict(blind, ROBOT, TRUTH, 2.0)


@pytest.mark.parametrize("known", [1, 2])
def test_an_episode_with_a_pose_or_two_is_predicted_from_it(log, known):
    first = log.episodes[0]
    poses = np.full_like(first.poses, np.nan)
    poses[:known] = first.poses[:known]
    broken = replace(log, episodes=(replace(first, poses=poses), log.episodes[1]))
    table = predict(broken, ROBOT, TRUTH, 2.0)
    assert len(table[table.episode == "00"]) == 41


def test_random_effects_are_predicted_by_their_mean(log):
    late = predict(log, ROBOT, {"trim": 0.03, "delay": 0.07, "delay_jitter": 0.1}, 2.0)
    assert agreement(late, log, 2.0).place < 1e-9


@pytest.fixture(scope="module")
def own_times(tmp_path_factory):
    home = tmp_path_factory.mktemp("own_times")
    return read_log(write_own_times(home, [drive(1, seconds=20.0)]))


def test_poses_at_times_of_their_own_are_predicted_at_those_times(own_times):
    (episode,) = own_times.episodes
    robot = robot_of(own_times)
    table = predict(own_times, robot, FOREIGN_TRUTH, 2.0)
    assert set(table.time) == set(episode.measured.times[episode.measured.times >= table.time.min()])
    found = agreement(table, own_times, 2.0)
    assert found.place < 0.0035, "noise of 1 mm at the start and 3 mrad over up to 0.5 m"
    assert found.poses > 1500
