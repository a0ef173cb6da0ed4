"""The error at a horizon is told before and after, against the best that any model reached."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))

from planted import CALM, DECLARED, NOISE, TRUTH, planted_drives

from proxytune.diagnosis.horizon.floor import pose_noise
from proxytune.diagnosis.horizon.windows import pose_errors
from proxytune.diagnosis.horizon_error import KeptAside, horizon_error
from proxytune.diagnosis.model.fitting import evaluate
from proxytune.diagnosis.naming.findings import AdoptedEffect, DroppedEffect, Findings, Variant

SCRUBBED = {**TRUTH, "yaw_scrub": 0.13}
SCRUB = AdoptedEffect("yaw_scrub", "", ("yaw_scrub",), (("yaw_scrub",),), 60.0, 0.002, ())


@pytest.fixture(scope="module")
def drives():
    return planted_drives(SCRUBBED, episodes=6, seconds=15.0, noise=CALM)


def error(drives, *, model=TRUTH, dropped=(), learnt=None, horizon_s=2.0, how=pose_errors):
    declared, extended = (evaluate(drives, theta, DECLARED, NOISE) for theta in (TRUTH, model))
    findings = Findings(declared, extended, (), (), (), (), tuple(dropped))
    kept = KeptAside(drives, drives, pose_noise(drives, model))
    return horizon_error(findings, kept, horizon_s, learnt or {}, how)


def test_before_is_the_declared_model_and_after_the_extended_one(drives):
    told = error(drives, model=SCRUBBED)
    assert told.before.value > 3.0 * told.after.value
    assert told.ratio.value == pytest.approx(told.after.value / told.before.value)
    assert told.floor.reached == pytest.approx(told.after.value)


@pytest.mark.parametrize(("model", "times"), [(TRUTH, 1), (SCRUBBED, 2)])
def test_a_model_to_which_nothing_was_added_is_driven_once(drives, model, times):
    driven = []

    def drive(*given):
        driven.append(given)
        return pose_errors(*given)

    told = error(drives, model=model, how=drive)
    assert len(driven) == times
    assert (told.before == told.after) == (times == 1)


@pytest.mark.parametrize("how", [{"dropped": [DroppedEffect(SCRUB, Variant(SCRUBBED, DECLARED))]},
                                 {"learnt": {"yaw_scrub": 0.13}}])  # fmt: skip
def test_what_a_dropped_effect_or_learnt_curves_reached_lowers_the_floor(drives, how):
    plain, lower = error(drives), error(drives, **how)
    assert plain.floor.reached == plain.after.value == lower.after.value
    assert lower.floor.reached < plain.floor.reached / 3.0


def test_no_error_is_told_where_fewer_than_three_blocks_have_a_window(drives):
    assert error(drives, horizon_s=100.0) is None
    assert error(drives.only(drives.block < 2)) is None
    assert error(drives.only(drives.block < 3)) is not None
