"""The error at a horizon before and after, and the verdict that follows from what is left of it."""

from dataclasses import replace

import pytest
from planted import CALM, DECLARED, NOISE, TRUTH, drives_of, planted_drives, planted_log

from proxytune.diagnosis import AdoptedEffect, Findings, Ratio
from proxytune.diagnosis.answer import verdict
from proxytune.diagnosis.motion.diagnose import KeptAside, bracket, horizon_error, is_explained
from proxytune.diagnosis.motion.evidence import DroppedEffect, Variant
from proxytune.diagnosis.motion.fitting import evaluate
from proxytune.diagnosis.motion.multistep_fit import pose_noise
from proxytune.diagnosis.motion.prediction import Repeated

SCRUBBED = {**TRUTH, "yaw_scrub": 0.13}
SCRUB = AdoptedEffect("yaw_scrub", "", ("yaw_scrub",), (("yaw_scrub",),), 60.0, 0.002, ())


@pytest.fixture(scope="module")
def drives():
    return planted_drives(SCRUBBED, episodes=6, seconds=15.0, noise=CALM)


def error(drives, *, model=TRUTH, dropped=(), learnt=None, horizon_s=2.0):
    declared, extended = (evaluate(drives, theta, DECLARED, NOISE) for theta in (TRUTH, model))
    findings = Findings(declared, extended, (), (), (), (), tuple(dropped))
    return horizon_error(findings, KeptAside(drives, drives, pose_noise(drives, model)), horizon_s, learnt or {})


def test_before_is_the_declared_model_and_the_floor_lies_between_noise_and_what_was_reached(drives):
    told = error(drives, model=SCRUBBED)
    assert told.before.value > 3.0 * told.after.value
    assert told.ratio.value == pytest.approx(told.after.value / told.before.value)
    assert told.floor.reached == pytest.approx(told.after.value)
    assert error(drives, horizon_s=100.0) is None
    assert error(drives.only(drives.block < 2)) is None
    assert error(drives.only(drives.block < 3)) is not None
    short, long = planted_log(TRUTH, episodes=70, seconds=2.0), planted_log(TRUTH, episodes=1, seconds=9.0)
    longest = replace(long.episodes[0], name="long")
    assert error(drives_of(replace(short, episodes=(*short.episodes, longest))), horizon_s=5.0) is None
    floor = bracket(0.004, 0.012, None)
    assert floor.lower == 0.004
    assert 0.012 < floor.upper < 0.0125
    assert bracket(0.013, 0.012, None).lower == 0.012
    alone = bracket(0.004, 0.012, None).upper
    most = 0.006 * 0.6 / 0.5
    assert bracket(0.004, 0.012, BEYOND._replace(part=1.0)).upper == pytest.approx(alone * most / 0.012)
    half = ((0.012**2 + most**2) / 2.0) ** 0.5
    assert bracket(0.004, 0.012, BEYOND._replace(part=0.5)).upper == pytest.approx(alone * half / 0.012)
    assert bracket(0.004, 0.012, KNOWN).upper == alone
    assert bracket(0.010, 0.012, BEYOND._replace(part=1.0)).upper == 0.010
    assert bracket(0.004, 0.005, BEYOND._replace(part=1.0)).upper == bracket(0.004, 0.005, None).upper


@pytest.mark.parametrize("how", [{"dropped": [DroppedEffect(SCRUB, Variant(SCRUBBED, DECLARED))]},
                                 {"learnt": SCRUBBED}])  # fmt: skip
def test_what_a_dropped_effect_or_learnt_curves_reached_lowers_the_floor(drives, how):
    plain, lower = error(drives), error(drives, **how)
    assert plain.floor.reached == plain.after.value == lower.after.value
    assert lower.floor.reached < plain.floor.reached / 3.0


KNOWN = Repeated(Ratio(0.97, (0.9, 1.05)), 0.0116, 0.8)
BEYOND = Repeated(Ratio(0.5, (0.4, 0.6)), 0.006, 0.75)
UNSURE = Repeated(Ratio(0.75, (0.5, 1.1)), 0.009, 0.8)


def said(after, lower, *, reached=None, repeated=None, named=True, unnamed=False):
    floor = bracket(lower, after if reached is None else reached, repeated)
    return verdict(is_explained(after, floor, unnamed=unnamed), named=named)


@pytest.mark.parametrize("unnamed", [True, False])
def test_an_error_at_the_noise_of_the_poses_is_explained(unnamed):
    assert said(0.0045, 0.004, unnamed=unnamed) == "explained"
    assert said(0.0045, 0.004, unnamed=unnamed, named=False) == "nothing missing"


def test_an_error_that_nothing_lowers_is_explained_also_by_repeats_unless_few_or_unlike():
    assert said(0.0055, 0.004) == "explained"
    assert said(0.0065, 0.004) == "cannot be told"
    assert said(0.0055, 0.004, reached=0.005) == "cannot be told"
    assert said(0.012, 0.004, repeated=KNOWN) == "explained"
    assert said(0.012, 0.004, repeated=KNOWN, named=False) == "nothing missing"
    assert said(0.012, 0.0005, repeated=KNOWN._replace(part=0.03)) == "cannot be told"
    assert said(0.012, 0.0005, repeated=KNOWN) == "explained"
    assert said(0.029, 0.004, repeated=KNOWN) == "cannot be told"
    assert said(0.012, 0.004, repeated=KNOWN, reached=0.0105) == "cannot be told"
    assert said(0.0055, 0.004, repeated=BEYOND) == "partly explained"
    assert said(0.012, 0.004) == "cannot be told"
    assert said(0.012, 0.004, repeated=UNSURE) == "cannot be told"


@pytest.mark.parametrize(("named", "answer"), [(True, "partly explained"), (False, "unexplained")])
def test_an_error_that_drives_repeat_or_a_signal_explains_is_not_explained(named, answer):
    assert said(0.012, 0.004, repeated=BEYOND, named=named) == answer
    assert said(0.012, 0.004, unnamed=True, named=named) == answer
    assert said(0.012, 0.004, repeated=KNOWN, unnamed=True, named=named) == answer
