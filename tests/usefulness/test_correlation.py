"""SRCC and Kendall's τ agree with scipy and SIMPLER, and say where they are undefined."""

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import kendall_tau, mmrv, srcc
from proxytune.usefulness.correlation import kendall_of_means, pearson_of_means

SCORES = Path(__file__).parents[2] / "../shared/data/scores"
M = [Metric("m"), Metric("n")]


def table(rows, agents="ABCDEFGH"):
    return ScoreTable.from_episodes({(agents[i], 1): {"m": float(m), "n": float(n)} for i, (m, n) in enumerate(rows)})


def test_both_agree_with_scipy_also_where_there_are_ties():
    rng = np.random.default_rng(1)
    proxy, target = rng.integers(0, 4, size=(2, 50, 8, 2)).astype(float)
    pearson, kendall = pearson_of_means(proxy, target), kendall_of_means(proxy, target)
    for i, column in np.ndindex(50, 2):
        one, other = proxy[i, :, column], target[i, :, column]
        assert pearson[i, column] == pytest.approx(stats.pearsonr(one, other).statistic, abs=1e-7)
        assert kendall[i, column] == pytest.approx(stats.kendalltau(one, other).statistic, abs=1e-12)


def test_a_constant_metric_is_undefined_and_said_so():
    proxy, target = table([(1, 5), (2, 5), (3, 5)]), table([(1, 1), (2, 2), (2, 3)])
    for measure in (srcc, kendall_tau):
        result = measure(proxy=proxy, target=target, metrics=M)
        assert result.value["n"] is None
        assert result.value["m"] > 0
        assert [note for note in result.notes if "n: " in note and "alike in the proxy" in note]
        assert (result.better, result.range) == ("higher", (-1, 1))


def test_identical_tables_correlate_exactly():
    same = table([(0.1, 5), (0.2, 3), (0.4, 4)])
    for measure in (srcc, kendall_tau):
        assert measure(proxy=same, target=same, metrics=M).value == {"m": 1.0, "n": 1.0}


def test_two_agents_correlate_perfectly_which_means_nothing():
    result = srcc(proxy=table([(1, 1), (2, 2)]), target=table([(1, 2), (2, 1)]), metrics=M)
    assert result.value == {"m": pytest.approx(1.0), "n": pytest.approx(-1.0)}
    assert "of two agents" in result.notes[0]


@pytest.mark.skipif(not SCORES.is_dir(), reason="the measured scores of ../shared/data are not here")
def test_simplers_own_figures_come_out():
    rows = list(csv.DictReader((SCORES / "simpler_success.csv").open()))
    golden = list(csv.DictReader((SCORES / "simpler_golden.csv").open()))
    metric = [Metric("success")]
    assert len(golden) == 9
    for task in golden:
        own = [row for row in rows if row["task"] == task["task"]]
        sides = {
            side: ScoreTable.from_episodes({(r["policy"], 1): {"success": float(r[f"{side}_success"])} for r in own})
            for side in ("proxy", "target")
        }
        assert mmrv(**sides, metrics=metric).value["success"] == pytest.approx(float(task["mmrv"]), abs=1e-9)
        assert srcc(**sides, metrics=metric).value["success"] == pytest.approx(float(task["pearson"]), abs=1e-9)
