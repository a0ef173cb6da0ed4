"""A wheel that is not round rolls faster and slower once a turn."""

import numpy as np
import pytest

from proxytune.effects import Setting
from proxytune.effects.motors.ripple import WheelRipple

RATE_HZ, RADIUS, BASELINE = 600.0, 0.03, 0.16
NOMINAL = {"wheel_radius": RADIUS, "effective_baseline": BASELINE}


def wheels(effect, forward, samples, angles=((0.0, 0.0),)):
    """Speeds of the left and the right wheel over a straight drive."""
    setting = Setting(RATE_HZ, np.zeros(3), NOMINAL, angles=np.array(angles))
    moved = effect.apply(np.tile((forward, 0.0, 0.0), (samples, 1)), effect.begin(setting))[0]
    turn = moved[:, 2] * BASELINE / 2.0
    return np.stack((moved[:, 0] - turn, moved[:, 0] + turn), axis=-1)


def test_one_wheel_ripples_by_its_angle_and_the_other_rolls_on():
    left, right = wheels(WheelRipple(0.2, 0.1, 0.0, 0.0), 0.3, 600).T
    angle = (np.arange(600) + 0.5) * 0.3 / RADIUS / RATE_HZ
    np.testing.assert_allclose(left, 0.3 * (1.0 + 0.2 * np.sin(angle) + 0.1 * np.cos(angle)))
    np.testing.assert_allclose(right, 0.3)


def test_a_whole_turn_of_the_wheel_rolls_as_far_as_a_round_one():
    turn = round(2.0 * np.pi * RADIUS / 0.3 * RATE_HZ)
    rolled = wheels(WheelRipple(0.0, 0.0, 0.3, 0.2), 0.3, turn)[:, 1].sum() / RATE_HZ
    assert rolled == pytest.approx(2.0 * np.pi * RADIUS, rel=0.005)


def test_angles_known_beforehand_say_where_the_wheel_is():
    ahead = wheels(WheelRipple(0.2, 0.0, 0.2, 0.0), 1e-9, 1, angles=((np.pi / 2, -np.pi / 2),))[0] / 1e-9
    np.testing.assert_allclose(ahead, (1.2, 0.8), atol=1e-6)
