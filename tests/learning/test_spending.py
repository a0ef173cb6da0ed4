"""Examinations go where they tell most about PLV, by a rule that only the known scores decide."""

import numpy as np
import pytest

from proxytune.learning.curves import Curve
from proxytune.learning.plv import sample_needs
from proxytune.learning.spending import Examination, Spending, first_examinations, next_examinations

GRID = (0, 100, 200, 400, 800, 1600)
SPENDING = Spending("none", GRID, 6, 12)
KNOWN = (GRID.index(100), GRID.index(400), GRID.index(1600))


def curve(*means, wobble=2.0, seeds=2, known=(0, *KNOWN)):
    scores = np.full((seeds, len(GRID)), np.nan)
    noise = wobble * np.random.default_rng(1).normal(size=scores.shape)
    scores[:, known] = (np.array(means, dtype=float) + noise)[:, known]
    return Curve(GRID, scores)


CURVES = {
    "none": curve(np.nan, 5, 10, 20, 50, 50, known=KNOWN),
    "sure": curve(50, 50, 50, 50, 50, 50),
    "open": curve(20, 22, 25, 40, 50, 50, wobble=6.0),
}


def needs(curves=CURVES):
    return sample_needs(curves, none="none", best_score=60.0, tolerance=5.0, draws=300)


def test_the_first_examinations_span_the_grid_in_two_repetitions_and_none_is_of_who_has_learnt_nothing():
    first = first_examinations(["none", "proxy"], SPENDING)
    assert {one.samples for one in first if one.curve == "proxy"} == {0, 200, 400, 1600}
    assert {one.repetition for one in first} == {0, 1}
    assert not any(one.curve == "none" and one.samples == 0 for one in first)
    assert [one.samples for one in first if one.curve == "none"] == [100, 200, 800, 1600] * 2
    assert len(first) == len(set(first)) == 2 * (4 + 4)


def test_a_proxy_whose_crossing_is_sure_is_examined_less_than_one_whose_is_open():
    chosen = next_examinations(needs(), list(CURVES), SPENDING)
    often = {name: sum(one.curve == name for one in chosen) for name in CURVES}
    assert len(chosen) == SPENDING.batch
    assert often["sure"] < min(often["open"], often["none"])


def test_nothing_is_examined_twice_and_new_repetitions_come_first():
    chosen = next_examinations(needs(), list(CURVES), SPENDING)
    done = {Examination(name, int(r), GRID[c]) for name, one in CURVES.items() for r, c in one.examined}
    assert len(set(chosen)) == len(chosen)
    assert not set(chosen) & done
    assert chosen[0].repetition == 2


def test_only_curves_that_are_asked_for_are_examined():
    assert {one.curve for one in next_examinations(needs(), ["open"], SPENDING)} == {"open"}


def test_the_learner_without_a_proxy_alone_is_examined_for_how_many_samples_it_needs():
    alone = {"none": CURVES["none"]}
    chosen = next_examinations(needs(alone), ["none"], SPENDING)
    assert len(chosen) == SPENDING.batch
    # Between 400, where it is far below, and 1600, where it is converged.
    assert np.mean([one.samples > 300 for one in chosen]) > 0.5


def test_the_same_scores_choose_the_same_examinations():
    assert next_examinations(needs(), list(CURVES), SPENDING) == next_examinations(needs(), list(CURVES), SPENDING)


@pytest.mark.parametrize("first", [1, 2, 7])
def test_a_grid_from_few_samples_on_has_no_place_twice_and_none_before_the_first(first):
    grid = (0, first, 8, 64, 512)
    spending = Spending("none", grid, 4, 12)
    scores = np.array([[np.nan, 1.0, 5.0, 30.0, 50.0], [np.nan, 3.0, 9.0, 35.0, 49.0]])
    curves = {"none": Curve(grid, scores), "proxy": Curve(grid, np.where(np.isnan(scores), 0.0, scores + 1.0))}
    found = sample_needs(curves, none="none", best_score=60.0, tolerance=5.0, draws=300)
    chosen = next_examinations(found, list(curves), spending)
    assert len(set(chosen)) == len(chosen) == spending.batch
    # The crossing lies between 8 and 512
    assert np.mean([one.samples >= 8 for one in chosen]) > 0.5


def test_where_every_repetition_of_every_count_is_done_fewer_or_none_are_left():
    one_repetition = Spending("none", GRID, 2, 500)
    chosen = next_examinations(needs(), list(CURVES), one_repetition)
    assert 0 < len(chosen) < 500
    assert {one.repetition for one in chosen} == {0, 1}
