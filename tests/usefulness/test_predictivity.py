"""Correlations agree with scipy and SIMPLER; MMRV is the cost of a wrong order, POD and PPV that of wrong values."""

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from score_tables import of_means

from proxytune.errors import InputError
from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import compare, pod_of_images, pod_of_poses, predictivity
from proxytune.usefulness.predictivity import kendall_of_means, mmrv, mmrv_of_means, pearson_of_means, ppv, srcc

SCORES = Path(__file__).parents[2] / "../shared/data/scores"
M = [Metric("m"), Metric("n")]


def test_correlations_agree_with_scipy_and_simplers_figures_come_out_by_its_double_loop():
    proxy, target = np.random.default_rng(1).integers(0, 4, size=(2, 50, 8, 2)).astype(float)
    pearson, kendall = pearson_of_means(proxy, target), kendall_of_means(proxy, target)
    for i, column in np.ndindex(50, 2):
        one, other = proxy[i, :, column], target[i, :, column]
        assert pearson[i, column] == pytest.approx(stats.pearsonr(one, other).statistic, abs=1e-7)
        assert kendall[i, column] == pytest.approx(stats.kendalltau(one, other).statistic, abs=1e-12)
    np.testing.assert_allclose(pearson_of_means(1e-5 * proxy, 1e-5 * target), pearson, atol=2e-5)

    proxy, target = of_means((1, 5), (2, 5), (3, 5)), of_means((1, 1), (2, 2), (2, 3))
    for measure in (srcc, predictivity.kendall_tau):
        result = measure(compare(proxy=proxy, target=target, metrics=M))
        assert result.value["n"] is None
        assert result.value["m"] > 0
        assert [note for note in result.notes if "n: " in note and "alike in the proxy" in note]

    result = srcc(compare(proxy=of_means((1, 1), (2, 2)), target=of_means((1, 2), (2, 1)), metrics=M))
    assert result.value == {"m": pytest.approx(1.0), "n": pytest.approx(-1.0)}
    assert "of two agents" in result.notes[0]
    # B and C change places: that costs each of them 0.3, and A nothing.
    result = mmrv(compare(proxy=of_means(0.9, 0.4, 0.6), target=of_means(0.8, 0.5, 0.2), metrics=[Metric("m")]))
    assert result.value["m"] == pytest.approx((0 + 0.3 + 0.3) / 3)

    proxy, target = np.random.default_rng(0).integers(0, 4, size=(2, 40, 5, 1)).astype(float)
    for direction, sign in (("max", 1), ("min", -1)):
        values = mmrv_of_means(proxy, target, [Metric("m", direction)])[:, 0]
        expected = [simplers_loop(sign * p[:, 0], sign * t[:, 0]) for p, t in zip(proxy, target, strict=True)]
        np.testing.assert_allclose(values, expected, atol=1e-12)

    tied, target = of_means(0.5, 0.5, 0.5), of_means(0.1, 0.4, 0.9)
    higher, lower = (compare(proxy=tied, target=target, metrics=[Metric("m", way)]) for way in ("max", "min"))
    assert mmrv(higher).value["m"] == pytest.approx((0 + 0.3 + 0.8) / 3)
    assert mmrv(lower).value["m"] == pytest.approx((0.8 + 0.5 + 0) / 3)


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
        both = compare(**sides, metrics=metric)
        assert mmrv(both).value["success"] == pytest.approx(float(task["mmrv"]), abs=1e-9)
        assert srcc(both).value["success"] == pytest.approx(float(task["pearson"]), abs=1e-9)


def simplers_loop(proxy, target):
    """The definition as a double loop, with SIMPLER's > between agents."""
    both = list(zip(proxy, target, strict=True))
    return np.mean([max(abs(t - u) * ((p > q) != (t > u)) for q, u in both) for p, t in both])


STILL = np.zeros((4, 3))
APART = STILL + np.array([3.0, 4.0, 0.0])


def test_images_and_poses_differ_by_what_is_seen():
    assert pod_of_poses(proxy=APART, target=STILL) == 5.0
    assert pod_of_poses(proxy=STILL + np.array([0.0, 0.0, 0.5]), target=STILL) == 0.0
    dark, bright = np.zeros((2, 3, 4, 3), dtype=np.uint8), np.full((2, 3, 4, 3), 51, dtype=np.uint8)
    assert pod_of_images(proxy=bright, target=dark) == pytest.approx(0.2)
    assert pod_of_images(proxy=bright / 255, target=dark / 255) == pytest.approx(0.2)
    assert pod_of_images(proxy=bright[..., 0], target=dark[..., 0]) == pytest.approx(0.2)
    assert pod_of_images(proxy=np.ones((2, 3, 4)), target=np.zeros((2, 3, 4))) == 1.0


@pytest.mark.parametrize(
    ("measure", "proxy", "target", "complaint"),
    [
        (pod_of_poses, STILL, STILL[:2], "at the same times"),
        (pod_of_poses, STILL[:, :2], STILL[:, :2], "x, y, heading"),
        (pod_of_poses, STILL[:0], STILL[:0], "no observation"),
        (pod_of_poses, STILL * np.nan, STILL, "NaN"),
        (pod_of_images, STILL, STILL, "height, width"),
        (pod_of_images, np.zeros((1, 2, 2)), np.full((1, 2, 2), 200.0), "within 0 and 1"),
        (pod_of_images, np.zeros((1, 2, 2), np.uint8), np.zeros((1, 2, 2)), "must both be"),
    ],
)
def test_observations_that_cannot_be_compared_are_refused(measure, proxy, target, complaint):
    with pytest.raises(InputError, match=complaint):
        measure(proxy=proxy, target=target)


TARGET = of_means((1.0, 10.0), (2.0, 20.0), (3.0, 30.0))


def test_without_weights_a_metric_counts_in_its_spread_on_the_target():
    proxy = of_means((2.0, 10.0), (2.0, 20.0), (1.0, 36.0))
    result = ppv(compare(proxy=proxy, target=TARGET, metrics=M), beta={"m": 1.0, "n": 0.5})
    assert result.value == pytest.approx((1 + 0 + 2 + 0.5 * 6) / 3)

    proxy = of_means((2.0, 20.0), (3.0, 30.0), (4.0, 40.0))
    result = ppv(compare(proxy=proxy, target=TARGET, metrics=M))
    assert result.beta == {"m": pytest.approx(1.0), "n": pytest.approx(0.1)}
    assert result.value == pytest.approx(2.0)

    flat = of_means((1.0, 5.0), (2.0, 5.0), (3.0, 5.0))
    result = ppv(compare(proxy=TARGET, target=flat, metrics=M))
    assert (result.value, result.beta["n"]) == (0.0, None)
    assert "n: left out of PPV" in result.notes[0]
    assert ppv(compare(proxy=TARGET, target=flat, metrics=[Metric("n")])).value is None


@pytest.mark.parametrize("beta", [{"m": 1.0}, {"m": 1.0, "n": -1.0}, {"m": 1.0, "n": np.nan}, {"m": 1.0, "k": 1.0}])
def test_weights_that_do_not_fit_are_refused(beta):
    with pytest.raises(InputError, match="weight"):
        ppv(compare(proxy=TARGET, target=TARGET, metrics=M), beta=beta)
