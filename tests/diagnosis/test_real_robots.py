"""What `diagnose` says of real robots, where their logs are at hand."""

from dataclasses import replace
from pathlib import Path

import pytest

from proxytune.diagnosis import robot_of
from proxytune.diagnosis.motion.diagnose import declared_effects, diagnose
from proxytune.logs import read_log

LOGS = Path(__file__).resolve().parents[2] / "../shared/data/logs"

pytestmark = pytest.mark.slow


def diagnosed(name, rows=None):
    """The diagnosis of the first rows of every drive."""
    folder = LOGS / name
    if not folder.is_dir():
        pytest.skip(f"the measured log {name} is not here: it is not part of the project")
    log = read_log(folder)
    kept = (replace(e, times=e.times[:rows], commands=e.commands[:rows], poses=e.poses[:rows]) for e in log.episodes)
    log = replace(log, episodes=tuple(kept))
    robot = robot_of(log)
    return diagnose(log, robot, declared_effects(robot))


def error(diagnosis, horizon_s):
    return next(error for error in diagnosis.errors if error.horizon_s == horizon_s)


def learnt(diagnosis, horizon_s):
    """The error with curves."""
    return next(error.after.value for error in diagnosis.learning.errors if error.horizon_s == horizon_s)


@pytest.fixture(scope="module")
def create():
    return diagnosed("mrclam6_robot2", rows=9000)


@pytest.fixture(scope="module")
def husky():
    return diagnosed("drive_husky")


def or_rivals(diagnosis):
    """The effects that were added, and those that the drives cannot tell from them."""
    return {name for effect in diagnosis.effects for name in (effect.effect, *(one.effect for one in effect.rivals))}


def test_a_create_loses_speed_in_turns_is_late_and_has_wheels_alike(create):
    assert "turn_slip" in or_rivals(create)
    assert {"motor_lag", "delay", "delay_jitter"} & or_rivals(create)
    assert not {"trim", "wheel_gain"} & {effect.effect for effect in create.effects}
    assert not any("wheel" in effect.form for effect in create.effects)
    five = error(create, 5.0)
    assert five.ratio.value < 0.7
    assert five.ratio.interval[1] < 0.85
    assert 0.02 < five.before.value < 0.045
    assert learnt(create, 5.0) < 0.55 * five.before.value


def test_a_husky_is_predicted_far_better_and_not_called_explained(husky):
    two = error(husky, 2.0)
    assert two.before.value > 0.4
    assert two.after.value < 0.25
    assert learnt(husky, 2.0) < 0.2
    assert husky.verdict in ("partly explained", "unexplained")
    assert husky.residual_depends_on
