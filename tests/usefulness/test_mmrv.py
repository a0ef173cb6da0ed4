"""MMRV is what a wrong order costs on the target."""

import pytest

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import mmrv


def table(values):
    return ScoreTable.from_episodes({(a, 1): {"m": v} for a, v in zip("ABC", values, strict=True)})


def test_three_agents_by_hand():
    """B and C change places: that costs each of them 0.3, and A nothing."""
    result = mmrv(proxy=table([0.9, 0.4, 0.6]), target=table([0.8, 0.5, 0.2]), metrics=[Metric("m")])
    assert result.value["m"] == pytest.approx((0 + 0.3 + 0.3) / 3)
    assert result.range["m"] == (0.0, pytest.approx(0.6))
    assert result.better == "lower"


def test_a_proxy_that_ties_what_the_target_orders_is_charged_to_the_worse_agent():
    """SIMPLER compares with <, so the two of a tied pair fare differently; the direction says which is the worse."""
    tied, target = table([0.5, 0.5, 0.9]), table([0.1, 0.4, 0.9])
    assert mmrv(proxy=tied, target=target, metrics=[Metric("m")]).value["m"] == pytest.approx(0.1)
    assert mmrv(proxy=tied, target=target, metrics=[Metric("m", "min")]).value["m"] == pytest.approx(0.1)


def test_the_same_order_costs_nothing_in_either_direction():
    for direction in ("max", "min"):
        metric = [Metric("m", direction)]
        assert mmrv(proxy=table([1.0, 5.0, 9.0]), target=table([0.1, 0.2, 0.7]), metrics=metric).value["m"] == 0.0
