"""Where the robot was: smoothed where it moves, exact where it stands, left out where nobody knows."""

import numpy as np
import pytest

from proxytune.diagnosis.camera.measured.tracks import LONGEST_GAP_S, track_frames
from proxytune.errors import LogError
from proxytune.logs import Frames, Log, LogEpisode

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


def test_a_drive_round_a_circle_has_its_poses_and_rates():
    times = np.linspace(1.0, 8.0, 30)
    tracks, numbers = track_frames(log_of(episode()), frames_at(times))
    poses, rates = tracks.at(0.0)
    np.testing.assert_array_equal(numbers, np.arange(30))
    np.testing.assert_allclose(poses, circle(times), atol=5e-4)
    heading = circle(times)[:, 2]
    course = np.column_stack((SPEED * np.cos(heading), SPEED * np.sin(heading), np.full(30, SPEED / RADIUS)))
    np.testing.assert_allclose(rates, course, atol=2e-3)
    assert tracks.moving


def test_smoothing_leaves_the_share_of_the_scatter_that_it_says():
    times = np.arange(1.0, 9.0, 0.5)
    errors = [
        track_frames(log_of(episode(noise=0.01, seed=seed)), frames_at(times))[0].at(0.0)[0] - circle(times)
        for seed in range(40)
    ]
    share = track_frames(log_of(episode()), frames_at(times))[0].share
    assert share < 0.6
    assert np.std(errors) == pytest.approx(0.01 * share, rel=0.1)


def test_a_latency_looks_up_the_pose_of_so_long_before():
    times = np.linspace(2.0, 8.0, 20)
    tracks, _ = track_frames(log_of(episode()), frames_at(times))
    np.testing.assert_allclose(tracks.at(0.13)[0], circle(times - 0.13), atol=6e-4)
    late, now = tracks.at(0.13)[0], tracks.at(0.0)[0]
    np.testing.assert_allclose(np.linalg.norm((now - late)[:, :2], axis=1), SPEED * 0.13, rtol=0.02)


def test_frames_standing_still_keep_their_poses_to_the_last_digit():
    times = np.arange(25.0)
    poses = np.random.default_rng(3).normal(size=(25, 3))
    still = LogEpisode("stills", times, np.zeros((25, 0)), poses, None)
    tracks, numbers = track_frames(log_of(still, rate=0.0), frames_at(times[::2]))
    np.testing.assert_array_equal(tracks.at(0.0)[0], poses[::2])
    assert (tracks.share, tracks.moving, len(numbers)) == (1.0, False, 13)


def test_frames_standing_still_between_two_poses_are_left_out():
    """However close they are in time: the robot was moved in between."""
    times = 0.1 * np.arange(25.0)
    still = LogEpisode("stills", times, np.zeros((25, 0)), circle(times), None)
    _, numbers = track_frames(log_of(still, rate=0.0), frames_at([0.3, 0.35, 0.4]))
    np.testing.assert_array_equal(numbers, [0, 2])


def test_frames_within_a_long_gap_between_poses_are_left_out():
    drive = episode()
    gap = (drive.times > 4.0) & (drive.times < 4.0 + 2.0 * LONGEST_GAP_S)
    drive.poses[gap] = np.nan
    _, numbers = track_frames(log_of(drive), frames_at([3.9, 4.2, 4.3, 4.6, -0.2, 12.0]))
    np.testing.assert_array_equal(numbers, [0, 3])


def test_a_missing_pose_is_bridged():
    drive = episode()
    drive.poses[80] = np.nan
    tracks, numbers = track_frames(log_of(drive), frames_at([4.0]))
    assert len(numbers) == 1
    np.testing.assert_allclose(tracks.at(0.0)[0], circle([4.0]), atol=1e-3)


def test_each_frame_is_looked_up_in_its_own_drive():
    first, second = episode(), episode(begin=100.0)
    tracks, _ = track_frames(log_of(first, second), frames_at([5.0, 105.0, 5.5], [0, 1, 0]))
    np.testing.assert_allclose(tracks.at(0.0)[0], circle([5.0, 105.0, 5.5]), atol=1e-3)


def test_a_drive_without_a_pose_is_passed_over():
    empty = episode()
    empty.poses[:] = np.nan
    tracks, numbers = track_frames(log_of(empty, episode()), frames_at([5.0, 5.0], [0, 1]))
    np.testing.assert_array_equal(numbers, [1])
    np.testing.assert_allclose(tracks.at(0.0)[0], circle([5.0]), atol=1e-3)


def test_frames_of_another_clock_are_refused_in_one_line():
    with pytest.raises(LogError, match="no frame has a pose near its time; check that times are on the poses' clock"):
        track_frames(log_of(episode()), frames_at([1000.0, 1001.0]))


def test_some_frames_of_a_track_are_those_frames():
    tracks, _ = track_frames(log_of(episode()), frames_at([2.0, 3.0, 4.0]))
    np.testing.assert_array_equal(tracks.only(np.array([2, 0])).at(0.0)[0], tracks.at(0.0)[0][[2, 0]])
