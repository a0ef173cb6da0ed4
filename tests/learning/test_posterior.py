"""Drawn learning curves keep within bounds, rise where the data allow it, and cross where they come to stay above."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.learning.curves import Curve
from proxytune.learning.posterior import crossing, draw_curves

GRID = (0, 100, 200, 400, 800)
COUNTS = np.array([0.0, 100.0, 200.0, 400.0])


def curve(*means, wobble=1.0, seeds=6):
    noise = wobble * np.random.default_rng(2).normal(size=(seeds, len(GRID)))
    return Curve(GRID, np.array(means, dtype=float) + noise)


def crossed(*scores, threshold=45.0):
    return float(crossing(COUNTS, np.array([scores], dtype=float), np.array([threshold]), first=100.0)[0])


def test_samples_are_needed_up_to_where_the_curve_comes_to_stay_above_the_threshold():
    assert crossed(0, 20, 40, 50) == 300.0
    assert crossed(0, 46, 30, 60) == 300.0
    assert crossed(45, 45, 45, 45) == 0.0
    assert crossed(0, 45, 50, 50) == 100.0


def test_what_is_not_reached_is_infinite_and_never_extrapolated():
    assert crossed(0, 10, 20, 44.9) == np.inf
    assert crossed(50, 50, 50, 44.9) == np.inf


def test_without_any_sample_there_is_no_learner_so_none_are_not_enough():
    assert crossed(np.nan, 50, 50, 50) == 100.0


def test_the_first_count_is_enough_though_the_next_place_drawn_lies_beyond_it():
    scores = np.array([[np.nan, np.nan, 50.0, 50.0], [np.nan, np.nan, 40.0, 50.0]])
    needed = crossing(np.array([0.0, 60.0, 120.0, 200.0]), scores, np.array([45.0, 45.0]), first=100.0)
    assert needed.tolist() == [100.0, 160.0]


@settings(derandomize=True, deadline=None, max_examples=100)
@given(st.lists(st.floats(-60, 60), min_size=4, max_size=4), st.floats(0, 60))
def test_better_scores_never_need_more_samples(scores, more):
    assert crossed(*(np.array(scores) + more)) <= crossed(*scores) + 1e-9


def test_draws_keep_within_the_scores_there_can_be():
    drawn = draw_curves({"high": curve(50, 58, 60, 60, 60, wobble=4.0)}, (-60.0, 60.0)).scores["high"]
    assert drawn.max() <= 60.0 + 1e-9
    assert drawn.shape[0] == 2000


def test_a_curve_rises_in_every_draw_unless_the_scores_show_a_fall():
    curves = {"rising": curve(10, 20, 40, 50, 50), "dipping": curve(40, 10, 20, 45, 50)}
    draws = draw_curves(curves, (-60.0, 60.0))
    assert draws.monotone == {"rising": True, "dipping": False}
    assert (np.diff(draws.scores["rising"], axis=1) >= -1e-9).all()
    assert np.mean(draws.scores["dipping"], axis=0).min() < 20.0


def test_a_fall_within_the_noise_does_not_count_as_one():
    assert draw_curves({"noisy": curve(30, 29, 31, 30, 30, wobble=6.0)}, (-60.0, 60.0)).monotone["noisy"]


def test_means_of_draws_are_where_many_scores_are_and_rising_ones_are_not_lifted_by_an_overshoot():
    draws = draw_curves({"steep": curve(0, 10, 20, 50, 50, wobble=0.3)}, (-60.0, 60.0))
    ends = [float(draws.scores["steep"][:, place].mean()) for place in (0, -1)]
    assert ends == pytest.approx([0.0, 50.0], abs=1.0)


def test_before_anything_has_been_learnt_nothing_is_drawn():
    draws = draw_curves({"none": curve(np.nan, 10, 20, 50, 50)}, (-60.0, 60.0))
    early = draws.counts < 99.9
    assert np.isnan(draws.scores["none"][:, early]).all()
    assert np.isfinite(draws.scores["none"][:, ~early]).all()
