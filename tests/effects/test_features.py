"""Hats are curves that vanish at 0 and stay level beyond their last knot."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.effects.learnt.bases import hats
from proxytune.effects.learnt.features import GROUPS


def test_a_hat_is_one_at_its_own_knot_and_nothing_at_the_others_and_at_rest():
    knots = (-2.0, -0.5, 1.0)
    np.testing.assert_array_equal(hats(np.array(knots), knots), np.eye(3))
    np.testing.assert_array_equal(hats(np.zeros(1), knots), np.zeros((1, 3)))


@given(value=st.floats(-1e6, 1e6))
@settings(max_examples=50, derandomize=True, deadline=None)
def test_hats_never_add_up_to_more_than_one(value):
    row = hats(np.array([value]), (-2.0, -0.5, 1.0, 4.0))
    assert 0.0 <= row.min() <= row.sum() <= 1.0 + 1e-12


def test_beyond_the_last_knot_a_hat_is_level():
    np.testing.assert_array_equal(hats(np.array([5.0, 50.0]), (1.0, 5.0)), [[0.0, 1.0], [0.0, 1.0]])


def test_every_group_and_channel_has_a_unit():
    assert all(group.unit and group.title for group in GROUPS.values())
    assert all(channel.unit for group in GROUPS.values() for channel in group.channels.values())
