"""What has no name is learnt, and used only where it is shown to help.
It is tested on other drives, and says when names are in its way; curves that do what a named effect does are read back
into its name.
"""

from dataclasses import replace

import numpy as np
import pytest
from learnt_truth import TURNING, VEERING
from planted import TRUTH, drives_of, planted_drives, planted_log, with_poses

from proxytune.diagnosis import RULES, AdoptedEffect, Findings, Learning, Ratio, cut, pose_errors
from proxytune.diagnosis.motion import discrepancy, prediction
from proxytune.diagnosis.motion.discrepancy import Discrepancy, fit_discrepancy, match_named_effect
from proxytune.diagnosis.motion.fitting import evaluate
from proxytune.diagnosis.motion.innovations import FIRST_GUESS
from proxytune.diagnosis.motion.screening import candidates
from proxytune.driving import read_robot
from proxytune.effects import GROUPS, FittedRange, Learnt, LearntCurve, learnt_theta

RAMP = (0.7, 0.7)
"""Seconds in which a command grows from 0 to 1, and shrinks back."""


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=3, seconds=20.0, noise=None)


@pytest.fixture(scope="module")
def bent():
    return planted_drives({**TRUTH, **TURNING}, episodes=6, seconds=20.0)


@pytest.fixture(scope="module")
def tested():
    return planted_drives({**TRUTH, **TURNING}, episodes=3, seconds=20.0, seed=9)


def squares(drives, theta):
    """The mean square of a model's errors over two seconds."""
    return float(np.mean(pose_errors(drives, theta, cut(drives, 2.0))[:, 0] ** 2))


@pytest.fixture(scope="module")
def found(bent):
    return bent, fit_discrepancy(bent, TRUTH)


def test_too_few_blocks_or_windows_teach_nothing_nor_test_it(tested):
    learnt = fit_discrepancy(planted_drives(TRUTH, episodes=8, seconds=1.5), TRUTH)
    assert (learnt.used, dict(learnt.theta), len(learnt.held_out)) == (False, {}, 0)
    learnt = fit_discrepancy(planted_drives({**TRUTH, **TURNING}, episodes=1, seconds=12.0), TRUTH)
    assert (dict(learnt.theta), learnt.used) == ({}, False)
    assert len(learnt.held_out)
    errors = [discrepancy._error(TRUTH, TRUTH, replace(tested, block=tested.block % count), 2.0) for count in (2, 3)]
    assert [error is None for error in errors] == [True, False]


def test_a_hidden_curve_is_learnt_by_its_signal_lowers_the_error_of_other_drives_and_passes_the_guard(found, tested):
    _, learnt = found
    assert learnt.used
    assert max(learnt.share, key=lambda title: learnt.share[title]) == "turn rate"
    assert sum(learnt.share.values()) == pytest.approx(1.0)
    after = squares(tested, {**TRUTH, **learnt.theta})
    assert after < 0.25 * squares(tested, TRUTH)
    assert after < 1.5 * squares(tested, {**TRUTH, **TURNING})
    drives, learnt = found
    assert set(learnt.guard) == {1.0, 2.0, 5.0}
    assert np.sqrt(learnt.held_out.mean() / squares(drives, TRUTH)) == pytest.approx(learnt.guard[2.0].value)
    assert squares(drives, {**TRUTH, **learnt.theta}) < learnt.held_out.mean()
    assert DULL.value < RULES.discrepancy_harms < BAD.value
    assert GOOD.value < RULES.discrepancy_helps < DULL.value
    assert discrepancy._helps({1.0: GOOD, 2.0: DULL}, RULES)
    for guard in ((GOOD, BAD), (DULL, DULL), (UNSURE, DULL), ()):
        assert not discrepancy._helps(dict(enumerate(guard)), RULES), guard
    assert not Discrepancy().used


@pytest.mark.slow
def test_curves_that_do_not_clearly_better_a_rival_are_not_used(found):
    drives, learnt = found
    refused = fit_discrepancy(drives, TRUTH, (), learnt.held_out)
    assert (refused.used, dict(refused.guard), dict(refused.theta)) == (False, {}, {})
    beaten = fit_discrepancy(drives, TRUTH, (), 1.5 * learnt.held_out)
    assert (beaten.used, beaten.theta) == (True, learnt.theta)


@pytest.mark.slow
def test_curves_that_come_nowhere_near_a_rival_are_given_up_after_three_linearisations(found, monkeypatch):
    drives, learnt = found
    linearised = []

    def slopes_of(*given):
        linearised.append(prediction.slopes_of(*given))
        return linearised[-1]

    monkeypatch.setattr(discrepancy, "slopes_of", slopes_of)
    given_up = fit_discrepancy(drives, TRUTH, (), 1e-4 * learnt.held_out)
    assert (given_up.used, len(given_up.held_out), len(linearised)) == (False, 0, 3)


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_used_where_nothing_is_missing(seed):
    assert not fit_discrepancy(planted_drives(TRUTH, episodes=6, seconds=12.0, seed=seed), TRUTH).used


def test_nothing_is_looked_for_where_only_the_noise_of_poses_is_left_nor_beside_names_that_leave_no_more(monkeypatch):
    monkeypatch.setattr(discrepancy, "offer_curves", None)  # to be asked for curves would be an error
    names, noise = {"saturation.limit": 0.25}, np.random.default_rng(1)
    log = planted_log({**TRUTH, **names}, episodes=6, seconds=12.0, noise=None)
    drives = drives_of(with_poses(log, lambda poses: poses + noise.normal(0.0, 0.003, poses.shape)))
    learning = discrepancy.learn(findings(drives, names, (WRONG,)), drives, (2.0,))
    assert (learning.discrepancy.used, learning.names_doubtful) == (False, False)
    assert len(learning.discrepancy.held_out)
    with pytest.raises(TypeError):
        fit_discrepancy(drives, TRUTH)


@pytest.mark.slow
def test_slow_wheels_are_learnt_alone_and_else_what_matters_in_few_drives_is_looked_for():
    drives = planted_drives({**TRUTH, "wheel_gain.left": 0.9, "wheel_gain.right": 0.9}, episodes=6, seconds=12.0)
    learnt = fit_discrepancy(drives, TRUTH)
    assert learnt.used
    assert dict(learnt.share) == {"level": 1.0}
    drives = planted_drives({**TRUTH, "understeer": 0.8}, episodes=6, seconds=12.0)
    learnt = fit_discrepancy(drives, TRUTH)
    assert learnt.used
    assert learnt.guard[2.0].value < 0.7
    assert not fit_discrepancy(replace(drives, rules=replace(RULES, rare_group_share=0.9)), TRUTH).used


@pytest.mark.slow
def test_a_delay_that_stood_for_slow_commands_gives_way_to_them():
    slow = learnt_theta(
        Learnt(FittedRange((-1.0, 1.0), (-6.0, 6.0)), (LearntCurve("ramped", "duty", (RAMP,), (1.0,)),))
    )
    drives = planted_drives({**TRUTH, **slow}, episodes=6, seconds=15.0)
    before = {**TRUTH, "delay": TRUTH["delay"] + 0.15}
    alone, along = (fit_discrepancy(drives, before, free) for free in ((), (("delay",),)))
    assert along.used
    assert max(along.share, key=lambda title: along.share[title]) == GROUPS["ramped"].title
    assert along.theta["delay"] == pytest.approx(TRUTH["delay"], abs=0.06)
    assert "delay" not in alone.theta
    assert along.held_out.mean() < 0.7 * alone.held_out.mean()


GOOD, DULL = Ratio(0.8, (0.7, 0.9)), Ratio(1.0, (0.9, 1.1))
BAD, UNSURE = Ratio(1.1, (0.9, 1.3)), Ratio(0.8, (0.6, 1.01))


WRONG = AdoptedEffect("saturation", "", ("saturation.limit",), (), 100.0, 0.001, ())


def findings(drives, names, adopted=()):
    declared, model = (evaluate(drives, theta, (), FIRST_GUESS) for theta in (TRUTH, {**TRUTH, **names}))
    return Findings(declared, model, adopted, (), (), ())


@pytest.mark.slow
def test_the_error_with_names_and_curves_is_told_beside_that_with_names_alone(bent, tested):
    learning = discrepancy.learn(findings(bent, {}), tested, (1.0, 2.0, 60.0))
    assert [error.horizon_s for error in learning.errors] == [1.0, 2.0]
    assert all(error.ratio.value < 0.7 and error.ratio.interval[1] < 1.0 for error in learning.errors)
    assert learning.theta == learning.discrepancy.theta
    assert learning.model == {**TRUTH, **learning.theta}
    assert not learning.names_doubtful


@pytest.mark.slow
def test_names_that_hide_what_curves_could_say_are_doubtful_and_left_out_of_the_model_with_curves(bent, tested):
    names = {"saturation.limit": 0.25}
    learning = discrepancy.learn(findings(bent, names, (WRONG,)), tested, (2.0,))
    assert learning.names_doubtful
    assert not names.keys() & learning.model.keys()
    (error,) = learning.errors
    assert error.after.value == pytest.approx(np.sqrt(squares(tested, learning.model)))
    assert error.ratio.value == pytest.approx(error.after.value / np.sqrt(squares(tested, {**TRUTH, **names})))


def test_what_the_guard_refuses_is_neither_told_nor_driven_and_used_signals_come_first_each_once():
    learning = Learning(Discrepancy({"learnt.turn_rate.yaw@1.0": 0.1}, {"turn rate": 1.0}), (), False)
    assert learning.theta == {}
    assert learning.depends_on(("heading",)) == ("heading",)
    learning = Learning(Discrepancy({}, {"heading": 0.2, "turn rate": 0.8}, {}, True), (), False)
    assert learning.depends_on(("position", "heading")) == ("turn rate", "heading", "position")


TAKEN = ("trim", "delay")
FEW = ("lateral_slip", "turn_slip", "yaw_scrub")


@pytest.fixture(autouse=True)
def _few_candidates(monkeypatch):
    few = [one for one in candidates(read_robot("duckiebot"), {}, ()) if one.effect in FEW]
    monkeypatch.setattr(discrepancy, "candidates", lambda robot, theta, taken: few)


def perfect(drives, theta):
    """What curves that say what is true would gain."""
    return Discrepancy({}, {}, {}, True, pose_errors(drives, theta, cut(drives, 2.0))[:, 0] ** 2)


def test_curves_are_named_only_where_they_do_what_an_effect_does():
    truth = {**TRUTH, "turn_slip": 0.13}
    drives = planted_drives(truth, episodes=2, seconds=12.0)
    found = match_named_effect(drives, TRUTH, perfect(drives, truth), TAKEN)
    assert (found.effect, found.form) == ("turn_slip", "")
    assert found.theta["turn_slip"] == pytest.approx(0.13, abs=0.02)
    assert found.share > 0.9
    truth = {**TRUTH, **VEERING}
    drives = planted_drives(truth, episodes=2, seconds=12.0)
    assert match_named_effect(drives, TRUTH, perfect(drives, truth), TAKEN) is None
    drives = planted_drives(TRUTH, episodes=2, seconds=12.0)
    assert match_named_effect(drives, TRUTH, replace(perfect(drives, TRUTH), held_out=np.ones(3)), TAKEN) is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tracked", "share"),
    [
        (lambda poses: poses * (1.0, 0.8, 1.0), "the tracker's y"),
        (lambda poses: poses + np.sin(2.0 * poses) * (0.0, 0.0, 0.15), "heading"),
    ],
)
def test_what_a_tracker_does_to_places_and_headings_is_learnt_as_its_own(tracked, share):
    logs = (planted_log(TRUTH, seed=seed, episodes=4, seconds=30.0) for seed in (1, 2))
    fitted, others = (drives_of(with_poses(log, tracked)) for log in logs)
    learnt = fit_discrepancy(fitted, TRUTH)
    assert learnt.used
    assert max(learnt.share, key=lambda title: learnt.share[title]) == share
    assert squares(others, {**TRUTH, **learnt.theta}) < 0.5 * squares(others, TRUTH)


@pytest.mark.parametrize(("alone", "chosen"), [(1.0, "turn rate"), (2.0, "time since a command changed")])
def test_curves_over_commands_are_left_out_where_motion_alone_predicts_as_well(drives, monkeypatch, alone, chosen):
    def fit_curves(task, patient):
        group = "held" if any(curve.group == "held" for curve in task.offer.curves) else "turn_rate"
        return {group: 1.0}, {group: 1.0}, [{group: 1.0}]

    def cross_validate(drives, theta, folds, windows):
        noise = np.random.default_rng(len(folds[0])).uniform(0.9, 1.1, len(windows.increment))
        return noise * (1.0 if "held" in folds[0] else alone)

    monkeypatch.setattr(discrepancy, "_fit_curves", fit_curves)
    monkeypatch.setattr(discrepancy, "_cross_validate", cross_validate)
    monkeypatch.setattr(discrepancy, "_guard", lambda *_: {})
    monkeypatch.setattr(discrepancy, "_helps", lambda *_: True)
    assert list(fit_discrepancy(drives, TRUTH).share) == [chosen]
