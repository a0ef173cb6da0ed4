"""MMRV is what a wrong order costs on the target."""

import numpy as np
import pytest

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import mmrv
from proxytune.usefulness.mmrv import mmrv_of_means


def table(values):
    return ScoreTable.from_episodes({(a, 1): {"m": v} for a, v in zip("ABC", values, strict=True)})


def test_three_agents_by_hand():
    """B and C change places: that costs each of them 0.3, and A nothing."""
    result = mmrv(proxy=table([0.9, 0.4, 0.6]), target=table([0.8, 0.5, 0.2]), metrics=[Metric("m")])
    assert result.value["m"] == pytest.approx((0 + 0.3 + 0.3) / 3)
    assert result.range["m"] == (0.0, pytest.approx(0.6))
    assert result.better == "lower"


def simplers_loop(proxy, target):
    """The definition as a double loop, with SIMPLER's > between agents."""
    agents = range(len(proxy))
    costs = [
        [abs(target[i] - target[j]) * ((proxy[i] > proxy[j]) != (target[i] > target[j])) for j in agents]
        for i in agents
    ]
    return np.mean([max(row) for row in costs])


def test_it_is_simplers_double_loop_also_where_there_are_ties():
    rng = np.random.default_rng(0)
    proxy, target = rng.integers(0, 4, size=(2, 40, 5, 1)).astype(float)
    for direction, sign in (("max", 1), ("min", -1)):
        values = mmrv_of_means(proxy, target, [Metric("m", direction)])[:, 0]
        expected = [simplers_loop(sign * p[:, 0], sign * t[:, 0]) for p, t in zip(proxy, target, strict=True)]
        np.testing.assert_allclose(values, expected, atol=1e-12)


def test_a_proxy_that_ties_everything_is_charged_for_the_better_agents():
    tied, target = table([0.5, 0.5, 0.5]), table([0.1, 0.4, 0.9])
    assert mmrv(proxy=tied, target=target, metrics=[Metric("m")]).value["m"] == pytest.approx((0 + 0.3 + 0.8) / 3)
    assert mmrv(proxy=tied, target=target, metrics=[Metric("m", "min")]).value["m"] == pytest.approx(
        (0.8 + 0.5 + 0) / 3
    )


def test_the_same_order_costs_nothing_in_either_direction():
    for direction in ("max", "min"):
        metric = [Metric("m", direction)]
        assert mmrv(proxy=table([1.0, 5.0, 9.0]), target=table([0.1, 0.2, 0.7]), metrics=metric).value["m"] == 0.0
