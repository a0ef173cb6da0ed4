"""What slows a robot down again and again is found by its period, and is not seen where nothing does."""

from dataclasses import replace

import numpy as np
import pytest
from planted import CALM, TRUTH, drives_of, planted_drives, planted_log

from proxytune.diagnosis.motion.drives import Drives
from proxytune.diagnosis.motion.moments import find_period


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=6, seconds=40.0, noise=CALM)


def behind(drives: Drives, period, stands) -> Drives:
    """As if the robot had stood so long in each period, in each drive at another time."""
    middle = (drives.first + drives.last) / 2.0 / drives.tick_hz + 1.3 * drives.episode
    moved = drives.measured * np.where(middle % period < stands, 0.0, 1.0)[:, None]
    changed = replace(drives)
    changed.__dict__["measured"] = moved
    return changed


def test_nothing_is_found_where_nothing_comes_again(drives):
    assert find_period(drives, TRUTH) is None


def test_drives_without_two_poses_do_not_count():
    log = planted_log(TRUTH, episodes=6, seconds=40.0, noise=CALM)
    gone = [
        replace(one, poses=np.where(np.arange(len(one.poses))[:, None] > 0, np.nan, one.poses)) for one in log.episodes
    ]
    assert find_period(drives_of(replace(log, episodes=(*gone[:4], *log.episodes[4:]))), TRUTH) is None


@pytest.mark.parametrize(("period", "stands"), [(4.0, 0.3), (2.5, 0.2)])
def test_its_period_and_how_long_it_stands_are_found(drives, period, stands):
    found = find_period(behind(drives, period, stands), TRUTH)
    assert found.period_s == pytest.approx(period, rel=0.02)
    assert found.lost_s == pytest.approx(stands, abs=0.1)
