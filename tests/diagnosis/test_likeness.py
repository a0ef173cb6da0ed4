"""Drives of two robots fall in two groups; drives of one do not, whatever it lacks."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))

import hidden
from planted import TRUTH, drives_of, fitted, planted_log

from proxytune.diagnosis.naming import likeness
from proxytune.diagnosis.naming.likeness import two_robots

SHORT = {"episodes": 6, "seconds": 20.0}


def mixed(theta, of=(1, 3, 4)):
    """A log some of whose drives are another robot's."""
    one, other = planted_log(TRUTH, **SHORT), planted_log({**TRUTH, **theta}, **SHORT)
    chosen = [(other if e in of else one).episodes[e] for e in range(6)]
    return replace(one, episodes=tuple(chosen))


CASES = {case.name: case for case in (*hidden.IN_FORM, *hidden.OTHER_FORM, *hidden.OUTSIDE)}


def unlike(log):
    drives = drives_of(log)
    return two_robots(drives, fitted(drives))


@pytest.mark.parametrize(("theta", "wheel"), [({"trim": -0.06}, None), ({"wheel_gain.left": 0.88}, "left")])
def test_drives_of_two_robots_are_told_apart_with_their_gains(theta, wheel):
    found = unlike(mixed(theta))
    assert found is not None
    assert set(found.groups) == {(0, 2, 5), (1, 3, 4)}
    assert wheel in (None, found.wheel)
    assert abs(found.gains[1] - found.gains[0]) > 0.06


@pytest.mark.parametrize("theta", [{}, {"motor_lag.time_constant": 0.3}])
def test_drives_of_one_robot_are_alike(theta):
    assert unlike(planted_log({**TRUTH, **theta}, **SHORT)) is None


@pytest.mark.parametrize(
    "name", ["dead_band width 0.12", "stiction breakaway 0.14", "dead_zone_that_jumps", "eccentric_wheel"]
)
def test_what_one_robot_lacks_does_not_make_two_of_it(name):
    assert unlike(hidden.make_log(CASES[name], episodes=8, seconds=40.0)) is None


def test_drives_on_two_floors_fall_in_two_groups_too():
    found = unlike(hidden.make_log(CASES["carpet"], episodes=8, seconds=40.0))
    assert sorted(found.gains) == pytest.approx([0.8, 1.0], abs=0.03)


def test_a_single_drive_of_another_kind_is_no_second_robot():
    assert unlike(mixed({"trim": -0.06}, of=(1,))) is None


def test_three_drives_are_too_few_to_tell():
    log = mixed({"trim": -0.06})
    assert unlike(replace(log, episodes=log.episodes[:3])) is None


def test_many_drives_are_looked_at_a_few_at_a_time_with_the_same_result(monkeypatch):
    drives = drives_of(mixed({"wheel_gain.left": 0.88}))
    model = fitted(drives)
    together = two_robots(drives, model)
    monkeypatch.setattr(likeness, "AT_ONCE", len(drives.episode) // 3)
    apart = two_robots(drives, model)
    assert apart.groups == together.groups
    assert apart.gains == pytest.approx(together.gains, rel=1e-9)
