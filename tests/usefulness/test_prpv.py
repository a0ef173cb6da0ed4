"""PRPV against hand-worked cases, its properties, and the published pilot."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.scores import Metric, ScoreTable, read_domains
from proxytune.usefulness import FlippedPair, prpv
from proxytune.usefulness.prpv import dominance, prpv_of_means

SCORES = Path(__file__).parents[2] / "../shared/data/scores"
PROXIES = ("base", "synthetic_tiles", "trim_plus_0.2", "delay_doubled", "blur_0.1", "trim_minus_0.2")
M2 = (Metric("m"), Metric("n"))
few = settings(max_examples=60, derandomize=True, deadline=None)


def table(*rows, metrics=("m", "n"), agents="ABCDEFGHIJ"):
    return ScoreTable.from_episodes(
        {(agents[i], 1): dict(zip(metrics, np.atleast_1d(row).tolist(), strict=True)) for i, row in enumerate(rows)}
    )


@st.composite
def pairs_of_means(draw):
    agents = draw(st.integers(2, 7))
    scores = st.lists(st.integers(-5, 5), min_size=2 * agents * 2, max_size=2 * agents * 2)
    return np.array(draw(scores), dtype=float).reshape(2, agents, 2)


def test_three_agents_by_hand():
    """Target A > B > C; proxy C > A > B: A–C and B–C are reversed, two each."""
    m = [Metric("m")]
    result = prpv(proxy=table(2, 1, 3, metrics=["m"]), target=table(3, 2, 1, metrics=["m"]), metrics=m)
    assert result.value == 4
    assert result.pairs == (FlippedPair("A", "C", "reversed"), FlippedPair("B", "C", "reversed"))


def test_four_agents_and_two_metrics_by_hand():
    """Target: A dominates all, B and C incomparable, both dominate D; proxy: as worked out pair by pair."""
    target = table((4, 4), (3, 2), (2, 3), (1, 1))
    proxy = table((4, 1), (3, 3), (2, 2), (1, 4))
    result = prpv(proxy=proxy, target=target, metrics=M2)
    assert set(result.pairs) == {
        FlippedPair("A", "B", "lost"),
        FlippedPair("A", "C", "lost"),
        FlippedPair("A", "D", "lost"),
        FlippedPair("B", "C", "invented"),
        FlippedPair("B", "D", "lost"),
        FlippedPair("C", "D", "lost"),
    }
    assert result.value == 6
    assert result.normalised == 0.5


def test_a_result_carries_inputs_direction_and_range():
    result = prpv(proxy=table((1, 1), (2, 2)), target=table((2, 2), (1, 1)), metrics=M2)
    assert (result.value, result.range, result.better) == (2, (0, 2), "lower")
    assert (result.inputs.agents, result.inputs.target_episodes) == (("A", "B"), (1, 1))


def test_the_parts_make_up_the_whole():
    rng = np.random.default_rng(3)
    result = prpv(proxy=table(*rng.normal(size=(9, 2))), target=table(*rng.normal(size=(9, 2))), metrics=M2)
    assert sum(2 if pair.flip == "reversed" else 1 for pair in result.pairs) == result.value
    assert {pair.flip for pair in result.pairs} == {"reversed", "lost", "invented"}


@few
@given(pairs_of_means())
def test_alpha_of_a_pair_and_its_mirror_add_up_to_one(means):
    alpha = dominance(means, M2)
    np.testing.assert_array_equal(alpha + np.swapaxes(alpha, -1, -2), 1.0)
    assert set(np.unique(alpha)) <= {0.0, 0.5, 1.0}


@few
@given(pairs_of_means())
def test_it_is_a_whole_number_within_bounds_symmetric_and_zero_for_the_same(means):
    proxy, target = means
    value = prpv_of_means(proxy, target, M2)
    agents = len(proxy)
    assert value == int(value)
    assert 0 <= value <= agents * (agents - 1)
    assert value == prpv_of_means(target, proxy, M2)
    assert prpv_of_means(proxy, proxy, M2) == 0


@few
@given(pairs_of_means(), st.randoms(use_true_random=False))
def test_the_order_of_the_agents_does_not_matter(means, random):
    proxy, target = (table(*rows) for rows in means)
    names = list(proxy.agents)
    random.shuffle(names)
    shuffled = ScoreTable.from_episodes(
        {(name, 1): dict(zip("mn", proxy.means[proxy.agents.index(name)].tolist(), strict=True)) for name in names}
    )
    expected = prpv(proxy=proxy, target=target, metrics=M2).value
    assert prpv(proxy=shuffled, target=target, metrics=M2).value == expected
    assert prpv(proxy=target, target=shuffled, metrics=M2).value == expected


@few
@given(pairs_of_means())
def test_an_increasing_rescaling_of_a_metric_changes_nothing(means):
    proxy, target = means
    bent = proxy.copy()
    bent[:, 0] = np.exp(proxy[:, 0] / 2) - 100.0
    assert prpv_of_means(bent, target, M2) == prpv_of_means(proxy, target, M2)


@few
@given(pairs_of_means())
def test_turning_a_metric_and_its_direction_changes_nothing(means):
    turned = (Metric("m", "min"), Metric("n"))
    assert prpv_of_means(*(means * [-1, 1]), turned) == prpv_of_means(*means, M2)


def test_differences_up_to_the_tolerance_are_ties():
    scores = np.array([[1.0], [1.5], [2.0]])
    assert dominance(scores, [Metric("m", "max", 0.5)])[:, 0].tolist() == [0.5, 0.5, 1.0]
    assert dominance(scores, [Metric("m", "max", 25.0, percent=True)])[:, 0].tolist() == [0.5, 0.5, 1.0]
    assert dominance(scores, [Metric("m", "min", 0.5)])[:, 0].tolist() == [0.5, 0.5, 0.0]


def test_rounding_of_a_mean_is_a_tie():
    one = ScoreTable.from_episodes({("A", e): {"m": 0.1} for e in range(10)} | {("B", 0): {"m": 0.1}})
    assert dominance(one.means, [Metric("m")]).tolist() == [[0.5, 0.5], [0.5, 0.5]]
    assert dominance(np.array([[0.1 + 0.2], [0.3]]), [Metric("m")]).tolist() == [[0.5, 0.5], [0.5, 0.5]]


def test_unrelated_tables_of_ten_agents_and_two_metrics_average_33_9():
    rng = np.random.default_rng(0)
    values = prpv_of_means(*rng.normal(size=(2, 20_000, 10, 2)), M2)
    assert values.mean() == pytest.approx(33.75, abs=0.3)
    assert values.std() == pytest.approx(7.1, abs=0.3)


needs_pilot = pytest.mark.skipif(not SCORES.is_dir(), reason="the measured scores of ../shared/data are not here")


@needs_pilot
@pytest.mark.parametrize(
    ("metrics", "published"),
    [
        ("distance:max:5% survival_time_s:max:5% time_out_of_lane_s:max:5%", [93, 74, 80, 86, 74, 69]),
        ("distance:max:5% survival_time_s:max:5% time_out_of_lane_s:min:5%", [90, 80, 89, 74, 80, 115]),
        ("distance:max:5% survival_time_s:max:5%", [117, 78, 74, 90, 87, 111]),
    ],
)
def test_the_pilots_published_figures_come_out_exactly(metrics, published):
    chosen = [Metric.parse(text) for text in metrics.split()]
    tables = read_domains(SCORES / "duckietown_pilot_published_means.csv", [metric.name for metric in chosen])
    values = [prpv(proxy=tables[name], target=tables["real"], metrics=chosen).value for name in PROXIES]
    assert values == published


@needs_pilot
def test_the_real_duckiebot_against_itself_flips_56_of_240():
    chosen = [Metric("distance"), Metric("survival_time_s")]
    real = read_domains(SCORES / "duckietown_pilot_episodes.csv", [m.name for m in chosen])["real"]
    halves = [ScoreTable(real.agents, ("1",), real.metrics, real.values[:, [episode]]) for episode in (0, 1)]
    result = prpv(proxy=halves[0], target=halves[1], metrics=chosen)
    assert (result.value, result.range[1]) == (56, 240)
