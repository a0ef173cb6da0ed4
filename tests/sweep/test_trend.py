from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.sweep.curves import Estimate, Series
from proxytune.sweep.trend import describe, shape_of
from proxytune.usefulness.catalogue import PRPV
from proxytune.usefulness.measure import ALL


def series(scores, spread=0.0, higher=False):
    found = [
        Estimate(float(place), score, None if score is None or spread is None else (score - spread, score + spread))
        for place, score in enumerate(scores)
    ]
    measure = replace(PRPV, better="higher" if higher else "lower")
    return Series(measure, ALL, tuple(found))


def test_a_valley_at_the_held_value_worsens_on_both_sides():
    shape = shape_of(series([9.0, 4.0, 1.0, 3.0, 8.0]), 2.0)
    assert (shape.best, shape.score, shape.near_best) == ((2.0,), 1.0, (2.0,))
    assert (shape.below, shape.above, shape.monotone) == ("worsens", "worsens", True)


def test_a_measure_of_which_higher_is_better_is_best_at_its_peak():
    shape = shape_of(series([0.2, 0.5, 0.9, 0.6, 0.1], higher=True), 2.0)
    assert (shape.best, shape.score, shape.monotone) == ((2.0,), 0.9, True)


def test_a_second_valley_is_a_turn_on_its_side_only():
    shape = shape_of(series([9.0, 4.0, 1.0, 6.0, 3.0]), 2.0)
    assert (shape.below, shape.above, shape.monotone) == ("worsens", "turns", False)


def test_a_best_value_beside_the_held_one_is_a_turn():
    assert shape_of(series([9.0, 4.0, 2.0, 0.0, 8.0]), 2.0).above == "turns"


def test_a_dip_within_noise_is_no_turn_and_a_rise_within_noise_is_flat():
    assert shape_of(series([9.0, 4.0, 1.0, 6.0, 5.0], spread=0.6), 2.0).above == "worsens"
    shape = shape_of(series([2.0, 1.5, 1.0, 1.5, 2.0], spread=0.6), 2.0)
    assert (shape.below, shape.above, shape.monotone) == ("flat", "flat", False)
    assert shape.near_best == (0.0, 1.0, 2.0, 3.0, 4.0)


def test_without_intervals_no_side_is_judged():
    shape = shape_of(series([9.0, 1.0, 8.0], spread=None), 1.0)
    assert (shape.below, shape.above, shape.monotone) == ("unknown", "unknown", None)


@pytest.mark.parametrize("held", [None, 7.0])
def test_sides_need_a_held_value_that_was_looked_at(held):
    shape = shape_of(series([9.0, 1.0, 8.0]), held)
    assert (shape.below, shape.above, shape.monotone) == ("unseen", "unseen", None)
    assert shape.best == (1.0,)


def test_a_held_value_at_an_end_has_one_side():
    shape = shape_of(series([1.0, 2.0, 3.0]), 0.0)
    assert (shape.below, shape.above, shape.monotone) == ("unseen", "worsens", True)


def test_undefined_points_are_passed_over():
    shape = shape_of(series([9.0, None, 1.0, None, 8.0]), 2.0)
    assert (shape.best, shape.monotone) == ((2.0,), True)
    empty = series([None, None])
    assert shape_of(empty, 0.0).best == ()
    assert describe(empty, 0.0) == "PRPV: undefined at every point"


def test_ties_for_the_best_are_all_named():
    assert shape_of(series([3.0, 1.0, 1.0, 2.0]), None).best == (1.0, 2.0)


def test_the_line_says_where_it_is_lowest_and_what_each_side_does():
    line = describe(series([9.0, 4.0, 1.0, 6.0, 3.0]), 2.0)
    assert line.startswith("PRPV: lowest (1) at 2; not worse beyond noise: 2; from 2 downwards it worsens")
    assert "upwards it turns" in line
    assert "from" not in describe(series([9.0, 4.0, 1.0]), None)
    assert "not worse beyond noise: 0, 2" in describe(series([1.0, 5.0, 1.0]), None)


@settings(derandomize=True, max_examples=50)
@given(st.lists(st.floats(-5, 5), min_size=3, max_size=9), st.data())
def test_the_mirror_image_of_a_curve_has_mirrored_sides(scores, data):
    held = data.draw(st.integers(0, len(scores) - 1))
    one = shape_of(series(scores, 0.5), float(held))
    other = shape_of(series(scores[::-1], 0.5), float(len(scores) - 1 - held))
    upside_down = shape_of(series([-score for score in scores], 0.5, higher=True), float(held))
    assert (one.below, one.above) == (other.above, other.below) == (upside_down.below, upside_down.above)
