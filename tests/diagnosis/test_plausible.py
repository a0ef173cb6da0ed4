"""Logs that cannot bear the question are refused with what is wrong; honest logs are not."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import NOISE, driven_log, drives_of, planted_log, with_poses

from proxytune.diagnosis.plausible import check_clocks, check_motion
from proxytune.errors import LogError

NOMINAL = {"trim": 0.0, "delay": 0.15}


@pytest.fixture(scope="module")
def log():
    return planted_log({"trim": 0.03, "delay": 0.12}, episodes=4, seconds=40.0)


def later(log, seconds):
    """The same log, its poses shown so much later."""
    rows = round(seconds * 20.0)

    def shift(poses):
        moved = np.full_like(poses, np.nan)
        if rows >= 0:
            moved[rows:] = poses[: len(poses) - rows]
        else:
            moved[:rows] = poses[-rows:]
        return moved

    return with_poses(log, shift)


def test_an_honest_log_is_let_through(log):
    check_motion("yard", drives_of(log))
    check_clocks("yard", drives_of(log), NOMINAL)


def test_a_robot_that_stands_still_is_refused(log):
    random = np.random.default_rng(1)
    still = with_poses(log, lambda poses: np.ones(3) + random.normal(0.0, 1e-4, poses.shape))
    with pytest.raises(LogError, match=r"^yard: the robot got 0\.\d+ m far .* stands still"):
        check_motion("yard", drives_of(still))


def test_a_robot_that_stands_still_under_a_noisy_tracker_is_refused(log):
    random = np.random.default_rng(1)
    still = with_poses(log, lambda poses: random.normal(0.0, (0.002, 0.002, 0.005), poses.shape))
    with pytest.raises(LogError, match="stands still"):
        check_motion("yard", drives_of(still))


def test_a_robot_that_is_never_told_to_move_is_refused(log):
    quiet = replace(log, episodes=tuple(replace(e, commands=0.0 * e.commands) for e in log.episodes))
    with pytest.raises(LogError, match="^yard: every command is zero"):
        check_motion("yard", drives_of(quiet))


@pytest.mark.parametrize(
    ("late", "said"),
    [
        (3.0, "3.00 s earlier"),
        (-3.0, "3.00 s later"),
        (1.7, "1.70 s earlier"),
        (-0.5, "0.50 s later"),
        (8.0, "8.00 s earlier"),
    ],
)
def test_clocks_apart_are_told_with_how_far_and_which_way(log, late, said):
    with pytest.raises(LogError) as caught:
        check_clocks("yard", drives_of(later(log, late)), {"trim": 0.03, "delay": 0.12})
    assert said in str(caught.value)
    assert "two clocks" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("theta", [{"delay": 0.3}, {"delay": 0.3, "motor_lag.time_constant": 0.8}, {"delay": 0.0}])
def test_a_slow_robot_is_no_clock_problem(theta):
    slow = planted_log({"trim": 0.03, **theta}, episodes=4, seconds=40.0)
    check_clocks("yard", drives_of(slow), NOMINAL)


@pytest.mark.parametrize("delay", [0.3, 0.5])
def test_a_long_delay_that_no_model_has_yet_is_no_clock_problem(delay):
    slow = planted_log({"trim": 0.03, "delay": delay, "motor_lag.time_constant": 0.05}, episodes=4, seconds=40.0)
    check_clocks("yard", drives_of(slow), {"trim": 0.03, "delay": 0.0, "motor_lag.time_constant": 0.05})


@pytest.mark.parametrize("seed", range(2, 8))
def test_clean_logs_of_many_drives_are_let_through(seed):
    check_clocks("yard", drives_of(planted_log({}, seed=seed, episodes=6, seconds=30.0, noise=NOISE)), NOMINAL)


def test_a_drive_that_repeats_itself_is_no_clock_problem():
    times = np.arange(1200) / 20.0
    turn = 0.2 * np.sin(2.0 * np.pi * times / 6.0)
    duties = np.tile(np.stack((0.5 - turn, 0.5 + turn), axis=1), (4, 1, 1))
    log = driven_log({}, duties, np.zeros((4, 3)))
    check_clocks("yard", drives_of(log), NOMINAL)
