"""Planted effects are named, alone and in pairs, and nothing is named of a nominal camera."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1]))
from pictured import ROBOT
from viewed import OPTICS, everything, still, tracked, views_of

from proxytune.diagnosis.camera.naming.search import cost_of, fit_everything, fit_set, name_camera_effects
from proxytune.driving.ground_plane import GroundPlaneCamera
from proxytune.driving.road.lane import lane_length, lane_point
from proxytune.driving.road.markings import Markings
from proxytune.driving.road.reading import shipped_map
from proxytune.driving.road.texture import draw_floor

DECLARED = ("camera_pitch",)
PLANTED = {
    "camera_roll": {"camera_roll": 4.0},
    "camera_yaw": {"camera_yaw": 5.0},
    "lens_distortion": {"lens_distortion": -0.25},
    "camera_height": {"camera_height": 0.125},
    "camera_forward": {"camera_forward": 0.1},
}


def on(name, theta, count=30, seed=3):
    """Views of a shipped map from both lanes, each driven its own way."""
    road, random = shipped_map(name), np.random.default_rng(seed)
    outer = np.arange(count) % 2 == 0
    along, step = random.random(count) * lane_length(road, outer), 0.005
    places = lane_point(road, outer, along)
    way = lane_point(road, outer, along + step) - lane_point(road, outer, along - step)
    poses = np.column_stack((places, np.arctan2(way[:, 1], way[:, 0])))
    poses = poses + random.normal(0.0, (0.03, 0.03, 0.2), poses.shape)
    figures = OPTICS.figures({**{each: OPTICS.neutral(each) for each in OPTICS.mounting}, **theta})
    shown = GroundPlaneCamera(figures, draw_floor(road)).render(poses)
    return views_of(shown, still(tracked(poses)), markings=Markings(road))


OFTEN = ("camera_roll", "lens_distortion")


@pytest.mark.parametrize(
    "effect", [name if name in OFTEN else pytest.param(name, marks=pytest.mark.slow) for name in PLANTED]
)
def test_a_planted_effect_is_named(effect):
    named = name_camera_effects(everything(PLANTED[effect]), DECLARED)
    assert named.effects == (effect,)
    for name, value in PLANTED[effect].items():
        place = named.model.names.index(name)
        assert abs(named.model.theta[name] - value) < 3.0 * named.model.sd[place] + 0.01 * abs(value)


@pytest.mark.slow
def test_a_pair_is_named():
    named = name_camera_effects(everything({"camera_roll": -4.0, "lens_distortion": -0.25}), DECLARED)
    assert set(named.effects) == {"camera_roll", "lens_distortion"}
    assert [len(one.effects) for one in named.losses] == [0, 1, 2]
    assert named.losses[0].loss > named.losses[1].loss > named.losses[2].loss


@pytest.mark.parametrize("name", ["small_loop", pytest.param("horseshoe", marks=pytest.mark.slow)])
def test_nothing_is_named_of_a_nominal_camera(name):
    full = fit_everything(on(name, {}), OPTICS.mounting, {}, learn_scatter=False)
    named = name_camera_effects(full, DECLARED)
    assert named.effects == ()
    assert named.model.theta["camera_pitch"] == pytest.approx(19.15, abs=0.3)
    assert named.model.names == DECLARED


def test_an_effect_is_named_on_another_map():
    full = fit_everything(on("horseshoe", {"camera_roll": 4.0}), OPTICS.mounting, {}, learn_scatter=False)
    assert name_camera_effects(full, DECLARED).effects == ("camera_roll",)


def test_a_declared_effect_is_tuned_and_not_named():
    named = name_camera_effects(everything({"camera_roll": 4.0}), ("camera_pitch", "camera_roll"))
    assert named.effects == ()
    assert named.declared.theta["camera_roll"] == pytest.approx(4.0, abs=0.3)


def test_an_effect_that_needs_motion_is_named_from_a_drive():
    named = name_camera_effects(everything({"camera_latency": 0.12}, count=40, moving=True), DECLARED)
    assert named.effects == ("camera_latency",)
    assert named.model.theta["camera_latency"] == pytest.approx(0.12, abs=0.01)


def test_an_effect_is_named_by_a_tracker_that_states_no_scatter():
    views = replace(on("small_loop", {"camera_roll": 4.0}), position_m=0.005, heading_rad=np.radians(1.0))
    full = fit_everything(views, OPTICS.mounting, {}, learn_scatter=True)
    assert full.views.position_m < 0.0045
    assert full.views.heading_rad < np.radians(0.8)
    assert name_camera_effects(full, DECLARED).effects == ("camera_roll",)


def test_what_is_known_is_held():
    views = on("small_loop", {}, count=20)
    names = [name for name in OPTICS.mounting if name != "lens_distortion"]
    full = fit_everything(views, names, {"rolling_shutter": 0.03, "lens_distortion": -0.01}, learn_scatter=False)
    assert (full.theta["rolling_shutter"], full.theta["lens_distortion"]) == (0.03, -0.01)
    held = fit_set(full, DECLARED)
    assert (held.theta["rolling_shutter"], held.theta["lens_distortion"]) == (0.03, -0.01)


def test_a_set_of_effects_leaves_all_others_neutral():
    fit = fit_set(everything({"camera_roll": 4.0}), ("camera_pitch", "lens_centre"))
    assert fit.names == ("camera_pitch", "lens_centre.right", "lens_centre.down")
    assert fit.theta["camera_roll"] == 0.0
    assert fit.theta["camera_height"] == ROBOT.camera_figures().height_m


def test_the_cost_is_least_with_everything_free():
    full = everything({"camera_roll": 4.0})
    assert cost_of(full) < cost_of(fit_set(full, DECLARED))
    assert cost_of(full) == pytest.approx(cost_of(fit_set(full, (*DECLARED, "camera_roll"))), rel=0.05)
