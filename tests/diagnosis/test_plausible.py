"""Logs that cannot bear the question are refused with what is wrong; honest logs are not."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import drives_of, planted_log, with_poses

from proxytune.diagnosis.model.plausible import check_motion, check_units
from proxytune.errors import LogError

NOMINAL = {"trim": 0.0, "delay": 0.15}


@pytest.fixture(scope="module")
def log():
    return planted_log({"trim": 0.03, "delay": 0.12}, episodes=4, seconds=40.0)


def test_an_honest_log_is_let_through(log):
    check_motion("yard", drives_of(log))
    check_units("yard", drives_of(log), NOMINAL)


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
