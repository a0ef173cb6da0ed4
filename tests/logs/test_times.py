"""Poses keep times of their own: none is lost, none is forced, and the grid beside them is theirs moved by a little."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from log_folders import write_files

from proxytune.errors import LogError
from proxytune.logs import Measured, read_log
from proxytune.logs.times import STEPS_HZ, moved

TOML = 'format = 1\nname = "yard"\nrobot = "tractor"\ncommand = "twist"\n'
COMMANDS = "episode,time,v,omega\na,3.5,0.5,0.0\n"


@pytest.fixture
def folder(tmp_path):
    def write(samples, description=TOML):
        """With commands at times of their own, unless the samples have some."""
        commands = {} if ",v,omega" in samples else {"commands.csv": COMMANDS}
        return write_files(tmp_path, {"log.toml": description, "samples.csv": samples, **commands})

    return write


def circle(times, speed=0.5, yaw=0.8):
    """Poses on a circle that is driven steadily."""
    heading = yaw * times
    return np.stack((speed / yaw * np.sin(heading), speed / yaw * (1.0 - np.cos(heading)), heading), axis=1)


def rows(times, poses):
    lines = [f"a,{time!r},{x!r},{y!r},{h!r}\n" for time, (x, y, h) in zip(times.tolist(), poses.tolist(), strict=True)]
    return "episode,time,x,y,heading\n" + "".join(lines)


def jittered(seed=1, count=200, usual=0.05, by=0.01):
    return 3.0 + np.arange(count) * usual + np.random.default_rng(seed).uniform(-by, by, count)


def test_poses_keep_their_times_and_rate_and_gaps_stay_gaps(folder):
    times = jittered()
    (episode,) = read_log(folder(rows(times, circle(times)))).episodes
    np.testing.assert_array_equal(episode.measured.times, times)
    np.testing.assert_array_equal(episode.measured.poses, circle(times))

    times = jittered(by=0.002)
    log = read_log(folder(rows(times, circle(times))))
    assert log.poses_hz == pytest.approx(20.0, rel=0.02)
    assert log.rate_hz == pytest.approx(60.0, rel=0.02)

    times = np.concatenate((jittered(count=50), jittered(count=50) + 4.0))
    (episode,) = read_log(folder(rows(times, circle(times)))).episodes
    inside = (episode.times > times[49] + 0.05) & (episode.times < times[50] - 0.05)
    assert inside.sum() > 60
    assert np.isnan(episode.poses[inside]).all()


def test_the_grid_has_each_pose_where_the_robot_was_at_that_step(folder):
    times = jittered()
    log = read_log(folder(rows(times, circle(times))))
    (episode,) = log.episodes
    assert 0.95 * STEPS_HZ <= log.rate_hz < 2.0 * STEPS_HZ
    known = np.flatnonzero(np.isfinite(episode.poses[:, 0]))
    np.testing.assert_array_equal(known, episode.measured.rows)
    np.testing.assert_allclose(episode.poses[known], circle(episode.times[known]), atol=2e-4)
    unmoved = np.abs(episode.measured.poses - circle(episode.times[known])).max()
    assert unmoved > 2e-3, "the poses as they are would be off by far more"


def test_of_poses_near_one_step_those_are_kept_that_find_a_free_one(folder):
    times = 3.47 + np.array([0.0, 0.01, 0.02, 0.029, 0.031, 0.04, 0.05])
    (episode,) = read_log(folder(rows(times, circle(times)))).episodes
    np.testing.assert_array_equal(episode.measured.times, times)
    assert (np.diff(episode.measured.rows) > 0).all()
    known = episode.measured.rows
    np.testing.assert_allclose(episode.poses[known], circle(episode.times[known]), atol=1e-4)
    times = 3.0 + np.sort(np.append(np.arange(100) * 0.02, 1.0 + np.arange(1, 9) * 1e-4))
    (episode,) = read_log(folder(rows(times, circle(times)))).episodes
    assert len(times) - 16 <= len(episode.measured.times) < len(times)


def test_commands_are_issued_and_wheel_speeds_held_at_the_times_of_their_rows(folder):
    text = "episode,time,v,omega,x,y,heading\na,0.0,0.5,0,0,0,0\na,0.013,0.6,0,0,0,0\na,0.031,0.7,0,0,0,0\n"
    (episode,) = read_log(folder(text)).episodes
    np.testing.assert_array_equal(episode.issued, [0.0, 0.013, 0.031])
    np.testing.assert_array_equal(episode.commands[:, 0], [0.5, 0.6, 0.7])
    lines = "a,3.45,0,0,0,1,2\na,3.5,0,0,0,,\na,3.55,0,0,0,3,4\n"
    (episode,) = read_log(folder("episode,time,x,y,heading,wheel_left,wheel_right\n" + lines)).episodes
    np.testing.assert_array_equal(episode.wheels[[0, 3, 5, 6]], [[1, 2], [1, 2], [1, 2], [3, 4]])


def test_a_pose_shown_again_stays_a_repeat():
    times = np.array([0.0, 0.02, 0.05, 0.07, 0.1])
    out = moved(Measured(times, circle(np.array([0.0, 0.0, 0.05, 0.05, 0.1])), np.arange(5)), times + 0.004)
    np.testing.assert_array_equal(out[0], out[1])
    np.testing.assert_array_equal(out[2], out[3])
    assert not np.array_equal(out[1], out[2])


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.floats(0.0, 0.02), st.floats(0.02, 0.2))
def test_every_pose_lies_within_a_step_of_its_own_time(seed, by, usual):
    times = jittered(seed, 60, usual, min(by, 0.4 * usual))
    files = {"log.toml": TOML, "samples.csv": rows(times, circle(times)), "commands.csv": COMMANDS}
    with tempfile.TemporaryDirectory() as home:
        log = read_log(write_files(Path(home), files))
    (episode,) = log.episodes
    assert np.abs(episode.times[episode.measured.rows] - episode.measured.times).max() <= 1.0 / log.rate_hz + 1e-9
    assert (np.diff(episode.measured.rows) > 0).all()


def test_minutes_taken_for_seconds_are_refused_with_line_and_remedy(folder):
    times = 3.0 + np.concatenate((np.arange(20) * 0.05, 60.0 + np.arange(20) * 0.05))
    with pytest.raises(LogError, match=r"line 22, column 'time': the rows cover 61 s with 40 rows.*write seconds"):
        read_log(folder(rows(times, circle(times))))


@pytest.mark.parametrize(("usual", "said"), [(1e-6, "1e-06 s apart"), (50.0, "50 s apart")])
def test_times_that_cannot_be_seconds_are_refused_and_poses_at_1300_hz_are_read(folder, usual, said):
    times = 3.5 + (np.arange(40) - 10) * usual
    with pytest.raises(LogError, match=f"column 'time': poses are usually {said}; write seconds"):
        read_log(folder(rows(times, circle(times))))
    times = 3.5 + (np.arange(40) - 10) / 1300.0
    assert read_log(folder(rows(times, circle(times)))).rate_hz == pytest.approx(1300.0, rel=0.01)


def test_a_single_pose_a_drive_is_refused(folder):
    text = "episode,time,v,omega,x,y,heading\na,0.0,0.5,0,0,0,0\na,0.013,0.6,0,,,\n"
    with pytest.raises(LogError, match="no drive has two measured poses"):
        read_log(folder(text))


def test_a_declared_clock_offset_moves_the_commands_to_the_poses_clock(folder):
    times = jittered()
    log = read_log(folder(rows(times, circle(times)), TOML + "clock_offset_s = -0.25\n"))
    assert (log.clock_offset_s, log.fit_clock_offset) == (-0.25, False)
    np.testing.assert_allclose(log.episodes[0].issued, [3.25])
    np.testing.assert_array_equal(log.episodes[0].measured.times, times)


def test_commands_on_a_grid_get_times_of_their_own_by_a_clock_offset(folder):
    text = "episode,time,v,omega,x,y,heading\na,0.0,0.5,0,0,0,0\na,0.1,0.6,0,0,0,0\n"
    (episode,) = read_log(folder(text, TOML + "rate_hz = 10\nclock_offset_s = 0.02\n")).episodes
    np.testing.assert_allclose(episode.issued, [0.02, 0.12])
