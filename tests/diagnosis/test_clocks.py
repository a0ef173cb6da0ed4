"""Clocks that are apart are told and put right; clocks that are not are left alone."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

import hidden
from clock_rates import planted
from planted import ROBOT, driven_log, planted_log

from proxytune.diagnosis.measured.clocks import put_in_step, read_clocks
from proxytune.diagnosis.measured.drives import gather
from proxytune.diagnosis.measured.stretches import Blocks, stretches
from proxytune.logs import read_log

LOGS = Path(__file__).resolve().parents[2] / "../shared/data/logs"
CASE = hidden.CLEAN[2]
SHORT = {"episodes": 6, "seconds": 40.0}
SHAPE = (6, 800)


def clocks(late_s, case=CASE):
    return read_clocks(hidden.make_log(case, late_s=late_s, **SHORT), ROBOT)


def in_one_drive(by, drive=3, after=0):
    late = np.zeros(SHAPE)
    late[drive, after:] = by
    return late


@pytest.mark.parametrize("late", [-0.2, -0.5, -3.0, 2.0])
def test_motion_that_no_delay_accounts_for_is_told_with_its_offset_for_the_nominal_delay(late):
    found = clocks(late)
    assert found.differ
    assert found.latency.value == pytest.approx(CASE.delay + late, abs=0.02)
    assert found.offset.value == pytest.approx(CASE.delay + late - 0.15, abs=0.02)
    assert found.offset.interval[0] < found.offset.value < found.offset.interval[1]
    assert found.left_s == pytest.approx(0.15)
    assert (found.drives, found.jumps) == ({}, ())


def test_an_offset_that_a_log_asks_to_fit_is_what_the_latency_has_beside_the_nominal_delay():
    log = replace(hidden.make_log(CASE, late_s=0.1, **SHORT), fit_clock_offset=True)
    found = read_clocks(log, ROBOT)
    assert found.offset.value == pytest.approx(CASE.delay + 0.1 - 0.15, abs=0.02)
    assert found.left_s == pytest.approx(0.15)


@pytest.mark.parametrize("late", [0.0, 0.1, 0.3, -0.05])
def test_an_offset_that_a_delay_accounts_for_is_no_proof(late):
    found = clocks(late)
    assert not found.differ
    assert found.latency.value == pytest.approx(CASE.delay + late, abs=0.02)
    assert not found.later_s.any()


@pytest.mark.parametrize("by", [-0.3, 0.1, 0.5])
def test_a_drive_with_a_clock_of_its_own_is_named(by):
    found = clocks(in_one_drive(by))
    assert list(found.drives) == ["03"]
    assert found.drives["03"].value == pytest.approx(by, abs=0.02)
    np.testing.assert_allclose(found.later_s, -np.eye(6)[3] * found.drives["03"].value)
    assert (found.offset.value, found.jumps) == (0.0, ())


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


@pytest.mark.slow
@pytest.mark.parametrize("number", [22, 23])
def test_a_jump_that_leaves_little_of_a_drive_is_clear_beside_what_the_others_say(number):
    one = planted("jump", number, hidden=False)
    (jump,) = read_clocks(hidden.make_log(one.case, late_s=one.late_s), ROBOT).jumps
    assert jump.drive == f"{one.drive:02d}"
    assert jump.time_s == pytest.approx(one.at_s, abs=4.0)
    assert jump.by_s == pytest.approx(one.by_s, abs=0.02)


@pytest.mark.parametrize("effect", [0, 12, 17, 21, 24])
def test_hidden_effects_are_no_clock_problem(effect):
    assert not clocks(0.0, hidden.IN_FORM[effect]).differ


@pytest.mark.parametrize("theta", [{"delay": 0.3}, {"delay": 0.5, "motor_lag.time_constant": 0.8}, {"delay": 0.0}])
def test_a_slow_or_late_robot_is_no_clock_problem(theta):
    assert not read_clocks(planted_log({"trim": 0.03, **theta}, episodes=4, seconds=40.0), ROBOT).differ


@pytest.mark.parametrize("name", ["slew_rate rise 0.4", "slew_rate rise 0.8", "yaw_lag time_constant 0.25"])
def test_a_lag_that_is_another_in_every_manoeuvre_is_no_clock_problem(name):
    (case,) = (case for case in hidden.IN_FORM if case.name == name)
    assert not clocks(0.0, case).differ


def test_a_drive_that_repeats_itself_is_no_clock_problem():
    times = np.arange(1200) / 20.0
    turn = 0.2 * np.sin(2.0 * np.pi * times / 6.0)
    duties = np.tile(np.stack((0.5 - turn, 0.5 + turn), axis=1), (4, 1, 1))
    assert not read_clocks(driven_log({}, duties, np.zeros((4, 3))), ROBOT).differ


def test_a_robot_that_is_stuck_at_first_is_no_clock_problem():
    latencies = np.arange(-40, 41) * 0.25
    moving = np.minimum((latencies - 0.25) ** 2, 4.0)
    stuck = np.minimum((10.0 - latencies) ** 2, 1.0) * 4.0
    log = planted_log({}, episodes=1, seconds=60.0)
    squares = np.concatenate((np.tile(stuck, (11, 1)), np.tile(moving, (19, 1))))
    blocks = Blocks(np.zeros(30, dtype=int), np.arange(30), squares)
    assert stretches(log, blocks, latencies) == ([(0.0, np.inf)], ())


def test_drives_put_in_step_are_those_of_one_clock():
    late = in_one_drive(-0.3)
    found = clocks(late)
    apart, right = (hidden.make_log(CASE, late_s=late_s, noiseless=True, **SHORT) for late_s in (late, 0.0))
    moved = put_in_step(gather(apart, ROBOT, apart.episodes), found, range(6))
    drives = gather(right, ROBOT, right.episodes)
    shift = found.later_s[3] * drives.tick_hz
    own, other = moved.episode == 3, drives.episode == 3
    assert moved.first[own][0] == np.ceil(shift)
    np.testing.assert_array_equal(moved.first[~own], drives.first[~other])
    np.testing.assert_array_equal(moved.duties[0, :2400], drives.duties[0])
    part = np.ceil(shift) - shift
    expected = (1.0 - part) * drives.duties[3, 1:] + part * drives.duties[3, :-1]
    np.testing.assert_allclose(moved.duties[3, 1:2400], expected)
    np.testing.assert_allclose(moved.headings[3, moved.first[own]], moved.poses[own, 0, 2], atol=1e-9)


def test_poses_put_before_the_first_command_are_left_out_and_so_is_what_lies_beyond_a_jump():
    found = clocks(in_one_drive(0.5, after=500))
    log = hidden.make_log(CASE, late_s=in_one_drive(0.5, after=500), **SHORT)
    moved = put_in_step(gather(log, ROBOT, log.episodes), found, range(6))
    assert moved.last[moved.episode == 3].max() <= found.kept_s[3, 1] * 60.0
    late = clocks(2.0)
    log = hidden.make_log(CASE, late_s=2.0, **SHORT)
    moved = put_in_step(gather(log, ROBOT, log.episodes), late, range(6))
    assert moved.first.min() >= 0
    assert not moved.linked[0]


def test_another_log_of_the_same_robot_is_put_on_the_same_latency():
    one, other = (hidden.make_log(CASE, late_s=late, **SHORT) for late in (0.0, 0.2))
    found = read_clocks(other, ROBOT, read_clocks(one, ROBOT))
    assert found.offset.value == pytest.approx(0.2, abs=0.02)
    assert not read_clocks(one, ROBOT, read_clocks(one, ROBOT)).differ


@pytest.mark.slow
@pytest.mark.parametrize("name", ["drive_husky", "gym_duckietown", "mrclam6_robot1", "mrclam6_robot4"])
def test_measured_logs_are_on_one_clock(name):
    if not (LOGS / name).is_dir():
        pytest.skip(f"the measured log {name} is not here: it is not part of the project")
    from proxytune.diagnosis.measured.vehicle import robot_of

    log = read_log(LOGS / name)
    assert not read_clocks(log, robot_of(log)).differ
