"""What was learnt is tested on other drives, and says when names are in its way.

Curves that do what a named effect does are read back into its name.
"""

from dataclasses import replace

import numpy as np
import pytest
from learnt_truth import TURNING, VEERING
from planted import TRUTH, planted_drives

from proxytune.diagnosis import AdoptedEffect, Findings, Learning, cut, pose_errors
from proxytune.diagnosis.motion import discrepancy as reading
from proxytune.diagnosis.motion.discrepancy import Discrepancy, learn, match_named_effect
from proxytune.diagnosis.motion.fitting import evaluate
from proxytune.diagnosis.motion.innovations import FIRST_GUESS
from proxytune.diagnosis.motion.screening import candidates
from proxytune.driving import read_robot

WRONG = AdoptedEffect("saturation", "", ("saturation.limit",), (), 100.0, 0.001, ())


def found(drives, names, adopted=()):
    declared, model = (evaluate(drives, theta, (), FIRST_GUESS) for theta in (TRUTH, {**TRUTH, **names}))
    return Findings(declared, model, adopted, (), (), ())


@pytest.fixture(scope="module")
def drives():
    return planted_drives({**TRUTH, **TURNING}, episodes=6, seconds=20.0)


@pytest.fixture(scope="module")
def tested():
    return planted_drives({**TRUTH, **TURNING}, episodes=3, seconds=20.0, seed=9)


@pytest.mark.slow
def test_the_error_with_names_and_remainder_is_told_beside_that_with_names_alone(drives, tested):
    learning = learn(found(drives, {}), tested, (1.0, 2.0, 60.0))
    assert [error.horizon_s for error in learning.errors] == [1.0, 2.0]
    assert all(error.ratio.value < 0.7 and error.ratio.interval[1] < 1.0 for error in learning.errors)
    assert learning.theta == learning.discrepancy.theta
    assert not learning.names_doubtful


@pytest.mark.slow
def test_names_that_hide_what_curves_could_say_are_doubtful(drives, tested):
    learning = learn(found(drives, {"saturation.limit": 0.25}, (WRONG,)), tested, (2.0,))
    assert learning.names_doubtful


def test_what_the_guard_refuses_is_neither_told_nor_driven():
    learning = Learning(Discrepancy({"learnt.turn_rate.yaw@1.0": 0.1}, {"turn rate": 1.0}), (), False)
    assert learning.theta == {}
    assert learning.depends_on(("heading",)) == ("heading",)


def test_signals_of_used_curves_come_first_each_once():
    learning = Learning(Discrepancy({}, {"heading": 0.2, "turn rate": 0.8}, {}, True), (), False)
    assert learning.depends_on(("position", "heading")) == ("turn rate", "heading", "position")


TAKEN = ("trim", "delay")
FEW = ("lateral_slip", "turn_slip", "yaw_scrub")


@pytest.fixture(autouse=True)
def _few_candidates(monkeypatch):
    few = [one for one in candidates(read_robot("duckiebot"), {}, ()) if one.effect in FEW]
    monkeypatch.setattr(reading, "candidates", lambda robot, theta, taken: few)


def perfect(drives, theta):
    """What curves that say what is true would gain."""
    return Discrepancy({}, {}, {}, True, pose_errors(drives, theta, cut(drives, 2.0))[:, 0] ** 2)


def test_curves_that_do_what_turn_slip_does_are_turn_slip_with_its_value():
    truth = {**TRUTH, "turn_slip": 0.13}
    drives = planted_drives(truth, episodes=2, seconds=12.0)
    found = match_named_effect(drives, TRUTH, perfect(drives, truth), TAKEN)
    assert (found.effect, found.form) == ("turn_slip", "")
    assert found.theta["turn_slip"] == pytest.approx(0.13, abs=0.02)
    assert found.share > 0.9


def test_curves_that_no_name_describes_have_none():
    truth = {**TRUTH, **VEERING}
    drives = planted_drives(truth, episodes=2, seconds=12.0)
    assert match_named_effect(drives, TRUTH, perfect(drives, truth), TAKEN) is None


def test_curves_that_gain_nothing_look_like_nothing():
    drives = planted_drives(TRUTH, episodes=2, seconds=12.0)
    worse = replace(perfect(drives, TRUTH), held_out=np.ones(3))
    assert match_named_effect(drives, TRUTH, worse, TAKEN) is None
