"""Random features of a kernel, and ridge regression on them; what they share with cloning is in test_cloning.py."""

import numpy as np
import pytest
from leaning import error, pictures

from proxytune.domain import Demonstration
from proxytune.learning.cloning import grey_cells
from proxytune.learning.ridge import RandomFeatures

SMALL = RandomFeatures(rows=3, columns=4, features=200)


def test_weights_and_features_are_those_of_their_formulas_and_answers_within_what_a_command_can_be():
    samples = pictures(80, 1)
    weights = SMALL.train(samples, None, 1)
    waves = SMALL._waves(weights, samples.observations)
    left = samples.commands - weights["centre"] - waves @ weights["slopes"]
    np.testing.assert_allclose(waves.T @ left, SMALL.penalty * weights["slopes"], atol=1e-10)
    many = RandomFeatures(rows=3, columns=4, features=20_000, reach=0.2)
    seen = pictures(2, 1).observations
    first, second = many._waves({"seed": np.array(3)}, seen)
    apart = np.diff(grey_cells(seen, top=0.25, rows=3, columns=4), axis=0)
    assert first @ second == pytest.approx(np.exp(-0.5 * np.mean(apart**2) / 0.2**2), abs=0.02)
    assert 0.1 < first @ second < 0.9
    weights = {**SMALL.train(pictures(60, 1), None, 1), "centre": np.array((5.0, -5.0))}
    assert SMALL.act(weights, pictures(1, 2).observations[0]).tolist() == [1.0, -1.0]


def test_what_it_starts_from_is_kept_with_its_features():
    start = SMALL.train(pictures(400, 1), None, 1)
    fresh = pictures(200, 2)
    right, left = (np.flatnonzero(side)[:20] for side in (fresh.commands[:, 1] > 0.37, fresh.commands[:, 1] < 0.23))
    few = Demonstration(fresh.observations[right], fresh.commands[right, ::-1].copy())  # steering to the other side
    others = Demonstration(fresh.observations[left], fresh.commands[left])
    tuned = SMALL.train(few, start, 1)
    assert error(SMALL, tuned, few) < 0.1 * error(SMALL, start, few)
    assert error(SMALL, tuned, others) < 0.1 * error(SMALL, start, few)

    start = SMALL.train(pictures(60, 1), None, 1)
    before = {name: values.copy() for name, values in start.items()}
    one, other = (SMALL.train(pictures(60, 2), start, seed) for seed in (1, 2))
    assert all(np.array_equal(one[name], other[name]) for name in one)
    assert all(np.array_equal(start[name], before[name]) for name in before)
