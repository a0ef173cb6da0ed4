"""A pose that repeats while the robot moves is an older one shown again; while it stands it is its pose."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hidden_cases import CLEAN, make_log

from proxytune.logs import Log, LogEpisode, log_cautions, read_log, rows_of_poses

HUSKY = Path(__file__).resolve().parents[2] / "../shared/data/logs/drive_husky"
ROWS = 60
TIMES = np.arange(ROWS) / 20.0


def log(*places, rate_hz=20.0):
    """Drives along x, in metres, one for each of these places by row."""
    rows = [np.asarray(x, dtype=float) for x in places]
    poses = [np.stack((x, 0.0 * x, 0.0 * x), axis=1) for x in rows]
    drives = [
        LogEpisode(f"{number}", np.arange(len(own)) / rate_hz, np.full((len(own), 2), 0.5), own, None)
        for number, own in enumerate(poses)
    ]
    return Log("yard", "duckiebot", "duty", rate_hz, {}, tuple(drives))


def rows_in(drives):
    return [rows.tolist() for rows in rows_of_poses(drives, drives.episodes)]


def held(x, first, rows):
    """The same places, but one is shown for so many rows."""
    shown = np.array(x)
    shown[first : first + rows] = shown[first]
    return shown


def stood(first, rows):
    """Places of a robot at 0.4 m/s that stops within a row, stands for some, and is as fast again within the next."""
    return 0.02 * np.cumsum([0.0 if first < row < first + rows else 1.0 for row in range(ROWS)])


STRAIGHT = 0.4 * TIMES
RAMPS = {"steady": STRAIGHT, "faster and faster": 0.2 * TIMES**2 + 0.1 * TIMES, "slower": 1.4 * TIMES - 0.2 * TIMES**2}


@pytest.mark.parametrize("ramp", RAMPS)
@pytest.mark.parametrize("rows", [3, 6, 9, 15])
def test_a_pose_shown_again_while_the_robot_moves_is_used_once(ramp, rows):
    (found,) = rows_in(log(held(RAMPS[ramp], 20, rows)))
    assert found == [*range(21), *range(20 + rows, ROWS)]


@pytest.mark.parametrize("rows", [6, 9, 15])
def test_a_robot_that_stands_has_its_pose_every_fifth_of_a_second(rows):
    (found,) = rows_in(log(stood(20, rows)))
    assert found == [*range(21), *range(24, 20 + rows, 4), *range(20 + rows, ROWS)]


def test_a_single_repeat_in_slow_rows_the_last_pose_and_rounding_are_no_stand():
    assert rows_in(log(held(STRAIGHT, 20, 2), rate_hz=5.0)) == [[*range(21), *range(22, ROWS)]]
    assert rows_in(log(stood(20, 2), rate_hz=5.0)) == [[*range(ROWS)]]
    assert rows_in(log(held(STRAIGHT[::2].repeat(2), 50, 10))) == [[*range(0, 51, 2)]]
    # Of a log whose poses are its own it is one: it may have stopped.
    assert rows_in(log(held(STRAIGHT, 50, 10))) == [[*range(51), 54, 58]]
    (found,) = rows_in(log(np.round(1e-4 * np.random.default_rng(1).standard_normal(ROWS).cumsum(), 4).repeat(6)))
    assert np.diff(found).max() <= 4


def test_poses_of_half_the_rate_or_of_a_lidar_that_repeats_are_told_in_one_line():
    made = make_log(CLEAN[0], episodes=3, seconds=40.0)
    twice = [replace(one, poses=one.poses[::2].repeat(2, axis=0)[: len(one.poses)]) for one in made.episodes]
    assert log_cautions(made, {}) == ()
    (line,) = log_cautions(replace(made, episodes=tuple(twice)), {})
    assert line.endswith("(about 10 a second are measured): each is used once, where it first comes")
    assert 30 <= int(line.split()[0]) <= 50
    if not HUSKY.is_dir():
        pytest.skip("the measured log drive_husky is not here: it is not part of the project")
    husky = read_log(HUSKY)
    (line,) = [line for line in log_cautions(husky, {}) if "repeat" in line]
    assert "(about 9.8 a second are measured)" in line
    assert 2 < sum(map(len, rows_of_poses(husky, husky.episodes))) / 603 / 2.0 < 11
