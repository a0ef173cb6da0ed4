"""Motors that rise slowly and tire under load.

Saturation and battery sag against what they should do by hand.
"""

import numpy as np
import pytest
from filtered import filtered

from proxytune.effects.motors import BatterySag, Saturation, SlewRate, ThermalFade

RATE_HZ = 10.0


def test_a_duty_rises_at_its_rate_from_where_it_is():
    risen = filtered(SlewRate(0.5), np.ones((60, 2)))
    np.testing.assert_allclose(risen[:30, 0], np.arange(1, 31) / 30.0)
    np.testing.assert_array_equal(risen[30:], 1.0)
    np.testing.assert_array_equal(filtered(SlewRate(0.5), [[0.03, -0.03]]), [[0.03, -0.03]])
    np.testing.assert_allclose(filtered(SlewRate(1.0), [[1.0, 1.0]], rest=(0.5, -0.5)), [[0.5 + 1 / 60, -0.5 + 1 / 60]])


def test_a_motor_loses_by_long_work_and_recovers_at_rest():
    tired = filtered(ThermalFade(0.3, 2.0), np.tile((1.0, -1.0), (60 * 20, 1)))
    np.testing.assert_allclose(tired[-1], (0.7, -0.7), atol=1e-3)
    assert tired[0, 0] == pytest.approx(1.0, abs=0.01)
    work, rest = np.ones((600, 2)), np.zeros((600, 2))
    tired = filtered(ThermalFade(0.4, 2.0), np.concatenate((work, rest, work)))
    assert tired[599, 0] == pytest.approx(0.6, abs=0.01)
    assert tired[1200, 0] > 0.99


@pytest.mark.parametrize(
    ("limit", "imbalance", "left", "right"),
    [(0.6, 0.0, 0.6, 0.6), (0.6, -1.0, 0.2, 1.0), (0.6, 0.5, 0.8, 0.4), (0.2, 1.0, 1.0, 0.05)],
)
def test_saturation_shares_the_lost_part_and_leaves_a_twentieth(limit, imbalance, left, right):
    clipped = filtered(Saturation(limit, imbalance), [[1.0, 1.0], [-1.0, -1.0], [0.03, -0.04]], rate_hz=RATE_HZ)
    np.testing.assert_allclose(clipped, [[left, right], [-left, -right], [0.03, -0.04]])


def test_a_battery_slows_both_wheels_by_what_was_driven_and_turns_none_round():
    np.testing.assert_allclose(filtered(BatterySag(0.2, 0.0, 0.0), [[1.0, -0.5]], rate_hz=RATE_HZ), [[0.85, -0.425]])
    faded = filtered(BatterySag(0.0, 0.5, 0.0), np.full((1200, 2), (0.3, -0.5)), rate_hz=RATE_HZ)
    np.testing.assert_allclose(faded[-1], np.array((0.3, -0.5)) * np.exp(-0.5 * 0.4 * 2.0), rtol=1e-3)
    np.testing.assert_allclose(faded[0], (0.3, -0.5), rtol=1e-3)
    coarse = filtered(BatterySag(0.0, 1.0, 0.0), np.full((600, 2), 0.8), rate_hz=10.0)
    fine = filtered(BatterySag(0.0, 1.0, 0.0), np.full((6000, 2), 0.8), rate_hz=100.0)
    np.testing.assert_allclose(coarse, fine.reshape(600, 10, 2).mean(axis=1), rtol=1e-6)
    np.testing.assert_array_equal(filtered(BatterySag(0.8, 0.0, 0.0), [[2.0, 2.0]], rate_hz=RATE_HZ), [[0.0, 0.0]])
