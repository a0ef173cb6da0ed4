"""Motors that rise slowly and tire under load."""

import numpy as np
import pytest

from proxytune.effects import Setting
from proxytune.effects.motors.load import SlewRate, ThermalFade

RATE_HZ = 60.0


def run(effect, signal, rest=(0.0, 0.0)):
    memory = effect.begin(Setting(RATE_HZ, np.array(rest), {}))
    return effect.apply(np.asarray(signal, dtype=float), memory)[0]


def test_a_full_duty_is_reached_after_the_rise_time_and_not_before():
    risen = run(SlewRate(0.5), np.ones((60, 2)))
    np.testing.assert_allclose(risen[:30, 0], np.arange(1, 31) / 30.0)
    np.testing.assert_array_equal(risen[30:], 1.0)


def test_a_small_change_passes_at_once():
    np.testing.assert_array_equal(run(SlewRate(0.5), [[0.03, -0.03]]), [[0.03, -0.03]])


def test_a_robot_that_moves_already_starts_from_there():
    np.testing.assert_allclose(run(SlewRate(1.0), [[1.0, 1.0]], rest=(0.5, -0.5)), [[0.5 + 1 / 60, -0.5 + 1 / 60]])


def test_after_long_work_at_full_duty_the_whole_loss_is_felt():
    tired = run(ThermalFade(0.3, 2.0), np.tile((1.0, -1.0), (60 * 20, 1)))
    np.testing.assert_allclose(tired[-1], (0.7, -0.7), atol=1e-3)
    assert tired[0, 0] == pytest.approx(1.0, abs=0.01)


def test_a_motor_that_rests_recovers():
    work, rest = np.ones((600, 2)), np.zeros((600, 2))
    tired = run(ThermalFade(0.4, 2.0), np.concatenate((work, rest, work)))
    assert tired[599, 0] == pytest.approx(0.6, abs=0.01)
    assert tired[1200, 0] > 0.99
