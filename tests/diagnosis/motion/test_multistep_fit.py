"""Parameters are fitted to windows, by the noise that logs tell, only where windows left out are no worse."""

from dataclasses import replace

import numpy as np
import pytest
from planted import DECLARED, NOISE, TRUTH, drives_of, planted_drives, planted_log, with_poses

from proxytune.diagnosis import RULES, cut, pose_errors
from proxytune.diagnosis.motion import multistep_fit
from proxytune.diagnosis.motion.fitting import evaluate
from proxytune.diagnosis.motion.innovations import Noise
from proxytune.diagnosis.motion.multistep_fit import PoseNoise, fit_multistep, fit_windows, noise_floor, pose_noise

STILL = Noise((0.0, 0.0, 0.0), (0.003, 0.008))


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=6, seconds=60.0, noise=STILL)


def test_the_noise_of_poses_is_found_whatever_passes_for_it_and_none_of_exact_or_short_drives(drives):
    found = pose_noise(drives, TRUTH)
    assert found.place == pytest.approx(0.003, rel=0.04)
    assert found.turn == pytest.approx(0.008, rel=0.04)
    found = pose_noise(planted_drives(TRUTH, episodes=6, seconds=60.0), TRUTH)
    assert found.place == pytest.approx(NOISE.pose[0], rel=0.08)
    assert found.turn == pytest.approx(NOISE.pose[1], rel=0.15)
    assert pose_noise(drives, {**TRUTH, "trim": 0.1, "yaw_scrub": 0.12}).place == pytest.approx(0.003, rel=0.1)
    log = planted_log(TRUTH, episodes=6, seconds=60.0, noise=STILL)
    jumping = with_poses(log, lambda poses: poses + np.outer(np.arange(1200) % 100 == 0, (0.5, 0.5, 0.0)))
    assert pose_noise(drives_of(jumping), TRUTH).place == pytest.approx(0.003, rel=0.25)
    assert max(pose_noise(planted_drives(TRUTH, episodes=2, seconds=20.0, noise=None), TRUTH)) < 1e-6
    assert pose_noise(planted_drives(TRUTH, episodes=1, seconds=0.3), TRUTH) == PoseNoise(0.0, 0.0)


@pytest.mark.parametrize("horizon_s", [1.0, 2.0, 5.0])
def test_the_floor_is_the_error_of_the_true_model_where_only_poses_are_noisy(drives, horizon_s):
    windows = cut(drives, horizon_s)
    place, turn = np.sqrt(np.mean(pose_errors(drives, TRUTH, windows) ** 2, axis=0))
    told = noise_floor(drives, windows, PoseNoise(0.003, 0.008))
    assert told[0] == pytest.approx(place, rel=0.08)
    assert told[1] == pytest.approx(turn, rel=0.08)
    assert noise_floor(drives, windows, pose_noise(drives, TRUTH))[0] == pytest.approx(place, rel=0.1)


def test_a_noisy_heading_counts_by_the_way_that_it_leads_astray(drives):
    windows = cut(drives, 5.0)
    place, _ = noise_floor(drives, windows, PoseNoise(0.0, 0.01))
    short, _ = noise_floor(drives, cut(drives, 1.0), PoseNoise(0.0, 0.01))
    assert place > 1.5 * short > 0.0
    assert noise_floor(drives, windows, PoseNoise(0.003, 0.0))[0] == pytest.approx(0.006)


@pytest.fixture(scope="module")
def driven():
    return planted_drives(TRUTH, episodes=6, seconds=20.0)


def model(driven, **values):
    return evaluate(driven, {**TRUTH, **values}, DECLARED, NOISE)


def squares(driven, theta, horizon_s=2.0):
    return pose_errors(driven, theta, cut(driven, horizon_s))[:, 0] ** 2


def test_windows_lead_back_to_the_values_that_drove_whatever_a_few_poses_do(driven):
    quiet = planted_drives(TRUTH, episodes=2, seconds=20.0, noise=None)
    found = fit_windows(quiet, {"trim": 0.0, "delay": 0.18}, DECLARED, cut(quiet, 2.0))
    assert found["trim"] == pytest.approx(TRUTH["trim"], abs=2e-4)
    assert found["delay"] == pytest.approx(TRUTH["delay"], abs=2e-3)
    poses = driven.poses.copy()
    poses[300:306] += (3.0, -2.0, 1.0)
    found = fit_windows(replace(driven, poses=poses), TRUTH, DECLARED, cut(driven, 2.0))
    assert found["trim"] == pytest.approx(TRUTH["trim"], abs=0.01)


def test_without_a_free_parameter_windows_enough_or_anything_to_mend_values_are_kept(driven):
    assert fit_windows(driven, TRUTH, (), cut(driven, 2.0)) == TRUTH
    assert fit_windows(driven, {"trim": 0.0, "delay": 0.1}, DECLARED, cut(driven, 100.0)) == {"trim": 0.0, "delay": 0.1}
    few = model(planted_drives(TRUTH, episodes=2, seconds=4.0), trim=0.08)
    assert multistep_fit.horizons(few.drives) == ()
    assert fit_multistep(few) == (few, None)
    right = model(driven)
    assert fit_multistep(right) == (right, None)
    poor = model(replace(driven, rules=replace(RULES, multistep_harms=0.01)), trim=0.08, delay=0.2)
    assert fit_multistep(poor) == (poor, None)


def without_predictions(patch):
    """The windows that predictions are asked for from now on, none of which moves."""
    asked, name = [], "predicted_motion"
    patch.setattr(multistep_fit, name, lambda d, t, w: asked.append(w) or np.zeros((len(w.window), 3)))
    return asked


def test_long_logs_are_thinned(driven, monkeypatch):
    asked = without_predictions(monkeypatch)
    monkeypatch.setattr(multistep_fit, "MOST_WINDOWS", 5)
    fit_windows(replace(driven), TRUTH, DECLARED, cut(driven, 2.0))
    assert 3 <= max(len(windows.begin) for windows in asked) <= 5


def test_what_was_fitted_is_not_fitted_again_but_other_windows_and_starts_are(monkeypatch):
    quiet, start = planted_drives(TRUTH, episodes=2, seconds=20.0, noise=None), {"trim": 0.0, "delay": 0.18}
    windows = cut(quiet, 2.0)
    found = fit_windows(quiet, start, DECLARED, windows)
    known = dict(found)
    found["trim"] = 9.0
    asked = without_predictions(monkeypatch)
    assert fit_windows(quiet, start, DECLARED, windows) == known
    assert not asked
    fewer = windows._replace(window=windows.window[:-1], increment=windows.increment[:-1])
    for other in ((start, DECLARED, fewer), (start, DECLARED[:1], windows), (known, DECLARED, windows)):
        asked.clear()
        fit_windows(quiet, *other)
        assert asked


def test_what_predicts_poorly_is_fitted_again_by_poses_not_fitted_to(driven):
    poses = driven.poses.copy()
    own = driven.block % 4 == 0
    poses[own, :, 2] += np.linspace(0.0, 2.0, own.sum())[:, None]
    fitted = fit_windows(replace(driven, poses=poses), TRUTH, DECLARED, cut(driven, 2.0))
    apart = multistep_fit.held_out_squares(replace(driven, poses=poses), TRUTH, DECLARED, 2.0)
    others = driven.block[cut(driven, 2.0).increment] % 4 == 0
    assert apart[2.0][others].mean() > squares(replace(driven, poses=poses), fitted)[others].mean()
    assert set(apart) == set(multistep_fit.horizons(driven)) == {1.0, 2.0, 5.0}

    poor = model(driven, trim=0.08, delay=0.2)
    better, polish = fit_multistep(poor)
    assert squares(driven, better.theta).mean() < 0.5 * squares(driven, poor.theta).mean()
    assert min(one.value for one in polish.ratios.values()) < RULES.multistep_helps
    assert max(one.value for one in polish.ratios.values()) <= RULES.multistep_harms
    for name, true in TRUTH.items():
        low, high = polish.intervals[name]
        assert low < better.theta[name] < high
        assert low - 0.5 * (high - low) < true < high + 0.5 * (high - low)
