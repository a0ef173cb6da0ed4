"""What lens and sensor do to each picture, against what it should be by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.effects import Setting
from proxytune.effects.sight.light import Defocus, Exposure, ImageNoise, Vignetting

ROWS, COLUMNS = 41, 61


def run(effect, pictures, seed=0, cuts=()):
    """Pictures (time, rows, columns, 3) through an effect, in one go or in chunks."""
    rows, columns = pictures.shape[1:3]
    signal = np.asarray(pictures, dtype=np.float32).reshape(len(pictures), -1)
    nominal = {"camera_rows": float(rows), "camera_columns": float(columns)}
    memory, chunks = effect.begin(Setting(60.0, signal[0], nominal, seed)), []
    for chunk in np.split(signal, cuts):
        answer, memory = effect.apply(chunk, memory)
        chunks.append(answer)
    return np.concatenate(chunks).reshape(pictures.shape)


def grey(level=100.0, count=1):
    return np.full((count, ROWS, COLUMNS, 3), level, dtype=np.float32)


@given(st.floats(0.0, 0.05))
@settings(max_examples=25, derandomize=True)
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


def test_two_defocused_lenses_are_one_whose_variance_is_the_sum():
    pictures = np.random.default_rng(0).uniform(0.0, 255.0, (2, ROWS, COLUMNS, 3))
    inside = np.s_[:, 12:-12, 12:-12]  # at the edges the picture goes on as it ends, each time anew
    twice = run(Defocus(0.008), run(Defocus(0.006), pictures))
    np.testing.assert_allclose(twice[inside], run(Defocus(0.010), pictures)[inside], atol=0.05)


def test_a_picture_of_one_colour_cannot_be_out_of_focus():
    np.testing.assert_allclose(run(Defocus(0.05), grey()), grey(), rtol=1e-6)


@given(st.floats(0.0, 0.9))
@settings(max_examples=25, derandomize=True)
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


def test_noise_does_not_depend_on_how_the_pictures_come_in():
    pictures = grey(count=9)
    whole = run(ImageNoise(3.0), pictures)
    np.testing.assert_array_equal(run(ImageNoise(3.0), pictures, cuts=(1, 2, 6)), whole)
    np.testing.assert_array_equal(run(ImageNoise(3.0), pictures[:5]), whole[:5])
