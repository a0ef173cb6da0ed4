"""Proxies are ranked, and only differences beyond noise are called so."""

import numpy as np
import pytest

from proxytune.errors import ScoresError
from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import prpv, select_proxy

M = (Metric("m"),)
TRUTH = np.arange(8.0)


def table(truth, seed, noise=0.3, episodes=8):
    values = np.asarray(truth)[:, None] + noise * np.random.default_rng(seed).normal(size=(len(truth), episodes))
    return ScoreTable(
        tuple(f"A{i}" for i in range(len(truth))), tuple(map(str, range(episodes))), ("m",), values[..., None]
    )


TARGET = table(TRUTH, 0)


def test_a_good_proxy_beats_a_bad_one_beyond_noise_but_not_its_twin():
    proxies = {"bad": table(-TRUTH, 1), "good": table(TRUTH, 2), "twin": table(TRUTH, 3)}
    selection = select_proxy(proxies=proxies, target=TARGET, metrics=M)
    assert [name for name, _ in selection.ranking][2] == "bad"
    beyond = {(pair.better, pair.worse): pair.beyond_noise for pair in selection.differences}
    assert beyond["good", "bad"] is beyond["twin", "bad"] is True
    assert next(value for pair, value in beyond.items() if set(pair) == {"good", "twin"}) is False


def test_the_ranking_is_by_prpv_and_differences_are_of_prpv():
    proxies = {name: table(TRUTH, seed, noise=4.0) for seed, name in enumerate("abcd", 10)}
    selection = select_proxy(proxies=proxies, target=TARGET, metrics=M)
    own = {name: prpv(proxy=proxy, target=TARGET, metrics=M).value for name, proxy in proxies.items()}
    assert dict(selection.ranking) == own
    assert [value for _, value in selection.ranking] == sorted(own.values())
    assert len(selection.differences) == 6
    for pair in selection.differences:
        assert pair.value == own[pair.worse] - own[pair.better] >= 0
        assert pair.low <= pair.value <= pair.high


def test_a_proxy_against_itself_differs_by_nothing():
    same = table(TRUTH, 5, noise=3.0)
    selection = select_proxy(proxies={"a": same, "b": same}, target=TARGET, metrics=M)
    assert (selection.differences[0].low, selection.differences[0].high) == (0.0, 0.0)
    assert selection.differences[0].beyond_noise is False


def test_one_episode_gives_a_ranking_without_intervals_and_says_why():
    proxies = {"a": table(TRUTH, 1, episodes=1), "b": table(-TRUTH, 2, episodes=1)}
    selection = select_proxy(proxies=proxies, target=TARGET, metrics=M)
    assert [name for name, _ in selection.ranking] == ["a", "b"]
    assert selection.differences[0].beyond_noise is None
    assert "one episode in the proxy" in selection.reason


def test_no_proxy_is_refused():
    with pytest.raises(ScoresError, match="no proxy"):
        select_proxy(proxies={}, target=TARGET, metrics=M)


@pytest.mark.slow
def test_equally_good_proxies_are_seldom_told_apart():
    false = 0
    for seed in range(0, 600, 4):
        proxies = {name: table(TRUTH / 4, seed + i, noise=1.0) for i, name in enumerate("abc")}
        selection = select_proxy(
            proxies=proxies, target=table(TRUTH / 4, seed + 3, noise=1.0), metrics=M, resamples=300, seed=seed
        )
        false += any(pair.beyond_noise for pair in selection.differences)
    assert false / 150 <= 0.10
