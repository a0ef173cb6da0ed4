"""Success rates have intervals of their own, and ties are counted."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import assess, compare
from proxytune.usefulness.rates import success_rates

METRICS = [Metric("success"), Metric("distance")]


def table(successes, episodes=10):
    """Agents A, B, … with so many successes each."""
    return ScoreTable.from_episodes(
        {
            ("ABCD"[row], episode): {"success": float(episode < count), "distance": 0.5 * row + 0.1 * episode}
            for row, count in enumerate(successes)
            for episode in range(episodes)
        }
    )


def test_a_rate_has_wilson_s_interval():
    (rates,) = success_rates(compare(proxy=table([8, 10]), target=table([0, 10]), metrics=METRICS))
    one = rates.proxy["A"]
    assert (rates.metric, one.value, one.episodes) == ("success", 0.8, 10)
    assert (one.low, one.high) == pytest.approx((0.4902, 0.9433), abs=1e-4), "Brown, Cai, DasGupta (2001), eq. (4)"
    assert rates.target["A"].low == pytest.approx(0.0, abs=1e-12)
    assert 0.2 < rates.target["A"].high < 0.3, "no success in ten is no proof of none"


@given(st.lists(st.integers(0, 10), min_size=2, max_size=4), st.integers(0, 10))
def test_an_interval_holds_its_rate_and_lies_within_0_and_1(successes, other):
    sides = {"proxy": table(successes), "target": table([other] * len(successes))}
    for rates in success_rates(compare(**sides, metrics=METRICS)):
        for one in (*rates.proxy.values(), *rates.target.values()):
            assert 0.0 <= one.low <= one.value + 1e-12
            assert one.value - 1e-12 <= one.high <= 1.0


def test_pairs_that_tie_are_counted_and_told_once():
    found = assess(proxy=table([3, 3, 5]), target=table([2, 4, 6]), metrics=METRICS[:1], resamples=100)
    told = [note for note in found.notes if "tie" in note]
    expected = "success is a success rate: 1 of 3 pairs of agents tie in the proxy, 0 on the target; a tie counts half"
    assert len(told) == 1
    assert told[0].startswith(expected)
    assert found.prpv.value == 1
    untied = assess(proxy=table([3, 4, 5]), target=table([2, 4, 6]), metrics=METRICS[:1], resamples=100)
    assert not [note for note in untied.notes if "tie" in note]


@pytest.mark.parametrize("successes", [[10, 10], [0, 0]])
def test_what_is_always_alike_or_no_zero_or_one_is_no_rate(successes):
    both = {"proxy": table(successes), "target": table(successes)}
    assert success_rates(compare(**both, metrics=METRICS)) == ()
    assert np.unique(both["proxy"].values[..., 1]).size > 2
