"""The posterior over the box, the proxies that it finds lacking, and how wide a region has to be."""

from dataclasses import replace

import numpy as np
import pytest
from confirmations import normal
from hypothesis import given, settings, strategies as st
from scipy.stats import chi2
from steps import SPACE, goal, whole

from proxytune.search import Trial, from_unit, learn_theta, to_unit
from proxytune.search.engine import design_point
from proxytune.search.likelihood import fit_outputs
from proxytune.search.posterior import FEWEST, MARGIN, WIDENINGS, LeftOut, Misfit, as_targets, leave_out, posterior_of

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


def test_theta_of_each_trial_is_told_but_for_other_placements():
    found = left_out(trials(20))
    assert found.deviances.shape == (20,)
    assert found.above.shape == (20, len(WIDENINGS))
    assert (found.above >= 0.0).all()
    assert (found.above <= 1.0 + 1e-9).all()
    told = trials(8)
    told += [replace(one, outcome=tuple(value + 0.01 for value in one.outcome), placement=-1) for one in told[:3]]
    for one in as_targets(fit_outputs(SPACE, told), told, goal(whole, (0.5,) * 12, 1e-4), 1):
        assert not np.isclose(one.likelihood.model.visited, one.theta).all(axis=1).any()


@pytest.mark.slow
def test_a_wider_density_holds_no_fewer_of_them():
    assert (np.diff((left_out(trials(20)).above <= 0.95).sum(axis=0)) >= 0).all()


def planted(missed, widening=0):
    """Of twenty trials so many are missed, up to this place in the list of widenings."""
    above = np.full((20, len(WIDENINGS)), 0.5)
    above[:missed, : widening + 1] = 0.99
    return LeftOut(np.ones(20), above)


def test_the_region_is_widened_until_it_holds_nine_of_ten_and_of_few_trials_by_the_margin_alone():
    assert planted(0).widening == planted(2).widening == MARGIN
    assert planted(3, 0).widening == MARGIN * WIDENINGS[1]
    assert planted(3, 2).widening == MARGIN * WIDENINGS[3]
    assert planted(20, len(WIDENINGS) - 1).widening == MARGIN * WIDENINGS[-1]
    few = left_out(trials(FEWEST - 1))
    assert (few.enough, few.widening) == (False, MARGIN)
    assert left_out(trials(1)).widening == MARGIN
    told = trials(12)
    told[::3] = [replace(trial, outcome=(*trial.outcome[:6], *[np.nan] * 6)) for trial in told[::3]]
    assert left_out(told).deviances.shape == (8,)
    low = [replace(trial, score=None, low_fidelity=True) for trial in trials(40)[8:]]
    assert left_out([*low, *trials(8)]).deviances.shape == (8,)


SPREAD = 0.03


def outputs(values, seed):
    """Twelve smooth outputs, rough by a little."""
    return np.sin(AGENTS @ to_unit(SPACE, values)) + np.random.default_rng([seed, 7]).normal(0.0, SPREAD, 12)


def trials_of_misfit(seed, count=16):
    points = [design_point(SPACE, index, seed) for index in range(count)]
    return [Trial(p, 1.0, tuple(outputs(p, 100 * seed + row).tolist())) for row, p in enumerate(points)]


def learnt(seed, shift):
    values = from_unit(SPACE, np.random.default_rng(seed).uniform(0.2, 0.8, 2))
    target = outputs(values, 10_000 + seed) + shift * np.resize([1.0, -1.0, 0.0], 12)
    return learn_theta(SPACE, trials_of_misfit(seed), goal(whole, target, SPREAD**2), seed)


def p_value(seed, shift):
    return learnt(seed, shift).misfit.p_value


@pytest.mark.slow
def test_targets_beyond_the_proxy_are_found_and_those_it_can_make_are_seldom_said_to_be():
    found = np.array([p_value(seed, 0.0) for seed in range(24)])
    assert (found < 0.05).sum() <= 3
    assert np.ptp(found) > 0.5
    assert max(p_value(seed, 0.6) for seed in range(6)) < 0.05


def test_the_density_is_wider_only_where_no_theta_explains_the_target():
    """The log density is divided by the dispersion, and the region takes more of the box."""
    found = learnt(0, 0.6)
    dispersion = found.misfit.deviance / found.misfit.expected
    assert found.misfit.fits is False
    assert dispersion > 2.0
    points = np.array([[0.3, 0.4], [0.7, 0.5]])
    narrow = found.likelihood.log(points) / found.left_out.widening
    assert found.log(points) == pytest.approx(narrow / dispersion)
    assert found.posterior.share > 1.5 * posterior_of(lambda some: found.log(some) * dispersion, 2).share

    found = learnt(0, 0.0)
    assert found.misfit.fits is True
    assert found.log(points).tolist() == (found.likelihood.log(points) / found.left_out.widening).tolist()


@pytest.mark.parametrize(
    ("misfit", "dispersion"),
    [
        (Misfit(2.0, 0.5, 0.02), 4.0),
        (Misfit(0.4, 0.5, 0.02), 1.0),
        (Misfit(2.0, 0.5, 0.03), 1.0),
        (Misfit(2.0, None, None), 1.0),
        (Misfit(None, None, None), 1.0),
    ],
)
def test_the_dispersion_is_one_unless_a_misfit_is_said(misfit, dispersion):
    assert misfit.dispersion == dispersion


@pytest.mark.parametrize("count", [4, 5])
def test_with_too_few_trials_nothing_is_said(count):
    found = learn_theta(SPACE, trials_of_misfit(1, count), goal(whole, outputs((0.1, 0.1), 5))).misfit
    assert (found.p_value, found.fits) == (None, None)


@settings(max_examples=15)
@given(st.floats(0.005, 0.08), st.floats(0.005, 0.08), st.floats(0.3, 0.7))
def test_of_a_normal_in_the_box_share_and_intervals_are_those_of_the_normal(first, second, middle):
    found = posterior_of(normal(np.array([middle, 1.0 - middle]), np.array([first, second])), 2)
    assert found.share == pytest.approx(np.pi * first * second * chi2.ppf(0.95, 2), rel=0.1)
    half = 1.96 * np.array([first, second])
    assert np.diff(found.intervals, axis=1)[:, 0] == pytest.approx(2 * half, rel=0.1)
    assert found.mean == pytest.approx([middle, 1.0 - middle], abs=0.01)
    assert found.mode == pytest.approx([middle, 1.0 - middle], abs=0.02)


@settings(max_examples=15)
@given(st.floats(0.03, 0.2), st.sampled_from([0.0, 1.0]))
def test_an_interval_holds_the_most_probable_value_also_at_an_end_of_the_box(width, end):
    found = posterior_of(normal(np.array([end, 0.5]), np.array([width, 0.05])), 2)
    low, high = sorted((end, abs(end - 2.24 * width)))
    assert found.intervals[0] == pytest.approx([low, high], abs=0.1 * width)
    assert end in found.intervals[0].tolist()
    assert 0.0 < found.intervals[1, 0] < found.intervals[1, 1] < 1.0
    inside = (found.intervals[:, 0] <= found.mode) & (found.mode <= found.intervals[:, 1])
    assert inside.all()


def test_a_small_region_in_four_dimensions_is_measured_and_nothing_said_where_no_output_changes():
    widths = np.array([0.01, 0.03, 0.05, 0.02])
    found = posterior_of(normal(np.array([0.2, 0.5, 0.7, 0.4]), widths), 4)
    expected = np.pi**2 / 2 * widths.prod() * chi2.ppf(0.95, 4) ** 2
    assert found.share == pytest.approx(expected, rel=0.3)
    assert np.diff(found.intervals, axis=1)[:, 0] == pytest.approx(3.92 * widths, rel=0.25)
    told = [Trial(design_point(SPACE, index, 1), 1.0, (7.0,)) for index in range(8)]
    assert learn_theta(SPACE, told, goal(whole, (3.0,))).misfit.fits is None


def test_parameters_are_identified_or_make_up_for_each_other_and_draws_are_of_the_density_in_the_box():
    found = posterior_of(lambda points: np.zeros(len(points)), 3)
    assert found.share == pytest.approx(1.0, abs=0.06)
    assert found.unidentified.all()
    assert found.trades == ()
    found = posterior_of(lambda points: -0.5 * ((points[:, 0] - 0.5) / 0.02) ** 2, 2)
    assert found.unidentified.tolist() == [False, True]
    assert found.share == pytest.approx(0.02 * 3.92, rel=0.15)
    ((first, second, correlation),) = posterior_of(normal(np.full(2, 0.5), np.full(2, 0.05), -0.9), 2).trades
    assert (first, second) == (0, 1)
    assert correlation == pytest.approx(-0.9, abs=0.05)
    found = posterior_of(normal(np.array([0.0, 0.5]), np.array([0.05, 0.1])), 2)
    draws = np.array([found.draw(seed) for seed in range(400)])
    assert draws.min() >= 0.0
    assert draws.max() <= 1.0
    assert draws[:, 1].mean() == pytest.approx(0.5, abs=0.02)
    assert draws[:, 1].std() == pytest.approx(0.1, abs=0.015)
    assert len({tuple(draw) for draw in draws}) == 400
    assert np.array_equal(found.draw(3), found.draw(3))
