"""The posterior over the box: its share, its intervals and its draws are those of densities that are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

from proxytune.search.knowledge.region import posterior_of


def normal(centre, widths, correlation=0.0):
    """Log density of a normal with these standard deviations."""
    matrix = np.diag(np.square(widths))
    matrix[0, 1] = matrix[1, 0] = correlation * widths[0] * widths[1]
    inverse = np.linalg.inv(matrix)
    return lambda points: -0.5 * np.einsum("ij,jk,ik->i", points - centre, inverse, points - centre)


@settings(derandomize=True, max_examples=15, deadline=None)
@given(st.floats(0.005, 0.08), st.floats(0.005, 0.08), st.floats(0.3, 0.7))
def test_of_a_normal_in_the_box_share_and_intervals_are_those_of_the_normal(first, second, middle):
    found = posterior_of(normal(np.array([middle, 1.0 - middle]), np.array([first, second])), 2)
    assert found.share == pytest.approx(np.pi * first * second * chi2.ppf(0.95, 2), rel=0.1)
    half = 1.96 * np.array([first, second])
    assert np.diff(found.intervals, axis=1)[:, 0] == pytest.approx(2 * half, rel=0.1)
    assert found.mean == pytest.approx([middle, 1.0 - middle], abs=0.01)
    assert found.mode == pytest.approx([middle, 1.0 - middle], abs=0.02)


def test_a_small_region_in_four_dimensions_is_found_and_measured():
    widths = np.array([0.01, 0.03, 0.05, 0.02])
    found = posterior_of(normal(np.array([0.2, 0.5, 0.7, 0.4]), widths), 4)
    expected = np.pi**2 / 2 * widths.prod() * chi2.ppf(0.95, 4) ** 2
    assert found.share == pytest.approx(expected, rel=0.3)
    assert np.diff(found.intervals, axis=1)[:, 0] == pytest.approx(3.92 * widths, rel=0.25)


def test_where_nothing_is_known_the_region_is_the_box_and_no_parameter_is_identified():
    found = posterior_of(lambda points: np.zeros(len(points)), 3)
    assert found.share == pytest.approx(1.0, abs=0.06)
    assert found.unidentified.all()
    assert found.trades == ()


def test_a_parameter_that_is_pinned_down_is_identified_beside_one_that_is_not():
    found = posterior_of(lambda points: -0.5 * ((points[:, 0] - 0.5) / 0.02) ** 2, 2)
    assert found.unidentified.tolist() == [False, True]
    assert found.share == pytest.approx(0.02 * 3.92, rel=0.15)


def test_parameters_that_make_up_for_each_other_are_named_with_their_correlation():
    ((first, second, correlation),) = posterior_of(normal(np.full(2, 0.5), np.full(2, 0.05), -0.9), 2).trades
    assert (first, second) == (0, 1)
    assert correlation == pytest.approx(-0.9, abs=0.05)


def test_draws_are_those_of_the_density_and_in_the_box():
    found = posterior_of(normal(np.array([0.0, 0.5]), np.array([0.05, 0.1])), 2)
    draws = np.array([found.draw(seed) for seed in range(400)])
    assert draws.min() >= 0.0
    assert draws.max() <= 1.0
    assert draws[:, 1].mean() == pytest.approx(0.5, abs=0.02)
    assert draws[:, 1].std() == pytest.approx(0.1, abs=0.015)
    assert len({tuple(draw) for draw in draws}) == 400
    assert np.array_equal(found.draw(3), found.draw(3))
