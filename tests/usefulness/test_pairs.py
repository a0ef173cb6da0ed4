"""PRPV counts wrongly ordered pairs of the same agents: by hand, by its properties and in the published pilot."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from score_tables import bootstrap_prpv, of_means, table_of

from proxytune.errors import ScoresError
from proxytune.scores import Metric, ScoreTable, read_domains
from proxytune.usefulness import assess, compare, dominance, pairs, predictivity, resampling, start_of, starts_of
from proxytune.usefulness.comparison import by_start, in_common
from proxytune.usefulness.pairs import FlippedPair, prpv, prpv_of_means, stand
from proxytune.usefulness.predictivity import kendall_of_means, mmrv_of_means
from proxytune.usefulness.resampling import bootstrap_means, draw_counts

M = [Metric("m")]


def table(agents, episodes=(1,)):
    return ScoreTable.from_episodes({(a, e): {"m": ord(a) + e / 10, "n": 0.0} for a in agents for e in episodes})


def test_tables_are_put_in_one_order_of_the_agents_that_all_have_and_others_named():
    inputs = compare(proxy=table("CAB", (2, 1)), target=table("ABC", (1, 2)), metrics=M)
    assert inputs.agents == inputs.proxy.agents == ("A", "B", "C")
    assert inputs.paired
    assert (inputs.proxy.values == inputs.target.values).all()
    assert not compare(proxy=table("AB", (1, 2)), target=table("AB", (1, 3)), metrics=M).paired
    inputs = compare(proxy=table("AB", (1, 2, 3)), target=table("AB"), metrics=M)
    assert inputs.episodes == ((3, 3), (1, 1))
    human = ScoreTable.from_episodes({(a, "day" if a == "H" else 1): {"m": 1.0} for a in "BHA"})
    kept, lines = in_common({"the target": human, "the proxy sim": table("ABC")})
    assert (kept["the target"].agents, kept["the proxy sim"].agents) == (("B", "A"), ("A", "B"))
    assert kept["the target"].episodes == ("1",), "an episode that nobody is left of is none"
    assert lines == (
        "left out, since not all sides have them: H of the target",
        "left out, since not all sides have them: C of the proxy sim",
    )
    with pytest.raises(ScoresError, match="at least two agents in common; one has A, B; other has C, D"):
        in_common({"one": table("AB"), "other": table("CD")})


@pytest.mark.parametrize(
    ("proxy", "target", "complaint"),
    [
        ("AB", "ABCD", "the proxy lacks scores of C, D, which the target has"),
        ("ABC", "AB", "the target lacks scores of C, which the proxy has"),
        ("A", "A", r"only one agent \('A'\) is scored"),
    ],
)
def test_agents_that_do_not_match_are_named(proxy, target, complaint):
    with pytest.raises(ScoresError, match=complaint):
        compare(proxy=table(proxy), target=table(target), metrics=M)


@pytest.mark.parametrize("metrics", [[], [Metric("m"), Metric("m", "min")], [Metric("k")]])
def test_no_metric_a_metric_twice_or_an_unknown_one_is_refused(metrics):
    with pytest.raises(ScoresError):
        compare(proxy=table("AB"), target=table("AB"), metrics=metrics)


MEASURES = {
    "prpv": prpv_of_means,
    "kendall_tau": lambda proxy, target, metrics: kendall_of_means(proxy, target),
    "mmrv": mmrv_of_means,
}
KINDS = {
    "continuous": lambda random, shape: random.normal(size=shape),
    "tied": lambda random, shape: random.integers(0, 6, size=shape) * 0.1,
    "nearly tied": lambda random, shape: 0.3 + random.integers(-9, 9, size=shape) * random.choice([1e-14, 2e-13]),
    "rates": lambda random, shape: random.integers(0, 2, size=(7, *shape)).mean(axis=0) - 0.3,
    "alike": lambda random, shape: np.ones(shape),
}


@pytest.mark.parametrize("measure", MEASURES)
@given(kind=st.sampled_from(sorted(KINDS)), seed=st.integers(0, 10**6), agents=st.integers(2, 100))
@settings(max_examples=60)
def test_sorting_gives_what_comparing_every_pair_gives(measure, kind, seed, agents):
    random = np.random.default_rng(seed)
    proxy, target = (KINDS[kind](random, (2, agents, 3)) for _ in range(2))
    metrics = (Metric("a"), Metric("b", "min", 0.1), Metric("c", "max", 5.0, percent=True))
    pairwise = MEASURES[measure](proxy, target, metrics)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pairs, "FEW_AGENTS", 1)
        patch.setattr(predictivity, "FEW_AGENTS", 1)
        patch.setattr(pairs, "WORDS", agents + 1)  # a word of 64 agents at a time
        np.testing.assert_array_equal(MEASURES[measure](proxy, target, metrics), pairwise)


def test_differences_up_to_the_tolerance_or_by_rounding_are_ties():
    """0.8 − 0.3 is 0.5 in floating point, though 0.8 − 0.5 is more than 0.3."""
    found = stand(np.array([0.8, 0.3, 0.1]), 0.5)
    assert found.below.tolist() == [1, 0, 0]
    assert found.reach.tolist() == [3, 3, 2]
    scores = np.array([[1.0], [1.5], [2.0]])
    assert dominance(scores, [Metric("m", "max", 0.5)])[:, 0].tolist() == [0.5, 0.5, 1.0]
    assert dominance(scores, [Metric("m", "max", 25.0, percent=True)])[:, 0].tolist() == [0.5, 0.5, 1.0]
    assert dominance(scores, [Metric("m", "min", 0.5)])[:, 0].tolist() == [0.5, 0.5, 0.0]
    for tenths in range(10):  # 0.4 − 0.3 is 0.10000000000000003
        rates = np.array([[tenths / 10], [(tenths + 1) / 10]])
        assert dominance(rates, [Metric("m", "max", 0.1)])[0].tolist() == [0.5, 0.5]
    one = ScoreTable.from_episodes({("A", e): {"m": 0.1} for e in range(10)} | {("B", 0): {"m": 0.1}})
    assert dominance(one.means, [Metric("m")]).tolist() == [[0.5, 0.5], [0.5, 0.5]]
    assert dominance(np.array([[0.1 + 0.2], [0.3]]), [Metric("m")]).tolist() == [[0.5, 0.5], [0.5, 0.5]]


@pytest.mark.slow
@pytest.mark.parametrize("labels", ["012345", ["0/0", "0/1", "1/0", "1/1", "2/0", "2/1"]])
def test_drawing_for_a_few_agents_at_a_time_changes_nothing(labels, monkeypatch):
    values = np.random.default_rng(0).normal(size=(2, 7, 6, 1))
    values[:, 2, 4] = np.nan
    proxy, target = (table_of(side, labels) for side in values)
    first = assess(proxy=proxy, target=target, metrics=[Metric("m")], resamples=100)
    monkeypatch.setattr(resampling, "BLOCK", 1)
    again = assess(proxy=proxy, target=target, metrics=[Metric("m")], resamples=100)
    assert vars(again.intervals) == vars(first.intervals)
    assert (again.noise_floor.value, again.noise_floor.high) == (first.noise_floor.value, first.noise_floor.high)
    assert again.prpv_interval.expected == first.prpv_interval.expected


SCORES = Path(__file__).parents[2] / "../shared/data/scores"
PROXIES = ("base", "synthetic_tiles", "trim_plus_0.2", "delay_doubled", "blur_0.1", "trim_minus_0.2")
M2 = (Metric("m"), Metric("n"))
few = settings(max_examples=60)


@st.composite
def pairs_of_means(draw):
    agents = draw(st.integers(2, 7))
    scores = st.lists(st.integers(-5, 5), min_size=2 * agents * 2, max_size=2 * agents * 2)
    return np.array(draw(scores), dtype=float).reshape(2, agents, 2)


def test_prpv_of_a_few_agents_is_that_by_hand_and_of_unrelated_tables_as_by_chance():
    """Target A > B > C; proxy C > A > B: A–C and B–C are reversed, two each."""
    result = prpv(compare(proxy=of_means(2, 1, 3), target=of_means(3, 2, 1), metrics=M))
    assert result.value == 4
    assert result.pairs == (FlippedPair("A", "C", "reversed"), FlippedPair("B", "C", "reversed"))

    target = of_means((4, 4), (3, 2), (2, 3), (1, 1))
    result = prpv(compare(proxy=of_means((4, 1), (3, 3), (2, 2), (1, 4)), target=target, metrics=M2))
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

    result = prpv(compare(proxy=of_means((1, 1), (2, 2)), target=of_means((2, 2), (1, 1)), metrics=M2))
    assert (result.value, result.range) == (2, (0, 2))
    assert (result.inputs.agents, result.inputs.episodes[1]) == (("A", "B"), (1, 1))
    values = prpv_of_means(*np.random.default_rng(0).normal(size=(2, 20_000, 10, 2)), M2)
    assert values.mean() == pytest.approx(33.75, abs=0.3)
    assert values.std() == pytest.approx(7.1, abs=0.3)


@few
@given(pairs_of_means())
def test_alpha_of_a_pair_and_its_mirror_add_up_to_one(means):
    alpha = dominance(means, M2)
    np.testing.assert_array_equal(alpha + np.swapaxes(alpha, -1, -2), 1.0)
    assert set(np.unique(alpha)) <= {0.0, 0.5, 1.0}


@few
@given(pairs_of_means())
def test_it_is_a_whole_number_within_bounds_that_rescaling_or_turning_a_metric_does_not_change(means):
    proxy, target = means
    value = prpv_of_means(proxy, target, M2)
    agents = len(proxy)
    assert value == int(value)
    assert 0 <= value <= agents * (agents - 1)
    assert value == prpv_of_means(target, proxy, M2)
    assert prpv_of_means(proxy, proxy, M2) == 0
    bent = proxy.copy()
    bent[:, 0] = np.exp(proxy[:, 0] / 2) - 100.0
    assert prpv_of_means(bent, target, M2) == prpv_of_means(proxy, target, M2)
    turned = (Metric("m", "min"), Metric("n"))
    assert prpv_of_means(*(means * [-1, 1]), turned) == prpv_of_means(*means, M2)


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
    values = [prpv(compare(proxy=tables[name], target=tables["real"], metrics=chosen)).value for name in PROXIES]
    assert values == published


def labelled(starts, repeats):
    return [f"{start}/{repeat}" for start in range(starts) for repeat in range(repeats)]


def test_the_start_is_what_is_before_the_last_stroke_and_more_repeats_of_it_make_no_interval_narrower():
    assert [start_of(label) for label in ("3", "3/0", "loop/3/1", "/1")] == ["3", "3", "loop/3", "/1"]
    assert starts_of(["1/0", "0/0", "1/1"]) == ("1", "0")
    # Copies of every episode say nothing new.
    rng = np.random.default_rng(3)
    starts, proxy = rng.normal(size=(8, 4)), table_of(rng.normal(size=(8, 6)), "abcdef")
    once = bootstrap_prpv(proxy=proxy, target=table_of(starts, "0123"), metrics=M)
    copied = bootstrap_prpv(proxy=proxy, target=table_of(starts.repeat(5, axis=1), labelled(4, 5)), metrics=M)
    assert (copied.low, copied.high) == (once.low, once.high)


def test_repeats_of_a_start_are_averaged_and_a_start_that_was_not_driven_stays_unknown():
    found = by_start(table_of([[1.0, 3.0, np.nan, 5.0], [1.0, 1.0, np.nan, np.nan]], labelled(2, 2)))
    assert found.episodes == ("0", "1")
    np.testing.assert_array_equal(found.values[:, :, 0], [[2.0, 5.0], [1.0, np.nan]])


def test_repeats_of_a_start_are_drawn_together_and_paired_by_start_with_a_proxy_of_plain_ones():
    repeated, plain = table_of(np.zeros((2, 6)), labelled(3, 2)), table_of(np.zeros((2, 3)), "012")
    counts = draw_counts(repeated, np.random.default_rng(0), 30)
    assert (counts[..., ::2] == counts[..., 1::2]).all()
    np.testing.assert_array_equal(counts[..., ::2], draw_counts(plain, np.random.default_rng(0), 30))
    values = np.random.default_rng(0).normal(size=(4, 6))
    target = table_of(values, labelled(1, 6))
    assert len(np.unique(draw_counts(target, np.random.default_rng(0), 30)[0], axis=0)) > 10
    assert not compare(proxy=table_of(values[:, :3], labelled(1, 3)), target=target, metrics=M).paired
    found = assess(proxy=table_of(values, "abcdef"), target=target, metrics=M)
    assert any("from one start" in note for note in found.notes)
    # Scores that depend on the start alone stay equal in every resample, in whatever order the starts come.
    starts = np.random.default_rng(0).normal(size=(1, 5)).repeat(3, axis=0)
    target = table_of(starts.repeat(2, axis=1), labelled(5, 2))
    inputs = compare(proxy=table_of(starts[:, ::-1], "43210"), target=target, metrics=M)
    assert inputs.paired
    means = bootstrap_means(inputs, resamples=50, seed=1)
    np.testing.assert_allclose(means[0], means[1], atol=1e-12)
    assert np.ptp(means[0], axis=0).min() > 0.0
    assert not compare(proxy=table_of(starts, "abcde"), target=target, metrics=M).paired
