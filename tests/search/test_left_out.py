"""Trials left out say how wide a region has to be."""

import numpy as np
from steps import SPACE, goal, whole

from proxytune.search.design import design_point, to_unit
from proxytune.search.knowledge.left_out import FEWEST, MARGIN, WIDENINGS, LeftOut, leave_out
from proxytune.search.knowledge.output_model import fit_outputs
from proxytune.search.proposer import Trial

AGENTS = np.random.default_rng(0).uniform(1.0, 4.0, (12, 2))


def trials(count, together=0.0):
    """Smooth outputs with roughness; a part of it may be one and the same in half of the outputs."""
    points = [design_point(SPACE, index, 1) for index in range(count)]
    rough = np.random.default_rng(3).normal(0.0, 0.05, (count, 13))
    smooth = [np.sin(AGENTS @ to_unit(SPACE, values)) for values in points]
    rows = [s + r[:12] + together * r[12] for s, r in zip(smooth, rough, strict=True)]
    return [Trial(v, 1.0, tuple(row.tolist())) for v, row in zip(points, rows, strict=True)]


def left_out(told, values=(0.5,) * 12):
    return leave_out(fit_outputs(SPACE, told), told, goal(whole, values, 1e-4), 1)


def test_each_trial_is_told_how_probable_its_own_theta_is():
    found = left_out(trials(20))
    assert found.deviances.shape == (20,)
    assert found.above.shape == (20, len(WIDENINGS))
    assert (found.above >= 0.0).all()
    assert (found.above <= 1.0 + 1e-9).all()


def test_a_wider_density_holds_no_fewer_of_them():
    held = (left_out(trials(20)).above <= 0.95).sum(axis=0)
    assert (np.diff(held) >= 0).all()


def planted(missed, widening=0):
    """Of twenty trials so many are missed, up to this place in the list of widenings."""
    above = np.full((20, len(WIDENINGS)), 0.5)
    above[:missed, : widening + 1] = 0.99
    return LeftOut(np.ones(20), above)


def test_the_region_is_widened_until_it_holds_nine_of_ten():
    assert planted(0).widening == planted(2).widening == MARGIN
    assert planted(3, 0).widening == MARGIN * WIDENINGS[1]
    assert planted(3, 2).widening == MARGIN * WIDENINGS[3]
    assert planted(20, len(WIDENINGS) - 1).widening == MARGIN * WIDENINGS[-1]


def test_few_of_them_widen_nothing_beyond_the_margin():
    few = left_out(trials(FEWEST - 1))
    assert not few.enough
    assert few.widening == MARGIN


def test_a_single_trial_is_not_left_out():
    assert left_out(trials(1)).widening == MARGIN


def test_trials_that_lack_outputs_are_not_left_out_but_are_learnt_from():
    told = trials(12)
    cut = [
        Trial(t.values, t.score, (*t.outcome[:6], *[np.nan] * 6)) if row % 3 == 0 else t for row, t in enumerate(told)
    ]
    assert left_out(cut).deviances.shape == (8,)
