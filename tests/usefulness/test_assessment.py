"""One call gives every measure of a proxy, and says what is missing; of several proxies, only what is beyond noise."""

import numpy as np
import pytest
from score_tables import bootstrap_prpv, ordered, table_of

from proxytune.errors import ScoresError
from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import assess, compare, floor_of_repeats, resampling, select_proxy
from proxytune.usefulness.pairs import prpv
from proxytune.usefulness.predictivity import kendall_tau, mmrv, ppv, srcc

M = (Metric("m"), Metric("n", "min"))


def test_it_gathers_measures_each_with_an_interval_of_episodes_drawn_once_for_all(monkeypatch):
    sides = {"proxy": ordered(1), "target": ordered(2), "metrics": M}
    found = assess(**sides)
    assert found.prpv.value == prpv(compare(**sides)).value == found.prpv_interval.value
    assert found.ppv.value == ppv(compare(**sides)).value
    for name, measure in (("srcc", srcc), ("kendall_tau", kendall_tau), ("mmrv", mmrv)):
        assert getattr(found, name).value == measure(compare(**sides)).value
    found = assess(proxy=ordered(1, 20), target=ordered(2, 20), metrics=M)
    assert found.intervals.ppv[0] < found.ppv.value < found.intervals.ppv[1]
    for name in ("srcc", "kendall_tau", "mmrv"):
        for metric, (low, high) in getattr(found.intervals, name).items():
            assert low <= getattr(found, name).value[metric] <= high, (name, metric)
    sides, drawn, draw = ({"proxy": ordered(1), "target": ordered(2), "metrics": M}, [], resampling._means_of_draws)
    sides["target"].values[3, 2] = np.nan
    monkeypatch.setattr(resampling, "_means_of_draws", lambda one, *rest: drawn.append(one) or draw(one, *rest))
    found = assess(**sides, resamples=200, seed=5)
    assert drawn == [sides["target"], sides["proxy"]]
    assert found.intervals is not None
    assert found.prpv_interval == bootstrap_prpv(**sides, resamples=200, seed=5)


def test_constant_metrics_and_single_episodes_have_no_interval_and_a_note():
    flat = ordered(1).values.copy()
    flat[:, :, 0] = 3.0
    found = assess(proxy=table_of(flat), target=ordered(2), metrics=M)
    assert found.srcc.value["m"] is found.intervals.srcc["m"] is found.intervals.kendall_tau["m"] is None
    assert found.intervals.srcc["n"] is not None
    assert any("m: SRCC is undefined" in note for note in found.notes)
    found = assess(proxy=ordered(1, 1), target=ordered(2, 1), metrics=M)
    assert found.intervals is found.at_noise_floor is found.prpv_interval.low is found.noise_floor.value is None
    assert [note.split(":")[0] for note in found.notes] == ["no interval", "no noise floor"]


PERFECT = "no difference between proxy and target"
CLEAR = (Metric("m"),)
"""By this metric alone agents are in a clear order."""


def again(one, noise=0.1, seed=9):
    """The same domain from the same starts under other noise."""
    values = one.values + noise * np.random.default_rng(seed).normal(size=one.values.shape)
    return ScoreTable(one.agents, one.episodes, one.metrics, values)


def test_a_proxy_within_the_noise_of_the_same_starts_is_said_to_be_and_one_above_is_not():
    target = ordered(2, agents=8)
    floor = floor_of_repeats(domain=target, again=again(target), metrics=CLEAR)
    found = assess(proxy=target, target=target, metrics=CLEAR, floor=floor)
    assert found.noise_floor is floor
    assert found.at_noise_floor is True
    assert any(PERFECT in note for note in found.notes)
    floor = floor_of_repeats(domain=target, again=target, metrics=CLEAR)
    found = assess(proxy=ordered(3, agents=8), target=target, metrics=CLEAR, floor=floor)
    assert found.prpv.value > floor.high
    assert found.at_noise_floor is False
    assert not any(PERFECT in note for note in found.notes)


@pytest.mark.parametrize("seed", range(5))
def test_halves_never_show_that_a_proxy_is_perfect(seed):
    target = ordered(seed, agents=8)
    found = assess(proxy=target, target=target, metrics=CLEAR)
    assert found.noise_floor.kind == "halves"
    assert found.prpv.value == 0
    assert found.at_noise_floor is None
    assert not any(PERFECT in note for note in found.notes)
    assert any("may score against each other (95 %)" in note for note in found.notes)


def test_nothing_is_said_of_halves_above_what_they_score_nor_of_a_perfect_proxy_that_chance_explains():
    target, worst = ordered(2, agents=8), ordered(2, agents=8)
    worst = ScoreTable(worst.agents, worst.episodes, worst.metrics, -worst.values)
    found = assess(proxy=worst, target=target, metrics=CLEAR)
    assert found.prpv.value > found.noise_floor.high
    assert not any("halves" in note for note in found.notes)
    # Of three agents every order comes by chance too often.
    target = ordered(2, agents=3)
    floor = floor_of_repeats(domain=target, again=again(target), metrics=CLEAR)
    found = assess(proxy=target, target=target, metrics=CLEAR, floor=floor)
    assert found.prpv.value == 0 <= floor.high
    assert found.chance.p_value >= 0.05
    assert found.at_noise_floor is False
    assert any(note.startswith("these agents cannot exclude chance") for note in found.notes)
    assert not any(PERFECT in note for note in found.notes)
    sure = assess(proxy=ordered(2, agents=8), target=ordered(2, agents=8), metrics=CLEAR)
    assert not any("chance" in note for note in sure.notes)


def test_the_target_s_own_repeats_are_taken_where_it_has_them():
    one = ordered(4, agents=8)
    values = np.concatenate([one.values, again(one).values], axis=1)
    labels = tuple(f"{episode}/{repeat}" for repeat in range(2) for episode in one.episodes)
    found = assess(proxy=again(one, seed=5), target=ScoreTable(one.agents, labels, one.metrics, values), metrics=CLEAR)
    assert found.noise_floor.kind == "same starts"
    assert found.at_noise_floor is True
    assert found.inputs.paired


TRUTH = np.arange(8.0)


def noisy(truth, seed, noise=0.3, episodes=8):
    """Episodes around each agent's true score."""
    return table_of(truth[:, None] + noise * np.random.default_rng(seed).normal(size=(len(truth), episodes)))


TARGET = noisy(TRUTH, 0)


def test_a_good_proxy_beats_a_bad_one_beyond_noise_but_not_its_twin_and_one_episode_only_ranks():
    proxies = {"bad": noisy(-TRUTH, 1), "good": noisy(TRUTH, 2), "twin": noisy(TRUTH, 3)}
    selection = select_proxy(proxies=proxies, target=TARGET, metrics=CLEAR)
    assert [name for name, _ in selection.ranking][2] == "bad"
    beyond = {(pair.better, pair.worse): pair.beyond_noise for pair in selection.differences}
    assert beyond["good", "bad"] is beyond["twin", "bad"] is True
    assert next(value for pair, value in beyond.items() if set(pair) == {"good", "twin"}) is False
    proxies = {"a": noisy(TRUTH, 1, episodes=1), "b": noisy(-TRUTH, 2, episodes=1)}
    selection = select_proxy(proxies=proxies, target=TARGET, metrics=CLEAR)
    assert [name for name, _ in selection.ranking] == ["a", "b"]
    assert selection.differences[0].beyond_noise is None
    assert "one episode in the proxy" in selection.reason
    with pytest.raises(ScoresError, match="no proxy"):
        select_proxy(proxies={}, target=TARGET, metrics=CLEAR)


def test_differences_are_of_prpv_and_none_of_a_proxy_with_itself():
    proxies = {name: noisy(TRUTH, seed, noise=4.0) for seed, name in enumerate("abcd", 10)}
    selection = select_proxy(proxies=proxies, target=TARGET, metrics=CLEAR)
    own = {name: prpv(compare(proxy=proxy, target=TARGET, metrics=CLEAR)).value for name, proxy in proxies.items()}
    assert dict(selection.ranking) == own
    assert [value for _, value in selection.ranking] == sorted(own.values())
    assert len(selection.differences) == 6
    for pair in selection.differences:
        assert pair.value == own[pair.worse] - own[pair.better] >= 0
        assert pair.low <= pair.value <= pair.high

    same = noisy(TRUTH, 5, noise=3.0)
    selection = select_proxy(proxies={"a": same, "b": same}, target=TARGET, metrics=CLEAR)
    assert (selection.differences[0].low, selection.differences[0].high) == (0.0, 0.0)
    assert selection.differences[0].beyond_noise is False


@pytest.mark.parametrize("seed", range(3))
def test_proxies_of_fewer_than_four_starts_are_not_told_apart_and_the_rest_are(seed):
    few = noisy(TRUTH, seed, episodes=3)
    proxies = {"few": few, "good": noisy(TRUTH, seed + 10), "bad": noisy(-TRUTH, seed + 20)}
    selection = select_proxy(proxies=proxies, target=TARGET, metrics=CLEAR)
    told = {frozenset((pair.better, pair.worse)): pair.beyond_noise for pair in selection.differences}
    assert told == {frozenset(("good", "bad")): True, frozenset(("few", "good")): None, frozenset(("few", "bad")): None}
    assert "fewer than four starts" in selection.reason
    found = select_proxy(proxies=proxies, target=few, metrics=CLEAR)
    assert {pair.low for pair in found.differences} == {None}


@pytest.mark.slow
@pytest.mark.parametrize(("names", "starts"), [("ab", 4), ("ab", 10), ("abc", 10)])
def test_equally_good_proxies_are_seldom_told_apart_even_by_four_starts(names, starts):
    false = 0
    for seed in range(0, 800, 4):
        proxies = {
            name: noisy(TRUTH / 4, seed + place, noise=1.0, episodes=starts) for place, name in enumerate(names, 1)
        }
        target = noisy(TRUTH / 4, seed, noise=1.0, episodes=starts)
        selection = select_proxy(proxies=proxies, target=target, metrics=CLEAR, resamples=300, seed=seed)
        false += any(pair.beyond_noise for pair in selection.differences)
    assert false / 200 <= 0.08
