"""The size of a random effect, and an interval that holds it."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import TRUTH, fitted, planted_drives

from proxytune.diagnosis.model.events import random_effects
from proxytune.diagnosis.model.sizing import _invert, size_random_effect


def told(effect, size, seed):
    """What is told of an effect at first, and in the end."""
    base = fitted(planted_drives({**TRUTH, effect: size}, seed=seed, episodes=6, seconds=30.0))
    (first,) = [one for one in random_effects(base, 1) if one.effect == effect]
    return first, size_random_effect(base, first, 1)


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "size"), [("dropped_commands", 0.3), ("delay_jitter", 0.15)])
def test_intervals_hold_the_true_size(effect, size):
    found = [told(effect, size, seed)[1] for seed in (1, 2, 3)]
    assert sum(one.interval[0] <= size <= one.interval[1] for one in found) >= 2
    for one in found:
        assert one.value == pytest.approx(size, rel=0.35)
        assert one.interval[0] < one.value < one.interval[1]
        assert one.interval[1] < 4.0 * one.interval[0]


@pytest.mark.slow
def test_the_same_seed_says_the_same():
    assert told("dropped_commands", 0.3, 1) == told("dropped_commands", 0.3, 1)


def test_the_size_is_that_of_which_drives_say_what_is_measured():
    sizes = np.array([0.1, 0.2, 0.4])
    said = np.log(0.5 * sizes) + np.array([[-0.05], [0.05]])
    value, low, high = _invert(sizes, said, float(np.log(0.1)))
    assert value == pytest.approx(0.2)
    assert 0.1 < low < 0.2 < high < 0.4
