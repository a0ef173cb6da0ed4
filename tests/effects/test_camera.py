"""Effects on how the camera is made and mounted set the figures that they are about, and no other."""

import numpy as np
import pytest

from proxytune.driving import read_robot
from proxytune.effects import CATALOGUE, CHANNELS, PARAMETERS, FilterContext, Stage, effects_from, theta_names
from proxytune.effects.model import stage_chain

ROBOT = read_robot("duckiebot")
SETS = {
    "camera_pitch": "pitch_deg",
    "camera_roll": "roll_deg",
    "camera_yaw": "yaw_deg",
    "camera_height": "height_m",
    "camera_forward": "forward_m",
    "field_of_view": "field_of_view_deg",
    "lens_distortion": "k1",
    "lens_centre.right": "centre_right",
    "lens_centre.down": "centre_down",
    "pixel_aspect": "aspect",
}


@pytest.mark.parametrize("name", SETS)
def test_a_parameter_of_a_camera_effect_sets_its_figure_alone(name):
    nominal, value = ROBOT.camera_figures().channels(), PARAMETERS[name].probes[0]
    chain = stage_chain(effects_from({name: value}, ROBOT.figures), Stage.CAMERA)
    mounted = chain.apply(nominal[None], chain.begin(FilterContext(60.0, nominal, ROBOT.figures)))[0][0]
    expected = nominal.copy()
    expected[CHANNELS[Stage.CAMERA].index(SETS[name])] = value
    np.testing.assert_array_equal(mounted, expected)


def test_every_figure_of_the_camera_has_an_effect_and_every_effect_a_figure():
    names = {name for effect in CATALOGUE.values() if effect.stage is Stage.CAMERA for name in theta_names(effect)}
    assert names == set(SETS)
    assert set(SETS.values()) == set(CHANNELS[Stage.CAMERA])
