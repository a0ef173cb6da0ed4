"""Chance is a proxy that knows nothing about which agent is which."""

from itertools import permutations

import numpy as np
import pytest

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import chance
from proxytune.usefulness.prpv import prpv_of_means

M = (Metric("m"), Metric("n"))


def table(values):
    return ScoreTable(tuple(f"A{i}" for i in range(len(values))), ("1",), ("m", "n"), values[:, None])


def test_it_agrees_with_all_permutations_of_five_agents():
    proxy, target = np.random.default_rng(0).normal(size=(2, 5, 2))
    every = np.array([prpv_of_means(proxy[list(order)], target, M) for order in permutations(range(5))])
    result = chance(proxy=table(proxy), target=table(target), metrics=M, permutations=4000)
    assert result.mean == pytest.approx(every.mean(), abs=0.2)
    assert result.deviation == pytest.approx(every.std(), abs=0.2)
    assert result.p_value == pytest.approx((every <= prpv_of_means(proxy, target, M)).mean(), abs=0.03)


def test_ten_agents_and_two_unrelated_metrics_give_33_9_and_7_1():
    """The 7.1 is over tables and permutations together; for two given tables permutations alone vary by less."""
    rng = np.random.default_rng(1)
    found = [
        chance(
            proxy=table(rng.normal(size=(10, 2))), target=table(rng.normal(size=(10, 2))), metrics=M, permutations=300
        )
        for _ in range(60)
    ]
    means, deviations = np.array([(result.mean, result.deviation) for result in found]).T
    assert means.mean() == pytest.approx(33.9, abs=1.5)
    assert np.sqrt(means.var() + (deviations**2).mean()) == pytest.approx(7.1, abs=0.7)


def test_a_perfect_proxy_is_hardly_by_chance_and_a_useless_one_is():
    target = np.random.default_rng(2).normal(size=(8, 1)).repeat(2, axis=1)
    assert chance(proxy=table(target), target=table(target), metrics=M).p_value == pytest.approx(1 / 1001, abs=2e-3)
    assert chance(proxy=table(-target), target=table(target), metrics=M).p_value == 1.0
