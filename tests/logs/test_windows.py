"""Windows cut from one drive are that drive again, and one line says so; what only looks alike is not joined."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hidden_cases import CLEAN, make_log
from log_folders import write_files

from proxytune.diagnosis import robot_of
from proxytune.diagnosis.motion.diagnose import diagnose
from proxytune.errors import LogError
from proxytune.logs import LogEpisode, join_windows, log_cautions, read_log

WHOLE = make_log(CLEAN[0], episodes=2, seconds=20.0)
ROWS = 40


def cut(episode, change=lambda number, window: window):
    """Windows of 40 rows, each changed in the same way."""
    starts = range(0, len(episode.times), ROWS)
    parts = [(episode.times[s : s + ROWS], episode.commands[s : s + ROWS], episode.poses[s : s + ROWS]) for s in starts]
    return [change(n, LogEpisode(f"{episode.name} {n}", *part, None)) for n, part in enumerate(parts)]


def windows(change=lambda number, window: window):
    return replace(WHOLE, episodes=tuple(window for episode in WHOLE.episodes for window in cut(episode, change)))


def begun_anew(number, window):
    """Stamps that count from each window's beginning."""
    return replace(window, times=window.times - window.times[0])


def in_own_frame(number, window):
    """Places from where the robot was at each window's beginning."""
    return replace(window, poses=window.poses - window.poses[0])


def apart(number, window):
    """Half a second was left out between windows."""
    return replace(window, times=window.times + 0.5 * number)


def turned(number, window):
    """Headings that were unwrapped in each window by itself."""
    return replace(window, poses=window.poses + (0.0, 0.0, 2.0 * np.pi * number))


def assert_same(joined):
    assert len(joined.episodes) == len(WHOLE.episodes)
    for one, other in zip(joined.episodes, WHOLE.episodes, strict=True):
        np.testing.assert_array_equal(one.commands, other.commands)
        np.testing.assert_allclose(one.times, other.times, atol=1e-9)
        np.testing.assert_allclose(one.poses, other.poses, atol=1e-9)


def test_windows_of_a_drive_are_the_drive_measured_wheels_too_and_that_they_are_joined_is_said():
    joined = join_windows(windows())
    assert_same(joined)
    assert joined.episodes[0].name == f"{WHOLE.episodes[0].name} 0 to {WHOLE.episodes[0].name} 9"
    assert_same(join_windows(windows(turned)))
    assert join_windows(WHOLE) is WHOLE
    (line,) = log_cautions(windows(), {})
    assert line.startswith("18 of its 20 drives go on a sample after the one before, where that ended")
    assert "they are windows" in line
    assert "of 2 drives" in line

    def turning(number, window):
        return replace(window, wheels=np.full((len(window.times), 2), float(number)))

    (one, _) = join_windows(windows(turning)).episodes
    np.testing.assert_array_equal(one.wheels[:, 0], np.arange(10).repeat(ROWS)[: len(one.wheels)])


@pytest.mark.parametrize("change", [begun_anew, in_own_frame, apart])
def test_what_does_not_go_on_stays_as_it_is(change):
    log = windows(change)
    assert join_windows(log) is log
    assert not [line for line in log_cautions(log, {}) if "windows of" in line]


def written(folder, names):
    """A log with stamps that jitter and commands of their own, its rows in episodes of these names (400,)."""
    times = np.arange(400) / 20.0 + np.random.default_rng(4).uniform(-0.005, 0.005, 400)
    poses = np.stack((0.3 * times, 0.1 * np.sin(times), 0.1 * np.cos(times)), axis=1)
    shown = {"episode": names, "time": times, **dict(zip(("x", "y", "heading"), poses.T, strict=True))}
    sent = {"episode": names, "time": times - 0.013, "v": 0.3, "omega": 0.1 * np.sin(times - 0.013)}
    tables = {"samples.csv": shown, "commands.csv": sent}
    files = {name: pd.DataFrame(columns).to_csv(index=False) for name, columns in tables.items()}
    return read_log(write_files(folder, {**files, "log.toml": 'format = 1\nrobot = "duckiebot"\ncommand = "twist"\n'}))


def test_windows_whose_poses_have_times_of_their_own_are_joined(tmp_path):
    whole = written(tmp_path / "whole", ["a"] * 400)
    joined = join_windows(written(tmp_path / "cut", [f"w{row // ROWS}" for row in range(400)]))
    (one,), (other,) = joined.episodes, whole.episodes
    np.testing.assert_array_equal(one.measured.times, other.measured.times)
    np.testing.assert_allclose(one.measured.poses, other.measured.poses, atol=1e-9)
    # The rate is counted within drives, so that the steps of both grids differ a little.
    assert np.abs(one.times[one.measured.rows] - one.measured.times).max() < 1.0 / joined.rate_hz
    np.testing.assert_array_equal(one.issued, other.issued)
    np.testing.assert_array_equal(one.commands, other.commands)
    assert np.isfinite(one.poses[one.measured.rows]).all()


def test_a_diagnosis_is_of_the_drives_that_windows_make(monkeypatch):
    seen = []

    def stop(log, robot, like, model):
        seen.append(log)
        raise LogError("seen enough")

    monkeypatch.setattr("proxytune.diagnosis.motion.clocks.read_clocks", stop)
    with pytest.raises(LogError, match="seen enough"):
        diagnose(windows(), robot_of(WHOLE), ("trim", "delay"))
    assert_same(seen[0])
