"""Every motion effect can be asked for; the one that is there leads, and chance is told as chance."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from planted import ROBOT, TRUTH, drives_of, fitted, planted_drives, planted_log, with_poses

from proxytune.diagnosis import RANDOM_EFFECTS, motion_effects, theta_at
from proxytune.diagnosis.motion import screening
from proxytune.diagnosis.motion.screening import candidates, project_out, screen, with_dense_probes
from proxytune.effects import CATALOGUE, PARAMETERS, SHIPPED, Stage, effects_from

THETA = {**ROBOT.theta, **TRUTH}


MOTION_EFFECTS = motion_effects(SHIPPED)


def forms(effect, theta=TRUTH, taken=()):
    return {form.form: form for form in candidates(ROBOT, theta, taken) if form.effect == effect}


def test_every_effect_of_motion_can_be_shown_in_a_form_unless_it_draws():
    unseen = {name for name, kind in CATALOGUE.items() if kind.stage in (Stage.CAMERA, Stage.IMAGE)}
    assert list(MOTION_EFFECTS) == [name for name in CATALOGUE if name not in unseen]
    assert {"camera_pitch", "blur"} <= unseen
    assert {form.effect for form in candidates(ROBOT, {}, ())} == set(MOTION_EFFECTS) - set(RANDOM_EFFECTS)


@pytest.mark.parametrize("taken", [("trim", "delay"), ("trim", "delay", "dead_band", "wheel_gain"), MOTION_EFFECTS])
def test_what_is_declared_or_adopted_is_left_out(taken):
    known = {form.effect for form in candidates(ROBOT, TRUTH, taken)}
    assert known == set(MOTION_EFFECTS) - set(RANDOM_EFFECTS) - set(taken)


@pytest.mark.parametrize("effect", ["dead_band", "stiction", "backlash", "saturation"])
def test_an_effect_of_wheels_may_be_on_one_of_them_alone(effect):
    known = {form: one for form, one in forms(effect).items() if form != "runs through reversals"}
    assert set(known) == {"", "left wheel", "right wheel"}
    imbalance = f"{effect}.imbalance"
    sides = {form: known[form].fixed[imbalance] for form in known}
    assert sides == {"": 0.0, "left wheel": -1.0, "right wheel": 1.0}
    assert known["left wheel"].label == f"{effect} (left wheel)"
    assert known[""].label == effect


def test_wheels_may_be_uneven_alone_or_together_and_a_battery_sags_with_load_use_or_time():
    known = forms("dead_band", {**TRUTH, "dead_band.width": 0.1, "dead_band.imbalance": 0.0})
    assert set(known) == {"", "uneven wheels"}
    assert known["uneven wheels"].free == (("dead_band.width",), ("dead_band.imbalance",))
    assert set(forms("motor_lag")) == {"", "uneven wheels"}
    known = forms("wheel_gain")
    assert known[""].free == (("wheel_gain.left", "wheel_gain.right"),)
    assert known["left wheel"].free == (("wheel_gain.left",),)
    assert known["right wheel"].fixed == {"wheel_gain.left": 1.0}
    known = {form: one.free for form, one in forms("battery_sag").items()}
    assert list(known) == ["load", "fade", "fade with time"]
    assert known == {form: ((f"battery_sag.{form.replace(' ', '_')}",),) for form in known}


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


SHORT = {"episodes": 4, "seconds": 30.0}


def added(effect, theta):
    """The probe that is added to an effect's own on drives of this truth."""
    base = fitted(planted_drives({**TRUTH, **theta}, **SHORT))
    forms = [form for form in candidates(ROBOT, base.theta, ()) if form.effect == effect]
    (form,), *_ = zip(with_dense_probes(base, forms), strict=False)
    assert form.probes[: len(forms[0].probes)] == forms[0].probes
    return form.probes[len(forms[0].probes) :]


def test_a_size_between_the_probes_is_met_within_one_percent_and_the_step_lands_near_the_planted_value():
    (size,) = added("command_quantisation", {"command_quantisation": 0.137})
    assert size[0] == pytest.approx(0.137, rel=0.01)
    lead = leads_of_scrubbing()[0]
    assert lead.candidate.effect == "yaw_scrub"
    assert lead.start[0] == pytest.approx(0.13, abs=0.02)
    assert lead.p_value <= 0.01
    assert lead.held_out > 30.0


@pytest.mark.slow
def test_a_slippery_place_is_met_within_a_patch_width():
    patch = {"loss": 0.6, "x": 0.3, "y": 0.2, "radius": 0.7}
    (where,) = added("slippery_patch", {f"slippery_patch.{key}": value for key, value in patch.items()})
    assert np.hypot(where[1] - 0.3, where[2] - 0.2) < 0.7


FEW = {"episodes": 3, "seconds": 20.0}


def leads_of(theta, *, base=None, **more):
    base = base or fitted(planted_drives({**TRUTH, **theta}, **{**FEW, **more}))
    return screen(base, candidates(ROBOT, base.theta, ("trim", "delay")), 1)


SLOWLY = {"turn_slip": 0.15, "motor_lag.time_constant": 0.4, "floor_slope.x": 0.04, "lateral_slip": 0.1}


@pytest.mark.parametrize(
    ("name", "value"),
    [("dead_band.width", 0.1), *(pytest.param(*one, marks=pytest.mark.slow) for one in SLOWLY.items())],
)
def test_a_planted_effect_leads(name, value):
    leads = leads_of({name: value})
    assert name.split(".")[0] in (leads[0].candidate.effect, *CATALOGUE[leads[0].candidate.effect].trace.contains)
    assert leads[0].p_value <= 0.01
    assert leads[0].held_out > 30.0
    assert leads[0].gain > leads[0].held_out - 30.0


@functools.cache
def leads_of_scrubbing():
    return leads_of({"yaw_scrub": 0.13})


@pytest.mark.slow
def test_leads_come_best_first_and_once_per_form():
    leads = leads_of_scrubbing()
    gains = [lead.gain for lead in leads]
    assert gains == sorted(gains, reverse=True)
    labels = [lead.candidate.label for lead in leads]
    assert len(labels) == len(set(labels)) > 15


@pytest.fixture(scope="module")
def chance():
    """The smallest p-value of every clean log."""
    return np.array([min(lead.p_value for lead in leads_of({}, seed=seed)) for seed in range(20, 28)])


@pytest.mark.slow
def test_chance_alone_is_told_as_chance(chance):
    assert chance.min() > 0.005
    assert (chance < 0.1).sum() <= 3
    assert 0.15 < chance.mean() < 0.85


def mirrored(log):
    """The same drives seen in a mirror."""
    swapped = tuple(replace(e, commands=e.commands[:, ::-1].copy()) for e in log.episodes)
    return with_poses(replace(log, episodes=swapped), lambda poses: poses * (1.0, -1.0, -1.0))


@pytest.mark.slow
def test_a_mirror_swaps_left_and_right_and_nothing_else():
    log = planted_log({"trim": 0.0, "delay": 0.12, "dead_band.width": 0.1, "dead_band.imbalance": -1.0}, **FEW)
    one, other = (leads_of({}, base=fitted(drives_of(seen))) for seen in (log, mirrored(log)))
    swap = {"left wheel": "right wheel", "right wheel": "left wheel"}
    gains = {(lead.candidate.effect, lead.candidate.form): lead.gain for lead in other}
    assert one[0].candidate.label == "dead_band (left wheel)"
    for lead in one:
        twin = gains[lead.candidate.effect, swap.get(lead.candidate.form, lead.candidate.form)]
        assert twin == pytest.approx(lead.gain, rel=0.03, abs=1.0)


def test_free_parameters_are_projected_out_of_stretches_within_episodes():
    random = np.random.default_rng(1)
    slopes, columns, weight = random.random((60, 2)), random.random((60, 3)), random.random(60) > 0.3
    np.testing.assert_allclose(slopes[weight].T @ project_out(slopes, columns, weight)[weight], 0.0, atol=1e-9)
    np.testing.assert_allclose(project_out(slopes, slopes @ random.random((2, 1)), weight), 0.0, atol=1e-9)
    assert project_out(np.empty((60, 0)), columns, weight) is columns

    drives = planted_drives(TRUTH, episodes=2, seconds=5.0)
    number = screening.number_stretches(drives)
    assert len(np.unique(number)) == 10
    for one in np.unique(number):
        own = number == one
        assert len(np.unique(drives.episode[own])) == 1
        assert np.ptp(drives.first[own]) < drives.tick_hz


def test_a_part_of_drives_is_stretches_of_eight_seconds_to_their_ends_whose_first_two_warm_up_amid_a_drive():
    drives = planted_drives(TRUTH, episodes=1, seconds=20.0)
    part = screening.cut_part(drives)
    for stretch, first_s in ((0, 0.0), (1, 2.0)):
        own = part.episode == stretch
        assert (part.first[own].min(), part.last[own].max()) == (first_s * drives.tick_hz, 8.0 * drives.tick_hz)


@pytest.mark.slow
def test_what_changes_nothing_in_these_drives_is_no_lead():
    drives = planted_drives(TRUTH, **FEW)
    half = replace(drives, duties=0.5 * drives.duties)
    labels = {lead.candidate.effect for lead in leads_of({}, base=fitted(half))}
    limits = [lead.probe for lead in leads_of({}, base=fitted(half)) if lead.candidate.effect == "saturation"]
    assert "yaw_scrub" in labels
    assert all(limit < 0.5 for (limit,) in limits)
