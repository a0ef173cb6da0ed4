"""Windows cover unbroken poses and are of the stated horizon; errors come with honest intervals."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import TRUTH, drives_of, planted_drives, planted_log

from proxytune.diagnosis.horizon import windows as windows_module
from proxytune.diagnosis.horizon.windows import SHORTEST, cut, pose_errors, ratio, rmse, select_windows


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=6, seconds=30.0)


def with_gaps(rows):
    log = planted_log(TRUTH, episodes=2, seconds=20.0)
    first = log.episodes[0]
    poses = first.poses.copy()
    poses[rows] = np.nan
    return drives_of(replace(log, episodes=(replace(first, poses=poses), *log.episodes[1:])))


@pytest.mark.parametrize("horizon_s", [0.5, 1.0, 2.0, 5.0])
def test_windows_cover_every_increment_once_but_for_short_ends(drives, horizon_s):
    windows = cut(drives, horizon_s)
    assert len(np.unique(windows.increment)) == len(windows.increment)
    left = np.setdiff1d(np.arange(len(drives.episode)), windows.increment)
    runs = int((~drives.linked).sum())
    assert len(left) <= runs * SHORTEST * horizon_s * 20.0
    assert len(windows.begin) >= drives.seconds / horizon_s * 0.6


@pytest.mark.parametrize("horizon_s", [0.7, 1.9, 4.0])
def test_a_horizon_that_does_not_divide_a_drive_leaves_no_stub(drives, horizon_s):
    windows = cut(drives, horizon_s)
    for window, begin in enumerate(windows.begin):
        own = windows.increment[windows.window == window]
        assert (drives.last[own[-1]] - drives.first[begin]) / drives.tick_hz >= 0.9 * horizon_s - 1e-9


def test_some_windows_are_chosen_with_all_their_poses(drives):
    windows = cut(drives, 2.0)
    kept = np.arange(len(windows.begin)) % 3 == 1
    some = select_windows(windows, kept)
    assert np.array_equal(some.begin, windows.begin[kept])
    assert np.array_equal(np.unique(some.window), np.arange(kept.sum()))
    for number, window in enumerate(np.flatnonzero(kept)):
        own = windows.increment[windows.window == window]
        assert np.array_equal(some.increment[some.window == number], own)


@pytest.mark.parametrize("horizon_s", [1.0, 2.0])
@pytest.mark.parametrize("rows", [slice(50, 60), slice(100, 150)])
def test_no_window_crosses_a_gap_a_block_or_an_episode(rows, horizon_s):
    drives = with_gaps(rows)
    windows = cut(drives, horizon_s)
    for window, begin in enumerate(windows.begin):
        own = windows.increment[windows.window == window]
        assert own[0] == begin
        assert np.array_equal(own, np.arange(begin, begin + len(own)))
        assert drives.linked[own[1:]].all()
        assert len(np.unique(drives.block[own])) == len(np.unique(drives.episode[own])) == 1
        lasts = (drives.last[own[-1]] - drives.first[begin]) / drives.tick_hz
        assert SHORTEST * horizon_s <= lasts <= horizon_s + 1e-9


def test_runs_shorter_than_most_of_the_horizon_have_no_window():
    few = planted_drives(TRUTH, episodes=2, seconds=4.0)
    assert len(cut(few, 10.0).begin) == 0


def test_a_model_does_not_stray_from_its_own_noiseless_drives():
    quiet = planted_drives(TRUTH, episodes=2, seconds=20.0, noise=None)
    assert pose_errors(quiet, TRUTH, cut(quiet, 2.0)).max() < 1e-9
    assert pose_errors(quiet, {**TRUTH, "trim": 0.1}, cut(quiet, 2.0))[:, 0].max() > 0.01


def test_an_error_has_an_interval_round_it():
    random = np.random.default_rng(1)
    blocks = np.repeat(np.arange(12), 50)
    found = rmse(random.chisquare(1, 600) * np.repeat(random.uniform(0.5, 1.5, 12), 50), blocks)
    assert 0.8 < found.interval[0] < found.value < found.interval[1] < 1.25


def test_intervals_cover_the_true_error_about_as_often_as_they_say():
    random = np.random.default_rng(2)
    blocks = np.repeat(np.arange(12), 20)
    covered = 0
    for _ in range(200):
        size = np.repeat(random.gamma(4.0, 0.25, 12), 20)
        low, high = rmse(random.chisquare(1, 240) * size, blocks).interval
        covered += low <= 1.0 <= high
    assert 170 <= covered <= 199


def test_the_ratio_of_an_error_with_itself_is_one():
    squares, blocks = np.random.default_rng(1).random(100), np.repeat(np.arange(10), 10)
    assert ratio(squares, squares, blocks)[:2] == (1.0, (1.0, 1.0))


def test_a_ratio_is_surer_than_its_parts_where_both_vary_together():
    random = np.random.default_rng(3)
    blocks = np.repeat(np.arange(10), 30)
    before = random.chisquare(1, 300) * np.repeat(random.uniform(0.2, 3.0, 10), 30)
    found = ratio(0.25 * before * random.uniform(0.9, 1.1, 300), before, blocks)
    assert found.value == pytest.approx(0.5, rel=0.02)
    assert found.interval[0] < 0.5 < found.interval[1]
    assert np.ptp(found.interval) < 0.1 * np.ptp(rmse(before, blocks).interval)


def test_a_single_block_says_nothing_of_its_uncertainty():
    found = rmse(np.ones(5), np.zeros(5, dtype=int))
    assert found.value == 1.0
    assert not np.isfinite(found.interval[1])


def test_a_ratio_is_shown_by_many_blocks_on_one_side_though_a_few_weigh_most():
    blocks = np.repeat(np.arange(16), 20)
    before = np.exp(np.random.default_rng(1).normal(size=320))
    more = np.append(np.full(15, 1.05), 300.0)[blocks]
    larger, smaller = ratio(before * more, before, blocks), ratio(before, before * more, blocks)
    assert larger.interval[0] < 1.0 < larger.value
    assert larger.above
    assert not larger.below
    assert smaller.below
    assert not smaller.above


def test_a_ratio_of_few_blocks_or_of_errors_that_are_the_same_shows_nothing():
    squares, blocks = np.arange(1.0, 9.0), np.arange(8)
    assert not ratio(squares, squares, blocks).above
    assert not ratio(np.append(squares, 0.0), np.append(squares, 0.0), np.arange(9)).below
    assert not ratio(np.array([4.0, 9.0, 1.0]), np.array([1.0, 1.0, 0.9]), np.arange(3)).above


def test_windows_of_a_few_episodes_at_a_time_have_the_same_errors_to_the_bit(drives, monkeypatch):
    theta = {**TRUTH, "dead_band.width": 0.1, "floor_slope.y": 0.02, "motor_lag.time_constant": 0.3}
    gone = drives.only((drives.episode != 3) & (np.arange(len(drives.episode)) != 150))
    windows = cut(gone, 2.0)
    every_other = select_windows(windows, np.arange(len(windows.begin)) % 2 == 0)
    whole = pose_errors(gone, theta, every_other)
    monkeypatch.setattr(windows_module, "AT_ONCE", gone.duties.shape[1])
    assert np.array_equal(pose_errors(gone, theta, every_other), whole)


def test_no_more_episodes_are_replayed_at_a_time_than_memory_is_to_take(drives, monkeypatch):
    sizes, replay = [], windows_module.window_paths
    monkeypatch.setattr(
        windows_module, "window_paths", lambda some, *rest: sizes.append(len(some.duties)) or replay(some, *rest)
    )
    monkeypatch.setattr(windows_module, "AT_ONCE", 2 * drives.duties.shape[1])
    pose_errors(drives, TRUTH, cut(drives, 2.0))
    assert sizes == [2, 2, 2]
