"""Many agents are sorted instead of compared pair by pair, and every measure stays what it is to the last bit."""

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import assess, resampling, standing
from proxytune.usefulness.correlation import kendall_of_means
from proxytune.usefulness.mmrv import mmrv_of_means
from proxytune.usefulness.prpv import prpv_of_means
from proxytune.usefulness.rates import _ties
from proxytune.usefulness.standing import stand

MEASURES = {
    "prpv": prpv_of_means,
    "correlation": lambda proxy, target, metrics: kendall_of_means(proxy, target),
    "mmrv": mmrv_of_means,
}
KINDS = {
    "continuous": lambda random, shape: random.normal(size=shape),
    "tied": lambda random, shape: random.integers(0, 6, size=shape) * 0.1,
    "nearly tied": lambda random, shape: 0.3 + random.integers(-9, 9, size=shape) * random.choice([1e-14, 2e-13]),
    "rates": lambda random, shape: random.integers(0, 2, size=(7, *shape)).mean(axis=0) - 0.3,
    "alike": lambda random, shape: np.ones(shape),
}


@pytest.mark.parametrize("module", MEASURES)
@given(kind=st.sampled_from(sorted(KINDS)), seed=st.integers(0, 10**6), agents=st.integers(2, 100))
@settings(max_examples=60, derandomize=True, deadline=None)
def test_sorting_gives_what_comparing_every_pair_gives(module, kind, seed, agents):
    random = np.random.default_rng(seed)
    proxy, target = (KINDS[kind](random, (2, agents, 3)) for _ in range(2))
    metrics = (Metric("a"), Metric("b", "min", 0.1), Metric("c", "max", 5.0, percent=True))
    pairwise = MEASURES[module](proxy, target, metrics)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys.modules[f"proxytune.usefulness.{module}"], "FEW_AGENTS", 1)
        patch.setattr(standing, "WORDS", agents + 1)  # a word of 64 agents at a time
        np.testing.assert_array_equal(MEASURES[module](proxy, target, metrics), pairwise)


def test_a_tolerance_that_differences_only_just_reach_is_a_tie_as_rounded():
    """0.8 − 0.3 is 0.5 in floating point, though 0.8 − 0.5 is more than 0.3."""
    found = stand(np.array([0.8, 0.3, 0.1]), 0.5)
    assert found.below.tolist() == [1, 0, 0]
    assert found.reach.tolist() == [3, 3, 2]


def test_ties_of_a_metric_are_counted_once_per_pair():
    values = np.array([0.0, 1.0, 1.0, 1.0])[:, None, None]
    table = ScoreTable(tuple("ABCD"), ("0",), ("won",), values)
    assert _ties(table, Metric("won"), 0) == 3


@pytest.mark.parametrize("labels", ["012345", ["0/0", "0/1", "1/0", "1/1", "2/0", "2/1"]])
def test_drawing_for_a_few_agents_at_a_time_changes_nothing(labels, monkeypatch):
    values = np.random.default_rng(0).normal(size=(2, 7, 6, 1))
    values[:, 2, 4] = np.nan
    proxy, target = (ScoreTable(tuple("ABCDEFG"), tuple(labels), ("m",), side) for side in values)
    first = assess(proxy=proxy, target=target, metrics=[Metric("m")], resamples=100)
    monkeypatch.setattr(resampling, "BLOCK", 1)
    again = assess(proxy=proxy, target=target, metrics=[Metric("m")], resamples=100)
    assert vars(again.intervals) == vars(first.intervals)
    assert (again.noise_floor.value, again.noise_floor.high) == (first.noise_floor.value, first.noise_floor.high)
    assert again.prpv_interval.expected == first.prpv_interval.expected
