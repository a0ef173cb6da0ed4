"""The likelihood is highest where the target was made, of outputs that are modelled with errors of their true size."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from steps import SPACE, goal, whole

from proxytune.errors import RunError
from proxytune.search import Trial, to_unit, unit_array
from proxytune.search.engine import design_point
from proxytune.search.likelihood import Likelihood, deviance, fit_outputs, temper

TRUTH = (0.12, 0.06)


def outputs(values):
    first, second = to_unit(SPACE, values)
    return (first + second, first - second, np.sin(4.0 * first), np.cos(3.0 * second))


def likelihood(values=None, noise=1e-4):
    trials = [Trial(p, 1.0, outputs(p)) for p in (design_point(SPACE, index, 1) for index in range(20))]
    return Likelihood(fit_outputs(SPACE, trials), goal(whole, outputs(TRUTH) if values is None else values, noise))


def test_outputs_count_by_what_they_tell_of_the_truth():
    grid = np.stack(np.meshgrid(np.linspace(0, 1, 41), np.linspace(0, 1, 41)), axis=-1).reshape(-1, 2)
    assert grid[np.argmax(likelihood().log(grid))] == pytest.approx(to_unit(SPACE, TRUTH), abs=0.05)
    part = (*outputs(TRUTH)[:2], np.nan, np.nan)
    assert likelihood(part).columns.tolist() == [0, 1]
    assert np.isfinite(likelihood(part).log(np.array([[0.5, 0.5]]))).all()
    points = np.array([to_unit(SPACE, TRUTH), [0.9, 0.1]])
    sharp, flat = (np.ptp(likelihood(noise=noise).log(points)) for noise in (1e-4, 1.0))
    assert sharp > 5.0 * flat
    found = [temper(np.random.default_rng(seed).normal(size=(24, 40))) for seed in range(20)]
    assert max(found) < 1.6
    assert np.mean(found) < 1.3


@settings(max_examples=20)
@given(st.integers(1, 9), st.integers(0, 99))
def test_copies_of_one_output_count_as_one(copies, seed):
    errors = np.random.default_rng(seed).normal(size=(200, 1))
    assert temper(np.repeat(errors, copies, axis=1)) == pytest.approx(copies, rel=0.01)


def test_holes_and_outputs_far_off_or_still_change_little():
    errors = np.repeat(np.random.default_rng(0).normal(size=(60, 3)), 4, axis=1)
    holes = np.where(np.random.default_rng(1).random(errors.shape) < 0.3, np.nan, errors)
    assert temper(errors) == pytest.approx(4.0, abs=0.3)
    assert temper(holes) == pytest.approx(4.0, abs=0.6)

    assert deviance(np.array([0.0]))[0] == 0.0
    assert deviance(np.array([1.0]))[0] == pytest.approx(0.5, abs=0.1)
    assert deviance(np.array([10.0]))[0] < 10.0

    model = fit_outputs(SPACE, [Trial(design_point(SPACE, index, 1), 1.0, (7.0,)) for index in range(6)])
    assert model.modelled.size == 0
    assert np.isnan(model.predict(np.array([[0.5, 0.5]]))[0]).all()

    forwards, backwards = fit_outputs(SPACE, trials(12)), fit_outputs(SPACE, trials(12)[::-1])
    points = unit_array(SPACE, HELD_OUT)
    for one, other in zip(forwards.predict(points), backwards.predict(points), strict=True):
        assert np.array_equal(one, other, equal_nan=True)


def five_outputs(values):
    """Two smooth outputs, a rough one, one that never changes, one that comes to its bound."""
    first, second = to_unit(SPACE, values)
    rough = np.random.default_rng([int(1e6 * first), int(1e6 * second)]).normal()
    return (first + second, np.sin(3.0 * second), first + 0.3 * rough, 60.0, min(20.0, 15.0 + 10.0 * first))


def trials(count, seed=1):
    points = [design_point(SPACE, index, seed) for index in range(count)]
    return [Trial(values, 1.0, five_outputs(values)) for values in points]


HELD_OUT = [design_point(SPACE, index, 9) for index in range(64)]


def test_smooth_outputs_are_predicted_with_errors_as_their_variance_says_and_others_not_trusted():
    model = fit_outputs(SPACE, trials(32))
    mean, variance = model.predict(unit_array(SPACE, HELD_OUT))
    truth = np.array([five_outputs(values) for values in HELD_OUT])
    errors = np.sqrt(np.mean((mean - truth) ** 2, axis=0))
    assert errors[0] < 0.05
    assert errors[1] < 0.05
    assert model.rough[2] > 10.0 * model.rough[0]
    assert np.isnan(mean[:, 3]).all()
    assert model.constant[3] == 60.0
    squares = np.mean((truth - mean)[:, :3] ** 2 / (variance + model.rough)[:, :3], axis=0)
    assert (squares > 0.05).all()
    assert (squares < 5.0).all()
    share = fit_outputs(SPACE, trials(32)).rough / np.nanvar([trial.outcome for trial in trials(32)], axis=0)
    assert share[2] > 3.0 * share[0]


def test_trials_that_know_some_outputs_alone_tell_of_these():
    whole = trials(24)
    part = [replace(t, outcome=(t.outcome[0], *[np.nan] * 4)) if row % 2 else t for row, t in enumerate(whole)]
    model, half = fit_outputs(SPACE, part), fit_outputs(SPACE, whole[::2])
    points = unit_array(SPACE, HELD_OUT)
    assert np.median(model.predict(points)[1][:, 0]) < np.median(half.predict(points)[1][:, 0])
    assert np.allclose(model.predict(points)[0][:, 1], half.predict(points)[0][:, 1])
    assert np.isnan(model.left_out).sum(axis=0)[:2].tolist() == [0, 12]


def cheaper(values):
    """A course that few trials do not tell."""
    first, second = to_unit(SPACE, values)
    return (np.sin(9.0 * first) + second, np.cos(8.0 * second) * first)


def better(values):
    """The same with a bias that is smooth."""
    first, second = to_unit(SPACE, values)
    return tuple(value + 0.5 + 0.4 * first - 0.3 * second for value in cheaper(values))


def test_few_trials_correct_a_cheaper_proxy_and_one_that_does_something_else_makes_no_promise():
    """Eight trials and what a cheaper proxy does predict better than eight alone, and say how well."""
    own = [Trial(values, 1.0, better(values)) for values in (design_point(SPACE, index, 1) for index in range(8))]
    points = [design_point(SPACE, index, 2) for index in range(64)]
    low = [Trial(values, None, cheaper(values), low_fidelity=True) for values in points]
    truth, unit = np.array([better(values) for values in HELD_OUT]), unit_array(SPACE, HELD_OUT)
    alone, both = fit_outputs(SPACE, own).predict(unit)[0], fit_outputs(SPACE, [*low, *own])
    mean, variance = both.predict(unit)
    assert np.abs(mean - truth).mean() < 0.2 * np.abs(alone - truth).mean()
    assert 0.1 < np.sqrt(((mean - truth) ** 2 / (variance + both.rough)).mean()) < 1.5
    assert both.visited.shape == (8, 2)
    # What it says is not believed: errors are as large as the model says.
    own = [Trial(values, 1.0, better(values)) for values in (design_point(SPACE, index, 1) for index in range(12))]
    draws = np.random.default_rng(1).normal(0.0, 2.0, (64, 2))
    low = [Trial(p, None, tuple(row), low_fidelity=True) for p, row in zip(points, draws.tolist(), strict=True)]
    model = fit_outputs(SPACE, [*low, *own])
    mean, variance = model.predict(unit)
    assert np.sqrt(((mean - truth) ** 2 / (variance + model.rough)).mean()) < 1.5


@pytest.mark.parametrize("trial", [Trial(TRUTH, 3.0), Trial(TRUTH, None, cheaper(TRUTH), low_fidelity=True)])
def test_without_an_outcome_of_the_proxy_itself_there_is_nothing_to_learn_from(trial):
    with pytest.raises(RunError, match="no trial has an outcome"):
        fit_outputs(SPACE, [trial])
