"""One call gives every measure of a proxy, and says what is missing."""

import numpy as np
import pytest

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import (
    assess,
    bootstrap_prpv,
    floor_of_repeats,
    kendall_tau,
    mmrv,
    ppv,
    prpv,
    resampling,
    srcc,
)

M = (Metric("m"), Metric("n", "min"))


def table(seed, episodes=6, agents=5):
    values = np.random.default_rng(seed).normal(size=(agents, episodes, 2)) + np.arange(agents)[:, None, None]
    return ScoreTable(tuple(f"A{i}" for i in range(agents)), tuple(map(str, range(episodes))), ("m", "n"), values)


def test_it_gathers_the_single_measures():
    sides = {"proxy": table(1), "target": table(2), "metrics": M}
    found = assess(**sides)
    assert found.prpv.value == prpv(**sides).value == found.prpv_interval.value
    assert found.ppv.value == ppv(**sides).value
    for name, measure in (("srcc", srcc), ("kendall_tau", kendall_tau), ("mmrv", mmrv)):
        assert getattr(found, name).value == measure(**sides).value


def test_every_measure_has_an_interval_around_it():
    found = assess(proxy=table(1, 20), target=table(2, 20), metrics=M)
    assert found.intervals.ppv[0] < found.ppv.value < found.intervals.ppv[1]
    for name in ("srcc", "kendall_tau", "mmrv"):
        for metric, (low, high) in getattr(found.intervals, name).items():
            assert low <= getattr(found, name).value[metric] <= high, (name, metric)


def test_episodes_are_drawn_once_for_all_intervals_though_one_is_missing(monkeypatch):
    sides, drawn, draw = {"proxy": table(1), "target": table(2), "metrics": M}, [], resampling._means_of_draws
    sides["target"].values[3, 2] = np.nan
    monkeypatch.setattr(resampling, "_means_of_draws", lambda one, *rest: drawn.append(one) or draw(one, *rest))
    found = assess(**sides, resamples=200, seed=5)
    assert drawn == [sides["target"], sides["proxy"]]
    assert found.intervals is not None
    assert found.prpv_interval == bootstrap_prpv(**sides, resamples=200, seed=5)


def test_a_constant_metric_has_no_interval_and_a_note():
    flat = table(1).values.copy()
    flat[:, :, 0] = 3.0
    found = assess(proxy=ScoreTable(table(1).agents, table(1).episodes, ("m", "n"), flat), target=table(2), metrics=M)
    assert found.srcc.value["m"] is found.intervals.srcc["m"] is found.intervals.kendall_tau["m"] is None
    assert found.intervals.srcc["n"] is not None
    assert any("m: SRCC is undefined" in note for note in found.notes)


def test_single_episodes_have_no_interval_nor_floor_and_two_notes():
    found = assess(proxy=table(1, 1), target=table(2, 1), metrics=M)
    assert found.intervals is found.at_noise_floor is found.prpv_interval.low is found.noise_floor.value is None
    assert [note.split(":")[0] for note in found.notes] == ["no interval", "no noise floor"]


def test_few_episodes_are_warned_of():
    assert any(
        "only 2 episodes per agent" in note for note in assess(proxy=table(1, 2), target=table(2), metrics=M).notes
    )
    assert not any("per agent" in note for note in assess(proxy=table(1), target=table(2), metrics=M).notes)


PERFECT = "no difference between proxy and target"
CLEAR = (Metric("m"),)
"""By this metric alone agents are in a clear order."""


def again(one, noise=0.1, seed=9):
    """The same domain from the same starts under other noise."""
    values = one.values + noise * np.random.default_rng(seed).normal(size=one.values.shape)
    return ScoreTable(one.agents, one.episodes, one.metrics, values)


def test_a_proxy_within_the_noise_of_the_same_starts_is_said_to_be():
    target = table(2, agents=8)
    floor = floor_of_repeats(domain=target, again=again(target), metrics=CLEAR)
    found = assess(proxy=target, target=target, metrics=CLEAR, floor=floor)
    assert found.noise_floor is floor
    assert found.at_noise_floor is True
    assert any(PERFECT in note for note in found.notes)


def test_a_proxy_above_the_floor_is_not():
    target = table(2, agents=8)
    floor = floor_of_repeats(domain=target, again=target, metrics=CLEAR)
    found = assess(proxy=table(3, agents=8), target=target, metrics=CLEAR, floor=floor)
    assert found.prpv.value > floor.high
    assert found.at_noise_floor is False
    assert not any(PERFECT in note for note in found.notes)


@pytest.mark.parametrize("seed", range(5))
def test_halves_never_show_that_a_proxy_is_perfect(seed):
    target = table(seed, agents=8)
    found = assess(proxy=target, target=target, metrics=CLEAR)
    assert found.noise_floor.kind == "halves"
    assert found.prpv.value == 0
    assert found.at_noise_floor is None
    assert not any(PERFECT in note for note in found.notes)
    assert any("does not show that the proxy is perfect" in note for note in found.notes)


def test_above_what_halves_score_nothing_is_said_of_them():
    target, worst = table(2, agents=8), table(2, agents=8)
    worst = ScoreTable(worst.agents, worst.episodes, worst.metrics, -worst.values)
    found = assess(proxy=worst, target=target, metrics=CLEAR)
    assert found.prpv.value > found.noise_floor.high
    assert not any("halves" in note for note in found.notes)


def test_what_chance_explains_is_no_perfect_proxy_and_is_said_to_be_chance():
    """Of three agents every order comes by chance too often."""
    target = table(2, agents=3)
    floor = floor_of_repeats(domain=target, again=again(target), metrics=CLEAR)
    found = assess(proxy=target, target=target, metrics=CLEAR, floor=floor)
    assert found.prpv.value == 0 <= floor.high
    assert found.chance.p_value >= 0.05
    assert found.at_noise_floor is False
    assert any(note.startswith("PRPV is no better than chance") for note in found.notes)
    assert not any(PERFECT in note for note in found.notes)
    sure = assess(proxy=table(2, agents=8), target=table(2, agents=8), metrics=CLEAR)
    assert not any("chance" in note for note in sure.notes)


def test_the_target_s_own_repeats_are_taken_where_it_has_them():
    one = table(4, agents=8)
    values = np.concatenate([one.values, again(one).values], axis=1)
    labels = tuple(f"{episode}/{repeat}" for repeat in range(2) for episode in one.episodes)
    target = ScoreTable(one.agents, labels, one.metrics, values)
    found = assess(proxy=again(one, seed=5), target=target, metrics=CLEAR)
    assert found.noise_floor.kind == "same starts"
    assert found.at_noise_floor is True
    assert found.inputs.paired
