"""Values known beforehand are used; beyond them the rates go on.

A first-order lag, exact for what holds over each sample.
"""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from proxytune.effects import Setting
from proxytune.effects.effect import FEW, beforehand, follow, lag_of, values_along


def test_beyond_what_is_known_the_rates_lead_on_in_chunks_as_in_one():
    setting = Setting(2.0, np.zeros(3), {})
    known = beforehand(np.array([1.0, 5.0]), setting)
    whole, _ = values_along(np.full(4, 2.0), known)
    np.testing.assert_allclose(whole, [1.0, 5.0, 6.0, 7.0])
    first, later = values_along(np.full(3, 2.0), known)
    np.testing.assert_allclose(np.concatenate((first, values_along(np.full(1, 2.0), later)[0])), whole)


def test_every_member_of_a_batch_has_the_values_unless_it_has_its_own():
    shared = beforehand(np.array([1.0]), Setting(2.0, np.zeros((3, 2)), {}))
    assert shared.values.shape == (3, 1)


def test_no_time_constant_follows_at_once():
    signal = np.array([[1.0], [-2.0]])
    mean, end = follow(signal, np.array([5.0]), lag_of(0.0))
    np.testing.assert_array_equal(mean, signal)
    np.testing.assert_array_equal(end, [-2.0])


def test_after_one_time_constant_63_percent_of_a_step_are_done():
    mean, end = follow(np.ones((10, 1)), np.zeros(1), lag_of(10.0))
    assert end[0] == pytest.approx(1.0 - np.exp(-1.0))
    assert mean.sum() == pytest.approx(10.0 - 10.0 * (1.0 - np.exp(-1.0)))


@given(
    st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)), min_size=1, max_size=FEW),
    st.floats(0.0, 40.0),
    st.floats(-2.0, 2.0),
)
@settings(max_examples=100, derandomize=True)
def test_a_few_samples_follow_to_the_last_bit_as_many_do(samples, lasts, before):
    signal, value = np.array(samples), np.array([before, -before])
    one = follow(signal, value, lag_of(lasts))
    many = follow(signal[None], value[None], lag_of(lasts))
    for few, filtered in zip(one, many, strict=True):
        assert few.tobytes() == filtered[0].tobytes()
