"""The noise floor is the target against itself."""

from pathlib import Path

import numpy as np
import pytest

from proxytune.scores import Metric, ScoreTable, read_domains
from proxytune.usefulness import noise_floor
from proxytune.usefulness.noise import split_halves

SCORES = Path(__file__).parents[2] / "../shared/data/scores"
M = (Metric("m"),)


def table(values):
    agents, episodes = values.shape
    return ScoreTable(
        tuple(f"A{i}" for i in range(agents)), tuple(map(str, range(episodes))), ("m",), values[:, :, None]
    )


def test_episodes_without_noise_have_no_floor_above_zero():
    result = noise_floor(target=table(np.arange(5.0)[:, None].repeat(4, axis=1)), metrics=M)
    assert (result.value, result.low, result.high) == (0.0, 0.0, 0.0)


def test_more_noise_gives_a_higher_floor():
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(8, 6))
    floors = [noise_floor(target=table(np.arange(8.0)[:, None] + size * noise), metrics=M).value for size in (0.3, 3.0)]
    assert floors[0] < floors[1]


def test_halves_are_disjoint_and_take_all_episodes_of_each_agent():
    values = np.zeros((3, 5))
    values[0, 4], values[1, :2] = np.nan, np.nan
    uneven = table(values)
    first = split_halves(uneven, np.random.default_rng(0), 50)
    assert (first.sum(axis=-1) == np.array([[2], [1], [2]])).all()
    assert not first[0, :, 4].any()
    assert not first[1, :, :2].any()
    assert len(np.unique(first[2], axis=0)) > 1


def test_agents_with_the_same_episodes_are_split_alike():
    first = split_halves(table(np.zeros((3, 4))), np.random.default_rng(0), 10)
    assert (first == first[:1]).all()
    assert len(np.unique(first[0], axis=0)) > 1


def test_one_episode_gives_no_floor_and_says_why():
    result = noise_floor(target=table(np.arange(3.0)[:, None]), metrics=M)
    assert result.value is None
    assert "each agent has one episode on the target" in result.reason


@pytest.mark.skipif(not SCORES.is_dir(), reason="the measured scores of ../shared/data are not here")
def test_the_real_duckiebots_two_episodes_have_one_split():
    chosen = [Metric("distance"), Metric("survival_time_s")]
    real = read_domains(SCORES / "duckietown_pilot_episodes.csv", [m.name for m in chosen])["real"]
    result = noise_floor(target=real, metrics=chosen)
    assert (result.value, result.low, result.high) == (56.0, 56.0, 56.0)
    loose = noise_floor(target=real.unpaired(), metrics=chosen)
    assert loose.low < loose.value < loose.high
