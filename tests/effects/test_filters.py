"""Each filter against what it should do by hand."""

import numpy as np
import pytest

from proxytune.effects import Setting
from proxytune.effects.command import CommandQuantisation, Delay
from proxytune.effects.motors.actuation import DriverMap, MotorLag, Trim, WheelGain
from proxytune.effects.motors.wheels import per_wheel
from proxytune.effects.sight.shutter import Blur

NOMINAL: dict[str, float] = {}


def run(effect, signal, rest=0.0, rate_hz=10.0):
    signal = np.asarray(signal, dtype=float)
    memory = effect.begin(Setting(rate_hz, np.full(signal.shape[-1], rest), NOMINAL))
    return effect.apply(signal, memory)[0]


def step(length=20):
    return np.ones((length, 2))


@pytest.mark.parametrize(("seconds", "expected"), [(0.0, [1, 1, 1]), (0.1, [0, 1, 1]), (0.25, [0, 0, 0.5])])
def test_delay_is_exact_for_whole_samples_and_splits_one_between_them(seconds, expected):
    np.testing.assert_allclose(run(Delay(seconds), step(3))[:, 0], expected, atol=1e-12)


def test_delay_is_continuous_in_its_value():
    signal = np.random.default_rng(0).uniform(-1, 1, (50, 2))
    values = np.linspace(0.0, 0.3, 301)
    outputs = np.array([run(Delay(value), signal) for value in values])
    assert np.abs(np.diff(outputs, axis=0)).max() < 2 * 0.001 * 10.0 + 1e-9


def test_a_delayed_command_keeps_its_integral():
    signal = np.zeros((30, 2))
    signal[3:9] = 0.7
    np.testing.assert_allclose(run(Delay(0.137), signal).sum(axis=0), signal.sum(axis=0))


def test_trim_speeds_up_the_right_wheel():
    np.testing.assert_allclose(run(Trim(0.1), step(1)), [[0.9, 1.1]])


def test_wheel_gain_scales_each_wheel():
    np.testing.assert_allclose(run(WheelGain(0.8, 1.2), step(1)), [[0.8, 1.2]])


def test_driver_map_jumps_by_its_offset_and_is_odd():
    duty = np.array([[0.0, 0.005], [0.01, 1.0], [-0.5, 0.5]])
    offset = 60 / 255
    low, half = offset + 0.01 * (1 - offset), offset + 0.5 * (1 - offset)
    expected = [[0.0, 0.0], [low, 1.0], [-half, half]]
    np.testing.assert_allclose(run(DriverMap(offset), duty), expected)


def test_motor_lag_gives_the_mean_of_the_exact_step_response():
    time_constant, rate_hz = 0.2, 10.0
    edges = np.arange(21) / rate_hz
    travelled = edges + time_constant * np.exp(-edges / time_constant)  # integral of 1 - exp(-t/tau), plus a constant
    np.testing.assert_allclose(
        run(MotorLag(time_constant, 0.0), step())[:, 0], np.diff(travelled) * rate_hz, atol=1e-12
    )


def test_motor_lag_does_not_depend_on_the_sample_rate():
    coarse = run(MotorLag(0.2, 0.0), step(20), rate_hz=10.0).cumsum(axis=0)[-1] / 10.0
    fine = run(MotorLag(0.2, 0.0), step(200), rate_hz=100.0).cumsum(axis=0)[-1] / 100.0
    np.testing.assert_allclose(coarse, fine, atol=1e-12)


def test_an_imbalance_lags_each_wheel_by_its_share():
    uneven = run(MotorLag(0.2, -0.5), step())
    np.testing.assert_allclose(uneven[:, 0], run(MotorLag(0.3, 0.0), step())[:, 0], atol=1e-12)
    np.testing.assert_allclose(uneven[:, 1], run(MotorLag(0.1, 0.0), step())[:, 1], atol=1e-12)


@pytest.mark.parametrize(("value", "imbalance", "expected"), [(0.2, 0, (0.2, 0.2)), (0.2, 0.25, (0.15, 0.25))])
def test_an_imbalance_gives_the_right_wheel_more(value, imbalance, expected):
    np.testing.assert_allclose(per_wheel(value, imbalance), expected)


def test_commands_are_rounded_to_multiples_of_the_step():
    duties = np.array([[0.0, 0.09], [0.11, 0.31], [-0.34, 1.0]])
    expected = [[0.0, 0.0], [0.2, 0.4], [-0.4, 1.0]]
    np.testing.assert_allclose(run(CommandQuantisation(0.2), duties), expected)


@pytest.mark.parametrize("samples", [0.4, 1.0, 2.0, 2.7, 5.3])
def test_blur_is_the_mean_of_a_scene_that_changes_linearly(samples):
    ramp = np.arange(30.0)[:, None] * np.ones(3)
    blurred = run(Blur(samples / 10.0), ramp)
    np.testing.assert_allclose(blurred[10:], ramp[10:] - samples / 2.0, atol=1e-4)


@pytest.mark.parametrize("samples", [0.3, 1.0, 2.718, 6.0, 11.9])
def test_blur_adds_8_bit_pictures_exactly_in_any_order(samples):
    pictures = np.random.default_rng(2).integers(0, 256, (20, 50)).astype(np.float32)
    effect = Blur(samples / 10.0)
    memory = effect.begin(Setting(10.0, pictures[0], NOMINAL))
    weights = memory.weights.astype(np.float64)
    assert weights.sum() == 1.0
    exact = [weights @ pictures[row - len(weights) + 1 : row + 1].astype(np.float64) for row in range(13, 20)]
    np.testing.assert_array_equal(effect.apply(pictures, memory)[0][13:], exact)


def test_blur_is_continuous_in_its_value():
    scene = np.random.default_rng(1).uniform(0, 255, (20, 4))
    outputs = np.array([run(Blur(value), scene)[10:] for value in np.linspace(0.01, 0.4, 800)])
    assert np.abs(np.diff(outputs, axis=0)).max() < 15.0


def test_blur_of_a_still_scene_changes_nothing():
    still = np.full((10, 6), 120.0)
    np.testing.assert_allclose(run(Blur(0.33), still, rest=120.0), still, atol=1e-3)
