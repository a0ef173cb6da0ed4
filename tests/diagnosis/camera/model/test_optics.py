"""A camera in θ: its own effects set it, all others leave it alone, and parameters stay within their bounds."""

import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

sys.path.append(str(Path(__file__).parents[1]))
from viewed import NEUTRAL, OPTICS

from proxytune.diagnosis.camera.model.optics import effects_of

PARAMETERS = OPTICS.robot.catalogue.parameters
MOUNTING = st.sampled_from(OPTICS.mounting)


def test_neutral_values_are_the_nominal_camera_in_the_log_s_size():
    figures = OPTICS.figures(NEUTRAL)
    nominal = OPTICS.robot.camera_figures()
    assert (figures.rows, figures.columns) == (120, 160)
    assert figures.channels().tolist() == nominal.channels().tolist()


@given(MOUNTING, st.floats(0.05, 0.95))
def test_every_parameter_of_the_mounting_changes_the_camera(name, share):
    parameter = PARAMETERS[name]
    value = parameter.low + share * (parameter.high - parameter.low)
    changed = OPTICS.figures({**NEUTRAL, name: value})
    assert (changed == OPTICS.figures(NEUTRAL)) == (value == OPTICS.neutral(name))


@given(st.floats(0.0, 0.5), st.floats(0.0, 0.2))
def test_what_is_not_of_the_mounting_leaves_the_camera_alone(latency, blur):
    assert OPTICS.figures({**NEUTRAL, "camera_latency": latency, "blur": blur}) == OPTICS.figures(NEUTRAL)
    assert not {"camera_latency", "rolling_shutter", "blur", "trim"} & set(OPTICS.mounting)


@given(MOUNTING, st.floats(-1e3, 1e3))
def test_values_are_clipped_to_the_nearest_bound(name, value):
    parameter = PARAMETERS[name]
    clipped = OPTICS.clipped(name, value)
    assert parameter.low <= clipped <= parameter.high
    assert clipped == value or clipped in (parameter.low, parameter.high)


@given(MOUNTING)
def test_a_step_is_a_small_part_of_a_spread_and_a_spread_lies_within_the_range(name):
    parameter = PARAMETERS[name]
    assert 0.0 < OPTICS.step(name, OPTICS.neutral(name)) < 0.01 * OPTICS.spread(name)
    assert OPTICS.spread(name) < parameter.high - parameter.low


@given(MOUNTING, st.floats(0.0, 1.0))
def test_a_step_never_leaves_the_bounds(name, share):
    """A camera cannot be made beyond them."""
    parameter = PARAMETERS[name]
    value = OPTICS.clipped(name, parameter.low + share * (parameter.high - parameter.low))
    assert parameter.low <= value + OPTICS.step(name, value) <= parameter.high


def test_parameters_of_one_effect_are_one_effect():
    names = ("lens_centre.right", "camera_roll", "lens_centre.down", "exposure.gain")
    assert effects_of(names) == ("lens_centre", "camera_roll", "exposure")


def test_a_robot_without_such_a_parameter_is_a_key_error():
    with pytest.raises(KeyError):
        OPTICS.neutral("camera_nothing")
