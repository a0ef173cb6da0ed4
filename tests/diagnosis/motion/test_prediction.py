"""What a model says of a log, window by window, and what drives from the same commands do not repeat."""

from dataclasses import replace

import numpy as np
import pytest
from foreign_robot import FOREIGN_TRUTH, drive, write_own_times
from learnt_truth import MANY, TURNING
from manoeuvres import make_drives
from planted import ROBOT, TRUTH, driven_log, drives_of, planted_drives, planted_log, with_poses

from proxytune.diagnosis import agreement, cut, pose_errors, predict, robot_of
from proxytune.diagnosis.motion import prediction as windows_module
from proxytune.diagnosis.motion.drives import gather
from proxytune.diagnosis.motion.innovations import span
from proxytune.diagnosis.motion.prediction import compare_repeats, ratio, rmse, select_windows, slopes_of
from proxytune.effects import learnt_effect
from proxytune.errors import LogError
from proxytune.logs import read_log


@pytest.fixture(scope="module")
def log():
    return planted_log(TRUTH, episodes=2, seconds=10.0, noise=None)


def without_poses(log, *rows):
    """The log whose first drive was not measured in these rows."""
    first = log.episodes[0]
    poses = first.poses.copy()
    for some in rows:
        poses[some] = np.nan
    return replace(log, episodes=(replace(first, poses=poses), *log.episodes[1:]))


def test_windows_cover_every_row_headings_go_on_and_a_stub_at_the_end_is_not_counted(log):
    table = predict(log, ROBOT, TRUTH, 2.0)
    assert list(table.columns) == ["episode", "start_time", "time", "x", "y", "heading"]
    for name, own in table.groupby("episode"):
        assert name in ("00", "01")
        assert sorted(own.start_time.unique()) == pytest.approx([0.0, 2.0, 4.0, 6.0, 8.0])
        assert sorted(own.time.unique()) == pytest.approx(np.arange(200) / 20.0)
        assert (own.groupby("start_time").time.count() <= 41).all()

    table = predict(log, ROBOT, TRUTH, 5.0)
    for _, window in table.groupby(["episode", "start_time"]):
        assert np.abs(np.diff(window.heading)).max() < 0.5
    turned = with_poses(log, lambda poses: poses + (0.0, 0.0, 40.0))
    assert predict(turned, ROBOT, TRUTH, 5.0).heading.iloc[0] == pytest.approx(turned.episodes[0].poses[0, 2])
    table = predict(log, ROBOT, {**TRUTH, "trim": 0.1}, 1.9)
    found = agreement(table, log, 1.9)
    ends = table.groupby(["episode", "start_time"]).time.max().reset_index()
    assert (ends.time - ends.start_time).min() < 0.5
    assert found.windows == 2 * 5
    assert found.poses == found.windows * 38
    assert agreement(table[table.start_time < 9.0], log, 1.9) == found


def test_exact_models_predict_random_effects_by_their_mean_and_noiseless_logs_slopes_and_markers(log):
    late = predict(log, ROBOT, {"trim": 0.03, "delay": 0.07, "delay_jitter": 0.1}, 2.0)
    assert agreement(late, log, 2.0).place < 1e-9
    found = agreement(predict(log, ROBOT, TRUTH, 2.0), log, 2.0)
    assert found.place < 1e-9
    assert found.turn < 1e-9
    assert (found.poses, found.windows) == (2 * 199, 10)

    theta = {**TRUTH, "floor_slope.x": 0.04, "floor_slope.y": -0.02}
    sloped = planted_log(theta, episodes=3, seconds=10.0, noise=None)
    assert agreement(predict(sloped, ROBOT, theta, 2.0), sloped, 2.0).place < 1e-6
    assert agreement(predict(sloped, ROBOT, TRUTH, 2.0), sloped, 2.0).place > 0.01

    theta = {**TRUTH, "marker_offset.forward": 0.05, "heading_offset": 3.0}

    def seen(poses):
        out = poses.copy()
        out[:, :2] += 0.05 * np.stack((np.cos(poses[:, 2]), np.sin(poses[:, 2])), axis=1)
        out[:, 2] += np.radians(3.0)
        return out

    marked = with_poses(log, seen)
    assert agreement(predict(marked, ROBOT, theta, 2.0), marked, 2.0).place < 1e-6


@pytest.mark.parametrize("extra", [TURNING, MANY], ids=["turning", "many"])
def test_learnt_motion_is_predicted_with_its_past_before_each_window(log, extra):
    driven = planted_log({**TRUTH, **extra}, episodes=2, seconds=10.0, noise=None)
    assert agreement(predict(driven, ROBOT, TRUTH, 2.0), driven, 2.0).place > 0.005
    found = agreement(predict(driven, ROBOT, {**TRUTH, **extra}, 2.0), driven, 2.0)
    assert found.place < 1e-9
    assert found.turn < 1e-9


def test_a_log_needs_a_pose_windows_begin_at_measured_ones_and_others_are_not_compared(log):
    table = predict(without_poses(log, slice(7), slice(44, 60)), ROBOT, TRUTH, 2.0)
    assert list(table[table.episode == "00"].start_time.unique()) == pytest.approx([0.35, 3.0, 5.0, 7.0, 9.0])
    broken = without_poses(log, slice(50, 60))
    assert agreement(predict(broken, ROBOT, TRUTH, 2.0), broken, 2.0).poses < 2 * 199 - 9
    table = predict(log, ROBOT, {**TRUTH, "trim": 0.1}, 1.0)
    starts = table[table.time == table.start_time]
    measured = {(e.name, time): pose for e in log.episodes for time, pose in zip(e.times, e.poses, strict=True)}
    for row in starts.itertuples():
        np.testing.assert_allclose((row.x, row.y, row.heading), measured[row.episode, row.time], atol=1e-12)
    blind = with_poses(log, lambda poses: np.full_like(poses, np.nan))
    with pytest.raises(LogError, match="to start a window from; add x, y and heading"):
        predict(blind, ROBOT, TRUTH, 2.0)
    alone = with_poses(log, lambda poses: np.where(np.arange(len(poses))[:, None] > 0, np.nan, poses))
    told = predict(alone, ROBOT, TRUTH, 100.0)
    np.testing.assert_allclose(told[["x", "y", "heading"]], predict(log, ROBOT, TRUTH, 100.0)[["x", "y", "heading"]])
    assert len(told) == sum(len(one.times) for one in log.episodes)
    assert agreement(told, alone, 100.0).windows == 0


@pytest.mark.parametrize("horizon", [0.0, 0.04, -1.0, float("nan")])
def test_a_horizon_shorter_than_a_sample_is_refused(log, horizon):
    with pytest.raises(LogError, match="shorter than a sample"):
        predict(log, ROBOT, TRUTH, horizon)


@pytest.mark.parametrize("known", [1, 2])
def test_an_episode_with_a_pose_or_two_is_predicted_from_it(log, known):
    table = predict(without_poses(log, slice(known, None)), ROBOT, TRUTH, 2.0)
    assert len(table[table.episode == "00"]) == 41


@pytest.fixture(scope="module")
def own_times(tmp_path_factory):
    return read_log(write_own_times(tmp_path_factory.mktemp("own_times"), [drive(1, seconds=20.0)]))


def test_poses_at_times_of_their_own_are_predicted_at_those_times(own_times):
    (episode,) = own_times.episodes
    table = predict(own_times, robot_of(own_times), FOREIGN_TRUTH, 2.0)
    assert set(table.time) == set(episode.measured.times[episode.measured.times >= table.time.min()])
    found = agreement(table, own_times, 2.0)
    assert found.place < 0.0035, "noise of 1 mm at the start and 3 mrad over up to 0.5 m"
    assert found.poses > 1500


def repeated_drives(log):
    return gather(log, ROBOT, log.episodes)


def again(times, *, theta=TRUTH, seconds=30.0):
    """Drives of which each manoeuvre is driven so many times."""
    duties, starts = make_drives(3, 2, round(20 * seconds))
    return repeated_drives(driven_log(theta, np.repeat(duties, times, axis=0), np.repeat(starts, times, axis=0)))


@pytest.mark.parametrize("times", [2, 5])
@pytest.mark.parametrize("horizon_s", [1.0, 2.0])
def test_a_model_that_is_right_misses_only_what_is_not_repeated(times, horizon_s):
    found, apart, part = compare_repeats(again(times), TRUTH, horizon_s)
    assert part == 1.0
    assert 0.003 < apart < 0.03
    assert found.value == pytest.approx(1.0, abs=0.15)
    assert found.interval[0] < 1.0 < found.interval[1] + 0.1


def test_repeats_show_what_a_model_lacks_as_far_as_drives_go_and_are_repeated():
    found = compare_repeats(again(3, theta={**TRUTH, "yaw_scrub": 0.12}), TRUTH, 2.0).share
    assert found.value < 0.7
    assert found.interval[1] < 0.9
    duties, starts = make_drives(3, 1, 600)
    log = driven_log(TRUTH, np.repeat(duties, 2, axis=0), np.repeat(starts, 2, axis=0))
    one, other = log.episodes
    short = replace(other, times=other.times[:500], commands=other.commands[:500], poses=other.poses[:500])
    assert compare_repeats(repeated_drives(replace(log, episodes=(one, short))), TRUTH, 1.0) is not None
    stub = replace(other, times=other.times[:150], commands=other.commands[:150], poses=other.poses[:150])
    assert compare_repeats(repeated_drives(replace(log, episodes=(one, stub))), TRUTH, 1.0) is None
    assert compare_repeats(again(2, seconds=3.0), TRUTH, 5.0) is None
    duties, starts = make_drives(3, 2, 600)
    log = driven_log(TRUTH, duties, starts)
    assert compare_repeats(repeated_drives(replace(log, episodes=(*log.episodes, *log.episodes))), TRUTH, 1.0) is None
    duties, starts = np.concatenate((duties, duties[:1])), np.concatenate((starts, starts[:1]))
    assert 0.3 < compare_repeats(repeated_drives(driven_log(TRUTH, duties, starts)), TRUTH, 1.0).part < 0.9
    duties, starts = make_drives(4, 6, 400)
    duties[:, :200] = 0.0
    assert compare_repeats(repeated_drives(driven_log(TRUTH, duties[:5], starts[:5])), TRUTH, 2.0) is None


@pytest.mark.parametrize(("times", "seconds"), [(1, 30.0), (2, 6.0)])
def test_of_drives_that_are_hardly_repeated_nothing_is_said(times, seconds):
    assert compare_repeats(again(times, seconds=seconds), TRUTH, 2.0) is None


SIZE = 1e-4


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=2, seconds=8.0, noise=None)


@pytest.mark.parametrize("extra", [TURNING, MANY], ids=["turning", "many"])
@pytest.mark.parametrize("named", [{}, {"marker_offset.forward": 0.05, "heading_offset": 4.0}], ids=["plain", "marker"])
def test_the_change_per_weight_is_that_of_replays(drives, extra, named):
    offered = learnt_effect(extra)
    theta = {**TRUTH, **named}
    still = slopes_of(drives, theta, offered)
    weights = [name for name in extra if "range" not in name]
    order = [f"learnt.{curve.group}.{curve.channel}@{knot!r}" for curve in offered.curves for knot in curve.knots]
    assert sorted(order) == sorted(weights)
    none = dict.fromkeys(weights, 0.0)
    for column, name in enumerate(order):
        seen = (still.residuals - slopes_of(drives, {**theta, **extra, **none, name: SIZE}, offered).residuals) / SIZE
        np.testing.assert_allclose(still.columns[..., column], seen, rtol=0, atol=2e-3 * np.abs(seen).max() + 1e-6)


def test_the_change_per_share_is_that_of_replays_and_a_right_model_leaves_nothing(drives):
    offered, free = learnt_effect(TURNING), (("delay",), ("trim",))
    theta = {**TRUTH, **TURNING}
    still = slopes_of(drives, theta, offered, free)
    np.testing.assert_array_equal(still.columns[..., :-2], slopes_of(drives, theta, offered).columns)
    share = 1e-3
    for column, (name,) in zip((-2, -1), free, strict=True):
        low, high = span((name,), drives)
        moved = slopes_of(drives, {**theta, name: theta[name] + share * (high - low)}, offered)
        seen = (still.residuals - moved.residuals) / share
        np.testing.assert_allclose(still.columns[..., column], seen, rtol=0, atol=0.1 * np.abs(seen).max())
    assert np.abs(slopes_of(drives, TRUTH, learnt_effect(TURNING)).residuals).max() < 1e-9
    quiet = planted_drives(TRUTH, episodes=2, seconds=20.0, noise=None)
    assert pose_errors(quiet, TRUTH, cut(quiet, 2.0)).max() < 1e-9
    assert pose_errors(quiet, {**TRUTH, "trim": 0.1}, cut(quiet, 2.0))[:, 0].max() > 0.01


def test_windows_are_thinned_and_short_runs_have_none(drives):
    windows = windows_module.choose_windows(drives)
    assert np.bincount(windows.window).max() == windows_module.POSES
    lasts = (drives.last[windows.increment] - drives.first[windows.begin][windows.window]) / drives.tick_hz
    assert lasts.max() == windows_module.FITTED_S
    assert np.all(np.diff(lasts)[np.diff(windows.window) == 0] > 0.0)
    assert len(cut(planted_drives(TRUTH, episodes=2, seconds=4.0), 10.0).begin) == 0


@pytest.fixture(scope="module")
def long():
    return planted_drives(TRUTH, episodes=6, seconds=30.0)


@pytest.mark.parametrize("horizon_s", [0.5, 1.0, 2.0, 5.0])
def test_windows_cover_every_increment_once_but_for_short_ends(long, horizon_s):
    windows = cut(long, horizon_s)
    assert len(np.unique(windows.increment)) == len(windows.increment)
    left = np.setdiff1d(np.arange(len(long.episode)), windows.increment)
    assert len(left) <= int((~long.linked).sum()) * windows_module.SHORTEST * horizon_s * 20.0
    assert len(windows.begin) >= long.seconds / horizon_s * 0.6


@pytest.mark.parametrize("horizon_s", [0.7, 1.9, 4.0])
def test_a_horizon_that_does_not_divide_a_drive_leaves_no_stub(long, horizon_s):
    windows = cut(long, horizon_s)
    for window, begin in enumerate(windows.begin):
        lasts = (long.last[windows.increment[windows.window == window][-1]] - long.first[begin]) / long.tick_hz
        assert lasts >= 0.9 * horizon_s - 1e-9


@pytest.mark.parametrize("horizon_s", [1.0, 2.0])
@pytest.mark.parametrize("rows", [slice(50, 60), slice(100, 150)])
def test_no_window_crosses_a_gap_a_block_or_an_episode(rows, horizon_s):
    long = drives_of(without_poses(planted_log(TRUTH, episodes=2, seconds=20.0), rows))
    windows = cut(long, horizon_s)
    for window, begin in enumerate(windows.begin):
        own = windows.increment[windows.window == window]
        assert own[0] == begin
        assert np.array_equal(own, np.arange(begin, begin + len(own)))
        assert long.linked[own[1:]].all()
        assert len(np.unique(long.block[own])) == len(np.unique(long.episode[own])) == 1
        lasts = (long.last[own[-1]] - long.first[begin]) / long.tick_hz
        assert windows_module.SHORTEST * horizon_s <= lasts <= horizon_s + 1e-9


def test_intervals_cover_the_true_error_about_as_often_as_they_say():
    random = np.random.default_rng(2)
    blocks = np.repeat(np.arange(12), 20)
    covered = 0
    for _ in range(200):
        low, high = rmse(random.chisquare(1, 240) * np.repeat(random.gamma(4.0, 0.25, 12), 20), blocks).interval
        covered += low <= 1.0 <= high
    assert 170 <= covered <= 199


def test_ratios_are_shown_by_many_blocks_also_where_few_weigh_most_and_not_by_few():
    random = np.random.default_rng(3)
    blocks = np.repeat(np.arange(10), 30)
    before = random.chisquare(1, 300) * np.repeat(random.uniform(0.2, 3.0, 10), 30)
    found = ratio(0.25 * before * random.uniform(0.9, 1.1, 300), before, blocks)
    assert found.value == pytest.approx(0.5, rel=0.02)
    assert found.interval[0] < 0.5 < found.interval[1]
    assert np.ptp(found.interval) < 0.1 * np.ptp(rmse(before, blocks).interval)

    found = rmse(np.ones(5), np.zeros(5, dtype=int))
    assert found.value == 1.0
    assert not np.isfinite(found.interval[1])

    squares, blocks = np.arange(1.0, 9.0), np.arange(8)
    assert not ratio(squares, squares, blocks).above
    assert not ratio(np.append(squares, 0.0), np.append(squares, 0.0), np.arange(9)).below
    assert not ratio(np.array([4.0, 9.0, 1.0]), np.array([1.0, 1.0, 0.9]), np.arange(3)).above
    # Where three of fifteen blocks are alike, all of the others go down by chance in one of 2 ** 12 cases.
    after = np.where(np.arange(15) < 3, 1.0, np.linspace(0.5, 0.9, 15))
    assert ratio(after, np.ones(15), np.arange(15)).p_below == pytest.approx(0.5**12)
    blocks = np.repeat(np.arange(16), 20)
    before = np.exp(np.random.default_rng(1).normal(size=320))
    more = np.append(np.full(15, 1.05), 300.0)[blocks]
    larger, smaller = ratio(before * more, before, blocks), ratio(before, before * more, blocks)
    assert larger.interval[0] < 1.0 < larger.value
    assert larger.above
    assert not larger.below
    assert smaller.below
    assert not smaller.above


def test_errors_are_the_same_however_few_episodes_are_replayed_at_a_time(long, monkeypatch):
    theta = {**TRUTH, "dead_band.width": 0.1, "floor_slope.y": 0.02, "motor_lag.time_constant": 0.3}
    gone = long.only((long.episode != 3) & (np.arange(len(long.episode)) != 150))
    windows = cut(gone, 2.0)
    every_other = select_windows(windows, np.arange(len(windows.begin)) % 2 == 0)
    whole = pose_errors(gone, theta, every_other)
    monkeypatch.setattr(windows_module, "AT_ONCE", gone.duties.shape[1])
    assert np.array_equal(pose_errors(gone, theta, every_other), whole)

    sizes, made = [], windows_module.innovations
    replay = made.window_paths
    monkeypatch.setattr(made, "window_paths", lambda some, *rest: sizes.append(len(some.duties)) or replay(some, *rest))
    monkeypatch.setattr(windows_module, "AT_ONCE", 2 * long.duties.shape[1])
    pose_errors(long, TRUTH, cut(long, 2.0))
    assert sizes == [2, 2, 2]
