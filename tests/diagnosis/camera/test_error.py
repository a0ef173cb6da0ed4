"""Before and after are compared on the same unseen frames, in pixels and in grey levels, with an interval."""

import functools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from pictured import lane_poses, pictures
from viewed import at_truth, everything, stood

from proxytune.diagnosis.camera import error as weighing
from proxytune.diagnosis.camera.edges import Gathered
from proxytune.diagnosis.camera.error import CAP_PX, FOLDS, error_over, fit_poses, pixel_errors, unseen_residuals
from proxytune.diagnosis.camera.selection import select_camera_effects

ROLLED = {"camera_roll": 4.0}
COUNT = 30


@functools.cache
def named():
    return select_camera_effects(everything(ROLLED, count=COUNT), ("camera_pitch",))


def gathered(shown, fixed=True):
    return Gathered(named().full.views, np.arange(COUNT), shown, SimpleNamespace(fixed_exposure=fixed), False, ())


@functools.cache
def weighed():
    return weighing.weigh_effects(named(), 1)


@functools.cache
def shown():
    return pictures(ROLLED, lane_poses(COUNT))


@pytest.mark.slow
def test_the_added_effect_lowers_the_displacement_to_about_the_floor_in_intervals_of_one_seed():
    pixels, ratios = weighed().pixels, weighed().ratios
    assert pixels.unit == "px"
    assert pixels.after.value < 0.5 * pixels.before.value
    assert pixels.floor.value <= pixels.after.value
    assert pixels.floor.value > 0.5 * pixels.after.value
    assert set(ratios) == {"camera_roll"}
    assert ratios["camera_roll"] > 2.0
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


@pytest.mark.slow
def test_the_added_effect_lowers_the_difference_of_brightness_of_which_exposure_is_no_part():
    grey, _ = weighing.compare_brightness(gathered(shown()), named(), ({}, {}), 1)
    assert grey.unit == "grey levels"
    assert grey.after.value < 0.7 * grey.before.value
    assert grey.after.frames.shape == (-(-COUNT // FOLDS),)
    assert grey.after.interval[0] < grey.after.value < grey.after.interval[1]
    levels = np.random.default_rng(1).uniform(0.6, 1.2, (COUNT, 1, 1, 1))
    drifting = np.clip(np.rint(shown() * levels), 0, 255).astype(np.uint8)
    fixed, free = (
        weighing.compare_brightness(gathered(drifting, one), named(), ({}, {}), 1)[0] for one in (True, False)
    )
    assert free.after.value < 0.6 * fixed.after.value
    assert free.after.value == pytest.approx(grey.after.value, rel=0.25)


@pytest.mark.slow
def test_an_effect_on_pictures_counts_after_and_not_before():
    dark = np.rint(shown() * 0.7).astype(np.uint8)
    look = {"exposure.gain": 0.7, "exposure.gamma": 1.0}
    (plain, _), (fitting, ratios) = (
        weighing.compare_brightness(gathered(dark), named(), ({}, one), 1) for one in ({}, look)
    )
    assert ratios == {"exposure": pytest.approx(plain.after.value / fitting.after.value)}
    assert fitting.after.value < 0.7 * plain.after.value
    assert fitting.before.value == plain.before.value


NAMES = ("camera_pitch", "camera_roll")


@pytest.fixture
def fits(monkeypatch):
    """Every fit that is made, in order."""
    made, fit_camera = [], weighing.fit_camera

    def spy(*given_):
        made.append(fit_camera(*given_))
        return made[-1]

    monkeypatch.setattr(weighing, "fit_camera", spy)
    return made


@pytest.mark.slow
def test_a_frame_left_out_does_not_change_the_camera_that_is_tested_on_it(fits):
    views = stood({"camera_roll": 4.0}, count=COUNT)
    state = at_truth(views, {"camera_roll": 4.0})
    first = unseen_residuals(views, state, NAMES)
    left_out = views.edges.frame % FOLDS == 0
    spoilt = replace(views, edges=views.edges._replace(row=views.edges.row + 2.0 * left_out))
    second = unseen_residuals(spoilt, state, NAMES)
    assert len(fits) == 2 * FOLDS
    assert fits[0].theta == fits[FOLDS].theta
    np.testing.assert_array_equal(fits[0].state.tape, fits[FOLDS].state.tape)
    assert fits[1].theta != fits[FOLDS + 1].theta
    assert np.abs(second[left_out]).mean() > 1.2 * np.abs(first[left_out]).mean()


def test_every_edge_point_has_a_residual_within_the_cap_and_only_poses_left_out_are_fitted():
    views = stood({"camera_roll": 4.0}, count=COUNT)
    residuals = unseen_residuals(views, at_truth(views), NAMES)
    assert residuals.shape == views.edges.row.shape
    assert np.abs(residuals).max() <= CAP_PX
    assert np.median(np.abs(residuals)) < 1.0
    views = stood(count=COUNT)
    out = np.arange(COUNT) % 3 == 0
    state = replace(at_truth(views), poses=np.full((COUNT, 3), 0.001))
    fitted = fit_poses(views, state, out)
    np.testing.assert_array_equal(fitted.poses[~out], 0.001)
    assert fitted.theta == state.theta
    exact = stood(count=COUNT, noisy=False).tracks.poses
    before = (views.tracks.poses - exact)[out]
    assert ((views.tracks.poses + fitted.poses - exact)[out][:, :2].std() < 0.9 * before[:, :2].std()).all()


def test_cameras_are_compared_on_the_same_points_of_frames_with_markings():
    """A point that one camera brings to a marking counts for the other with the cap."""
    views = stood(count=COUNT)
    size = len(views.edges.row)
    good, blind = np.full(size, 0.5), np.full(size, CAP_PX)
    one, other = pixel_errors(views, [good, blind], 1)
    assert (one.value, other.value) == (0.5, CAP_PX)
    alone = pixel_errors(views, [blind, blind], 1)[0]
    assert alone.value == 0.0
    assert np.isnan(alone.frames).all()
    error = error_over(np.array([10.0, 0.0, 30.0]), np.array([10.0, 0.0, 10.0]), 1)
    assert error.value == 2.0
    np.testing.assert_array_equal(error.frames, [1.0, np.nan, 3.0])


SUMS = st.lists(st.tuples(st.floats(0.0, 4.0), st.integers(1, 500)), min_size=4, max_size=60)


@settings(max_examples=40)
@given(SUMS, st.integers(0, 1000))
def test_the_interval_holds_the_value_and_seeds_reproduce_it(rows, seed):
    means, counts = np.array(rows).T
    error = error_over(means * counts, counts, seed)
    low, high = error.interval
    assert low - 1e-9 <= high
    assert means.min() - 1e-9 <= low
    assert high <= means.max() + 1e-9
    assert error.value == pytest.approx(np.average(means, weights=counts))
    assert error_over(means * counts, counts, seed).interval == error.interval


def test_the_interval_of_many_frames_holds_the_value_and_narrows_as_the_root_of_their_number():
    random = np.random.default_rng(2)
    wide, narrow = (error_over(random.uniform(50, 150, count), np.full(count, 100.0), 1) for count in (25, 2500))
    for error in (wide, narrow):
        assert error.interval[0] < error.value < error.interval[1]
    ratio = (wide.interval[1] - wide.interval[0]) / (narrow.interval[1] - narrow.interval[0])
    assert ratio == pytest.approx(10.0, rel=0.4)
