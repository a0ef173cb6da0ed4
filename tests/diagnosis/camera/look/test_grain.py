"""Noise is told from the floor's texture where it can be, and is bounded where it cannot."""

import sys
from pathlib import Path

import numpy as np
import pytest

from proxytune.diagnosis.camera.look.grain import fit_grain

sys.path.append(str(Path(__file__).parent))
from photographs import drawn, floor, logged, measured, needs_measured, on_the_road, photographed, predicted, scene


@pytest.mark.slow
@pytest.mark.parametrize("noise", [2.0, 5.0])
def test_noise_on_a_plain_floor_is_told_outright(noise):
    """2 → 1.98, 5 → 4.94."""
    model, _ = scene()
    found = fit_grain(logged(model, noise=noise), model, floor()).noise
    assert found.identified
    assert found.value == pytest.approx(noise, rel=0.05)
    assert found.interval[0] <= noise <= found.interval[1]


def test_a_picture_without_noise_has_none():
    model, _ = scene()
    found = fit_grain(logged(model), model, floor()).noise
    assert found.value < 0.3


def test_texture_is_no_noise():
    model, seen = scene()
    found = fit_grain(logged(seen), model, floor()).noise
    assert not found.identified
    assert found.interval[0] == 0.0


def test_the_bound_holds_the_noise_on_a_textured_floor():
    model, seen = scene()
    for noise in (2.0, 5.0):
        assert fit_grain(logged(seen[:30], noise=noise), model[:30], floor()).noise.interval[1] >= noise


def test_standing_still_tells_noise_from_texture_whatever_the_exposure_does():
    poses = on_the_road(6)
    poses[1:4] = poses[0]
    seen = drawn(poses, picture=None), photographed(poses)
    still = seen[1].copy()
    still[1:4] = still[0]
    grain = fit_grain(logged(still, noise=2.0, drift=0.05), seen[0], floor())
    assert grain.still_pairs == 3
    assert grain.noise.identified
    assert grain.noise.value == pytest.approx(2.0, rel=0.05)


def test_the_same_frame_logged_twice_is_no_proof_of_a_camera_without_noise():
    model, seen = scene()
    twice = np.repeat(np.arange(10), 2)
    grain = fit_grain(logged(seen, noise=3.0)[twice], model[twice], floor())
    assert grain.still_pairs == 0
    assert grain.noise.interval[1] >= 3.0


def test_frames_without_floor_tell_nothing():
    sky = np.full((5, 120, 160, 3), 200.0, dtype=np.float32)
    sky += np.arange(5, dtype=np.float32)[:, None, None, None]
    found = fit_grain(logged(sky, noise=3.0), sky, floor()).noise
    assert not found.identified
    assert found.interval == (0.0, np.inf)


@needs_measured
def test_photographs_without_noise_give_a_bound_of_a_grey_level():
    found = fit_grain(measured(), predicted(), floor()).noise
    assert not found.identified
    assert found.interval[1] < 1.3
