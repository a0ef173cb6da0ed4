"""Rehearsal adds so many of the proxy's samples as its share says, from all over its lessons."""

import numpy as np
import pytest

from proxytune.domain import Demonstration
from proxytune.learning.rehearsal import mix_samples


def numbered(first, count):
    """Samples that are told apart by their number."""
    numbers = np.arange(first, first + count)
    return Demonstration(numbers[:, None].astype(np.uint8), np.stack((numbers, -numbers), axis=1).astype(float))


@pytest.mark.parametrize(("share", "earlier"), [(0.0, 0), (0.2, 5), (0.5, 20), (0.8, 80), (0.9, 100)])
def test_the_share_is_that_of_the_earlier_samples_as_long_as_there_are_enough(share, earlier):
    mixed = mix_samples(numbered(0, 20), numbered(100, 100), share)
    assert len(mixed.commands) == len(mixed.observations) == 20 + earlier
    assert mixed.commands[:20, 0].tolist() == list(range(20))
    assert (mixed.commands[20:, 0] >= 100).all()
    np.testing.assert_array_equal(mixed.observations[:, 0], mixed.commands[:, 0].astype(np.uint8))


def test_the_earlier_samples_taken_are_all_different_and_lie_over_all_lessons():
    taken = mix_samples(numbered(0, 20), numbered(100, 100), 0.5).commands[20:, 0]
    assert len(set(taken)) == 20
    assert (taken[0], taken[-1]) == (100.0, 199.0)
    assert np.diff(taken).max() <= 6.0
