"""What the measures cost: `python -m pytest tests/benchmarks/bench_usefulness.py -o addopts=`."""

import numpy as np
import pytest

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import assess
from proxytune.usefulness.noise import noise_floor
from proxytune.usefulness.pairs import prpv
from proxytune.usefulness.resampling import bootstrap_prpv

METRICS = tuple(Metric(name) for name in "abc")


def table(seed):
    values = np.random.default_rng(seed).normal(size=(16, 10, 3))
    return ScoreTable(tuple(f"A{i:02}" for i in range(16)), tuple(map(str, range(10))), tuple("abc"), values)


@pytest.fixture
def sides():
    return {"proxy": table(1), "target": table(2), "metrics": METRICS}


def test_prpv_of_16_agents_10_episodes_3_metrics(benchmark, sides):
    benchmark(lambda: prpv(**sides))


def test_1000_bootstrap_resamples(benchmark, sides):
    benchmark(lambda: bootstrap_prpv(**sides, resamples=1000))


def test_1000_bootstrap_resamples_of_unpaired_episodes(benchmark, sides):
    apart = {"proxy": table(1).unpaired(), "target": table(2).unpaired(), "metrics": METRICS}
    benchmark(lambda: bootstrap_prpv(**apart, resamples=1000))


def test_noise_floor_of_200_splits(benchmark, sides):
    benchmark(lambda: noise_floor(target=sides["target"], metrics=METRICS, splits=200))


def test_every_measure_with_its_interval(benchmark, sides):
    benchmark(lambda: assess(**sides, resamples=1000))


def test_a_table_of_160_finished_episodes(benchmark):
    scored = {(f"A{i}", e): {"a": 1.0 * i, "b": 1.0 * e, "c": 0.0} for i in range(16) for e in range(10)}
    benchmark(lambda: ScoreTable.from_episodes(scored))
