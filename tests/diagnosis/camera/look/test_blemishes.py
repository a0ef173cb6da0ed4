"""Dirt and a bumper are found where they are; a floor's own texture, lights and tape are no blemishes."""

import functools
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from proxytune.diagnosis.camera.look.blemishes import find_blemishes
from proxytune.diagnosis.camera.look.light import fit_light
from proxytune.driving.road.texture import Floor

sys.path.append(str(Path(__file__).parent))
from photographs import drawn, floor, logged, measured, needs_measured, on_the_road, predicted, scene, textured


def blemishes(frames, model):
    return find_blemishes(frames, model, floor(), fit_light(frames, model, floor()))


def dirty(pictures, row, column, diameter=12.0, opacity=0.5, colour=(60.0, 50.0, 40.0)):
    rows, columns = np.mgrid[:120, :160]
    cover = opacity * (np.hypot(rows - row, columns - column) < diameter / 2.0)[..., None]
    return pictures * (1.0 - cover) + cover * np.array(colour)


@pytest.mark.parametrize(
    ("row", "column"), [(70, 40), *(pytest.param(*place, marks=pytest.mark.slow) for place in ((95, 120), (85, 80)))]
)
def test_dirt_is_found_where_it_is(row, column):
    model, seen = scene()
    (spot,) = blemishes(logged(dirty(seen, row, column), noise=2.0), model)
    assert spot.rows[0] <= row <= spot.rows[1]
    assert spot.columns[0] <= column <= spot.columns[1]
    assert max(np.ptp(spot.rows), np.ptp(spot.columns)) <= 16
    assert spot.contrast == pytest.approx(0.55, abs=0.12)
    assert 0.001 < spot.share < 0.02


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


def test_the_largest_blemish_comes_first():
    model, seen = scene()
    spots = dirty(dirty(seen, 75, 40, diameter=12.0), 95, 110, diameter=26.0)
    first, second = blemishes(logged(spots), model)
    assert first.share > second.share
    assert first.columns[0] > 80 > second.columns[1]


@pytest.mark.parametrize("light", [(1.0, 1.0, 0.0), (0.8, 1.3, 0.3)])
def test_a_clean_camera_has_no_blemishes_whatever_its_light(light):
    model, seen = scene()
    assert blemishes(logged(seen, *light, drift=0.1, noise=3.0), model) == ()


@functools.cache
def unevenly_lit():
    """The textured floor under lamps: brightness changes by 15 % over half a metre."""
    plain = textured()
    lamps = gaussian_filter(np.random.default_rng(3).normal(size=(len(plain.pixels) // 8,) * 2), 25.0)
    lamps = np.kron(1.0 + 0.15 * lamps / lamps.std(), np.ones((8, 8)))
    pixels = np.clip(plain.pixels * lamps[..., None], 0, 255).astype(np.uint8)
    return Floor(pixels, plain.pixels_per_metre, plain.origin)


def test_lamps_over_the_floor_are_not_fixed_to_the_camera():
    model, _ = scene()
    assert blemishes(logged(drawn(on_the_road(), unevenly_lit()), noise=2.0), model) == ()


def test_frames_without_markings_cannot_be_judged():
    sky = np.full((40, 120, 160, 3), 200.0, dtype=np.float32)
    assert blemishes(logged(sky, noise=2.0), sky) == ()


@needs_measured
def test_measured_frames_of_the_nominal_camera_have_no_blemish():
    assert blemishes(measured(), predicted()) == ()


@needs_measured
def test_dirt_and_a_bumper_before_measured_frames_are_found():
    hidden = dirty(measured().astype(float), 85, 60, diameter=14.0)
    hidden[:, 110:] = (30.0, 30.0, 35.0)
    bumper, spot = blemishes(logged(hidden), predicted())
    assert bumper.rows[1] == 119
    assert spot.columns[0] <= 60 <= spot.columns[1]
