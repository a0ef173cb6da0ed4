"""Noise is told from the floor's texture, motion blur from defocus, and each comes out as it was put in."""

import functools

import numpy as np
import pytest
from photographs import drawn, floor, logged, measured, needs_measured, on_the_road, photographed, predicted, scene
from scipy.ndimage import gaussian_filter

from proxytune.diagnosis.camera.appearance import MovingEdges, fit_grain, fit_sharpness


@pytest.mark.slow
@pytest.mark.parametrize("noise", [2.0, 5.0])
def test_noise_on_a_plain_floor_is_told_outright(noise):
    """2 → 1.98, 5 → 4.94."""
    model, _ = scene()
    found = fit_grain(logged(model, noise=noise), model, floor()).noise
    assert found.identified
    assert found.value == pytest.approx(noise, rel=0.05)
    assert found.interval[0] <= noise <= found.interval[1]


@pytest.mark.slow
def test_a_picture_without_noise_has_none_and_texture_is_none_whose_bound_holds_the_noise_on_it():
    model, seen = scene()
    assert fit_grain(logged(model), model, floor()).noise.value < 0.3
    found = fit_grain(logged(seen), model, floor()).noise
    assert (found.identified, found.interval[0]) == (False, 0.0)
    for noise in (2.0, 5.0):
        assert fit_grain(logged(seen[:30], noise=noise), model[:30], floor()).noise.interval[1] >= noise


def test_noise_is_told_from_texture_only_where_frames_are_another_each():
    poses = on_the_road(6)
    poses[1:4] = poses[0]
    seen = drawn(poses, picture=None), photographed(poses)
    still = seen[1].copy()
    still[1:4] = still[0]
    grain = fit_grain(logged(still, noise=2.0, drift=0.05), seen[0], floor())
    assert grain.still_pairs == 3
    assert grain.noise.identified
    assert grain.noise.value == pytest.approx(2.0, rel=0.05)

    model, seen = scene()
    twice = np.repeat(np.arange(10), 2)
    grain = fit_grain(logged(seen, noise=3.0)[twice], model[twice], floor())
    assert grain.still_pairs == 0
    assert grain.noise.interval[1] >= 3.0

    sky = np.full((5, 120, 160, 3), 200.0, dtype=np.float32)
    sky += np.arange(5, dtype=np.float32)[:, None, None, None]
    found = fit_grain(logged(sky, noise=3.0), sky, floor()).noise
    assert not found.identified
    assert found.interval == (0.0, np.inf)


@pytest.mark.slow
@needs_measured
def test_photographs_without_noise_give_a_bound_of_a_grey_level():
    found = fit_grain(measured(), predicted(), floor()).noise
    assert not found.identified
    assert found.interval[1] < 1.3


COUNT = 40
SPEEDS = np.random.default_rng(0).permutation(np.linspace(-120.0, 120.0, COUNT))  # pixel/s, one of each bar
ROWS, COLUMNS = 60, 80
HALF_A_PIXEL = 0.5 / ROWS


def bars(blur_s=0.0, defocus=0.0, shift=0.0, still=False):
    """A bright bar, 30 pixels wide, that crosses each picture at its own speed, as the mean over the exposure."""
    places = np.arange(COLUMNS) + 0.5
    speed = np.zeros(COUNT) if still else SPEEDS
    times = blur_s * ((np.arange(41) + 0.5) / 41 - 0.5)
    left = 25.0 + shift + speed[:, None, None] * times[:, None]
    cover = np.clip(places - left + 0.5, 0, 1) - np.clip(places - left - 30.0 + 0.5, 0, 1)
    line = gaussian_filter(60.0 + 140.0 * cover.mean(axis=1), (0, defocus * ROWS), mode="nearest")
    return np.broadcast_to(line[:, None, :, None], (COUNT, ROWS, COLUMNS, 3)).astype(np.float32)


def edges(still=False):
    """Points on both edges of the bars; the picture brightens towards the bar's middle."""
    frame = np.repeat(np.arange(COUNT), 20)
    side = np.tile([0, 1], COUNT * 10)
    place = np.stack((np.where(side, 55.0, 25.0), np.tile(np.arange(20) * 2.0 + 10.5, COUNT)), axis=-1)
    normal = np.stack((np.where(side, -1.0, 1.0), np.zeros(len(frame))), axis=-1)
    speed = np.zeros(len(frame)) if still else SPEEDS[frame] * normal[:, 0]
    return MovingEdges(frame, place, normal, speed)


def seen(*figures, seed=0, **more):
    noise = np.random.default_rng(seed).normal(0.0, 3.0, (COUNT, ROWS, COLUMNS, 3))
    return np.clip(np.rint(bars(*figures, **more) + noise), 0, 255).astype(np.uint8)


@pytest.mark.parametrize(("blur", "defocus"), [(0.0, 0.0), (0.08, 0.0), (0.0, 0.02), (0.06, 0.02)])
def test_blur_and_defocus_come_out(blur, defocus):
    fitted = fit_sharpness(seen(blur, defocus), edges(), bars)
    assert fitted.blur.value == pytest.approx(blur, abs=0.01)
    assert fitted.defocus.value == pytest.approx(defocus, abs=HALF_A_PIXEL)
    assert fitted.blur.identified
    assert fitted.defocus.identified


def test_blur_is_told_by_edges_in_motion_alone():
    fitted = fit_sharpness(seen(0.08, 0.02, still=True), edges(still=True), functools.partial(bars, still=True))
    assert not fitted.blur.identified
    assert fitted.blur.interval == (0.0, np.inf)
    assert fitted.defocus.value == pytest.approx(0.02, abs=HALF_A_PIXEL)
    fitted = fit_sharpness(seen(0.06, 0.0, shift=2.3), edges(), bars)
    assert fitted.blur.value == pytest.approx(0.06, abs=0.01)
    none = MovingEdges(np.zeros(0, dtype=int), np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0))
    fitted = fit_sharpness(seen(), none, bars)
    assert not fitted.blur.identified
    assert not fitted.defocus.identified


def test_intervals_hold_the_truth():
    """Of 95 % intervals of ten draws of the noise, two may miss."""
    fits = [fit_sharpness(seen(0.06, 0.02, seed=seed), edges(), bars) for seed in range(10)]
    assert sum(fit.blur.interval[0] <= 0.06 <= fit.blur.interval[1] for fit in fits) >= 8
    assert sum(fit.defocus.interval[0] <= 0.02 <= fit.defocus.interval[1] for fit in fits) >= 8
    assert all(np.ptp(fit.blur.interval) < 0.02 for fit in fits)
