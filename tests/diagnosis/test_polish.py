"""Parameters are fitted to windows, and only where windows that were left out are no worse."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import DECLARED, NOISE, TRUTH, planted_drives

from proxytune.diagnosis.horizon.polish import fit_windows, held_out_squares, horizons, polish_fit
from proxytune.diagnosis.horizon.windows import cut, pose_errors
from proxytune.diagnosis.model.fitting import evaluate
from proxytune.diagnosis.rules import RULES


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=6, seconds=20.0)


def model(drives, **values):
    return evaluate(drives, {**TRUTH, **values}, DECLARED, NOISE)


def squares(drives, theta, horizon_s=2.0):
    return pose_errors(drives, theta, cut(drives, horizon_s))[:, 0] ** 2


def test_windows_lead_back_to_the_values_that_drove():
    quiet = planted_drives(TRUTH, episodes=2, seconds=20.0, noise=None)
    found = fit_windows(quiet, {"trim": 0.0, "delay": 0.18}, DECLARED, cut(quiet, 2.0))
    assert found["trim"] == pytest.approx(TRUTH["trim"], abs=2e-4)
    assert found["delay"] == pytest.approx(TRUTH["delay"], abs=2e-3)


def test_without_a_free_parameter_or_a_window_nothing_is_fitted(drives):
    assert fit_windows(drives, TRUTH, (), cut(drives, 2.0)) == TRUTH
    assert fit_windows(drives, {"trim": 0.0, "delay": 0.1}, DECLARED, cut(drives, 100.0)) == {"trim": 0.0, "delay": 0.1}


def test_a_few_wild_poses_do_not_bend_the_parameters(drives):
    poses = drives.poses.copy()
    poses[300:306] += (3.0, -2.0, 1.0)
    found = fit_windows(replace(drives, poses=poses), TRUTH, DECLARED, cut(drives, 2.0))
    assert found["trim"] == pytest.approx(TRUTH["trim"], abs=0.01)


def test_long_logs_are_thinned(drives, monkeypatch):
    asked = []
    monkeypatch.setattr("proxytune.diagnosis.horizon.polish.MOST_WINDOWS", 5)
    monkeypatch.setattr(
        "proxytune.diagnosis.horizon.polish.predicted_motion",
        lambda d, t, w: asked.append(len(w.begin)) or np.zeros((len(w.window), 3)),
    )
    fit_windows(drives, TRUTH, DECLARED, cut(drives, 2.0))
    assert 3 <= max(asked) <= 5


def test_no_pose_is_predicted_by_what_was_fitted_to_it(drives):
    poses = drives.poses.copy()
    own = drives.block % 4 == 0
    poses[own, :, 2] += np.linspace(0.0, 2.0, own.sum())[:, None]
    fitted = fit_windows(replace(drives, poses=poses), TRUTH, DECLARED, cut(drives, 2.0))
    apart = held_out_squares(replace(drives, poses=poses), TRUTH, DECLARED, 2.0)
    others = drives.block[cut(drives, 2.0).increment] % 4 == 0
    together = squares(replace(drives, poses=poses), fitted)
    assert apart[2.0][others].mean() > together[others].mean()
    assert set(apart) == set(horizons(drives)) == {1.0, 2.0, 5.0}


def test_values_that_predict_poorly_are_fitted_again(drives):
    poor = model(drives, trim=0.08, delay=0.2)
    better, polish = polish_fit(poor)
    assert squares(drives, better.theta).mean() < 0.5 * squares(drives, poor.theta).mean()
    assert min(one.value for one in polish.ratios.values()) < RULES.polish_helps
    assert max(one.value for one in polish.ratios.values()) <= RULES.polish_harms
    for name, true in TRUTH.items():
        low, high = polish.intervals[name]
        assert low < better.theta[name] < high
        assert low - 0.5 * (high - low) < true < high + 0.5 * (high - low)


def test_values_that_windows_do_not_mend_are_kept(drives):
    right = model(drives)
    assert polish_fit(right) == (right, None)


def test_values_that_would_do_harm_at_some_horizon_are_not_taken(drives, monkeypatch):
    poor = model(drives, trim=0.08, delay=0.2)
    monkeypatch.setattr("proxytune.diagnosis.horizon.polish.RULES", replace(RULES, polish_harms=0.01))
    assert polish_fit(poor) == (poor, None)


def test_drives_too_short_for_windows_in_three_blocks_are_not_fitted_to():
    few = model(planted_drives(TRUTH, episodes=2, seconds=4.0), trim=0.08)
    assert horizons(few.drives) == ()
    assert polish_fit(few) == (few, None)
