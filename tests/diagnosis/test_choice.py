"""Of what was looked at, what has most evidence is chosen, unless it stands for something else."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import DECLARED, NOISE, TRUTH, planted_drives

from proxytune.diagnosis.model.coordinates import at_edge
from proxytune.diagnosis.model.events import RandomEffect
from proxytune.diagnosis.model.fitting import evaluate
from proxytune.diagnosis.naming.candidates import candidates
from proxytune.diagnosis.naming.choice import choose_best
from proxytune.diagnosis.naming.evidence import Evidence, FittedLead
from proxytune.diagnosis.naming.screening import Lead
from proxytune.driving.robot import read_robot

ROBOT = read_robot("duckiebot")
FORMS = {one.label: one for one in reversed(candidates(ROBOT, TRUTH, ()))}


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=4, seconds=12.0)


def chosen(drives, *tried, p_value=0.002, random=()):
    """What is chosen of effects, each with its values and its gain."""
    model = evaluate(drives, TRUTH, DECLARED, NOISE)
    fits = {}
    for label, values, gain in tried:
        form = FORMS[label]
        lead = Lead(form, form.probes[0], form.probes[0], gain, gain, p_value, np.ones(3))
        fits[label] = FittedLead(lead, evaluate(drives, {**TRUTH, **values}, DECLARED + form.free, NOISE), gain)
    best = choose_best(model, Evidence([], fits, random, []), 15.0)
    return best and best.lead.candidate.label


def patch(radius):
    values = {"loss": 0.001, "x": 0.0, "y": 0.0, "radius": radius}
    return {f"slippery_patch.{name}": value for name, value in values.items()}


def test_most_evidence_is_chosen_and_little_is_not(drives):
    slip, scrub = ("lateral_slip", {"lateral_slip": 1e-4}, 90.0), ("yaw_scrub", {"yaw_scrub": 0.1601}, 80.0)
    assert chosen(drives, slip, scrub) == "lateral_slip"
    assert chosen(drives, ("yaw_scrub", {"yaw_scrub": 0.1601}, 10.0)) is None


@pytest.mark.parametrize(("p_value", "wanted"), [(0.002, "yaw_scrub"), (0.01, "yaw_scrub"), (0.02, None), (0.1, None)])
def test_what_chance_gains_more_than_once_in_a_hundred_logs_is_not_chosen(drives, p_value, wanted):
    assert chosen(drives, ("yaw_scrub", {"yaw_scrub": 0.1601}, 500.0), p_value=p_value) == wanted


@pytest.mark.parametrize(("gain", "p_value"), [(500.0, 0.02), (25.0, 0.01)])
def test_a_random_effect_needs_as_small_a_chance_and_twice_the_evidence(drives, gain, p_value):
    lost = RandomEffect("dropped_commands", "dropped_commands", 0.1, (0.05, 0.2), gain, p_value)
    assert chosen(drives, random=(lost,)) is None


@pytest.mark.parametrize(("scrub", "wanted"), [(0.1601, "yaw_scrub"), (0.14, None), (0.12, None)])
def test_an_effect_that_predicts_worse_is_not_chosen_whatever_its_evidence(drives, scrub, wanted):
    assert chosen(drives, ("yaw_scrub", {"yaw_scrub": scrub}, 500.0)) == wanted


def test_behind_an_effect_that_predicts_worse_the_next_one_is_chosen(drives):
    worse, next_best = ("yaw_scrub", {"yaw_scrub": 0.12}, 500.0), ("lateral_slip", {"lateral_slip": 1e-4}, 90.0)
    assert chosen(drives, worse, next_best) == "lateral_slip"


def test_a_part_of_the_map_that_holds_all_drives_is_no_part(drives):
    scrub = ("yaw_scrub", {"yaw_scrub": 0.1601}, 50.0)
    assert chosen(drives, ("slippery_patch", patch(0.1), 90.0), scrub) == "slippery_patch"
    assert chosen(drives, ("slippery_patch", patch(5.0), 90.0), scrub) == "yaw_scrub"


@pytest.mark.parametrize(("gain", "wanted"), [(85.0, "dead_band"), (40.0, "dead_band (left wheel)")])
def test_a_form_for_both_wheels_is_preferred_to_one_for_a_single_wheel_at_little_loss(drives, gain, wanted):
    one = ("dead_band (left wheel)", {"dead_band.width": 0.001, "dead_band.imbalance": 0.001}, 90.0)
    both = ("dead_band", {"dead_band.width": 0.001, "dead_band.imbalance": 0.0}, gain)
    assert chosen(drives, one, both) == wanted


@pytest.mark.parametrize(("gain", "wanted"), [(85.0, "yaw_scrub"), (40.0, "motor_lag")])
def test_an_effect_within_its_range_is_preferred_to_one_at_its_end(drives, gain, wanted, monkeypatch):
    monkeypatch.setattr("proxytune.diagnosis.naming.choice.predicts_no_worse", lambda one, other: True)
    lag = ("motor_lag", {"motor_lag.time_constant": 1.0, "motor_lag.imbalance": 0.0}, 90.0)
    assert chosen(drives, lag, ("yaw_scrub", {"yaw_scrub": 0.1601}, gain)) == wanted


def test_only_an_end_that_is_not_neutral_is_an_edge():
    assert at_edge("motor_lag.time_constant", 1.0, ROBOT)
    assert not at_edge("dead_band.width", 0.0, ROBOT)
    assert not at_edge("motor_lag.time_constant", 0.5, ROBOT)
