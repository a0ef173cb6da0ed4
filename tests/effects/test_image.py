"""What lens and sensor do to each picture, and from which instants it is made, against what should be by hand."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from proxytune.effects import Blur, Chain, FilterContext, RollingShutter
from proxytune.effects.image import CameraLatency, Defocus, Exposure, ImageNoise, Vignetting

ROWS, COLUMNS = 41, 61


def run(effect, pictures, seed=0, cuts=()):
    """Pictures (time, rows, columns, 3) through an effect, in one go or in chunks."""
    rows, columns = pictures.shape[1:3]
    signal = np.asarray(pictures, dtype=np.float32).reshape(len(pictures), -1)
    nominal = {"camera_rows": float(rows), "camera_columns": float(columns)}
    memory, chunks = effect.begin(FilterContext(60.0, signal[0], nominal, seed)), []
    for chunk in np.split(signal, cuts):
        answer, memory = effect.apply(chunk, memory)
        chunks.append(answer)
    return np.concatenate(chunks).reshape(pictures.shape)


def grey(level=100.0, count=1):
    return np.full((count, ROWS, COLUMNS, 3), level, dtype=np.float32)


@given(st.floats(0.0, 0.05))
@settings(max_examples=25)
def test_a_point_out_of_focus_is_a_spot_of_the_deviation_however_small_and_as_bright(deviation):
    """As a share of the height, along rows and columns alike: 0.05 of 41 rows are 2 pixels, 0.005 a fifth of one."""
    point = np.zeros((1, ROWS, COLUMNS, 3), dtype=np.float32)
    point[0, 20, 30] = 200.0
    spot = run(Defocus(deviation), point)[0].astype(float)
    assert spot.sum() == pytest.approx(point.sum(), rel=1e-5)
    down, right, _ = np.meshgrid(np.arange(ROWS) - 20, np.arange(COLUMNS) - 30, range(3), indexing="ij")
    for way in (down, right):
        assert (spot * way**2).sum() / spot.sum() == pytest.approx((deviation * ROWS) ** 2, rel=5e-3, abs=1e-5)
        assert (spot * way).sum() / spot.sum() == pytest.approx(0.0, abs=1e-5)


def test_a_picture_of_one_colour_cannot_be_out_of_focus():
    np.testing.assert_allclose(run(Defocus(0.05), grey()), grey(), rtol=1e-6)


@given(st.floats(0.0, 0.9))
@settings(max_examples=25)
def test_corners_lose_the_strength_and_the_middle_nothing(strength):
    share = run(Vignetting(strength), grey())[0] / 100.0
    assert share[20, 30] == pytest.approx(1.0)
    assert share[0, 0] == pytest.approx(1.0 - strength * (20**2 + 30**2) / (20.5**2 + 30.5**2))
    assert share[0, 30] == pytest.approx(1.0 - strength * 20**2 / (20.5**2 + 30.5**2))
    np.testing.assert_allclose(share, share[::-1, ::-1], rtol=1e-6)


@pytest.mark.parametrize(("gain", "gamma"), [(2.0, 1.0), (1.0, 2.2), (0.5, 0.45), (4.0, 0.3)])
def test_brightness_follows_gain_and_gamma_and_is_not_clipped_yet(gain, gamma):
    levels = np.arange(0.0, 256.0, 5.0)
    pictures = np.repeat(levels, 3).reshape(1, 1, -1, 3)
    expected = 255.0 * gain * (levels / 255.0) ** gamma
    np.testing.assert_allclose(run(Exposure(gain, gamma), pictures)[0, 0, :, 1], expected, rtol=1e-6)


def test_noise_is_white_has_its_deviation_and_is_drawn_anew_for_every_picture_and_seed():
    noise = run(ImageNoise(5.0), grey(count=4)) - grey(count=4)
    assert noise.mean() == pytest.approx(0.0, abs=0.1)
    assert noise.std() == pytest.approx(5.0, rel=0.02)
    for axis in range(4):  # the picture before, the pixel above, the one to the left, and the colour before
        assert abs(np.corrcoef(noise.ravel(), np.roll(noise, 1, axis).ravel())[0, 1]) < 0.05
    other = run(ImageNoise(5.0), grey(count=4), seed=1) - grey(count=4)
    assert abs(np.corrcoef(noise.ravel(), other.ravel())[0, 1]) < 0.05


SHUTTER_ROWS, SHUTTER_COLUMNS, RATE_HZ = 6, 4, 10.0
NOMINAL = {"camera_rows": float(SHUTTER_ROWS), "camera_columns": float(SHUTTER_COLUMNS)}
RAMP = np.repeat(np.arange(40.0, dtype=np.float32)[:, None], SHUTTER_ROWS * SHUTTER_COLUMNS * 3, axis=1)
"""A scene that brightens by one grey level per picture, so that a brightness tells an age."""
SECONDS = st.floats(0.0, 0.5)


def shown(effect, pictures):
    return effect.apply(pictures, effect.begin(FilterContext(RATE_HZ, pictures[0], NOMINAL)))[0]


def ages(effect):
    """How old each pixel of a late picture of the ramp is [s], (rows, columns, 3)."""
    return ((RAMP[-1] - shown(effect, RAMP)[-1]) / RATE_HZ).reshape(SHUTTER_ROWS, SHUTTER_COLUMNS, 3)


@given(SECONDS)
@settings(max_examples=25)
def test_a_picture_is_as_old_as_the_latency(latency):
    np.testing.assert_allclose(ages(CameraLatency(latency)), latency, atol=1e-5)


@pytest.mark.parametrize(("latency", "expected"), [(0.0, [7, 0, 0]), (0.1, [0, 7, 0]), (0.125, [0, 5.25, 1.75])])
def test_a_latency_mixes_the_two_pictures_that_it_falls_between(latency, expected):
    flash = np.zeros((3, SHUTTER_ROWS * SHUTTER_COLUMNS * 3), dtype=np.float32)
    flash[0] = 7.0
    memory = CameraLatency(latency).begin(FilterContext(RATE_HZ, np.zeros(flash.shape[1]), NOMINAL))
    np.testing.assert_allclose(CameraLatency(latency).apply(flash, memory)[0][:, 5], expected, atol=1e-6)


@given(st.floats(0.0, 0.1))
@settings(max_examples=25)
def test_rows_are_the_older_the_higher_they_are_and_the_picture_by_half_the_readout(readout):
    found = ages(RollingShutter(readout))
    expected = readout * (1.0 - (np.arange(SHUTTER_ROWS) + 0.5) / SHUTTER_ROWS)
    np.testing.assert_allclose(found, np.broadcast_to(expected[:, None, None], found.shape), atol=1e-5)
    assert found.mean() == pytest.approx(readout / 2.0, abs=1e-5)


def test_blur_is_a_latency_of_half_of_it_and_alone_a_mean():
    np.testing.assert_allclose(ages(Blur(0.2)), 0.1, atol=1e-5)
    late = shown(CameraLatency(0.13), shown(Blur(0.2), RAMP))
    np.testing.assert_allclose(RAMP[-1] - late[-1], (0.1 + 0.13) * RATE_HZ, atol=1e-4)
    assert Chain(()).mean_weights(RATE_HZ).tolist() == [1.0]
    for effects in ((CameraLatency(0.1),), (Blur(0.1), Blur(0.1)), (CameraLatency(0.1), Blur(0.1))):
        assert Chain(effects).mean_weights(RATE_HZ) is None


@given(SECONDS, st.floats(0.0, 0.1), st.floats(0.0, 0.2))
@settings(max_examples=25)
def test_it_does_not_matter_which_mixture_of_pictures_comes_first(latency, readout, blur):
    pictures = np.random.default_rng(3).uniform(0.0, 255.0, (20, SHUTTER_ROWS * SHUTTER_COLUMNS * 3)).astype(np.float32)
    one, other = pictures, pictures
    effects = Blur(blur), RollingShutter(readout), CameraLatency(latency)
    for forwards, backwards in zip(effects, reversed(effects), strict=True):
        one, other = shown(forwards, one), shown(backwards, other)
    np.testing.assert_allclose(one, other, atol=1e-3)


@given(st.floats(0.0, 0.9))
@settings(max_examples=60)
def test_the_mean_of_the_last_pictures_is_the_newest_blurred_one_to_the_last_bit(blur):
    pictures = np.random.default_rng(0).integers(0, 256, (12, 12)).astype(np.float32)
    weights = Chain((Blur(blur),)).mean_weights(RATE_HZ)
    assert weights[0] > 0.0
    np.testing.assert_array_equal(weights @ pictures[-len(weights) :], shown(Blur(blur), pictures)[-1])


@pytest.mark.parametrize(("blur", "expected"), [(0.0, 1), (0.1, 2), (0.15, 3), (0.3, 4)])
def test_a_mean_takes_no_picture_that_does_not_count(blur, expected):
    assert len(Chain((Blur(blur),)).mean_weights(RATE_HZ)) == expected
