"""Hats vanish at 0 and stay level beyond their last knot, and memory is the same however a signal is cut."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from proxytune.effects import GROUPS
from proxytune.effects.features import hats, low_passes, moved_since, play, rings, rolled_since


def test_a_hat_is_one_at_its_knot_and_level_beyond_the_last_and_every_group_and_channel_has_a_unit():
    knots = (-2.0, -0.5, 1.0)
    np.testing.assert_array_equal(hats(np.array(knots), knots), np.eye(3))
    np.testing.assert_array_equal(hats(np.zeros(1), knots), np.zeros((1, 3)))
    np.testing.assert_array_equal(hats(np.array([5.0, 50.0]), (1.0, 5.0)), [[0.0, 1.0], [0.0, 1.0]])
    assert all(group.unit and group.title for group in GROUPS.values())
    assert all(channel.unit for group in GROUPS.values() for channel in group.channels.values())


@given(value=st.floats(-1e6, 1e6))
@settings(max_examples=50)
def test_hats_never_add_up_to_more_than_one(value):
    row = hats(np.array([value]), (-2.0, -0.5, 1.0, 4.0))
    assert 0.0 <= row.min() <= row.sum() <= 1.0 + 1e-12


RATE_HZ = 10.0


def test_a_low_pass_follows_in_its_time_constant_and_a_play_drags_along_what_has_crossed_it():
    assert low_passes(np.ones(10), np.zeros(1), (1.0,), RATE_HZ)[-1, 0] == pytest.approx(1.0 - np.exp(-1.0))
    dragged = play(np.array([0.0, 0.3, 0.5, 0.45, 0.2, -0.1]), np.zeros(1), (0.1,))[:, 0]
    np.testing.assert_allclose(dragged, [0.0, 0.2, 0.4, 0.4, 0.3, 0.0], atol=1e-12)


def test_ways_and_times_count_from_where_a_wheel_turns_or_stood_and_a_change_sets_off_a_swing():
    speed = np.array([1.0, 1.0, 0.0, 1.0, -2.0, -2.0, 0.0, -2.0, 1.0])
    way = rolled_since(speed, np.array(5.0), RATE_HZ)
    np.testing.assert_allclose(way, [5.1, 5.2, 5.2, 5.3, -0.2, -0.4, -0.4, -0.6, 0.1])
    assert np.all(np.abs(rolled_since(np.array([1.0, -0.01, 1.0]), np.zeros(()), RATE_HZ)) >= 10.0)
    speed = np.array([0.0, 1.0, 1.0, 0.01, -1.0, 1.0])
    np.testing.assert_allclose(moved_since(speed, np.zeros(()), 0.02, RATE_HZ), [0.0, 0.1, 0.2, 0.0, 0.1, 0.2])
    np.testing.assert_allclose(moved_since(np.ones(2), np.array(0.5), 0.02, RATE_HZ), [0.6, 0.7])
    change = np.zeros(400)
    change[10] = 0.3
    swing = rings(change, np.zeros(1, dtype=complex), (0.5,), RATE_HZ)[:, 0]
    np.testing.assert_array_equal(swing[:10], 0.0)
    assert swing[10] == 0.3
    period = np.flatnonzero(np.diff(np.sign(swing.imag[10:200])) > 0.0)
    assert np.diff(period[1:3])[0] == pytest.approx(RATE_HZ / 0.5, rel=0.1)
    assert abs(swing[-1]) < 1e-3
