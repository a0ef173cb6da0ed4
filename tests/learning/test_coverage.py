"""Intervals of PLV hold the truth as often as they say, where examinations are chosen as where all are made."""

import numpy as np
import pytest
from made_up_learners import BEST, GRID, NONE, TOLERANCE, MadeUpLearners

from proxytune.learning.plv import sample_needs, teaching
from proxytune.learning.spending import Spending, curves_of, first_examinations, next_examinations

REPETITIONS = 8
CLASSROOMS = 50
WHOLE = 5 * REPETITIONS * len(GRID)
"""Examinations of the whole grid."""


def needs_of(curves, draws=2000):
    return sample_needs(curves, none=NONE, best_score=BEST, tolerance=TOLERANCE, draws=draws)


def spend(learners, examinations):
    """The curves after so many examinations that were chosen."""
    spending, scores = Spending(NONE, GRID, REPETITIONS, 12), {}
    batch = first_examinations(learners.names, spending)
    while True:
        for one in batch[: examinations - len(scores)]:
            scores[one] = learners.score(one.curve, one.repetition, one.samples)
        curves = curves_of(GRID, scores)
        if len(scores) >= examinations:
            return curves
        batch = next_examinations(needs_of(curves, 500), learners.names, spending)


def judged(learners, curves):
    """Of every proxy: whether the interval of its PLV holds the truth, and how wide it is."""
    needs, alone = needs_of(curves), learners.needed(NONE)
    found = []
    for name in learners.names[1:]:
        plv = teaching(needs, none=NONE, proxy=name).plv
        low, high = -np.inf if plv.low is None else plv.low, np.inf if plv.high is None else plv.high
        truth = alone - learners.needed(name)
        # Where η is not reached, PLV is known to lie below what the largest count leaves.
        holds = low <= truth <= high if np.isfinite(truth) else plv.low is None and high >= alone - GRID[-1]
        found.append((holds, high - low))
    return found


def grid_width(curves, name, resamples=300):
    """How wide the interval is that the smallest count of the grid and a bootstrap over repetitions give."""
    rows = np.random.default_rng(0).integers(0, REPETITIONS, (resamples, REPETITIONS))
    least = [curves[one].scores[rows].mean(axis=1) for one in (NONE, name)]
    threshold = curves[NONE].scores[:, -1].mean() - TOLERANCE
    below = [~(mean >= threshold) for mean in least]
    first = [np.where(one.any(axis=1), len(GRID) - np.argmax(one[:, ::-1], axis=1), 0) for one in below]
    alone, taught = (np.array([*GRID, np.inf])[places] for places in first)
    saved = np.sort(alone[known := np.isfinite(alone)] - taught[known])
    return saved[round(0.975 * (len(saved) - 1))] - saved[round(0.025 * (len(saved) - 1))]


@pytest.mark.slow
def test_intervals_hold_the_truth_in_nine_of_ten_of_200_proxies_and_a_third_of_the_grid_is_sharper_than_a_bootstrap():
    chosen, whole, bootstrap = [], [], []
    for seed in range(CLASSROOMS):
        learners = MadeUpLearners(seed)
        chosen += judged(learners, spend(learners, WHOLE // 3))
        if seed < 12:
            curves = learners.curves(REPETITIONS)
            whole += judged(learners, curves)
            bootstrap += [grid_width(curves, name) for name in learners.names[1:]]
    assert len(chosen) == 200
    assert np.mean([holds for holds, _ in chosen]) >= 0.9
    assert np.mean([holds for holds, _ in whole]) >= 0.9
    third, all_of_it = (np.median([width for _, width in found]) for found in (chosen[: len(whole)], whole))
    assert all_of_it < third < 0.75 * np.median(bootstrap)
