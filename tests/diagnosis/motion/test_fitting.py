"""Parameters are found with honest intervals, and logs that cannot bear the question are refused."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from planted import DECLARED, NOISE, TRUTH, drives_of, fitted, planted_drives, planted_log

from proxytune.diagnosis import Fit, increments, span, theta_at
from proxytune.diagnosis.motion import fitting
from proxytune.diagnosis.motion.fitting import fit, held_out_log_likelihood, intervals, loss_of, slopes
from proxytune.diagnosis.motion.innovations import Whitener, whitener
from proxytune.errors import LogError


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH)


@pytest.fixture(scope="module")
def found(drives):
    return fitted(drives)


def test_trim_delay_and_noise_are_found_in_narrow_intervals_and_nothing_free_leaves_them_alone(found, drives):
    known = intervals(found)
    for name, true in TRUTH.items():
        low, high = known[name]
        assert low < true < high
        assert low < found.theta[name] < high
    assert known["trim"][1] - known["trim"][0] < 0.02
    assert known["delay"][1] - known["delay"][0] < 0.03
    np.testing.assert_allclose(found.noise.drive, NOISE.drive, rtol=0.3)
    np.testing.assert_allclose(found.noise.pose, NOISE.pose, rtol=0.15)
    assert fit(drives, TRUTH, ()).theta == TRUTH


@pytest.mark.parametrize("start", [0.08, 0.2, 0.28, 0.34])
def test_a_delay_is_found_from_afar_past_the_kinks_that_its_loss_has_at_every_tick(start):
    truth, free = {**TRUTH, "slew_rate": 1.6}, (*DECLARED, ("slew_rate",))
    found = fit(planted_drives(truth, episodes=8), {**truth, "delay": start}, free)
    assert found.theta["delay"] == pytest.approx(TRUTH["delay"], abs=0.005)
    low, high = intervals(found)["delay"]
    assert low < TRUTH["delay"] < high
    assert high - low < 0.015


@pytest.mark.slow
def test_intervals_of_four_and_of_eight_blocks_hold_the_truth_as_often_as_they_say():
    held = []
    for seed, episodes in product(range(10, 50), (1, 2)):
        known = intervals(fitted(planted_drives(TRUTH, seed=seed, episodes=episodes)))
        held += [known[name][0] <= true <= known[name][1] for name, true in TRUTH.items()]
    assert 0.93 < np.mean(held) < 0.99


def test_parameters_that_share_a_coordinate_stay_equal_and_steps_and_thresholds_are_found():
    truth = {"wheel_gain.left": 0.9, "wheel_gain.right": 0.9, **TRUTH}
    drives = planted_drives(truth, episodes=3)
    both = (("wheel_gain.left", "wheel_gain.right"),)
    fit_of_gain = fit(drives, {**truth, "wheel_gain.left": 1.0, "wheel_gain.right": 1.0}, both)
    assert fit_of_gain.theta["wheel_gain.left"] == fit_of_gain.theta["wheel_gain.right"] == pytest.approx(0.9, abs=0.01)
    assert set(intervals(fit_of_gain)) == set(both[0])
    truth = {**TRUTH, "command_quantisation": 0.25}
    free = (*DECLARED, ("command_quantisation",))
    found = fit(planted_drives(truth), {**truth, "command_quantisation": 0.2503}, free)
    assert found.theta["command_quantisation"] == pytest.approx(0.25, rel=2e-3)
    assert not found.slopes[:, 2].any()
    low, high = intervals(found)["command_quantisation"]
    assert 0.24 < low < 0.25 < high < 0.26
    truth = {**TRUTH, "stiction.breakaway": 0.141, "stiction.imbalance": 0.0}
    found = fit(planted_drives(truth), {**truth, "stiction.breakaway": 0.15}, (*DECLARED, ("stiction.breakaway",)))
    low, high = intervals(found)["stiction.breakaway"]
    assert low < 0.141 < high < low + 0.03


@pytest.mark.parametrize("start", [0.09, 0.2])
def test_a_scan_finds_the_threshold_of_stiction(start):
    truth = {**TRUTH, "stiction.breakaway": 0.14, "stiction.imbalance": 0.0}
    found = fit(planted_drives(truth), {**truth, "stiction.breakaway": start}, (("stiction.breakaway",),))
    assert found.theta["stiction.breakaway"] == pytest.approx(0.14, rel=0.03)


def test_of_steps_as_good_a_round_one_is_taken_and_values_stay_within_their_bounds(drives, monkeypatch):
    name = "command_quantisation"
    monkeypatch.setattr(fitting, "loss_of", lambda drives, theta, whiten: round(abs(theta[name] - 0.25), 3))
    theta = {**TRUTH, name: 0.2503}
    assert fitting._scan(drives, theta, ((name,),), None, np.array([0.9, 1.1]))[name] == 0.25
    low, high = span(("delay",), drives)
    edge = planted_drives({"trim": 0.0, "delay": high, "motor_lag.time_constant": 0.3}, episodes=3)
    known = fit(edge, {"trim": 0.0, "delay": high - 0.02}, DECLARED).theta
    assert low <= known["delay"] <= high
    assert known["delay"] == pytest.approx(high, abs=1e-3)


def test_slopes_foretell_a_small_change_also_backwards_and_the_fitted_model_loses_least(found, drives):
    low, high = span(("trim",), found.drives)
    moved = theta_at(found.theta, (("trim",),), np.array([found.theta["trim"] + 1e-4 * (high - low)]))
    there = found.whiten.whiten(found.drives.measured - increments(found.drives, moved))
    change = found.slopes[:, 0] * 1e-4
    assert np.linalg.norm(there - found.innovations - change) < 0.01 * np.linalg.norm(change)

    whiten = whitener(drives, NOISE)
    high = span(("delay",), drives)[1]
    edge = slopes(drives, {"trim": 0.0, "delay": high}, (("delay",),), whiten)
    inside = slopes(drives, {"trim": 0.0, "delay": high - 0.001}, (("delay",),), whiten)
    assert np.corrcoef(edge[:, 0], inside[:, 0])[0, 1] > 0.9

    here = loss_of(found.drives, found.theta, found.whiten)
    for name, step in (("trim", 0.01), ("delay", 0.01)):
        for sign in (-1.0, 1.0):
            moved = {**found.theta, name: found.theta[name] + sign * step}
            assert loss_of(found.drives, moved, found.whiten) > here + 0.1


def linear(drives, columns=2, seed=4):
    """A model whose innovations are linear in its parameters and small."""
    random = np.random.default_rng(seed)
    size = 3 * len(drives.episode)
    slope = random.standard_normal((size, columns))
    factor = np.zeros((6, size))
    factor[0] = random.uniform(0.5, 2.0, size)
    free = tuple((str(number),) for number in range(columns))
    z = 0.5 * random.standard_normal(size)
    return Fit(drives, {}, free, NOISE, Whitener(factor), z, slope)


def test_blocks_are_foretold_and_useless_parameters_cost(drives):
    few = drives.only(np.isin(drives.block, (0, 3, 4, 7)) & (np.arange(len(drives.block)) % 5 == 0))
    model = linear(few)
    told = held_out_log_likelihood(model)
    label = np.repeat(few.block, 3)
    for block in range(4):
        own = label == block
        refit = np.linalg.lstsq(model.slopes[~own], -model.innovations[~own], rcond=None)[0]
        left = model.innovations[own] + model.slopes[own] @ refit
        surprise = 0.5 * left @ left + np.log(model.whiten.factor[0][own]).sum()
        assert told[block] == pytest.approx(-surprise, rel=1e-5)

    model = linear(drives, columns=3)
    assert gain(model) < 2.0
    needed = replace(model, innovations=model.innovations + 0.2 * model.slopes[:, 1])
    assert gain(needed) == pytest.approx(0.5 * 0.04 * (model.slopes[:, 1] ** 2).sum(), rel=0.3)


def gain(model):
    """What all parameters but the first are worth."""
    alone = replace(model, slopes=model.slopes[:, :1])
    return float(held_out_log_likelihood(model).sum() - held_out_log_likelihood(alone).sum())


@pytest.fixture(scope="module")
def log():
    return planted_log({"trim": 0.03, "delay": 0.12}, episodes=4, seconds=40.0)


def test_a_robot_that_is_never_told_to_move_is_refused_and_an_honest_log_is_not(log):
    fitting.check_motion("yard", drives_of(log))
    fitting.check_units("yard", drives_of(log), {"trim": 0.0, "delay": 0.15})
    drives = drives_of(log)
    with pytest.raises(LogError, match="^yard: every command is zero"):
        fitting.check_motion("yard", replace(drives, duties=0.0 * drives.duties))
