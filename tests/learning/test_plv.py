"""PLV counts target samples on the grid that was tried, and says where nothing was reached."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.errors import InputError
from proxytune.learning.plv import (
    Convergence,
    Curve,
    converged_level,
    general_plv,
    plv,
    samples_needed,
    settled,
    teaching,
)

GRID = (0, 100, 200, 400, 800)
WHEN = Convergence(level=50.0, tolerance=5.0)


def curve(*means, seeds=4, wobble=0.0):
    noise = wobble * np.random.default_rng(1).normal(size=(seeds, len(GRID)))
    return Curve(GRID, np.tile(np.array(means, dtype=float), (seeds, 1)) + noise)


def test_the_samples_needed_are_the_first_count_from_which_on_it_stays_converged():
    assert samples_needed(curve(0, 20, 45, 50, 50), WHEN) == 200
    assert samples_needed(curve(0, 46, 30, 50, 50), WHEN) == 400
    assert samples_needed(curve(45, 45, 45, 45, 45), WHEN) == 0


def test_what_is_not_reached_is_said_and_never_extrapolated():
    assert samples_needed(curve(0, 10, 20, 30, 44.9), WHEN) is None


def test_without_any_sample_there_is_no_learner_so_none_are_not_enough():
    assert samples_needed(curve(np.nan, 50, 50, 50, 50), WHEN) == 100


def test_a_proxy_that_helps_has_a_plv_above_zero_and_one_that_harms_below():
    without = curve(np.nan, 10, 20, 50, 50)
    helped = teaching(without=without, with_proxy=curve(20, 48, 50, 50, 50), when=WHEN)
    harmed = teaching(without=without, with_proxy=curve(-9, -9, 10, 20, 50), when=WHEN)
    assert (helped.plv.value, helped.factor.value, helped.reduction.value) == (300.0, 4.0, 0.75)
    assert (harmed.plv.value, harmed.factor.value, harmed.reduction.value) == (-400.0, 0.5, -1.0)


def test_where_the_target_needs_no_sample_at_all_the_reduction_is_whole_and_the_factor_unbounded():
    found = teaching(without=curve(np.nan, 10, 20, 50, 50), with_proxy=curve(50, 50, 50, 50, 50), when=WHEN)
    assert (found.needed.value, found.reduction.value, found.factor.value) == (0.0, 1.0, None)


def test_a_proxy_with_which_the_learner_never_converges_has_no_plv():
    found = teaching(without=curve(np.nan, 10, 20, 50, 50), with_proxy=curve(0, 0, 0, 0, 0), when=WHEN)
    assert found.needed.value is None
    assert found.plv.value is None
    assert found.plv.high is None
    assert found.factor.value is None


def test_the_interval_holds_the_value_and_is_wider_where_seeds_differ_more():
    without = curve(np.nan, 10, 30, 50, 50, seeds=6)
    spans = []
    for wobble in (0.0, 6.0):
        found = teaching(without=without, with_proxy=curve(0, 40, 47, 52, 54, seeds=6, wobble=wobble), when=WHEN)
        assert found.needed.low <= found.needed.value <= found.needed.high
        spans.append(found.needed.high - found.needed.low)
    assert spans[0] == 0.0 < spans[1]


@settings(derandomize=True, deadline=None, max_examples=50)
@given(st.lists(st.floats(-60, 60), min_size=10, max_size=10), st.floats(0, 60))
def test_better_scores_never_need_more_samples(scores, more):
    worse = Curve(GRID, np.array(scores).reshape(2, 5))
    better = Curve(GRID, worse.scores + more)
    needed = [samples_needed(one, WHEN) for one in (better, worse)]
    assert needed[1] is None or (needed[0] is not None and needed[0] <= needed[1])


def test_the_general_form_is_equation_5_where_all_samples_are_an_experts():
    assert general_plv(without=(0, 400), with_proxy=(0, 100)) == plv(without=400, with_proxy=100) == 300
    assert general_plv(without=(50, 400), with_proxy=(10, 100), cost_on=10.0, cost_off=0.5) == 550.0


def test_a_curve_that_still_rises_has_not_settled():
    assert settled(curve(0, 20, 40, 48, 52), 5.0)
    assert not settled(curve(0, 10, 20, 30, 40), 5.0)
    assert not settled(Curve((0, 100), np.array([[np.nan, 50.0]])), 5.0)


def test_without_a_stated_level_it_is_what_the_largest_count_comes_to():
    assert converged_level(curve(0, 10, 20, 30, 41)) == 41.0


@pytest.mark.parametrize(
    ("counts", "scores", "says"),
    [
        ((100, 200), np.zeros((2, 2)), "add 0"),
        ((0, 200, 200), np.zeros((2, 3)), "must rise"),
        ((0, 200), np.zeros((2, 3)), "shape"),
        ((), np.zeros((2, 0)), "add 0"),
    ],
)
def test_a_curve_that_is_none_is_refused(counts, scores, says):
    with pytest.raises(InputError, match=says):
        Curve(counts, scores)


def test_curves_of_other_grids_are_not_compared():
    with pytest.raises(InputError, match="one grid"):
        teaching(without=curve(0, 0, 0, 0, 0), with_proxy=curve(0, 0, 0, 0, 0, seeds=2), when=WHEN)
