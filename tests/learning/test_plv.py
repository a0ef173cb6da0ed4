"""PLV counts samples where the mean curve crosses, and examinations go where they tell most about it."""

import numpy as np
import pytest

from proxytune.learning import AdaptiveDesign, Examination, LearningCurve, first_examinations, mean_score
from proxytune.learning.plv import more_needed, next_examinations, sample_needs, teaching_value

GRID = (0, 100, 200, 400, 800)


def curve(*means, seeds=6, wobble=0.5):
    noise = wobble * np.random.default_rng(1).normal(size=(seeds, len(GRID)))
    return LearningCurve(GRID, np.tile(np.array(means, dtype=float), (seeds, 1)) + noise)


WITHOUT = curve(np.nan, 10, 20, 50, 50)


def judged(level=None, **curves):
    return sample_needs({"none": WITHOUT, **curves}, best_score=60.0, tolerance=5.0, level=level)


def worth(proxy, level=None):
    return teaching_value(judged(proxy=proxy, level=level), "proxy")


def test_a_proxy_is_worth_the_samples_between_crossings_with_a_bound_where_none_or_all_are_needed():
    helped, harmed = worth(curve(20, 48, 50, 50, 50)), worth(curve(-9, -9, 10, 20, 50))
    assert 0.0 < helped.plv.low < helped.plv.value < helped.plv.high
    assert helped.factor.low > 1.0
    assert 0.0 < helped.reduction.low <= helped.reduction.high <= 1.0
    assert harmed.plv.low < harmed.plv.value < harmed.plv.high < 0.0
    assert harmed.factor.high < 1.0
    assert harmed.reduction.high < 0.0
    found = worth(curve(0, 40, 47, 50, 50))
    assert 100.0 < found.needed.low < found.needed.value < found.needed.high < 200.0
    assert 200.0 < found.without.low < found.without.value < found.without.high < 400.0
    found = worth(curve(50, 50, 50, 50, 50))
    assert (found.needed.value, found.reduction.value, found.factor.value) == (0.0, 1.0, None)

    found = worth(curve(0, 0, 0, 0, 0))
    assert (found.needed.value, found.needed.low, found.needed.high) == (None, pytest.approx(800.0), None)
    assert (found.plv.value, found.plv.low, found.factor.value) == (None, None, None)
    assert found.plv.high < 0.0
    assert found.plv.high == pytest.approx(found.without.high - 800.0)

    found = worth(curve(55, 58, 59, 59, 59), level=59.0)
    assert found.without.value is None
    assert found.plv.value is None
    assert found.plv.low > 0.0

    found = worth(curve(40, 50, 58, 59, 59), level=59.0).reduction
    assert found.value is None
    assert 0.0 < found.low < found.high == 1.0


def test_who_has_converged_at_the_first_count_of_the_grid_may_have_needed_a_single_sample():
    early = {"none": curve(np.nan, 50, 50, 50, 50), "proxy": curve(50, 50, 50, 50, 50), "poor": curve(0, 0, 0, 50, 50)}
    needs = sample_needs(early, best_score=60.0, tolerance=5.0)
    helped, harmed = teaching_value(needs, "proxy"), teaching_value(needs, "poor")
    assert (helped.without.low, helped.without.value, helped.without.high) == (1.0, 100.0, 100.0)
    assert (helped.plv.low, helped.plv.value, helped.plv.high) == (1.0, 100.0, 100.0)
    assert harmed.factor.low < harmed.factor.value / 50.0
    assert harmed.plv.high < -90.0
    assert more_needed(needs, more="poor", less="none").high == pytest.approx(-harmed.plv.low)


def test_a_grid_is_settled_by_its_last_doubling_alone():
    rising = curve(np.nan, 10, 20, 30, 50)
    assert judged(proxy=curve(0, 10, 20, 30, 40)).settled
    assert not sample_needs({"none": rising}, best_score=60.0, tolerance=5.0).settled
    alone = LearningCurve((0, 500, 800), np.array([[np.nan, 50.0, 50.0], [np.nan, 49.0, 51.0]]))
    needs = sample_needs({"none": alone}, best_score=60.0, tolerance=5.0)
    assert (needs.gain, needs.settled) == (None, False)


@pytest.mark.parametrize("grid", [(0, 400, 800), (0, 3, 6), (0, 50, 100)])
def test_a_grid_that_begins_at_half_its_last_tells_the_gain(grid):
    alone = LearningCurve(grid, np.array([[np.nan, 20.0, 50.0], [np.nan, 19.0, 51.0], [np.nan, 21.0, 50.5]]))
    assert 20.0 < sample_needs({"none": alone}, best_score=60.0, tolerance=5.0).gain < 35.0


def test_proxies_are_compared_by_what_they_need_whatever_beside_and_their_first_score_has_an_interval():
    needs = judged(good=curve(20, 48, 50, 50, 50), never=curve(0, 0, 0, 0, 0))
    good, never = (teaching_value(needs, name) for name in ("good", "never"))
    assert good.without == never.without
    assert good.without.low > 200.0
    needs = judged(good=curve(20, 48, 50, 50, 50), poor=curve(0, 10, 20, 48, 50))
    more = more_needed(needs, more="poor", less="good")
    assert 0.0 < more.low < more.value < more.high
    assert more_needed(needs, more="good", less="good").value == 0.0
    needs = judged(proxy=curve(20, 48, 50, 50, 50))
    found = mean_score(needs, "proxy", 0)
    assert found.low < 20.0 < found.high
    assert found.high - found.low < 5.0
    assert mean_score(needs, "none", 0).value is None


def test_scores_beyond_the_best_are_no_others_and_unit_costs_are_plv():
    lower = {"none": curve(np.nan, -900, -600, -200, -190), "proxy": curve(-500, -200, -190, -190, -190)}
    needs = sample_needs(lower, best_score=0.0, tolerance=20.0)
    assert -195.0 < needs.when.level < -185.0
    assert 200.0 < teaching_value(needs, proxy="proxy").without.value < 800.0


SPENDING_GRID = (0, 100, 200, 400, 800, 1600)
SPENDING = AdaptiveDesign(SPENDING_GRID, 6, 12)
KNOWN = (SPENDING_GRID.index(100), SPENDING_GRID.index(400), SPENDING_GRID.index(1600))


def curve_of_spending(*means, wobble=2.0, seeds=2, known=(0, *KNOWN)):
    scores = np.full((seeds, len(SPENDING_GRID)), np.nan)
    noise = wobble * np.random.default_rng(1).normal(size=scores.shape)
    scores[:, known] = (np.array(means, dtype=float) + noise)[:, known]
    return LearningCurve(SPENDING_GRID, scores)


CURVES = {
    "none": curve_of_spending(np.nan, 5, 10, 20, 50, 50, known=KNOWN),
    "sure": curve_of_spending(50, 50, 50, 50, 50, 50),
    "open": curve_of_spending(20, 22, 25, 40, 50, 50, wobble=6.0),
}


def needs(curves=CURVES):
    return sample_needs(curves, best_score=60.0, tolerance=5.0, draws=300)


def test_the_first_examinations_span_the_grid_in_two_repetitions_and_none_is_of_who_has_learnt_nothing():
    first = first_examinations(["none", "proxy"], SPENDING)
    assert {one.samples for one in first if one.curve == "proxy"} == {0, 200, 400, 1600}
    assert {one.repetition for one in first} == {0, 1}
    assert not any(one.curve == "none" and one.samples == 0 for one in first)
    assert [one.samples for one in first if one.curve == "none"] == [100, 200, 800, 1600] * 2
    assert len(first) == len(set(first)) == 2 * (4 + 4)


def test_examinations_go_where_they_tell_most_nothing_twice_and_fewer_where_all_is_done():
    chosen = next_examinations(needs(), list(CURVES), SPENDING)
    often = {name: sum(one.curve == name for one in chosen) for name in CURVES}
    assert len(chosen) == SPENDING.batch
    assert often["sure"] < min(often["open"], often["none"])

    done = {Examination(name, int(r), SPENDING_GRID[c]) for name, one in CURVES.items() for r, c in one.examined}
    assert len(set(chosen)) == len(chosen)
    assert not set(chosen) & done
    assert chosen[0].repetition == 2

    assert {one.curve for one in next_examinations(needs(), ["open"], SPENDING)} == {"open"}

    chosen = next_examinations(needs({"none": CURVES["none"]}), ["none"], SPENDING)
    assert len(chosen) == SPENDING.batch
    # Between 400, where it is far below, and 1600, where it is converged.
    assert np.mean([one.samples > 300 for one in chosen]) > 0.5
    chosen = next_examinations(needs(), list(CURVES), AdaptiveDesign(SPENDING_GRID, 2, 500))
    assert 0 < len(chosen) < 500
    assert {one.repetition for one in chosen} == {0, 1}


@pytest.mark.parametrize("first", [1, 2, 7])
def test_a_grid_from_few_samples_on_has_no_place_twice_and_none_before_the_first(first):
    grid = (0, first, 8, 64, 512)
    spending = AdaptiveDesign(grid, 4, 12)
    scores = np.array([[np.nan, 1.0, 5.0, 30.0, 50.0], [np.nan, 3.0, 9.0, 35.0, 49.0]])
    taught = LearningCurve(grid, np.where(np.isnan(scores), 0.0, scores + 1.0))
    curves = {"none": LearningCurve(grid, scores), "proxy": taught}
    chosen = next_examinations(sample_needs(curves, best_score=60.0, tolerance=5.0, draws=300), list(curves), spending)
    assert len(set(chosen)) == len(chosen) == spending.batch
    # The crossing lies between 8 and 512
    assert np.mean([one.samples >= 8 for one in chosen]) > 0.5
