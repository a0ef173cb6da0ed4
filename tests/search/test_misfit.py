"""A proxy that fits is not said to lack anything, and one that lacks something is."""

import numpy as np
import pytest
from steps import SPACE, goal, whole

from proxytune.search.design import design_point, from_unit, to_unit
from proxytune.search.knowledge.knowledge import learn
from proxytune.search.proposer import Trial

AGENTS = np.random.default_rng(0).uniform(1.0, 4.0, (12, 2))
SPREAD = 0.03


def outputs(values, seed):
    """Twelve smooth outputs, rough by a little."""
    waves = np.sin(AGENTS @ to_unit(SPACE, values))
    return waves + np.random.default_rng([seed, 7]).normal(0.0, SPREAD, 12)


def trials(seed, count=16):
    points = [design_point(SPACE, index, seed) for index in range(count)]
    return [Trial(p, 1.0, tuple(outputs(p, 100 * seed + row).tolist())) for row, p in enumerate(points)]


def p_value(seed, shift):
    values = from_unit(SPACE, np.random.default_rng(seed).uniform(0.2, 0.8, 2))
    target = outputs(values, 10_000 + seed) + shift * np.resize([1.0, -1.0, 0.0], 12)
    told = trials(seed)
    return learn(SPACE, told, goal(whole, target, SPREAD**2), seed).misfit.p_value


@pytest.mark.slow
def test_targets_that_the_proxy_can_make_are_seldom_said_to_be_beyond_it():
    found = np.array([p_value(seed, 0.0) for seed in range(24)])
    assert (found < 0.05).sum() <= 3
    assert np.ptp(found) > 0.5


@pytest.mark.slow
def test_targets_beyond_it_are_found():
    assert max(p_value(seed, 0.6) for seed in range(6)) < 0.05


def test_the_same_trials_in_any_order_give_the_same_verdict():
    told = trials(1)
    target = goal(whole, outputs((0.1, 0.1), 5), SPREAD**2)
    assert learn(SPACE, told, target, 1).misfit == learn(SPACE, told[::-1], target, 1).misfit


@pytest.mark.parametrize("count", [4, 5])
def test_with_too_few_trials_nothing_is_said(count):
    told = trials(1, count)
    found = learn(SPACE, told, goal(whole, outputs((0.1, 0.1), 5))).misfit
    assert (found.p_value, found.fits) == (None, None)


def test_where_no_output_changes_nothing_is_said():
    told = [Trial(design_point(SPACE, index, 1), 1.0, (7.0,)) for index in range(8)]
    assert learn(SPACE, told, goal(whole, (3.0,))).misfit.fits is None
