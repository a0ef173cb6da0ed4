"""Groups are chosen if they pay on parts that they were not fitted to."""

import numpy as np
import pytest

from proxytune.diagnosis.horizon.window_slopes import Slopes
from proxytune.diagnosis.remainder.group_choice import FIRMEST_ONLY, RIDGES, choose, sums

PARTS = 12
GROUPS = {"one": np.arange(3), "other": np.arange(3, 7), "speed_and_turn": np.arange(7, 15)}


def slopes(truth, *, seed=1, noise=0.1, odd=0):
    """Errors that the true weights (15,) make, and white noise; some of them are wild."""
    random = np.random.default_rng(seed)
    columns = random.standard_normal((PARTS * 40, 3, 15))
    left = columns @ truth + noise * random.standard_normal(columns.shape[:2])
    left[:odd] += 50.0
    return Slopes(left, columns, np.repeat(np.arange(PARTS), 40))


def summed(given, weights=None):
    return sums(given, np.zeros(15) if weights is None else weights, given.block, PARTS)


TRUTH = np.concatenate((np.zeros(3), (0.5, -0.3, 0.2, 0.4), np.zeros(8)))


def test_the_group_that_is_there_is_chosen_alone_with_its_weights():
    chosen = choose(summed(slopes(TRUTH)), GROUPS)
    assert list(chosen.gains) == ["other"]
    np.testing.assert_allclose(chosen.weights, TRUTH, atol=0.02)


@pytest.mark.parametrize("seed", range(5))
def test_nothing_is_chosen_of_noise(seed):
    chosen = choose(summed(slopes(np.zeros(15), seed=seed)), GROUPS)
    assert not chosen.gains
    assert not chosen.weights.any()


def test_the_group_that_gains_most_is_chosen_first():
    chosen = choose(summed(slopes(TRUTH + np.eye(15)[0] * 0.2)), GROUPS)
    assert list(chosen.gains) == ["other", "one"]
    assert chosen.gains["other"] > chosen.gains["one"] > 0.0


def test_a_few_wild_errors_hardly_move_the_weights():
    np.testing.assert_allclose(choose(summed(slopes(TRUTH, odd=12)), GROUPS).weights, TRUTH, atol=0.05)


def test_errors_are_counted_from_no_weights_wherever_they_were_linearised():
    plain = slopes(TRUTH)
    moved = plain._replace(left=plain.left - plain.columns @ TRUTH)
    np.testing.assert_allclose(summed(moved, TRUTH).pull / PARTS, summed(plain).pull / PARTS, rtol=1.0, atol=8.0)
    np.testing.assert_allclose(choose(summed(moved, TRUTH), GROUPS).weights, TRUTH, atol=0.02)


def test_curves_over_two_signals_are_always_pulled_firmly():
    assert min(RIDGES) < FIRMEST_ONLY["speed_and_turn"] <= max(RIDGES)
    truth = np.concatenate((np.zeros(7), 0.3 * np.ones(8)))
    weights = choose(summed(slopes(truth, noise=0.0)), GROUPS).weights
    assert np.all(np.abs(weights[7:]) < 0.95 * 0.3)


def test_the_level_is_always_there_and_never_a_gain():
    groups = {"level": GROUPS["one"], "other": GROUPS["other"]}
    truth = TRUTH + np.concatenate(((0.6, -0.4, 0.5), np.zeros(12)))
    chosen = choose(summed(slopes(truth)), groups)
    assert list(chosen.gains) == ["other"]
    np.testing.assert_allclose(chosen.weights[:7], truth[:7], atol=0.02)
    assert not choose(summed(slopes(truth - TRUTH)), groups).gains
