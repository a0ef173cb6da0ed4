"""Dirt, a bumper, exposure and vignetting come out as they were put in; the floor's own look is no blemish."""

import functools

import numpy as np
import pytest
from photographs import drawn, floor, logged, measured, needs_measured, on_the_road, predicted, scene, textured
from scipy.ndimage import gaussian_filter

from proxytune.diagnosis.camera.light import PAINTS, find_blemishes, fit_light, flat_places
from proxytune.driving.road_picture import Floor


def blemishes(frames, model):
    return find_blemishes(frames, model, floor(), fit_light(frames, model, floor()))


def dirty(pictures, row, column, diameter=12.0, opacity=0.5, colour=(60.0, 50.0, 40.0)):
    rows, columns = np.mgrid[:120, :160]
    cover = opacity * (np.hypot(rows - row, columns - column) < diameter / 2.0)[..., None]
    return pictures * (1.0 - cover) + cover * np.array(colour)


@pytest.mark.parametrize(("row", "column"), [(70, 40), pytest.param(95, 120, marks=pytest.mark.slow)])
def test_dirt_is_found_where_it_is(row, column):
    model, seen = scene()
    (spot,) = blemishes(logged(dirty(seen, row, column), noise=2.0), model)
    assert spot.rows[0] <= row <= spot.rows[1]
    assert spot.columns[0] <= column <= spot.columns[1]
    assert max(np.ptp(spot.rows), np.ptp(spot.columns)) <= 16
    assert spot.contrast == pytest.approx(0.55, abs=0.12)
    assert 0.001 < spot.share < 0.02


@pytest.mark.slow
def test_a_bumper_leaves_no_contrast_where_markings_pass():
    """Its left part is not judged: few of these frames show a marking there."""
    model, seen = scene()
    hidden = seen.copy()
    hidden[:, 108:] = (30.0, 30.0, 35.0)
    bumper = blemishes(logged(hidden, noise=2.0), model)[0]
    assert bumper.contrast < 0.15
    assert 106 <= bumper.rows[0] <= 112
    assert bumper.rows[1] == 119
    assert bumper.columns[1] - bumper.columns[0] > 60
    assert 0.02 < bumper.share < 0.11


@pytest.mark.slow
def test_the_largest_blemish_comes_first_and_a_clean_camera_has_none_whatever_light_or_lamps():
    model, seen = scene()
    first, second = blemishes(logged(dirty(dirty(seen, 75, 40, diameter=12.0), 95, 110, diameter=26.0)), model)
    assert first.share > second.share
    assert first.columns[0] > 80 > second.columns[1]
    assert blemishes(logged(seen, 0.8, 1.3, 0.3, drift=0.1, noise=3.0), model) == ()
    assert blemishes(logged(drawn(on_the_road(), unevenly_lit()), noise=2.0), model) == ()


@functools.cache
def unevenly_lit():
    """The textured floor under lamps: brightness changes by 15 % over half a metre."""
    plain = textured()
    lamps = gaussian_filter(np.random.default_rng(3).normal(size=(len(plain.pixels) // 8,) * 2), 25.0)
    lamps = np.kron(1.0 + 0.15 * lamps / lamps.std(), np.ones((8, 8)))
    pixels = np.clip(plain.pixels * lamps[..., None], 0, 255).astype(np.uint8)
    return Floor(pixels, plain.pixels_per_metre, plain.origin)


def test_without_markings_or_floor_nothing_can_be_told():
    sky = np.full((40, 120, 160, 3), 200.0, dtype=np.float32)
    assert blemishes(logged(sky, noise=2.0), sky) == ()
    sky = np.full((5, 120, 160, 3), 200.0, dtype=np.float32)
    light = fit_light(logged(sky), sky, floor())
    assert (light.gain.value, light.gamma.value, light.vignetting.value) == (1.0, 1.0, 0.0)
    assert not any(figure.identified for figure in (light.gain, light.gamma, light.vignetting))


@pytest.mark.slow
@needs_measured
def test_dirt_and_a_bumper_before_measured_frames_are_found():
    hidden = dirty(measured().astype(float), 85, 60, diameter=14.0)
    hidden[:, 110:] = (30.0, 30.0, 35.0)
    bumper, spot = blemishes(logged(hidden), predicted())
    assert bumper.rows[1] == 119
    assert spot.columns[0] <= 60 <= spot.columns[1]


def inside(figure, truth):
    return figure.interval[0] <= truth <= figure.interval[1]


def test_exposure_and_vignetting_come_out_under_noise_and_drift():
    """0.8, 1.3, 0.3 with noise 5 and 10 % drift."""
    model, seen = scene()
    light = fit_light(logged(seen, 0.8, 1.3, 0.3, drift=0.1, noise=5.0), model, floor())
    assert light.gain.value == pytest.approx(0.8, abs=0.06)
    assert light.gamma.value == pytest.approx(1.3, abs=0.05)
    assert light.vignetting.value == pytest.approx(0.3, abs=0.03)
    assert all(figure.identified for figure in (light.gain, light.gamma, light.vignetting))
    assert inside(light.gamma, 1.3)
    assert inside(light.vignetting, 0.3)


@pytest.mark.slow
def test_a_camera_without_faults_comes_out_neutral():
    model, seen = scene()
    light = fit_light(logged(seen), model, floor(), fixed_exposure=True)
    assert light.gain.value == pytest.approx(1.0, abs=0.05)
    assert light.gamma.value == pytest.approx(1.0, abs=0.05)
    assert light.vignetting.value == pytest.approx(0.0, abs=0.03)
    np.testing.assert_array_equal(light.levels, 1.0)


def test_each_frame_has_a_level_where_exposure_is_automatic_and_one_paint_tells_neither_gain_nor_gamma():
    model, seen = scene()
    seen = seen[:30].copy()
    half = fit_light(np.concatenate((logged(seen[:15]), logged(seen[15:], 0.5))), model[:30], floor())
    assert half.levels[:15].mean() / half.levels[15:].mean() == pytest.approx(2.0, rel=0.05)
    assert np.log(half.levels).mean() == pytest.approx(0.0, abs=1e-6)
    plain = np.tile(PAINTS[0].astype(np.float32), (20, 120, 160, 1))
    light = fit_light(logged(plain, vignetting=0.4, noise=2.0), plain, floor())
    assert not light.gain.identified
    assert not light.gamma.identified
    assert light.vignetting.value == pytest.approx(0.4, abs=0.03)


@pytest.mark.slow
def test_unknown_paint_leaves_exposure_open_but_not_vignetting():
    model, seen = scene()
    near = np.abs(seen[..., None, :] - PAINTS.astype(np.float32)).sum(axis=-1).argmin(axis=-1)
    repainted = seen * np.array([1.1, 0.9, 0.75], dtype=np.float32)[near][..., None]
    light = fit_light(logged(repainted, vignetting=0.3, noise=2.0), model, floor())
    assert not light.gamma.identified
    assert not light.gain.identified
    assert light.vignetting.identified
    assert inside(light.vignetting, 0.3)


def test_shining_the_fitted_light_gives_the_logged_brightness_on_flat_places_away_from_edges():
    model, seen = scene()
    model, frames = model[:40], logged(seen[:40], 0.8, 1.3, 0.3, drift=0.1)
    flat = flat_places(model, floor()) >= 0
    assert abs((fit_light(frames, model, floor()).shine(model) - frames)[flat].mean()) < 2.0
    assert abs((model - frames)[flat].mean()) > 15.0
    model, _ = scene()
    flat = flat_places(model[:5], floor()) >= 0
    frame, row, column = np.nonzero(flat[:, 3:-3, 3:-3])
    assert frame.size > 1000
    for down, right in ((0, 0), (6, 0), (0, 6), (6, 6)):
        np.testing.assert_allclose(model[frame, row + down, column + right], model[frame, row + 3, column + 3], atol=4)
        assert floor()[row + down, column + right].all()
