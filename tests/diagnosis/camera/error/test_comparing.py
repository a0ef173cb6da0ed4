"""Before and after are compared on the same unseen frames, in pixels and in grey levels."""

import functools
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1]))
from pictured import lane_poses, pictures
from viewed import everything

from proxytune.diagnosis.camera.error import weighing
from proxytune.diagnosis.camera.error.comparing import compare_brightness
from proxytune.diagnosis.camera.error.unseen import FOLDS
from proxytune.diagnosis.camera.gathering import Gathered
from proxytune.diagnosis.camera.naming.search import name_camera_effects

ROLLED = {"camera_roll": 4.0}
COUNT = 30


@functools.cache
def named():
    return name_camera_effects(everything(ROLLED, count=COUNT), ("camera_pitch",))


def gathered(shown, fixed=True):
    return Gathered(named().full.views, np.arange(COUNT), shown, SimpleNamespace(fixed_exposure=fixed), ())


@functools.cache
def weighed():
    return weighing.weigh_effects(named(), 1)


@functools.cache
def shown():
    return pictures(ROLLED, lane_poses(COUNT))


@pytest.mark.slow
def test_the_added_effect_lowers_the_displacement_to_about_the_floor():
    pixels, ratios = weighed().pixels, weighed().ratios
    assert pixels.unit == "px"
    assert pixels.after.value < 0.5 * pixels.before.value
    assert pixels.floor.value <= pixels.after.value
    assert pixels.floor.value > 0.5 * pixels.after.value
    assert set(ratios) == {"camera_roll"}
    assert ratios["camera_roll"] > 2.0


@pytest.mark.slow
def test_intervals_hold_their_values_and_one_seed_gives_one_result():
    pixels = weighed().pixels
    for error in (pixels.before, pixels.after, pixels.floor):
        assert error.interval[0] < error.value < error.interval[1]
    again, other = (weighing.weigh_effects(named(), seed) for seed in (1, 2))
    assert again.pixels.after.interval == pixels.after.interval
    assert other.pixels.after.interval != pixels.after.interval
    assert again.ratios == weighed().ratios
    assert other.pixels.after.value == pixels.after.value


@pytest.mark.slow
def test_without_what_does_not_matter_the_model_is_as_if_it_had_not_been_named(monkeypatch):
    monkeypatch.setattr(weighing, "MATERIAL", np.inf)
    left = weighing.weigh_effects(named(), 1)
    assert (left.named.effects, left.dropped) == ((), ("camera_roll",))
    assert left.named.model.theta == named().declared.theta
    assert left.pixels.after.value == left.pixels.before.value
    assert left.with_dropped is named().model


def test_the_added_effect_lowers_the_difference_of_brightness():
    grey, _ = compare_brightness(gathered(shown()), named(), ({}, {}), 1)
    assert grey.unit == "grey levels"
    assert grey.after.value < 0.7 * grey.before.value
    assert grey.after.frames.shape == (-(-COUNT // FOLDS),)
    assert grey.after.interval[0] < grey.after.value < grey.after.interval[1]


def test_an_effect_on_pictures_counts_after_and_not_before():
    dark = np.rint(shown() * 0.7).astype(np.uint8)
    look = {"exposure.gain": 0.7, "exposure.gamma": 1.0}
    (plain, _), (fitting, ratios) = (compare_brightness(gathered(dark), named(), ({}, one), 1) for one in ({}, look))
    assert ratios == {"exposure": pytest.approx(plain.after.value / fitting.after.value)}
    assert fitting.after.value < 0.7 * plain.after.value
    assert fitting.before.value == plain.before.value


def test_an_automatic_exposure_is_no_difference():
    levels = np.random.default_rng(1).uniform(0.6, 1.2, (COUNT, 1, 1, 1))
    drifting = np.clip(np.rint(shown() * levels), 0, 255).astype(np.uint8)
    fixed, free = (compare_brightness(gathered(drifting, one), named(), ({}, {}), 1)[0] for one in (True, False))
    assert free.after.value < 0.6 * fixed.after.value
    right, _ = compare_brightness(gathered(shown()), named(), ({}, {}), 1)
    assert free.after.value == pytest.approx(right.after.value, rel=0.25)
