"""Saturation and battery sag against what they should do by hand."""

import numpy as np
import pytest

from proxytune.effects import Setting
from proxytune.effects.motors.power import BatterySag, Saturation


def run(effect, signal, rate_hz=10.0):
    memory = effect.begin(Setting(rate_hz, np.zeros(2), {}))
    return effect.apply(np.asarray(signal, dtype=float), memory)[0]


@pytest.mark.parametrize(
    ("limit", "imbalance", "left", "right"),
    [(0.6, 0.0, 0.6, 0.6), (0.6, -1.0, 0.2, 1.0), (0.6, 0.5, 0.8, 0.4), (0.2, 1.0, 1.0, 0.05)],
)
def test_saturation_shares_the_lost_part_and_leaves_a_twentieth(limit, imbalance, left, right):
    clipped = run(Saturation(limit, imbalance), [[1.0, 1.0], [-1.0, -1.0], [0.03, -0.04]])
    np.testing.assert_allclose(clipped, [[left, right], [-left, -right], [0.03, -0.04]])


def test_a_loaded_battery_slows_both_wheels_by_one_factor():
    np.testing.assert_allclose(run(BatterySag(0.2, 0.0, 0.0), [[1.0, -0.5]]), [[0.85, -0.425]])


def test_a_used_battery_fades_with_what_was_driven():
    faded = run(BatterySag(0.0, 0.5, 0.0), np.full((1200, 2), (0.3, -0.5)))  # two minutes at 0.4 in the mean
    np.testing.assert_allclose(faded[-1], np.array((0.3, -0.5)) * np.exp(-0.5 * 0.4 * 2.0), rtol=1e-3)
    np.testing.assert_allclose(faded[0], (0.3, -0.5), rtol=1e-3)


def test_fading_does_not_depend_on_the_sample_rate():
    coarse = run(BatterySag(0.0, 1.0, 0.0), np.full((600, 2), 0.8), rate_hz=10.0)
    fine = run(BatterySag(0.0, 1.0, 0.0), np.full((6000, 2), 0.8), rate_hz=100.0)
    np.testing.assert_allclose(coarse, fine.reshape(600, 10, 2).mean(axis=1), rtol=1e-6)


def test_a_battery_never_turns_wheels_the_other_way():
    np.testing.assert_array_equal(run(BatterySag(0.8, 0.0, 0.0), [[2.0, 2.0]]), [[0.0, 0.0]])
