"""The population of a fleet: what was planted between robots is told, and what measurement adds is not."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies

from proxytune.search import population, summary_of
from proxytune.search.engine import unit_points
from proxytune.search.population import population_of
from proxytune.search.posterior import Posterior

MEASURED = 0.05
"""Standard deviation of what is measured of each robot, in widths of the box."""


@pytest.fixture(autouse=True, scope="module")
def _fewer_draws():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(population, "DRAWS", 1000)
        yield


def posterior(middle, deviation=MEASURED):
    """What is known of a robot that is measured so: a normal distribution in the box."""
    low, high = np.clip(middle - 5.0 * deviation, 0.0, 1.0), np.clip(middle + 5.0 * deviation, 0.0, 1.0)
    points = low + (high - low) * unit_points(len(middle), 2048, 0)
    return Posterior(points, -0.5 * (((points - middle) / deviation) ** 2).sum(axis=1), float(np.prod(high - low)))


def fleet(robots, spread, seed=0):
    """θ of robots that spread so round 0.5, what is measured of each, and what both together tell."""
    rng = np.random.default_rng(seed)
    theta = 0.5 + np.array(spread) * rng.standard_normal((robots, len(spread)))
    measured = theta + MEASURED * rng.standard_normal(theta.shape)
    return theta, measured, population_of([posterior(one) for one in measured])


@pytest.fixture(scope="module")
def planted():
    """Forty robots, of which one parameter spreads twice as far as is measured, and one not at all."""
    return fleet(40, (0.1, 0.0))


def test_mean_and_spread_are_told_and_robots_that_are_alike_have_none_of_their_measurements(planted):
    """The truth lies in both 95 % intervals, and the spread's middle is within a quarter of it."""
    _, _, found = planted
    mean, deviation = summary_of(found.mean), summary_of(found.deviation)
    assert np.all((mean[0] < 0.5) & (mean[2] > 0.5))
    assert deviation[0, 0] < 0.1 < deviation[2, 0]
    assert deviation[1, 0] == pytest.approx(0.1, rel=0.25)
    # Measured values spread by 0.05; between robots less than half of that is told, perhaps nothing.
    _, measured, found = planted
    low, middle, high = summary_of(found.deviation)[:, 1]
    assert measured[:, 1].std() > 0.04
    assert low < 0.1 * MEASURED
    assert middle < 0.5 * MEASURED
    assert high < MEASURED


def test_robots_know_themselves_better_by_the_fleet_and_the_next_is_where_they_are(planted):
    """Errors are smaller than each robot's own, far smaller where robots are alike; intervals hold 95 % of truths."""
    theta, measured, found = planted
    low, middle, high = summary_of(found.robots)
    own, shared = (np.sqrt(((one - theta) ** 2).mean(axis=0)) for one in (measured, middle))
    assert shared[0] < own[0]
    assert shared[1] < 0.5 * own[1]
    assert ((low <= theta) & (theta <= high)).mean() > 0.88
    low, _, high = summary_of(planted[2].next_robot)[:, 0]
    assert 2 * 1.96 * 0.075 < high - low < 2 * 1.96 * 0.15


@pytest.mark.slow
def test_few_robots_have_intervals_that_hold_the_truth():
    """Of 30 fleets of five robots, the intervals of spread and of mean hold the truth in nine of ten or more."""
    held = np.zeros(2)
    for seed in range(30):
        _, _, found = fleet(5, (0.08,), seed)
        for place, (draws, truth) in enumerate(((found.mean, 0.5), (found.deviation, 0.08))):
            low, _, high = summary_of(draws)[:, 0]
            held[place] += low <= truth <= high
    assert np.all(held >= 27)


def test_parameters_that_go_together_are_told_and_what_no_robot_tells_stays_open():
    """A planted correlation of 0.9 has an interval well above 0."""
    rng = np.random.default_rng(1)
    theta = 0.5 + 0.12 * (np.sqrt(0.9) * rng.standard_normal((30, 1)) + np.sqrt(0.1) * rng.standard_normal((30, 2)))
    found = population_of([posterior(one) for one in theta + MEASURED * rng.standard_normal(theta.shape)])
    low, middle, high = summary_of(found.correlation)[:, 0, 1]
    assert 0.4 < low < 0.9 < high
    assert middle == pytest.approx(0.9, abs=0.2)
    # Where every value in the box explains each robot, the mean may be anywhere and the spread as well be large.
    found = population_of([posterior(np.array([0.4 + 0.05 * row, 0.5]), 2.0) for row in range(4)])
    low, _, high = summary_of(found.next_robot)[:, 1]
    assert high - low > 0.7


@settings(max_examples=6)
@given(order=strategies.permutations(range(5)))
def test_the_order_of_robots_does_not_matter(order):
    """Same draws to the last bit, each robot's its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(population, "BURN_IN", 5)
        patch.setattr(population, "DRAWS", 40)
        robots = [posterior(np.array([0.3 + 0.1 * row, 0.5])) for row in (3, 0, 4, 1, 2)]
        plain, mixed = population_of(robots), population_of([robots[row] for row in order])
    assert np.array_equal(plain.mean, mixed.mean)
    assert np.array_equal(plain.robots[:, order], mixed.robots)
