"""Clocks that are apart are told and put right, rests cut out, drives kept aside to test on, long ones shortened."""

from dataclasses import replace

import hidden_cases as hidden
import numpy as np
import pytest
from clock_rates import planted
from planted import CALM, ROBOT, TRUTH, driven_log, planted_drives, planted_log, with_poses
from project import ROOT

from proxytune.diagnosis import cut, increments, robot_of
from proxytune.diagnosis.motion import clocks as timing
from proxytune.diagnosis.motion.clocks import cut_into_blocks, cut_out_long_rests, read_clocks, split, thin
from proxytune.diagnosis.motion.drives import gather
from proxytune.diagnosis.motion.latency import Blocks, Drift, _steps, stretches
from proxytune.errors import LogError
from proxytune.logs import Log, LogEpisode, Measured, read_log

LOGS = ROOT / "../shared/data/logs"
CASE = hidden.CLEAN[2]
SHORT = {"episodes": 6, "seconds": 40.0}
SHAPE = (6, 800)


def clocks(late_s, case=CASE):
    return read_clocks(hidden.make_log(case, late_s=late_s, **SHORT), ROBOT)


def in_one_drive(by, drive=3, after=0):
    late = np.zeros(SHAPE)
    late[drive, after:] = by
    return late


@pytest.mark.parametrize("late", [-0.2, 2.0])
def test_motion_that_no_delay_accounts_for_is_told_with_its_offset_for_the_nominal_delay(late):
    found = clocks(late)
    assert found.differ
    assert found.latency.value == pytest.approx(CASE.delay + late, abs=0.02)
    assert found.offset.value == pytest.approx(CASE.delay + late - 0.15, abs=0.02)
    assert found.offset.interval[0] < found.offset.value < found.offset.interval[1]
    assert found.left_s == pytest.approx(0.15)
    assert (found.drives, found.jumps) == ({}, ())


def test_an_offset_that_a_log_asks_to_fit_is_what_the_latency_has_beside_the_nominal_delay():
    found = read_clocks(replace(hidden.make_log(CASE, late_s=0.1, **SHORT), fit_clock_offset=True), ROBOT)
    assert found.offset.value == pytest.approx(CASE.delay + 0.1 - 0.15, abs=0.02)
    assert found.left_s == pytest.approx(0.15)


@pytest.mark.parametrize("late", [0.3, -0.05])
def test_an_offset_that_a_delay_accounts_for_is_no_proof(late):
    found = clocks(late)
    assert not found.differ
    assert found.latency.value == pytest.approx(CASE.delay + late, abs=0.02)
    assert not found.later_s.any()


@pytest.mark.parametrize("by", [-0.3, 0.1])
def test_a_drive_with_a_clock_of_its_own_is_named(by):
    found = clocks(in_one_drive(by))
    assert list(found.drives) == ["03"]
    assert found.drives["03"].value == pytest.approx(by, abs=0.02)
    np.testing.assert_allclose(found.later_s, -np.eye(6)[3] * found.drives["03"].value)
    assert (found.offset.value, found.jumps) == (0.0, ())


def test_without_noise_a_drive_of_its_own_clock_makes_no_jump_in_another():
    found = read_clocks(hidden.make_log(CASE, late_s=in_one_drive(-0.3), noiseless=True, **SHORT), ROBOT)
    assert (list(found.drives), found.jumps) == (["03"], ())


@pytest.mark.parametrize("by", [-0.3, 0.2])
def test_a_clock_that_jumps_is_named_with_its_time_and_the_longer_stretch_is_kept(by):
    found = clocks(in_one_drive(by, after=500))
    (jump,) = found.jumps
    assert jump.drive == "03"
    assert jump.time_s == pytest.approx(25.0, abs=2.0)
    assert jump.by_s == pytest.approx(by, abs=0.03)
    low, high = found.kept_s[3]
    assert (low, high <= 25.0) == (0.0, True)
    assert np.isinf(found.kept_s[[0, 1, 2, 4, 5], 1]).all()


def test_clocks_that_jump_in_a_third_of_the_drives_are_told_where_poses_step_which_alone_is_no_jump():
    late = in_one_drive(-0.3, after=500) + in_one_drive(0.2, drive=1, after=300)
    found = clocks(late)
    assert [(jump.drive, jump.time_s) for jump in found.jumps] == [
        ("01", pytest.approx(15.0, abs=2.0)),
        ("03", pytest.approx(25.0, abs=2.0)),
    ]
    np.testing.assert_allclose([jump.by_s for jump in found.jumps], (0.2, -0.3), atol=0.05)
    # Of drive 01 the stretch after its jump is kept, on the clock of the others.
    assert found.kept_s[1, 0] > 15.0
    np.testing.assert_allclose(found.later_s, (0.0, -0.2, 0.0, 0.0, 0.0, 0.0), atol=0.02)
    log = hidden.make_log(CASE, **SHORT)

    def moved_on(poses):
        heading = poses[300, 2]
        return poses + (np.arange(800) >= 300)[:, None] * (0.08 * np.cos(heading), 0.08 * np.sin(heading), 0.0)

    assert len(_steps(with_poses(log, moved_on))[0]) > len(_steps(log)[0])
    assert not read_clocks(with_poses(log, moved_on), ROBOT).jumps


@pytest.mark.slow
def test_what_a_drive_does_in_its_last_seconds_is_no_second_jump_far_off():
    one = planted("jump in a third", 4, hidden=False)
    jumps = read_clocks(hidden.make_log(one.case, late_s=one.late_s), ROBOT).jumps
    np.testing.assert_allclose([jump.by_s for jump in jumps], [-0.3] * 4, atol=0.02)


@pytest.mark.parametrize("number", [154, *(pytest.param(number, marks=pytest.mark.slow) for number in (22, 23))])
def test_a_jump_is_told_where_latencies_alone_show_too_little_and_where_it_leaves_little_of_a_drive(number):
    """By the step of the poses: that of 154 is 0.05 s early in double noise. Else by what other drives say."""
    one = planted("jump", number, hidden=False)
    (jump,) = read_clocks(hidden.make_log(one.case, late_s=one.late_s), ROBOT).jumps
    assert jump.drive == f"{one.drive:02d}"
    assert jump.time_s == pytest.approx(one.at_s, abs=2.0 if number == 154 else 4.0)
    assert jump.by_s == pytest.approx(one.by_s, abs=0.015 if number == 154 else 0.02)


DRIFTING = np.broadcast_to(np.arange(800) / 20.0, SHAPE)


@pytest.mark.parametrize(("rate", "case"), [(0.0012, CASE), (-0.003, hidden.CLEAN[22])])
def test_clocks_that_run_at_different_rates_are_told_with_the_rate_and_nothing_else(rate, case):
    found = clocks(rate * DRIFTING, case)
    low, high = found.drift.interval
    assert low < rate < high
    assert high - low < 0.0008
    assert found.differ
    assert (found.offset.value, found.drives, found.jumps) == (0.0, {}, ())


def test_drift_is_one_line_through_drives_and_none_of_one_drive_that_grows_late():
    log = hidden.make_log(CASE, late_s=0.001 * (DRIFTING + 60.0 * np.arange(6)[:, None]), **SHORT)
    following = (replace(episode, times=episode.times + 60.0 * e) for e, episode in enumerate(log.episodes))
    found = read_clocks(replace(log, episodes=tuple(following)), ROBOT)
    assert found.drift.value == pytest.approx(0.001, abs=1e-4)
    assert found.drives == {}
    assert clocks(0.003 * DRIFTING * (np.arange(6) == 3)[:, None]).drift.value == 0.0
    rate = 0.003
    log = timing.without_drift(hidden.make_log(CASE, late_s=rate * DRIFTING, **SHORT), rate)
    np.testing.assert_allclose(log.episodes[0].issued, (1.0 + rate) * log.episodes[0].times)
    assert not read_clocks(log, ROBOT).differ


def test_a_drift_that_a_model_explains_is_none_and_a_true_one_stays_beside_the_model(monkeypatch):
    model = {**TRUTH, "dead_band.width": 0.2}
    log = planted_log(model, episodes=6, seconds=40.0)
    without = read_clocks(log, ROBOT, model=model)
    drifting = timing.without_drift(log, -0.003)
    assert read_clocks(drifting, ROBOT, model=model).drift == read_clocks(drifting, ROBOT).drift
    assert read_clocks(drifting, ROBOT).drift.value == pytest.approx(0.003, abs=5e-4)
    # As a robot of first order shows it, then what is left of it, then as the model does.
    for model_given, value in ((None, 0.003), (model, 0.0)):
        shown = iter((Drift(0.003, 0.0003, 40.0), None, Drift(0.0004, 0.0003, 40.0)))
        monkeypatch.setattr("proxytune.diagnosis.motion.latency.clock_drift", lambda *_, of=shown: next(of))
        found = read_clocks(log, ROBOT, model=model_given)
        assert (found.drift.value, found.latency == without.latency) == (value, not value)


@pytest.mark.parametrize(
    "name",
    [
        "slew_rate rise 0.4",
        "yaw_lag time_constant 0.25",
        *(pytest.param(hidden.IN_FORM[number].name, marks=pytest.mark.slow) for number in (0, 12, 17, 21, 24)),
    ],
)
def test_hidden_effects_are_no_clock_problem_even_a_lag_that_is_another_in_every_manoeuvre(name):
    (case,) = (case for case in hidden.IN_FORM if case.name == name)
    assert not clocks(0.0, case).differ


@pytest.mark.parametrize("theta", [{"yaw_lag": 0.1}, {"delay": 0.5, "motor_lag.time_constant": 0.8}, {"delay": 0.0}])
def test_a_slow_or_late_robot_is_no_clock_problem(theta):
    assert not read_clocks(planted_log({**TRUTH, **theta}, episodes=6, seconds=20.0, noise=CALM), ROBOT).differ


def test_a_slow_motor_is_as_if_clocks_jumped_but_not_beside_its_own_motion_where_true_jumps_remain():
    slow = {**TRUTH, "slew_rate": 1.6}
    log = planted_log(slow, episodes=12, seconds=40.0)
    assert len(read_clocks(log, ROBOT).odd) > 3
    assert not read_clocks(log, ROBOT, model=slow).differ
    # A model that leaves more than a robot of first order says nothing of clocks.
    assert read_clocks(log, ROBOT, model={"trim": 0.3}).odd == read_clocks(log, ROBOT).odd
    jumped = hidden.make_log(CASE, late_s=in_one_drive(0.2, after=400), **SHORT)
    (jump,) = read_clocks(jumped, ROBOT, model={"trim": CASE.trim, "delay": CASE.delay}).jumps
    assert (jump.drive, jump.by_s) == ("03", pytest.approx(0.2, abs=0.02))


def test_a_robot_that_repeats_itself_is_stuck_or_rests_is_no_clock_problem():
    times = np.arange(1200) / 20.0
    turn = 0.2 * np.sin(2.0 * np.pi * times / 6.0)
    duties = np.tile(np.stack((0.5 - turn, 0.5 + turn), axis=1), (4, 1, 1))
    assert not read_clocks(driven_log({}, duties, np.zeros((4, 3))), ROBOT).differ

    latencies = np.arange(-40, 41) * 0.25
    moving = np.minimum((latencies - 0.25) ** 2, 4.0)
    stuck = np.minimum((10.0 - latencies) ** 2, 1.0) * 4.0
    log = planted_log({}, episodes=1, seconds=60.0)
    squares = np.concatenate((np.tile(stuck, (11, 1)), np.tile(moving, (19, 1))))
    blocks = Blocks(np.zeros(30, dtype=int), np.arange(30), squares)
    assert stretches(log, blocks, latencies) == ([(0.0, np.inf)], ())

    own = 0.25 + 0.05 * np.sin(np.arange(24.0))
    moving = 9.0 + np.minimum(50.0 * (latencies - own[:, None]) ** 2, 900.0)
    # The map is put right while the robot rests, and long after there was a command that it looks like.
    put_right = 9.0 + np.minimum(50.0 * (latencies + 9.52) ** 2, 180.0)
    resting = 9.0 + 0.01 * (latencies + 9.5) ** 2 * np.ones((5, 1))
    squares = np.concatenate((moving, put_right[None], resting))
    blocks = Blocks(np.zeros(30, dtype=int), np.arange(30), squares)
    assert stretches(log, blocks, latencies) == ([(0.0, np.inf)], ())


def test_one_clock_is_left_and_commands_are_put_on_that_of_the_poses():
    late = in_one_drive(-0.3)
    apart, right = (hidden.make_log(CASE, late_s=late_s, noiseless=True, **SHORT) for late_s in (late, 0.0))
    corrected, found = timing.on_one_clock(apart, ROBOT)
    shift = found.later_s[3]
    assert shift == pytest.approx(0.3, abs=0.02)
    np.testing.assert_allclose(corrected.episodes[3].issued, apart.episodes[3].times - shift)
    moved, drives = gather(corrected, ROBOT, corrected.episodes), gather(right, ROBOT, right.episodes)
    ticks, part = divmod(shift * drives.tick_hz, 1.0)
    known = drives.duties[3, int(ticks) :]
    duties = moved.duties[:, moved.lead :]
    np.testing.assert_allclose(duties[3, : len(known) - 1], (1.0 - part) * known[:-1] + part * known[1:])
    np.testing.assert_allclose(duties[0], drives.duties[0])
    np.testing.assert_array_equal(corrected.episodes[3].poses, apart.episodes[3].poses)

    log = hidden.make_log(CASE, **SHORT)
    assert timing.on_one_clock(log, ROBOT)[0] is log


def test_poses_before_the_first_command_or_beyond_a_jump_are_left_out_also_at_times_of_their_own():
    log = hidden.make_log(CASE, late_s=in_one_drive(0.5, after=500), **SHORT)
    found = read_clocks(log, ROBOT)
    poses = [episode.poses for episode in timing.put_on_one_clock(log, found).episodes]
    assert np.isfinite(poses[3]).all(axis=1).sum() == pytest.approx(found.kept_s[3, 1] * 20.0, abs=1)
    assert np.isnan(poses[3][500:]).all()
    assert np.isfinite(poses[2]).all()
    late = replace(found, later_s=np.full(6, -1.0))
    for episode in timing.put_on_one_clock(hidden.make_log(CASE, **SHORT), late).episodes:
        assert np.isnan(episode.poses[:20]).all()
        assert np.isfinite(episode.poses[20]).all()
    drives = list(log.episodes)
    measured = Measured(drives[3].times[::2] + 0.01, drives[3].poses[::2], np.arange(0, 800, 2))
    drives[3] = replace(drives[3], measured=measured)
    kept = timing.put_on_one_clock(replace(log, episodes=tuple(drives)), found).episodes[3]
    assert len(kept.measured.rows) == len(kept.measured.times) == pytest.approx(found.kept_s[3, 1] * 10.0, abs=1)
    assert kept.measured.rows.max() < 500


@pytest.mark.slow
def test_another_log_of_the_same_robot_is_put_on_the_same_latency():
    one, other = (hidden.make_log(CASE, late_s=late, **SHORT) for late in (0.0, 0.2))
    assert read_clocks(other, ROBOT, read_clocks(one, ROBOT)).offset.value == pytest.approx(0.2, abs=0.02)
    assert not read_clocks(one, ROBOT, read_clocks(one, ROBOT)).differ


@pytest.mark.slow
@pytest.mark.parametrize("name", ["drive_husky", "gym_duckietown", "mrclam6_robot1", "mrclam6_robot4"])
def test_measured_logs_are_on_one_clock(name):
    if not (LOGS / name).is_dir():
        pytest.skip(f"the measured log {name} is not here: it is not part of the project")
    log = read_log(LOGS / name)
    assert not read_clocks(log, robot_of(log)).differ


def log(*told, rows=4000, **more):
    """One drive of 200 s at 20 rows a second, told to move between these times [s]."""
    times = 5.0 + np.arange(rows) / 20.0
    commands = np.zeros((rows, 2))
    for begin, end in told:
        commands[round(begin * 20) : round(end * 20)] = (0.3, 0.2)
    poses = np.stack((times, times, times), axis=1)
    return Log("yard", "duckiebot", "duty", 20.0, {}, (LogEpisode("a", times, commands, poses, commands, **more),))


def test_each_stretch_between_long_rests_is_a_drive_and_logs_without_any_are_left_to_others():
    whole = log((30.0, 50.0), (60.0, 70.0), (120.0, 150.0))
    first, second = cut_out_long_rests(whole).episodes
    assert (first.name, second.name) == ("a from 34 s", "a from 124 s")
    assert (first.times[0], first.times[-1]) == pytest.approx((34.0, 77.95))
    assert (second.times[0], second.times[-1]) == pytest.approx((124.0, 157.95))
    np.testing.assert_array_equal(first.poses[:, 0], first.times)
    np.testing.assert_array_equal(second.commands, second.wheels)
    np.testing.assert_array_equal(second.commands, whole.episodes[0].commands[2380:3060])

    (episode,) = whole.episodes
    rows = np.arange(0, 4000, 3)
    measured = Measured(episode.times[rows] + 0.01, episode.poses[rows], rows)
    own = replace(whole, episodes=(replace(episode, measured=measured),))
    for piece in cut_out_long_rests(own).episodes:
        np.testing.assert_allclose(piece.times[piece.measured.rows] + 0.01, piece.measured.times)
        assert len(piece.measured.times) == pytest.approx(len(piece.times) / 3, abs=1)

    whole = log((10.0, 80.0), (95.0, 190.0))
    assert cut_out_long_rests(whole) is whole

    still, frames = log(), replace(log(), command="none")
    assert cut_out_long_rests(still) is still
    assert cut_out_long_rests(frames) is frames
    issued = np.array([0.0, 50.0, 60.0, 150.0, 170.0])
    commands = np.array([[0, 0], [0.5, 0.5], [0, 0], [0.2, 0.2], [0, 0]])
    own = replace(still.episodes[0], issued=issued, commands=commands)
    first, second = cut_out_long_rests(replace(still, episodes=(own,))).episodes
    np.testing.assert_array_equal(first.issued, [0.0, 50.0, 60.0])
    np.testing.assert_array_equal(second.issued, [60.0, 150.0, 170.0])
    np.testing.assert_array_equal(second.held[[0, -1]], [[0, 0], [0, 0]])
    np.testing.assert_array_equal(second.commands, commands[2:])


def test_drives_are_split_by_motion_and_another_log_may_be_tested_on():
    log = planted_log(TRUTH, episodes=7, seconds=15.0)
    fitted, tested = split(log, ROBOT, None)
    assert fitted.duties.shape[0] == 5
    assert tested.duties.shape[0] == 2
    np.testing.assert_array_equal(tested.duties[0, ::3], log.episodes[2].commands)
    for row, episode in enumerate((0, 1, 3, 4, 6)):
        np.testing.assert_array_equal(fitted.duties[row, ::3], log.episodes[episode].commands)

    log, other = (planted_log(TRUTH, seed=seed, episodes=2, seconds=15.0) for seed in (1, 2))
    fitted, tested = split(log, ROBOT, other)
    assert (fitted.duties.shape[0], tested.duties.shape[0]) == (2, 2)
    np.testing.assert_array_equal(tested.duties[1, ::3], other.episodes[1].commands)

    def lost(poses):
        poses = poses.copy()
        poses[400:1400] = np.nan
        return poses

    fitted, tested = split(with_poses(planted_log(TRUTH, episodes=1, seconds=120.0), lost), ROBOT, None)
    assert fitted.seconds == pytest.approx(tested.seconds, abs=0.2)
    assert len(np.unique(fitted.block)) >= 6


@pytest.mark.parametrize("episodes", [1, 2, 5])
def test_few_episodes_are_split_by_time(episodes):
    fitted, tested = split(planted_log(TRUTH, episodes=episodes, seconds=60.0), ROBOT, None)
    assert fitted.seconds == pytest.approx(tested.seconds, abs=0.2 * episodes)
    for episode in range(episodes):
        assert fitted.last[fitted.episode == episode].max() <= tested.first[tested.episode == episode].min()
        assert not tested.linked[tested.episode == episode][0]


@pytest.mark.parametrize(("episodes", "seconds"), [(1, 30.0), (3, 10.0), (6, 6.0)])
def test_too_little_motion_is_refused_with_how_much_is_needed(episodes, seconds):
    with pytest.raises(LogError, match=r"^planted: only [0-9.]+ s of measured motion to .*at least 20 s"):
        split(planted_log(TRUTH, episodes=episodes, seconds=seconds), ROBOT, None)


@pytest.mark.parametrize(("episodes", "seconds"), [(1, 60.0), (6, 30.0), (12, 60.0)])
def test_there_are_enough_blocks_to_leave_out_and_none_is_tiny(episodes, seconds):
    for drives in split(planted_log(TRUTH, episodes=episodes, seconds=seconds), ROBOT, None):
        numbers = np.unique(drives.block)
        np.testing.assert_array_equal(numbers, np.arange(len(numbers)))
        assert len(numbers) >= min(timing.BLOCKS, drives.seconds / timing.TEST_BLOCK_S) * 0.6
        for block in numbers:
            own = drives.block == block
            assert len(np.unique(drives.episode[own])) == 1
            assert (drives.last[own].max() - drives.first[own].min()) / drives.tick_hz > 0.9 * timing.TEST_BLOCK_S
            assert not drives.linked[own][0]


def test_of_very_many_drives_no_more_are_tested_on_than_needed_spread_over_all(monkeypatch):
    log = planted_log(TRUTH, episodes=36, seconds=10.0)
    whole = split(log, ROBOT, None).tested
    monkeypatch.setattr(timing, "MOST_TESTED_S", 60.0)
    some = split(log, ROBOT, None).tested
    assert (len(whole.duties), len(some.duties)) == (12, 7)
    kept = [int(np.flatnonzero((whole.headings == own).all(axis=1))[0]) for own in some.headings]
    assert kept == [0, 1, 3, 5, 6, 8, 10]


@pytest.fixture(scope="module")
def drives():
    return cut_into_blocks(planted_drives(TRUTH, episodes=4, seconds=20.0, noise=None))


def test_a_right_model_predicts_joined_increments_too_missing_poses_stay_missing_and_short_drives_whole(drives):
    assert thin(drives) is drives
    assert timing.join_increments(drives, 1) is drives
    few = timing.join_increments(drives.only(np.arange(len(drives.episode)) % 50 > 4), 4)
    assert (few.last - few.first).max() <= 4 * (drives.last - drives.first).max()
    assert np.abs(few.measured - increments(few, TRUTH)).max() < 1e-9
    few = timing.join_increments(drives, 3)
    assert np.abs(few.measured - increments(few, TRUTH)).max() < 1e-9


@pytest.mark.parametrize("times", [2, 3, 7])
def test_joined_increments_lead_from_the_first_pose_to_the_last(drives, times):
    few = timing.join_increments(drives, times)
    assert (few.last - few.first).sum() == (drives.last - drives.first).sum()
    assert set(map(tuple, few.poses.reshape(-1, 3))) <= set(map(tuple, drives.poses.reshape(-1, 3)))
    assert few.travel.sum(axis=0) == pytest.approx(drives.travel.sum(axis=0))
    assert set(few.block) == set(drives.block)
    assert (~few.linked).sum() == (~drives.linked).sum()


def test_of_drives_of_two_seconds_fewer_are_taken_whole_and_else_blocks_shortened_and_none_lost(monkeypatch, drives):
    monkeypatch.setattr(timing, "MOST", 300)
    few = thin(cut_into_blocks(planted_drives(TRUTH, episodes=60, seconds=2.1, noise=None)))
    assert timing.FEWEST_BLOCKS <= len(set(few.block)) < 60
    assert len(cut(few, 2.0).begin) == len(set(few.block))
    monkeypatch.setattr(timing, "STRETCH_S", 1.0)
    few = thin(drives)
    assert 250 <= len(few.episode) <= 300 + len(set(drives.block))
    assert set(few.block) == set(drives.block)
    usual = float(np.median(few.last - few.first)) / few.tick_hz
    assert usual == pytest.approx(timing.JOINED_S)
    sizes = np.bincount(few.block)
    assert sizes.max() <= 2 * sizes.min()
    assert len(set(few.first[~few.linked])) > 1, "not always a block's beginning"
