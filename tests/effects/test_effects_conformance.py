"""What every effect promises, run over the whole catalogue."""

import numpy as np
import pytest

from proxytune.driving.robot import read_robot
from proxytune.effects import CATALOGUE, PARAMETERS, Stage
from proxytune.space import Parameter
from proxytune.testing import check_effect
from proxytune.testing.signals import Candidate

ROBOT = read_robot("duckiebot")
IMBALANCED = [name for name, effect in CATALOGUE.items() if f"{name}.imbalance" in PARAMETERS]
FLAT = [name for name, effect in CATALOGUE.items() if effect.stage not in (Stage.CAMERA, Stage.IMAGE)]


def candidate(name):
    return Candidate(CATALOGUE[name], ROBOT, name)


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_effect_keeps_what_effects_promise(name):
    check_effect(CATALOGUE[name], robot=ROBOT)


@pytest.mark.parametrize("name", IMBALANCED)
@pytest.mark.parametrize("imbalance", [-1.0, 0.3, 1.0])
def test_an_imbalance_of_nothing_changes_nothing(name, imbalance):
    lagging = {"time_constant": 0.0} if name == "motor_lag" else {}
    signal, tried = candidate(name).signal(1), candidate(name)
    np.testing.assert_array_equal(tried.filtered(tried.at({"imbalance": imbalance, **lagging}), signal), signal)


@pytest.mark.parametrize("name", IMBALANCED)
@pytest.mark.parametrize(("imbalance", "wheel"), [(-1.0, "left"), (1.0, "right")])
def test_an_imbalance_of_one_leaves_the_other_wheel_alone(name, imbalance, wheel):
    signal, tried = candidate(name).signal(1), candidate(name)
    effect = tried.moved(CATALOGUE[name].parameters[1], imbalance)
    moved = np.abs(tried.filtered(effect, signal) - signal).max(axis=0)
    here, there = moved if wheel == "left" else moved[::-1]
    assert here > 0.0
    assert there == 0.0


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_parameter_has_bounds_around_its_neutral_value_and_a_source(name):
    for parameter in CATALOGUE[name].parameters:
        assert parameter.low <= parameter.neutral_value(ROBOT.figures) <= parameter.high
        assert parameter.source
        assert len(parameter.probes) >= 4
        assert all(parameter.low <= probe <= parameter.high for probe in parameter.probes)


@pytest.mark.parametrize("name", CATALOGUE)
def test_an_effect_leaves_a_trace_in_motion_unless_it_bends_pictures_alone(name):
    assert (CATALOGUE[name].trace is None) == (name not in FLAT)


@pytest.mark.parametrize("name", FLAT)
def test_the_forms_of_an_effect_name_its_own_parameters_and_no_form_twice(name):
    known = {parameter.name for parameter in CATALOGUE[name].parameters}
    forms = CATALOGUE[name].trace.forms
    assert len({form.name for form in forms}) == len(forms)
    for form in forms:
        free = {parameter for coordinate in form.free for parameter in coordinate}
        assert free <= known
        assert set(form.fixed) <= known - free
        assert set(form.moved) <= free
    assert CATALOGUE[name].trace.cues


@pytest.mark.parametrize("name", [name for name in FLAT if CATALOGUE[name].trace.draws])
def test_an_effect_that_draws_tells_how_late_commands_are_about_their_mean(name):
    (parameter,) = CATALOGUE[name].parameters
    draws = CATALOGUE[name].trace.draws
    assert parameter.low < draws.sizes[0] < draws.sizes[1] <= parameter.high
    late = draws.lateness(draws.sizes[0] * 5.0, 20.0)
    weights = np.exp(late.log_weights)
    assert late.mean_s > 0.0
    assert weights.sum() == pytest.approx(1.0, abs=1e-3)
    assert weights @ late.commands == pytest.approx(0.0, abs=1e-3)


def test_parameters_are_given_by_keyword():
    with pytest.raises(TypeError, match="positional"):
        Parameter("trim", "", -0.5, 0.5, 0.0)
