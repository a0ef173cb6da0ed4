"""What was learnt is tested on other drives, and says when names are in its way."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))

from learnt_truth import TURNING
from planted import TRUTH, planted_drives

from proxytune.diagnosis.model.fitting import evaluate
from proxytune.diagnosis.model.innovations import FIRST_GUESS
from proxytune.diagnosis.naming.findings import AdoptedEffect, Findings
from proxytune.diagnosis.remainder.learning import Learning, learn
from proxytune.diagnosis.remainder.remainder import Remainder

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
    assert learning.theta == learning.remainder.theta
    assert not learning.names_doubtful


@pytest.mark.slow
def test_names_that_hide_what_curves_could_say_are_doubtful(drives, tested):
    learning = learn(found(drives, {"saturation.limit": 0.25}, (WRONG,)), tested, (2.0,))
    assert learning.names_doubtful


def test_what_the_guard_refuses_is_neither_told_nor_driven():
    learning = Learning(Remainder({"learnt.turn_rate.yaw@1.0": 0.1}, {"turn rate": 1.0}), (), False)
    assert learning.theta == {}
    assert learning.depends_on(("heading",)) == ("heading",)


def test_signals_of_used_curves_come_first_each_once():
    learning = Learning(Remainder({}, {"heading": 0.2, "turn rate": 0.8}, {}, True), (), False)
    assert learning.depends_on(("position", "heading")) == ("turn rate", "heading", "position")
