"""The compiled inner loops do what NumPy and SciPy do, which take their place where Numba does not work."""

import sys
from functools import cache

import numpy as np
import pytest
from planted import NOISE, planted_drives

from proxytune.diagnosis.motion import compiled, innovations
from proxytune.diagnosis.motion.innovations import FIRST_GUESS, HUBER, fit_noise, integrate_twists, whitener


@pytest.fixture(scope="module")
def drives():
    return planted_drives({}, episodes=2, seconds=20.0, noise=None)


@pytest.fixture
def uncompiled(monkeypatch):
    monkeypatch.setattr(innovations, "_by_numba", cache(lambda: None))


@pytest.fixture(scope="module")
def errors(drives):
    return whitener(drives, NOISE).colour(np.random.default_rng(2).standard_normal(3 * len(drives.episode)))


@pytest.mark.parametrize("turn", [0.0, 3.0, 150.0])
@pytest.mark.parametrize("sideways", [0.0, 0.3])
def test_both_walk_to_the_last_bit_alike(uncompiled, turn, sideways):
    twists = np.random.default_rng(1).standard_normal((2, 300, 3)) * (0.5, sideways, turn)
    twists[:, 40:60, 2], twists[:, -20:] = 0.0, 0.0
    np.testing.assert_array_equal(compiled.walk(twists, 0.02), integrate_twists(twists, 0.02))


def test_a_turn_that_a_lag_leaves_after_minutes_is_none(uncompiled):
    twists = np.tile((0.5, 0.1, 5e-324), (1, 4, 1))
    straight = twists * (1.0, 1.0, 0.0)
    for walk in (compiled.walk, integrate_twists):
        np.testing.assert_allclose(walk(twists, 1.0), walk(straight, 1.0), rtol=0, atol=1e-12)
    np.testing.assert_allclose(integrate_twists(twists, 1.0)[0, -1], (2.0, 0.4, 0.0), atol=1e-12)


def test_what_walks_is_compiled_once_noise_was_fitted(monkeypatch, drives, errors):
    loaded = []
    monkeypatch.setattr(innovations, "_by_numba", cache(lambda: loaded.append(compiled) or compiled))
    integrate_twists(np.zeros((1, 5, 3)), 0.02)
    assert not loaded
    fit_noise(drives, errors, FIRST_GUESS)
    monkeypatch.setattr(compiled, "walk", lambda twists, tick_s: tick_s)
    assert integrate_twists(np.zeros((1, 5, 3)), 0.02) == 0.02


def test_the_loss_is_that_of_the_whitener_and_noise_the_same_without_numba(drives, errors, uncompiled, monkeypatch):
    errors = errors.copy()
    errors[::20] *= 8.0
    band = innovations._covariance(drives, np.square((*NOISE.drive, *NOISE.pose))).reshape(6, -1, 3)
    band[0] += innovations.JITTER
    assert not drives.linked.all()
    expected = -innovations.log_likelihood(errors, whitener(drives, NOISE))
    assert compiled.loss(band, errors, HUBER) == pytest.approx(expected, rel=1e-12)
    plain = fit_noise(drives, errors, FIRST_GUESS)
    monkeypatch.setattr(innovations, "_by_numba", lambda: compiled)
    fast = fit_noise(drives, errors, FIRST_GUESS)
    np.testing.assert_allclose((*fast.drive, *fast.pose), (*plain.drive, *plain.pose), rtol=1e-3)


@pytest.mark.parametrize("at_hand", [True, False])
def test_scipy_does_it_where_numba_does_not_work(monkeypatch, at_hand):
    if not at_hand:
        monkeypatch.delattr("proxytune.diagnosis.motion.compiled")
        monkeypatch.setitem(sys.modules, "proxytune.diagnosis.motion.compiled", None)
    assert innovations._by_numba.__wrapped__() is (compiled if at_hand else None)
