"""A first-order lag, exact for what holds over each sample, and values known beforehand."""

import sys

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from proxytune.effects import FilterContext, compiled, effect
from proxytune.effects.effect import FEW, low_pass, low_pass_at, reckon, start_reckoning
from proxytune.effects.features import play, ramp
from proxytune.effects.motors import SlewRate, SlewState


def test_beyond_what_is_known_the_rates_lead_on_in_chunks_as_in_one():
    known = start_reckoning(np.array([1.0, 5.0]), FilterContext(2.0, np.zeros(3), {}))
    whole, _ = reckon(np.full(4, 2.0), known)
    np.testing.assert_allclose(whole, [1.0, 5.0, 6.0, 7.0])
    first, later = reckon(np.full(3, 2.0), known)
    np.testing.assert_allclose(np.concatenate((first, reckon(np.full(1, 2.0), later)[0])), whole)


def test_low_passes_follow_by_their_time_constant_for_each_of_a_batch():
    assert start_reckoning(np.array([1.0]), FilterContext(2.0, np.zeros((3, 2)), {})).values.shape == (3, 1)
    signal = np.array([[1.0], [-2.0]])
    mean, end = low_pass(signal, low_pass_at(np.array([5.0]), 0.0))
    np.testing.assert_array_equal(mean, signal)
    np.testing.assert_array_equal(end.value, [-2.0])
    mean, end = low_pass(np.ones((10, 1)), low_pass_at(np.zeros(1), 10.0))
    assert end.value[0] == pytest.approx(1.0 - np.exp(-1.0))
    assert mean.sum() == pytest.approx(10.0 - 10.0 * (1.0 - np.exp(-1.0)))


@given(
    st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)), min_size=1, max_size=FEW),
    st.floats(0.0, 40.0),
    st.floats(-2.0, 2.0),
)
@settings(max_examples=100)
def test_a_few_samples_follow_to_the_last_bit_as_many_do(samples, lasts, before):
    signal, value = np.array(samples), np.array([before, -before])
    mean, end = low_pass(signal, low_pass_at(value, lasts))
    means, ends = low_pass(signal[None], low_pass_at(value[None], lasts))
    assert mean.tobytes() == means[0].tobytes()
    assert end.value.tobytes() == ends.value[0].tobytes()


@given(st.integers(FEW + 1, 40), st.integers(1, 3), st.sampled_from([(), (2,), (2, 3)]), st.floats(0.0, 40.0))
@settings(max_examples=100)
def test_many_samples_follow_to_the_last_bit_as_compiled(length, channels, batch, lasts):
    random = np.random.default_rng(length)
    signal = random.standard_normal((*batch, length, channels + 1))[..., 1:]
    signal[..., : length // 2, :] = 0.0
    state, ways = low_pass_at(random.standard_normal((*batch, channels)), lasts), []
    widths = np.linspace(0.0, 0.5, channels)
    for used in (-np.inf, effect.PAYS_OFF):
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(effect, "_filtered", [used])
            mean, end = low_pass(signal, state)
            first = effect.approach(signal[..., 0], np.exp(-(signal[..., 0] ** 2)), state.value[..., 0])
            slewed = SlewRate(lasts / 4.0).apply(signal[..., :2].round(), SlewState(state.value[..., :2], lasts / 20.0))
            dragged = play(signal[..., 0], state.value, widths), ramp(signal[..., 0], state.value, widths, 0.5 - widths)
        ways.append(
            ([one.tobytes() for one in (*first, slewed[0], *dragged, mean, end.value)], end.value.shape, end[1:])
        )
    assert ways[0] == ways[1]


def test_numba_filters_once_that_pays_off(monkeypatch):
    monkeypatch.setattr(effect, "_filtered", [effect.PAYS_OFF - 20])
    assert [effect.fastest(10) for _ in range(3)] == [None, None, compiled]


@pytest.mark.parametrize("at_hand", [True, False])
def test_scipy_filters_where_numba_does_not_work(monkeypatch, at_hand):
    if not at_hand:
        monkeypatch.delattr("proxytune.effects.compiled")
        monkeypatch.setitem(sys.modules, "proxytune.effects.compiled", None)
    assert effect._by_numba.__wrapped__() is (compiled if at_hand else None)
