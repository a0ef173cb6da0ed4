"""One call gives every measure of a proxy, and says what is missing."""

import numpy as np

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import assess, kendall_tau, mmrv, ppv, prpv, srcc

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
        "2 episodes per agent are few" in note for note in assess(proxy=table(1, 2), target=table(2), metrics=M).notes
    )
    assert not any("are few" in note for note in assess(proxy=table(1), target=table(2), metrics=M).notes)


def test_a_proxy_within_the_targets_noise_is_said_to_be():
    found = assess(proxy=table(2), target=table(2), metrics=M)
    assert found.at_noise_floor
    assert any("cannot be told from a perfect one" in note for note in found.notes)
