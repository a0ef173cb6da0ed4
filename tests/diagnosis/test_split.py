"""Drives are kept aside to test on, and blocks never reach over them."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import ROBOT, TRUTH, planted_log, with_poses

from proxytune.diagnosis.measured import split as splitting
from proxytune.diagnosis.measured.split import BLOCK_S, BLOCKS, split
from proxytune.errors import LogError


def test_every_third_of_many_episodes_is_tested_and_not_fitted():
    log = planted_log(TRUTH, episodes=7, seconds=15.0)
    fitted, tested = split(log, ROBOT, None)
    assert fitted.duties.shape[0] == 5
    assert tested.duties.shape[0] == 2
    np.testing.assert_array_equal(tested.duties[0, ::3], log.episodes[2].commands)
    for row, episode in enumerate((0, 1, 3, 4, 6)):
        np.testing.assert_array_equal(fitted.duties[row, ::3], log.episodes[episode].commands)


@pytest.mark.parametrize("episodes", [1, 2, 5])
def test_few_episodes_are_split_by_time(episodes):
    fitted, tested = split(planted_log(TRUTH, episodes=episodes, seconds=60.0), ROBOT, None)
    assert fitted.seconds == pytest.approx(tested.seconds, abs=0.2 * episodes)
    for episode in range(episodes):
        assert fitted.last[fitted.episode == episode].max() <= tested.first[tested.episode == episode].min()
        assert not tested.linked[tested.episode == episode][0]


def test_another_log_may_be_tested_on():
    log, other = (planted_log(TRUTH, seed=seed, episodes=2, seconds=15.0) for seed in (1, 2))
    fitted, tested = split(log, ROBOT, other)
    assert (fitted.duties.shape[0], tested.duties.shape[0]) == (2, 2)
    np.testing.assert_array_equal(tested.duties[1, ::3], other.episodes[1].commands)


@pytest.mark.parametrize(("episodes", "seconds"), [(1, 30.0), (3, 10.0), (6, 6.0)])
def test_too_little_motion_is_refused_with_how_much_is_needed(episodes, seconds):
    with pytest.raises(LogError, match=r"^planted: only [0-9.]+ s of measured motion to .*at least 20 s"):
        split(planted_log(TRUTH, episodes=episodes, seconds=seconds), ROBOT, None)


@pytest.mark.parametrize(("episodes", "seconds"), [(1, 60.0), (6, 30.0), (12, 60.0)])
def test_there_are_enough_blocks_to_leave_out_and_none_is_tiny(episodes, seconds):
    for drives in split(planted_log(TRUTH, episodes=episodes, seconds=seconds), ROBOT, None):
        numbers = np.unique(drives.block)
        np.testing.assert_array_equal(numbers, np.arange(len(numbers)))
        assert len(numbers) >= min(BLOCKS, drives.seconds / BLOCK_S) * 0.6
        for block in numbers:
            own = drives.block == block
            assert len(np.unique(drives.episode[own])) == 1
            assert (drives.last[own].max() - drives.first[own].min()) / drives.tick_hz > 0.9 * BLOCK_S
            assert not drives.linked[own][0]


def test_half_of_the_measured_motion_not_of_the_time_is_fitted():
    def lost(poses):
        poses = poses.copy()
        poses[400:1400] = np.nan
        return poses

    fitted, tested = split(with_poses(planted_log(TRUTH, episodes=1, seconds=120.0), lost), ROBOT, None)
    assert fitted.seconds == pytest.approx(tested.seconds, abs=0.2)
    assert len(np.unique(fitted.block)) >= 6


def test_of_very_many_drives_no_more_are_tested_on_than_needed_spread_over_all(monkeypatch):
    log = planted_log(TRUTH, episodes=36, seconds=10.0)
    whole = split(log, ROBOT, None).tested
    monkeypatch.setattr(splitting, "MOST_TESTED_S", 60.0)
    some = split(log, ROBOT, None).tested
    assert (len(whole.duties), len(some.duties)) == (12, 7)
    kept = [int(np.flatnonzero((whole.headings == own).all(axis=1))[0]) for own in some.headings]
    assert kept == [0, 1, 3, 5, 6, 8, 10]
