"""How long after its command the motion comes is measured apart from how slow the motors are."""

import numpy as np
import pytest
from planted import drives_of, planted_log, with_poses

from proxytune.diagnosis.motion import latency
from proxytune.diagnosis.motion.latency import likeliest_latency, measured_speeds, reaction, reaction_at


def answered(theta, change=lambda poses: poses):
    drives = drives_of(with_poses(planted_log(theta, episodes=3, seconds=30.0), change))
    return reaction(drives, measured_speeds(drives), 1.0)


@pytest.mark.parametrize(("delay", "lag"), [(0.0, 0.0), (0.1, 0.05), (0.1, 0.3), (0.3, 0.6)])
def test_a_slow_motor_is_told_from_latency(delay, lag):
    found = answered({"delay": delay, "motor_lag.time_constant": lag})
    assert found.latency_s == pytest.approx(delay, abs=0.02)
    assert found.lags_s[0] == pytest.approx(lag, abs=0.02 + 0.05 * lag)


def test_latency_may_be_below_none_and_gains_are_what_the_robot_makes_of_commands():
    found = answered({"delay": 0.1}, lambda poses: np.concatenate((poses[5:], np.full((5, 3), np.nan))))
    assert found.latency_s == pytest.approx(0.1 - 0.25, abs=0.02)
    gains = answered({"wheel_gain.left": 0.9, "wheel_gain.right": 0.9}).gains
    np.testing.assert_allclose(np.diag(gains), 0.9, atol=0.02)
    drives = drives_of(planted_log({"delay": 0.2}, episodes=3, seconds=30.0))
    speeds = measured_speeds(drives)
    late, best = reaction_at(drives, speeds, 0.0), reaction(drives, speeds, 1.0)
    assert late.latency_s == 0.0
    assert late.squares.sum() > 1.5 * best.squares.sum()


def test_speeds_are_taken_within_unbroken_runs_of_poses():
    drives = drives_of(planted_log({}, episodes=2, seconds=10.0))
    speeds = measured_speeds(drives.only(np.arange(len(drives.first)) != 50))
    assert not ((speeds.first <= drives.first[50]) & (speeds.last >= drives.last[50]) & (speeds.episode == 0)).any()
    assert np.all(speeds.last > speeds.first)


def test_the_vertex_between_steps_is_found_where_there_is_one():
    latencies = np.arange(-10, 11) * 0.05
    found = likeliest_latency((latencies - np.array([0.11, 0.13, 0.12, 0.12])[:, None]) ** 2, latencies)
    assert found.value == pytest.approx(0.12)
    assert found.deviation == pytest.approx(np.sqrt((np.array([0.01, 0.01, 0, 0]) ** 2).sum()) / 4.0)
    assert likeliest_latency(np.ones((4, 9)), np.arange(9.0)).deviation == np.inf
    latencies = np.arange(-4, 5) * 0.5
    for end in (-2.0, 2.0, 7.0):
        assert likeliest_latency((latencies - end) ** 2 * np.ones((6, 1)), latencies).deviation == np.inf


def test_a_few_drives_at_a_time_give_the_same_latency_to_the_bit(monkeypatch):
    log = planted_log({"delay": 0.1, "motor_lag.time_constant": 0.3}, episodes=5, seconds=20.0)
    drives = drives_of(log)
    few = drives.only(drives.episode != 2)
    speeds, latencies = measured_speeds(few), np.arange(-10, 11) * 0.05

    def measured():
        best = reaction(few, speeds, 1.0)
        expected = latency.speeds_by_reaction(few, speeds, best, latencies)
        return best, latency.squares_by_latency(log, few, speeds, expected, 12, latencies).squares

    whole, squares = measured()
    monkeypatch.setattr(latency, "AT_ONCE", 2 * few.duties.shape[1])
    parts, again = measured()
    for one, other in zip((*whole, squares), (*parts, again), strict=True):
        assert np.array_equal(one, other)
