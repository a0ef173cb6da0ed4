"""What `diagnose` says of real robots, where their logs are at hand."""

from pathlib import Path

import pytest

from proxytune.diagnosis.diagnose import declared_effects, diagnose
from proxytune.diagnosis.vehicle import robot_of
from proxytune.logs import read_log

LOGS = Path(__file__).resolve().parents[2] / "../shared/data/logs"

pytestmark = pytest.mark.slow


def diagnosed(name):
    folder = LOGS / name
    if not folder.is_dir():
        pytest.skip(f"the measured log {name} is not here: it is not part of the project")
    log = read_log(folder)
    robot = robot_of(log)
    return diagnose(log, robot, declared_effects(robot))


def error(diagnosis, horizon_s):
    return next(error for error in diagnosis.errors if error.horizon_s == horizon_s)


@pytest.fixture(scope="module")
def create():
    return diagnosed("mrclam6_robot2")


@pytest.fixture(scope="module")
def husky():
    return diagnosed("drive_husky")


def named(diagnosis):
    return [effect.effect for effect in diagnosis.effects]


def test_a_create_loses_speed_in_turns(create):
    assert "turn_slip" in named(create)
    assert create.theta["turn_slip"].value > 0.0


def test_a_create_is_late_by_lag_or_delay_which_its_drives_cannot_tell_apart_or_needs_both(create):
    said = set(named(create))
    rivals = {frozenset((effect.effect, rival.effect)) for effect in create.effects for rival in effect.rivals}
    assert {"motor_lag", "delay"} <= said or frozenset(("motor_lag", "delay")) in rivals


def test_a_creates_wheels_are_alike(create):
    assert not {"trim", "wheel_gain"} & set(named(create))
    assert not any("wheel" in effect.form for effect in create.effects)


def test_a_creates_error_falls_on_the_unseen_half(create):
    five = error(create, 5.0)
    assert five.ratio.value < 0.7
    assert five.ratio.interval[1] < 0.8
    assert 0.02 < five.before.value < 0.045


def test_a_husky_is_predicted_far_better_by_its_limit_and_what_else_it_lacks(husky):
    two = error(husky, 2.0)
    assert two.before.value > 0.4
    assert two.after.value < 0.23
    assert "saturation" in named(husky)


def test_what_is_left_of_a_husky_is_called_unexplained(husky):
    assert husky.verdict == "partly explained"
    assert husky.residual_depends_on
