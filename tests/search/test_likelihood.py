"""The likelihood is highest where the target was made, and outputs that say the same count as one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from steps import SPACE, goal, whole

from proxytune.search.design import design_point, to_unit
from proxytune.search.knowledge.likelihood import Likelihood, deviance, temper
from proxytune.search.knowledge.output_model import fit_outputs
from proxytune.search.proposer import Trial

TRUTH = (0.12, 0.06)


def outputs(values):
    first, second = to_unit(SPACE, values)
    return (first + second, first - second, np.sin(4.0 * first), np.cos(3.0 * second))


def likelihood(values=None, noise=1e-4):
    trials = [Trial(p, 1.0, outputs(p)) for p in (design_point(SPACE, index, 1) for index in range(20))]
    return Likelihood(fit_outputs(SPACE, trials), goal(whole, outputs(TRUTH) if values is None else values, noise))


def test_it_is_highest_near_the_truth():
    grid = np.stack(np.meshgrid(np.linspace(0, 1, 41), np.linspace(0, 1, 41)), axis=-1).reshape(-1, 2)
    best = grid[np.argmax(likelihood().log(grid))]
    assert best == pytest.approx(to_unit(SPACE, TRUTH), abs=0.05)


def test_outputs_that_the_target_lacks_say_nothing():
    part = (*outputs(TRUTH)[:2], np.nan, np.nan)
    assert likelihood(part).columns.tolist() == [0, 1]
    assert np.isfinite(likelihood(part).log(np.array([[0.5, 0.5]]))).all()


def test_more_noise_makes_it_flatter():
    points = np.array([to_unit(SPACE, TRUTH), [0.9, 0.1]])
    sharp, flat = (np.ptp(likelihood(noise=noise).log(points)) for noise in (1e-4, 1.0))
    assert sharp > 5.0 * flat


@settings(derandomize=True, max_examples=20, deadline=None)
@given(st.integers(1, 9), st.integers(0, 99))
def test_copies_of_one_output_count_as_one(copies, seed):
    errors = np.random.default_rng(seed).normal(size=(200, 1))
    assert temper(np.repeat(errors, copies, axis=1)) == pytest.approx(copies, rel=0.01)


def test_independent_outputs_count_each():
    found = [temper(np.random.default_rng(seed).normal(size=(24, 40))) for seed in range(20)]
    assert max(found) < 1.6
    assert np.mean(found) < 1.3


def test_holes_change_little():
    base = np.random.default_rng(0).normal(size=(60, 3))
    errors = np.repeat(base, 4, axis=1)
    holes = np.where(np.random.default_rng(1).random(errors.shape) < 0.3, np.nan, errors)
    assert temper(errors) == pytest.approx(4.0, abs=0.3)
    assert temper(holes) == pytest.approx(4.0, abs=0.6)


def test_an_output_that_is_far_off_counts_for_less_than_a_normal_s_would():
    assert deviance(np.array([0.0]))[0] == 0.0
    assert deviance(np.array([1.0]))[0] == pytest.approx(0.5, abs=0.1)
    assert deviance(np.array([10.0]))[0] < 10.0
