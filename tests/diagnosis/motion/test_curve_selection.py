"""Groups of curves are chosen if they pay on parts that they were not fitted to."""

from dataclasses import replace

import numpy as np
import pytest

from proxytune.diagnosis import RULES
from proxytune.diagnosis.motion.curve_selection import FIRMEST_ONLY, RIDGES, choose_groups, sum_squares
from proxytune.diagnosis.motion.prediction import Slopes
from proxytune.effects import PLACE

PARTS = 12
COLUMNS = {"one": slice(0, 3), "other": slice(3, 7), "speed_and_turn": slice(7, 15)}


def slopes(truth, *, seed=1, noise=0.1, odd=0):
    """Errors that the true weights (15,) make, and white noise; some of them are wild."""
    random = np.random.default_rng(seed)
    columns = random.standard_normal((PARTS * 40, 3, 15))
    left = columns @ truth + noise * random.standard_normal(columns.shape[:2])
    left[:odd] += 50.0
    return Slopes(left, columns, np.repeat(np.arange(PARTS), 40))


def summed(given, weights=None):
    return sum_squares(given, np.zeros(15) if weights is None else weights, given.block, PARTS)


WEIGHTS = np.concatenate((np.zeros(3), (0.5, -0.3, 0.2, 0.4), np.zeros(8)))


def test_the_group_that_gains_most_is_chosen_first_and_curves_over_two_signals_pulled_firmly():
    chosen = choose_groups(summed(slopes(WEIGHTS)), COLUMNS, RULES)
    assert list(chosen.gains) == ["other"]
    np.testing.assert_allclose(chosen.weights, WEIGHTS, atol=0.02)
    chosen = choose_groups(summed(slopes(WEIGHTS + np.eye(15)[0] * 0.2)), COLUMNS, RULES)
    assert list(chosen.gains) == ["other", "one"]
    assert chosen.gains["other"] > chosen.gains["one"] > 0.0
    assert min(RIDGES) < FIRMEST_ONLY["speed_and_turn"] <= max(RIDGES)
    given = summed(slopes(np.concatenate((np.zeros(7), 0.3 * np.ones(8))), noise=0.0))
    assert np.all(np.abs(choose_groups(given, COLUMNS, RULES).weights[7:]) < 0.95 * 0.3)
    load, duty = (choose_groups(given, {name: slice(7, 15)}, RULES).weights[7:] - 0.3 for name in ("load", "duty"))
    assert 0.0 < np.abs(duty).max() < 0.1 * np.abs(load).max(), "correlated weights are pulled less"


@pytest.mark.parametrize("seed", [0, 3, 4])
def test_a_map_gives_way_to_a_curve_over_x_or_y_that_does_as_well_and_other_groups_to_none(seed):
    given = slopes(WEIGHTS, seed=seed)
    given.columns[..., 7:11] = given.columns[..., 3:7]
    given.columns[..., 3:7] += 0.005 * np.random.default_rng(seed).standard_normal(given.columns[..., 3:7].shape)
    for many, few, chosen in ((PLACE, "y", "y"), ("load", "y", "load")):
        groups = {many: slice(7, 15), few: slice(3, 7)}
        assert list(choose_groups(summed(given), groups, RULES).gains) == [chosen], "better by a hair alone"


@pytest.mark.parametrize("seed", range(5))
def test_nothing_is_chosen_of_noise_nor_any_rare_moment(seed):
    chosen = choose_groups(summed(slopes(np.zeros(15), seed=seed)), COLUMNS, RULES)
    assert not chosen.gains
    assert not chosen.weights.any()
    assert not choose_groups(summed(slopes(np.zeros(15), seed=seed)), COLUMNS, RULES, rare=True).gains


def test_the_group_that_gains_most_is_chosen_however_uneven_errors_are_and_few_wild_ones_hardly_count():
    scale = np.repeat([30.0, *np.ones(PARTS - 1)], 40)
    plain = slopes(WEIGHTS)
    given = summed(Slopes(plain.residuals * scale[:, None], plain.columns * scale[:, None, None], plain.block))
    assert given.size.max() > 10.0 * given.size.sum() / PARTS * 0.5
    assert list(choose_groups(given, COLUMNS, RULES).gains) == ["other"]
    np.testing.assert_allclose(
        choose_groups(summed(slopes(WEIGHTS, odd=12)), COLUMNS, RULES).weights, WEIGHTS, atol=0.05
    )
    moved = plain._replace(residuals=plain.residuals - plain.columns @ WEIGHTS)
    np.testing.assert_allclose(
        summed(moved, WEIGHTS).gradient / PARTS, summed(plain).gradient / PARTS, rtol=1.0, atol=8.0
    )
    np.testing.assert_allclose(choose_groups(summed(moved, WEIGHTS), COLUMNS, RULES).weights, WEIGHTS, atol=0.02)


def test_a_group_of_rare_moments_is_chosen_by_what_it_takes_of_all_error_where_that_is_asked():
    plain = slopes(WEIGHTS)
    elsewhere = (plain.block > 1)[:, None]
    quiet = Slopes(
        np.where(elsewhere, slopes(np.zeros(15)).residuals, plain.residuals),
        np.where(elsewhere[..., None], 1e-3, 1.0) * plain.columns,
        plain.block,
    )
    given = summed(quiet)
    assert not choose_groups(given, COLUMNS, RULES).gains
    assert list(choose_groups(given, COLUMNS, RULES, rare=True).gains) == ["other"]
    assert not choose_groups(given, COLUMNS, replace(RULES, rare_group_share=0.99), rare=True).gains


@pytest.mark.parametrize(("always", "alone"), [("level", ["level"]), ("model", [])])
def test_the_level_and_the_model_are_always_there_and_the_level_is_a_gain_where_no_group_is(always, alone):
    groups = {always: COLUMNS["one"], "other": COLUMNS["other"]}
    truth = WEIGHTS + np.concatenate(((0.6, -0.4, 0.5), np.zeros(12)))
    chosen = choose_groups(summed(slopes(truth)), groups, RULES)
    assert list(chosen.gains) == ["other"]
    np.testing.assert_allclose(chosen.weights[:7], truth[:7], atol=0.02)
    left = choose_groups(summed(slopes(truth - WEIGHTS)), groups, RULES)
    assert list(left.gains) == alone
    np.testing.assert_allclose(left.weights[:7], (truth - WEIGHTS)[:7], atol=0.02)
    assert not choose_groups(summed(slopes(np.zeros(15))), groups, RULES).gains
