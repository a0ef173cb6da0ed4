"""What drives could not have shown: a full-speed limit in slow drives, say."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import TRUTH, driven_log, drives_of, fitted, planted_drives

from proxytune.diagnosis.naming.candidates import MOTION_EFFECTS
from proxytune.diagnosis.naming.visibility import invisible_effects

DECLARED = {"trim", "delay"}


def swinging(level, swing):
    times = np.arange(600) / 20.0
    turn = swing * np.sin(2.0 * np.pi * times / 5.0)
    duties = np.stack((level - turn, level + turn), axis=1)
    return fitted(drives_of(driven_log(TRUTH, np.tile(duties, (3, 1, 1)), np.zeros((3, 3)))))


@pytest.fixture(scope="module")
def slow():
    return invisible_effects(swinging(0.15, 0.03), DECLARED)


def test_slow_drives_cannot_show_saturation(slow):
    assert "saturation" in slow


def test_driving_below_the_limit_of_both_wheels_cannot_show_saturation():
    assert "saturation" in invisible_effects(swinging(0.3, 0.05), DECLARED)


def test_fast_drives_can():
    assert "saturation" not in invisible_effects(swinging(0.9, 0.1), DECLARED)


def test_straight_drives_cannot_show_what_turning_costs():
    assert "turn_slip" in invisible_effects(swinging(0.3, 0.0), DECLARED)


def test_rich_drives_show_nearly_everything():
    hidden = invisible_effects(fitted(planted_drives(TRUTH, episodes=6, seconds=30.0)), DECLARED)
    assert len(hidden) <= 3


def test_what_is_declared_or_adopted_is_not_told_as_unseen(slow):
    assert not DECLARED & set(slow)
    assert "saturation" not in invisible_effects(swinging(0.15, 0.03), {*DECLARED, "saturation"})


def test_unseen_effects_are_effects_of_motion_in_the_catalogues_order(slow):
    assert slow == tuple(name for name in MOTION_EFFECTS if name in slow)


def test_commands_that_never_change_cannot_show_their_loss():
    steady = fitted(drives_of(driven_log(TRUTH, np.full((3, 600, 2), 0.4), np.zeros((3, 3)))))
    assert {"dropped_commands", "delay_jitter"} <= set(invisible_effects(steady, DECLARED))
