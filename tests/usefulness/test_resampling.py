"""The bootstrap keeps pairs together, tells when it cannot be had, and covers what it claims to cover."""

import numpy as np
import pytest
from score_tables import bootstrap_prpv, table_of

from proxytune.scores import Metric
from proxytune.usefulness import assess, bootstrap_means, compare, prpv_of_means
from proxytune.usefulness.predictivity import mmrv_of_means, pearson_of_means
from proxytune.usefulness.resampling import draw_counts, interval_around

M = (Metric("m"), Metric("n"))


def noisy(seed, agents=6, episodes=5, noise=1.0):
    rng = np.random.default_rng(seed)
    return table_of(rng.normal(size=(agents, 1, 2)) + noise * rng.normal(size=(agents, episodes, 2)))


def test_paired_episodes_are_resampled_alike_for_agents_and_domains_and_those_of_other_labels_apart():
    """Scores that depend on the start alone stay equal in every resample."""
    starts = np.random.default_rng(0).normal(size=(1, 5, 2)).repeat(4, axis=0)
    means = bootstrap_means(compare(proxy=table_of(starts), target=table_of(starts), metrics=M), resamples=50, seed=1)
    np.testing.assert_array_equal(means[0], means[1])
    assert np.ptp(means[0], axis=1).max() == 0.0
    assert np.ptp(means[0], axis=0).min() > 0.0
    inputs = compare(proxy=table_of(starts, "abcde"), target=table_of(starts), metrics=M)
    means = bootstrap_means(inputs, resamples=50, seed=1)
    assert np.abs(means[0] - means[1]).max() > 0.0


def test_the_interval_holds_the_value_follows_from_the_seed_and_is_a_point_without_noise():
    same = noisy(1, agents=8, noise=3.0).unpaired()
    result = bootstrap_prpv(proxy=same, target=noisy(1, agents=8, noise=3.0), metrics=M)
    assert result.value == result.low == 0
    assert result.expected == 0.0
    every = assess(proxy=same, target=noisy(1, agents=8, noise=3.0), metrics=M, resamples=200)
    assert every.intervals.ppv[0] == every.ppv.value == pytest.approx(0.0, abs=1e-12)
    assert every.intervals.mmrv["m"][0] == every.mmrv.value["m"] == 0.0
    assert every.intervals.srcc["m"][1] == every.srcc.value["m"]
    sides = {"proxy": noisy(1, episodes=9), "target": noisy(2, episodes=9), "metrics": M}
    first, again, other = (assess(**sides, seed=seed) for seed in (1, 1, 2))
    assert (first.prpv_interval, first.intervals) == (again.prpv_interval, again.intervals)
    assert first.intervals.ppv != other.intervals.ppv
    result = bootstrap_prpv(**{"proxy": noisy(1, noise=0.0), "target": noisy(2, noise=0.0)}, metrics=M)
    assert result.low == result.high == result.value == result.expected
    assert result.value > 0


def test_one_episode_gives_no_interval_and_says_why():
    for sides, where in (((1, 5), "in the proxy"), ((5, 1), "on the target")):
        result = bootstrap_prpv(proxy=noisy(1, episodes=sides[0]), target=noisy(2, episodes=sides[1]), metrics=M)
        assert result.low is result.high is result.expected is None
        assert f"each agent has one episode {where}" in result.reason
    uneven = noisy(1).values.copy()
    uneven[3, 1:] = np.nan
    assert "agent 'A3' has one" in bootstrap_prpv(proxy=table_of(uneven), target=noisy(2), metrics=M).reason


@pytest.mark.slow
@pytest.mark.parametrize("paired", [True, False])
def test_the_interval_covers_the_expected_prpv_at_about_the_nominal_rate(paired):
    """Over 300 repeated experiments; the expected PRPV itself is the mean over 20 000 of them."""
    agents, episodes, noise = 10, 8, 0.7
    rng = np.random.default_rng(5)
    truth = rng.normal(size=(2, agents, 2)) * [[[0.5]], [[1.0]]]
    truth[0] += truth[1]
    many = truth[:, None] + noise / np.sqrt(episodes) * rng.normal(size=(2, 20_000, agents, 2))
    expected = prpv_of_means(many[0], many[1], M).mean()
    held = []
    for seed in range(300):
        sides = [table_of(mean[:, None] + noise * rng.normal(size=(agents, episodes, 2))) for mean in truth]
        sides = sides if paired else [side.unpaired() for side in sides]
        result = bootstrap_prpv(proxy=sides[0], target=sides[1], metrics=M, resamples=300, seed=seed)
        held.append(result.low <= expected <= result.high)
    assert 0.92 <= np.mean(held) <= 0.99


def test_intervals_of_many_agents_lie_about_what_such_tables_score():
    """Success rates, of which a perfect proxy's episodes break fewer orders than their draws do."""
    rng, rates = np.random.default_rng(21), np.linspace(0.2, 0.9, 20)
    many = rng.binomial(25, rates, size=(2, 2000, 20))[..., None] / 25
    expected = [measure(*many).mean() for measure in (pearson_of_means, lambda *it: mmrv_of_means(*it, M[:1]))]
    expected.insert(0, prpv_of_means(*many, M[:1]).mean())
    held = []
    for seed in range(60):
        proxy, target = (table_of(rng.random((20, 25)) < rates[:, None]) for _ in range(2))
        found = assess(proxy=proxy.unpaired(), target=target, metrics=M[:1], resamples=200, seed=seed)
        inner, others = found.prpv_interval, found.intervals
        ends = (inner.low, inner.high), others.srcc["m"], others.mmrv["m"]
        held.append([low <= middle <= high for middle, (low, high) in zip(expected, ends, strict=True)])
        assert inner.expected == found.prpv.value
    assert np.mean(held, axis=0).min() >= 0.92


def test_an_interval_is_wider_by_what_few_starts_lack_and_ends_with_the_scale():
    draws = np.linspace(-1.0, 3.0, 401)
    assert interval_around(0.5, draws, 4) == pytest.approx((0.5 - 1.9 * np.sqrt(4 / 3), 0.5 + 1.9 * np.sqrt(4 / 3)))
    assert interval_around(0.5, draws, 4, (0.0, 1.0)) == (0.0, 1.0)
    assert interval_around(np.nan, draws, 4) is interval_around(0.5, np.full(9, np.nan), 4) is None


def test_episodes_of_uneven_agents_are_drawn_evenly_and_independently():
    values = np.zeros((2, 5, 2))
    values[0, 3:] = np.nan
    counts = draw_counts(table_of(values), np.random.default_rng(3), 20_000)
    for drawn, episodes in zip(counts, (3, 5), strict=True):
        together = np.full((episodes, episodes), -1 / episodes) + np.eye(episodes)  # a multinomial's
        np.testing.assert_allclose(drawn[:, :episodes].mean(axis=0), 1.0, atol=0.03)
        np.testing.assert_allclose(np.cov(drawn[:, :episodes].T), together, atol=0.03)
    assert not counts[0, :, 3:].any()
