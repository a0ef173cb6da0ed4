"""Curves that do what a named effect does are read back into its name."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from learnt_truth import VEERING
from planted import TRUTH, planted_drives

from proxytune.diagnosis.horizon.windows import cut, pose_errors
from proxytune.diagnosis.naming.candidates import candidates
from proxytune.diagnosis.remainder import lookalike as reading
from proxytune.diagnosis.remainder.lookalike import lookalike
from proxytune.diagnosis.remainder.remainder import Remainder
from proxytune.driving.robot import read_robot

TAKEN = ("trim", "delay")
FEW = ("lateral_slip", "turn_slip", "yaw_scrub")


@pytest.fixture(autouse=True)
def _few_candidates(monkeypatch):
    few = [one for one in candidates(read_robot("duckiebot"), {}, ()) if one.effect in FEW]
    monkeypatch.setattr(reading, "candidates", lambda robot, theta, taken: few)


def perfect(drives, theta):
    """What curves that say what is true would gain."""
    return Remainder({}, {}, {}, True, pose_errors(drives, theta, cut(drives, 2.0))[:, 0] ** 2)


def test_curves_that_do_what_turn_slip_does_are_turn_slip_with_its_value():
    truth = {**TRUTH, "turn_slip": 0.13}
    drives = planted_drives(truth, episodes=2, seconds=12.0)
    found = lookalike(drives, TRUTH, perfect(drives, truth), TAKEN)
    assert (found.effect, found.form) == ("turn_slip", "")
    assert found.theta["turn_slip"] == pytest.approx(0.13, abs=0.02)
    assert found.share > 0.9


def test_curves_that_no_name_describes_have_none():
    truth = {**TRUTH, **VEERING}
    drives = planted_drives(truth, episodes=2, seconds=12.0)
    assert lookalike(drives, TRUTH, perfect(drives, truth), TAKEN) is None


def test_curves_that_gain_nothing_look_like_nothing():
    drives = planted_drives(TRUTH, episodes=2, seconds=12.0)
    worse = replace(perfect(drives, TRUTH), held_out=np.ones(3))
    assert lookalike(drives, TRUTH, worse, TAKEN) is None
