"""An effect is adopted with its rivals, and what no longer pays beside it is dropped."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import DECLARED, NOISE, ROBOT, TRUTH, planted_drives

from proxytune.diagnosis.model.events import RandomEffect
from proxytune.diagnosis.model.fitting import evaluate, fit
from proxytune.diagnosis.naming.adoption import adopt, drop_idle
from proxytune.diagnosis.naming.candidates import candidates
from proxytune.diagnosis.naming.choice import Choice
from proxytune.diagnosis.naming.evidence import Evidence, FittedLead
from proxytune.diagnosis.naming.findings import AdoptedEffect
from proxytune.diagnosis.naming.screening import Lead

FORMS = {form.effect: form for form in candidates(ROBOT, TRUTH, ()) if not form.form}
AS_GOOD, WORSE = {"lateral_slip": 1e-4}, {"lateral_slip": 0.2}
ACROSS, ALONG = (0.0, 1.0, 0.0), (0.99, 0.1, 0.0)


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=4, seconds=12.0)


def lead(effect, column):
    form = FORMS[effect]
    return Lead(form, form.probes[0], form.probes[0], 100.0, 100.0, 0.002, np.array(column))


def rivals(drives, gain, theta, column=ACROSS):
    """The rivals of an effect of 100 nats beside a second one: its gain, its values and what it does."""
    best, second = lead("yaw_scrub", (1.0, 0.0, 0.0)), lead("lateral_slip", column)
    model = evaluate(drives, {**TRUTH, "yaw_scrub": 0.16}, DECLARED, NOISE)
    fits = {"yaw_scrub": FittedLead(best, model, 100.0)}
    if gain is not None:
        fits["lateral_slip"] = FittedLead(second, evaluate(drives, {**TRUTH, **theta}, DECLARED, NOISE), gain)
    (adopted,) = adopt([], Choice(100.0, model, best), Evidence([best, second], fits, (), []))
    return [rival.effect for rival in adopted.rivals]


@pytest.mark.parametrize(("gain", "expected"), [(50.0, []), (65.0, []), (75.0, ["lateral_slip"])])
def test_a_second_effect_is_a_rival_by_most_of_the_evidence_if_it_predicts_no_worse(drives, gain, expected):
    assert rivals(drives, gain, AS_GOOD) == expected


@pytest.mark.parametrize(("gain", "expected"), [(75.0, []), (96.0, []), (98.0, ["lateral_slip"])])
def test_an_effect_that_predicts_worse_is_a_rival_only_within_three_nats(drives, gain, expected):
    assert rivals(drives, gain, WORSE) == expected


@pytest.mark.parametrize("gain", [None, 20.0])
def test_an_effect_that_does_the_same_to_the_motion_is_a_rival_whatever_its_evidence(drives, gain):
    assert rivals(drives, gain, AS_GOOD, ALONG) == ["lateral_slip"]


@pytest.mark.parametrize(("gain", "expected"), [(50.0, []), (80.0, ["delay_jitter"])])
def test_a_random_effect_has_the_other_as_rival_by_most_of_the_evidence(drives, gain, expected):
    lost, late = (RandomEffect(name, name, 0.1, (0.05, 0.2), nats, 0.01) for name, nats in
                  (("dropped_commands", 100.0), ("delay_jitter", gain)))  # fmt: skip
    choice = Choice(100.0, evaluate(drives, TRUTH, DECLARED, NOISE), random=lost)
    (adopted,) = adopt([], choice, Evidence([], {}, (lost, late), []))
    assert [rival.effect for rival in adopted.rivals] == expected
    assert (adopted.names, adopted.interval) == (("dropped_commands",), (0.05, 0.2))


def test_an_effect_that_does_nothing_beside_the_last_one_is_dropped_and_one_that_pays_is_kept():
    drives = planted_drives({**TRUTH, "yaw_scrub": 0.13}, episodes=4, seconds=12.0)
    idle, pays, last = (
        AdoptedEffect(name, "", (name,), ((name,),), 60.0, 0.002, ())
        for name in ("lateral_slip", "yaw_scrub", "turn_slip")
    )
    theta = {**TRUTH, "yaw_scrub": 0.13, "lateral_slip": 0.0, "turn_slip": 0.0}
    free = DECLARED + idle.free + pays.free + last.free
    model, kept = drop_idle(fit(drives, theta, free), [pays, idle, last])
    assert [effect.effect for effect in kept] == ["yaw_scrub", "turn_slip"]
    assert "lateral_slip" not in model.theta
    assert model.theta["yaw_scrub"] == pytest.approx(0.13, abs=0.005)
