"""From which instants a picture is made: ages of pictures and of their rows, against what they should be by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.effects import Setting
from proxytune.effects.chain import Chain
from proxytune.effects.sight.shutter import Blur, CameraLatency, RollingShutter

ROWS, COLUMNS, RATE_HZ = 6, 4, 10.0
NOMINAL = {"camera_rows": float(ROWS), "camera_columns": float(COLUMNS)}
RAMP = np.repeat(np.arange(40.0, dtype=np.float32)[:, None], ROWS * COLUMNS * 3, axis=1)
"""A scene that brightens by one grey level per picture, so that a brightness tells an age."""
SECONDS = st.floats(0.0, 0.5)


def run(effect, pictures):
    memory = effect.begin(Setting(RATE_HZ, pictures[0], NOMINAL))
    return effect.apply(pictures, memory)[0]


def ages(effect):
    """How old each pixel of a late picture of the ramp is [s], (rows, columns, 3)."""
    return ((RAMP[-1] - run(effect, RAMP)[-1]) / RATE_HZ).reshape(ROWS, COLUMNS, 3)


@given(SECONDS)
@settings(max_examples=25, derandomize=True)
def test_a_picture_is_as_old_as_the_latency(latency):
    np.testing.assert_allclose(ages(CameraLatency(latency)), latency, atol=1e-5)


@pytest.mark.parametrize(("latency", "expected"), [(0.0, [7, 0, 0]), (0.1, [0, 7, 0]), (0.125, [0, 5.25, 1.75])])
def test_a_latency_mixes_the_two_pictures_that_it_falls_between(latency, expected):
    flash = np.zeros((3, ROWS * COLUMNS * 3), dtype=np.float32)
    flash[0] = 7.0
    memory = CameraLatency(latency).begin(Setting(RATE_HZ, np.zeros(flash.shape[1]), NOMINAL))
    np.testing.assert_allclose(CameraLatency(latency).apply(flash, memory)[0][:, 5], expected, atol=1e-6)


@given(st.floats(0.0, 0.1))
@settings(max_examples=25, derandomize=True)
def test_rows_are_the_older_the_higher_they_are_and_the_picture_by_half_the_readout(readout):
    found = ages(RollingShutter(readout))
    expected = readout * (1.0 - (np.arange(ROWS) + 0.5) / ROWS)
    np.testing.assert_allclose(found, np.broadcast_to(expected[:, None, None], found.shape), atol=1e-5)
    assert found.mean() == pytest.approx(readout / 2.0, abs=1e-5)


def test_blur_looks_like_a_latency_of_half_of_it_and_a_latency_adds_to_that():
    np.testing.assert_allclose(ages(Blur(0.2)), 0.1, atol=1e-5)
    late = run(CameraLatency(0.13), run(Blur(0.2), RAMP))
    np.testing.assert_allclose(RAMP[-1] - late[-1], (0.1 + 0.13) * RATE_HZ, atol=1e-4)


@given(SECONDS, st.floats(0.0, 0.1), st.floats(0.0, 0.2))
@settings(max_examples=25, derandomize=True)
def test_it_does_not_matter_which_mixture_of_pictures_comes_first(latency, readout, blur):
    pictures = np.random.default_rng(3).uniform(0.0, 255.0, (20, ROWS * COLUMNS * 3)).astype(np.float32)
    one, other = pictures, pictures
    effects = Blur(blur), RollingShutter(readout), CameraLatency(latency)
    for forwards, backwards in zip(effects, reversed(effects), strict=True):
        one, other = run(forwards, one), run(backwards, other)
    np.testing.assert_allclose(one, other, atol=1e-3)


@pytest.mark.parametrize("effect", [CameraLatency(0.37), RollingShutter(0.1)])
def test_a_scene_that_stands_still_hides_the_shutter(effect):
    still = np.repeat(np.arange(ROWS * COLUMNS * 3, dtype=np.float32)[None], 12, axis=0)
    np.testing.assert_allclose(run(effect, still), still, atol=1e-4)


@given(st.floats(0.0, 0.9))
@settings(max_examples=60, derandomize=True)
def test_the_mean_of_the_last_pictures_is_the_newest_blurred_one_to_the_last_bit(blur):
    pictures = np.random.default_rng(0).integers(0, 256, (12, 12)).astype(np.float32)
    weights = Chain((Blur(blur),)).mean_weights(RATE_HZ)
    assert weights[0] > 0.0
    np.testing.assert_array_equal(weights @ pictures[-len(weights) :], run(Blur(blur), pictures)[-1])


@pytest.mark.parametrize(("blur", "expected"), [(0.0, 1), (0.1, 2), (0.15, 3), (0.3, 4)])
def test_a_mean_takes_no_picture_that_does_not_count(blur, expected):
    assert len(Chain((Blur(blur),)).mean_weights(RATE_HZ)) == expected


def test_blur_alone_is_a_mean_and_no_effect_at_all_the_mean_of_one_picture():
    assert Chain(()).mean_weights(RATE_HZ).tolist() == [1.0]
    for effects in ((CameraLatency(0.1),), (Blur(0.1), Blur(0.1)), (CameraLatency(0.1), Blur(0.1))):
        assert Chain(effects).mean_weights(RATE_HZ) is None
