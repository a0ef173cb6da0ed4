"""The whitener is the factor of the errors' covariance, and noise is found from them."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.append(str(Path(__file__).parent))

from planted import NOISE, planted_drives

from proxytune.diagnosis.measured.drives import relative
from proxytune.diagnosis.model.innovations import (
    FIRST_GUESS,
    HUBER,
    JITTER,
    TURN_WEIGHT,
    Noise,
    clip_outliers,
    fit_noise,
    huber,
    log_likelihood,
    whitener,
)


@pytest.fixture(scope="module")
def drives():
    return planted_drives({}, episodes=3, seconds=20.0, noise=None)


@pytest.fixture(scope="module")
def few(drives):
    """Twelve increments of two episodes, one of them apart."""
    places = np.flatnonzero(drives.travel[:, 0] > 0.005)
    first, second = places[places < 300][40:47], places[places > 500][30:36]
    chosen = np.zeros(len(drives.episode), dtype=bool)
    chosen[[*first[:4], *first[5:], *second]] = True
    return drives.only(chosen)


def dense(drives, noise):
    """The covariance by definition: Jacobians of the increments in the noise of every pose, and drive noise."""
    count = len(drives.episode)
    sample = np.cumsum(~drives.linked) + np.arange(count) - 1
    ends = np.stack((sample, sample + 1), axis=1)
    poses = np.zeros((ends.max() + 1, 3))
    poses[ends[:, 0]], poses[ends[:, 1]] = drives.poses[:, 0], drives.poses[:, 1]
    jacobian = np.zeros((3 * count, poses.size))
    for column in range(poses.size):
        moved = np.zeros(poses.size)
        moved[column] = 1e-6
        there, back = (
            relative(poses[ends[:, 0]] + step[ends[:, 0]], poses[ends[:, 1]] + step[ends[:, 1]])
            for step in (moved.reshape(-1, 3), -moved.reshape(-1, 3))
        )
        jacobian[:, column] = (there - back).ravel() / 2e-6
    white = np.tile(np.square((noise.pose[0], noise.pose[0], noise.pose[1])), len(poses))
    way = drives.travel[:, 0] + TURN_WEIGHT * drives.travel[:, 1]
    drive = np.square(noise.drive) * way[:, None] + JITTER
    return jacobian @ np.diag(white) @ jacobian.T + np.diag(drive.ravel())


def factor(whiten, size):
    return np.stack([whiten.colour(unit).ravel() for unit in np.eye(size)], axis=1)


def test_the_few_drives_have_a_break_and_turn(few):
    assert (~few.linked).sum() >= 3
    assert np.abs(few.measured[:, 2]).max() > 0.02


@pytest.mark.parametrize("noise", [NOISE, Noise((0.1, 0.02, 0.5), (0.02, 0.1))])
def test_the_banded_covariance_is_that_of_noisy_poses_and_noisy_driving(few, noise):
    lower = factor(whitener(few, noise), 3 * len(few.episode))
    wanted = dense(few, noise)
    np.testing.assert_allclose(lower @ lower.T, wanted, atol=1e-7 * np.abs(wanted).max())
    assert np.abs(wanted[3:6, :3]).max() > 0.1 * noise.pose[0] ** 2


@settings(derandomize=True, deadline=None, max_examples=20)
@given(seed=st.integers(0, 10**6), size=st.floats(0.1, 10.0))
def test_colouring_and_whitening_undo_each_other(few, seed, size):
    whiten = whitener(few, Noise((0.02 * size, 0.01, 0.1), (0.003, 0.01 * size)))
    z = np.random.default_rng(seed).standard_normal(3 * len(few.episode))
    np.testing.assert_allclose(whiten.whiten(whiten.colour(z)), z, atol=1e-9)


def test_columns_are_whitened_side_by_side(few):
    whiten = whitener(few, NOISE)
    errors = np.random.default_rng(1).standard_normal((len(few.episode), 3, 4))
    together = whiten.whiten(errors)
    for column in range(4):
        np.testing.assert_allclose(together[:, column], whiten.whiten(errors[..., column]))


def test_the_log_likelihood_is_the_gaussian_one_where_nothing_is_an_outlier(few):
    whiten, covariance = whitener(few, NOISE), dense(few, NOISE)
    errors = 0.3 * whiten.colour(np.random.default_rng(2).standard_normal(3 * len(few.episode)))
    flat = errors.ravel()
    wanted = -0.5 * flat @ np.linalg.solve(covariance, flat) - 0.5 * np.linalg.slogdet(covariance)[1]
    assert log_likelihood(errors, whiten) == pytest.approx(wanted, rel=1e-5)


@pytest.mark.parametrize(
    "noise", [Noise((0.03, 0.015, 0.2), (0.003, 0.008)), Noise((0.01, 0.02, 0.05), (0.0015, 0.004))]
)
def test_planted_noise_is_found_again(drives, noise):
    z = np.random.default_rng(3).standard_normal(3 * len(drives.episode))
    found = fit_noise(drives, whitener(drives, noise).colour(z), FIRST_GUESS)
    np.testing.assert_allclose(found.drive, noise.drive, rtol=0.25)
    np.testing.assert_allclose(found.pose, noise.pose, rtol=0.1)


def test_noise_is_found_from_a_start_ten_times_too_large(drives):
    z = np.random.default_rng(3).standard_normal(3 * len(drives.episode))
    start = replace(NOISE, drive=tuple(10.0 * s for s in NOISE.drive), pose=tuple(10.0 * s for s in NOISE.pose))
    found = fit_noise(drives, whitener(drives, NOISE).colour(z), start)
    np.testing.assert_allclose(found.pose, NOISE.pose, rtol=0.1)


def test_the_innovations_of_a_model_that_is_right_are_white():
    from proxytune.diagnosis.model.replay import increments

    drives = planted_drives({"trim": 0.03}, episodes=6, seconds=20.0)
    z = whitener(drives, NOISE).whiten(drives.measured - increments(drives, {"trim": 0.03})).reshape(-1, 3)
    np.testing.assert_allclose(z.std(axis=0), 1.0, atol=0.1)
    assert np.abs(np.mean(z[1:] * z[:-1], axis=0)).max() < 0.08


def test_outliers_count_linearly_and_their_slope_is_cut():
    z = np.linspace(-8.0, 8.0, 1601)
    np.testing.assert_allclose(np.gradient(huber(z), z)[1:-1], clip_outliers(z)[1:-1], atol=0.01)
    assert np.diff(huber(np.array([HUBER, 5.0, 6.0, 7.0])))[1:].tolist() == [HUBER, HUBER]
