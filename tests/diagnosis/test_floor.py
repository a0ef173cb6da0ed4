"""The noise of measured poses is told from the logs alone, and what it makes of windows."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import NOISE, TRUTH, drives_of, planted_drives, planted_log

from proxytune.diagnosis.horizon.floor import PoseNoise, noise_floor, pose_noise
from proxytune.diagnosis.horizon.windows import cut, pose_errors
from proxytune.diagnosis.model.innovations import Noise

STILL = Noise((0.0, 0.0, 0.0), (0.003, 0.008))


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=6, seconds=60.0, noise=STILL)


def test_the_noise_of_poses_is_found_within_a_few_percent(drives):
    found = pose_noise(drives, TRUTH)
    assert found.place == pytest.approx(0.003, rel=0.04)
    assert found.turn == pytest.approx(0.008, rel=0.04)


def test_noise_of_the_drive_does_not_pass_for_noise_of_poses():
    found = pose_noise(planted_drives(TRUTH, episodes=6, seconds=60.0), TRUTH)
    assert found.place == pytest.approx(NOISE.pose[0], rel=0.08)
    assert found.turn == pytest.approx(NOISE.pose[1], rel=0.15)


def test_a_missing_effect_does_not_pass_for_noise_of_poses(drives):
    wrong = pose_noise(drives, {**TRUTH, "trim": 0.1, "yaw_scrub": 0.12})
    assert wrong.place == pytest.approx(0.003, rel=0.1)


def test_outliers_do_not_pass_for_noise(drives):
    log = planted_log(TRUTH, episodes=6, seconds=60.0, noise=STILL)

    def jumping(episode):
        poses = episode.poses.copy()
        poses[::100, :2] += 0.5
        return replace(episode, poses=poses)

    jumped = pose_noise(drives_of(replace(log, episodes=tuple(map(jumping, log.episodes)))), TRUTH)
    assert jumped.place == pytest.approx(0.003, rel=0.25)


def test_poses_without_noise_have_none():
    quiet = planted_drives(TRUTH, episodes=2, seconds=20.0, noise=None)
    assert max(pose_noise(quiet, TRUTH)) < 1e-6


def test_drives_too_short_for_third_differences_tell_no_noise():
    few = planted_drives(TRUTH, episodes=1, seconds=0.3)
    assert pose_noise(few, TRUTH) == PoseNoise(0.0, 0.0)


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
