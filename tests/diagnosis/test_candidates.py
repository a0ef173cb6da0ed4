"""Every motion effect can be asked for, in forms that the catalogue accepts."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import ROBOT, TRUTH

from proxytune.diagnosis.model.coordinates import theta_at
from proxytune.diagnosis.model.replay import RANDOM_EFFECTS
from proxytune.diagnosis.naming.candidates import MOTION_EFFECTS, candidates
from proxytune.effects import CATALOGUE, PARAMETERS, Stage, effects_from

THETA = {**ROBOT.theta, **TRUTH}
WHEELS = ("dead_band", "stiction", "backlash", "saturation")


def forms(effect, theta=TRUTH, taken=()):
    return {form.form: form for form in candidates(ROBOT, theta, taken) if form.effect == effect}


def test_motion_can_show_every_effect_but_those_of_the_camera_and_its_pictures():
    unseen = {name for name, kind in CATALOGUE.items() if kind.stage in (Stage.CAMERA, Stage.IMAGE)}
    assert list(MOTION_EFFECTS) == [name for name in CATALOGUE if name not in unseen]
    assert {"camera_pitch", "blur"} <= unseen


def test_every_effect_of_motion_that_does_not_draw_has_a_form():
    known = {form.effect for form in candidates(ROBOT, {}, ())}
    assert known == set(MOTION_EFFECTS) - set(RANDOM_EFFECTS)


@pytest.mark.parametrize("taken", [("trim", "delay"), ("trim", "delay", "dead_band", "wheel_gain"), MOTION_EFFECTS])
def test_what_is_declared_or_adopted_is_left_out(taken):
    known = {form.effect for form in candidates(ROBOT, TRUTH, taken)}
    assert known == set(MOTION_EFFECTS) - set(RANDOM_EFFECTS) - set(taken)


@pytest.mark.parametrize("effect", WHEELS)
def test_an_effect_of_wheels_may_be_on_one_of_them_alone(effect):
    known = {form: one for form, one in forms(effect).items() if form != "runs through reversals"}
    assert set(known) == {"", "left wheel", "right wheel"}
    imbalance = f"{effect}.imbalance"
    sides = {form: known[form].fixed[imbalance] for form in known}
    assert sides == {"": 0.0, "left wheel": -1.0, "right wheel": 1.0}
    assert known["left wheel"].label == f"{effect} (left wheel)"
    assert known[""].label == effect


def test_an_effect_of_wheels_that_the_model_has_may_be_uneven():
    known = forms("dead_band", {**TRUTH, "dead_band.width": 0.1, "dead_band.imbalance": 0.0})
    assert set(known) == {"", "uneven wheels"}
    assert known["uneven wheels"].free == (("dead_band.width",), ("dead_band.imbalance",))


def test_a_lag_that_every_robot_has_may_be_uneven():
    assert set(forms("motor_lag")) == {"", "uneven wheels"}


def test_a_gain_is_of_both_wheels_together_or_of_one():
    known = forms("wheel_gain")
    assert known[""].free == (("wheel_gain.left", "wheel_gain.right"),)
    assert known["left wheel"].free == (("wheel_gain.left",),)
    assert known["right wheel"].fixed == {"wheel_gain.left": 1.0}


def test_a_battery_sags_with_load_with_use_or_with_time():
    known = forms("battery_sag")
    assert list(known) == ["load", "fade", "fade with time"]
    assert {form.free for form in known.values()} == {
        ((f"battery_sag.{name}",),) for name in ("load", "fade", "fade_with_time")
    }


def test_labels_are_unique():
    labels = [form.label for form in candidates(ROBOT, TRUTH, ())]
    assert len(labels) == len(set(labels))


@pytest.mark.parametrize("form", candidates(ROBOT, TRUTH, ("trim", "delay")), ids=lambda form: form.label)
def test_every_probe_is_a_model_that_differs_from_neutral(form):
    assert form.probes
    assert len(form.free) == len(form.neutral)
    for values in form.probes:
        assert len(values) == len(form.free)
        assert not np.allclose(values, form.neutral)
        theta = theta_at({**THETA, **form.fixed}, form.free, np.array(values))
        assert set(theta) <= set(PARAMETERS)
        assert form.effect in {effect.name for effect in effects_from(theta, ROBOT.figures)}
