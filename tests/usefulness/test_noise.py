"""PRPV lies between chance and the noise floor; success rates have intervals of their own."""

from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from score_tables import of_means, table_of

from proxytune.scores import Metric, ScoreTable, read_domains
from proxytune.usefulness import assess, chance, compare, floor_of_repeats, prpv_of_means
from proxytune.usefulness.expectation import noise_floor
from proxytune.usefulness.noise import floor_of_halves, split_halves, success_rates

M = (Metric("m"), Metric("n"))
FIRST = M[:1]
SCORES = Path(__file__).parents[2] / "../shared/data/scores"


def test_chance_agrees_with_all_permutations_and_tells_perfect_from_useless():
    proxy, target = np.random.default_rng(0).normal(size=(2, 5, 2))
    every = np.array([prpv_of_means(proxy[list(order)], target, M) for order in permutations(range(5))])
    result = chance(compare(proxy=of_means(*proxy), target=of_means(*target), metrics=M), permutations=4000)
    assert result.mean == pytest.approx(every.mean(), abs=0.2)
    assert result.deviation == pytest.approx(every.std(), abs=0.2)
    assert result.p_value == pytest.approx((every <= prpv_of_means(proxy, target, M)).mean(), abs=0.03)
    target = np.random.default_rng(2).normal(size=(8, 1)).repeat(2, axis=1)
    right, wrong = (compare(proxy=of_means(*one), target=of_means(*target), metrics=M) for one in (target, -target))
    assert chance(right).p_value == pytest.approx(1 / 1001, abs=2e-3)
    assert chance(wrong).p_value == 1.0


def repeated(values, repeats):
    """A table of START/REPEAT from values of shape (agents, starts · repeats)."""
    return table_of(values, [f"{episode // repeats}/{episode % repeats}" for episode in range(values.shape[1])])


def planted(seed, starts=6, noise=0.2):
    """Twelve agents whose order depends strongly on the start, measured twice under a little placement noise."""
    rng = np.random.default_rng(seed)
    truth = rng.normal(size=(12, 1)) + 3.0 * rng.normal(size=(12, starts))
    return tuple(truth + noise * rng.normal(size=truth.shape) for _ in range(2)), rng


def interleaved(one, two):
    return np.stack([one, two], axis=2).reshape(len(one), -1)


def test_halves_are_disjoint_for_agents_alike_and_without_a_second_episode_there_is_no_floor():
    values = np.zeros((3, 5))
    values[0, 4], values[1, :2] = np.nan, np.nan
    uneven = table_of(values)
    first, second = split_halves(uneven.driven, np.random.default_rng(0), 50)
    assert ((first ^ second) == uneven.driven[:, None]).all()
    assert (first.sum(axis=-1) == np.array([[2], [1], [2]])).all()
    assert not first[0, :, 4].any()
    assert not first[1, :, :2].any()
    assert len(np.unique(first[2], axis=0)) > 1
    starts = np.random.default_rng(0).normal(size=(1, 4))
    assert floor_of_halves(target=table_of(starts + np.arange(3.0)[:, None]), metrics=FIRST).high == 0.0
    result = floor_of_halves(target=table_of(np.arange(3.0)[:, None]), metrics=FIRST)
    assert (result.value, result.kind) == (None, "none")
    assert "each agent has one episode on the target" in result.reason
    (one, two), _ = planted(5)
    assert "both times" in floor_of_repeats(domain=table_of(one), again=table_of(two, "abcdef"), metrics=FIRST).reason


@given(seed=st.integers(0, 10_000), starts=st.integers(2, 5), repeats=st.integers(2, 5))
def test_without_placement_noise_a_domain_has_a_floor_of_zero(seed, starts, repeats):
    values = np.random.default_rng(seed).normal(size=(6, starts))
    target = repeated(values.repeat(repeats, axis=1), repeats)
    result = noise_floor(compare(proxy=target, target=target, metrics=FIRST))
    assert (result.kind, result.value, result.high) == ("same starts", 0.0, 0.0)
    same = floor_of_repeats(domain=table_of(values), again=table_of(values), metrics=FIRST, resamples=20)
    assert (same.kind, same.value, same.low, same.high) == ("same starts", 0.0, 0.0, 0.0)


def test_the_floor_lies_far_below_that_of_halves_with_strong_starts_and_is_what_a_perfect_proxy_scores():
    (one, two), _ = planted(1)
    halves = floor_of_halves(target=table_of(interleaved(one, two)), metrics=FIRST)
    target = repeated(interleaved(one, two), 2)
    floor = noise_floor(compare(proxy=table_of(one), target=target, metrics=FIRST))
    again = floor_of_repeats(domain=table_of(one), again=table_of(two), metrics=FIRST)
    assert (halves.kind, floor.kind, again.kind) == ("halves", "same starts", "same starts")
    assert 0.0 < floor.value < 0.4 * halves.value
    assert again.high < 0.4 * halves.value
    assert again.low <= again.value <= again.high
    # Over 60 planted domains: a third measurement scores about the floor's value, and seldom more than its end.
    scored, values, within = [], [], []
    for seed in range(60):
        (one, two), rng = planted(seed, noise=1.0)
        third = planted(seed, noise=0.0)[0][0] + rng.normal(size=one.shape)
        perfect = float(prpv_of_means(third.mean(axis=1)[:, None], one.mean(axis=1)[:, None], FIRST))
        floor = floor_of_repeats(domain=table_of(one), again=table_of(two), metrics=FIRST, resamples=200)
        scored.append(perfect)
        values.append(floor.value)
        within.append(perfect <= floor.high)
    assert np.mean(values) == pytest.approx(np.mean(scored), rel=0.15)
    assert np.mean(within) >= 0.93


@pytest.mark.parametrize(("others", "once"), [(False, True), (False, False), (True, True)])
def test_the_floor_holds_a_perfect_proxy_from_the_same_starts_and_halves_bound_one_from_others(others, once):
    """Success rates; the proxy drives each start once or twice, as the target."""
    rng, agents, starts = np.random.default_rng(41), np.linspace(0.0, 2.0, 8)[:, None], 8
    held, above = [], []
    for seed in range(60):
        own = agents + rng.normal(size=(8, starts))
        sides = [own, agents + rng.normal(size=own.shape) if others else own]
        target, proxy = (
            repeated((side.repeat(2, axis=1) + 0.3 * rng.normal(size=(8, 2 * starts))) > 0.5, 2) for side in sides
        )
        proxy = proxy.arrange(agents=proxy.agents, episodes=proxy.episodes[:: 2 if once else 1])
        proxy = proxy.unpaired() if others else proxy
        inputs = compare(proxy=proxy, target=target, metrics=FIRST)
        floor, scored = noise_floor(inputs, seed), float(prpv_of_means(*inputs.means, FIRST))
        held.append(floor.low <= scored <= floor.high)
        above.append(scored > floor.high)
    assert floor.kind == ("halves" if others else "same starts")
    assert np.mean(above) <= 0.1
    assert others or np.mean(held) >= 0.88


def test_starts_are_paired_by_their_label_on_both_sides():
    (one, _), rng = planted(2)
    again = table_of(one).arrange(agents=table_of(one).agents, episodes=tuple("543210"))
    holes = again.values.copy()
    holes[0, 2], holes[3, :4] = np.nan, np.nan
    again = ScoreTable(again.agents, again.episodes, again.metrics, holes)
    found = floor_of_repeats(domain=table_of(one), again=again, metrics=FIRST)
    assert (found.value, found.low, found.high) == (0.0, 0.0, 0.0)
    loud = ScoreTable(again.agents, again.episodes, again.metrics, holes + rng.normal(size=holes.shape))
    assert floor_of_repeats(domain=table_of(one), again=loud, metrics=FIRST).value > 0.0
    (one, _), _ = planted(3)
    domain, again = repeated(one.repeat(2, axis=1), 2), repeated(one.repeat(3, axis=1), 3)
    assert floor_of_repeats(domain=domain, again=again, metrics=FIRST).high == 0.0


@pytest.mark.parametrize(
    ("driven", "told"), [([], "'A5' drove no start both times"), ([0], "'A5' has one episode from starts driven both")]
)
def test_an_agent_with_less_than_two_starts_driven_both_times_gives_no_floor_but_a_reason(driven, told):
    (one, two), _ = planted(4)
    two[5, [column for column in range(6) if column not in driven]] = np.nan
    two[5, 0] = two[4, 0] if driven else np.nan
    found = floor_of_repeats(domain=table_of(one), again=table_of(two), metrics=FIRST)
    assert (found.kind, found.value, found.high) == ("none", None, None)
    assert told in found.reason


@pytest.mark.parametrize(("rates", "bound"), [((0.95, 0.95), False), ((0.1, 0.9), True)])
def test_halves_bound_what_a_perfect_proxy_scores_where_few_agents_tie_and_are_said_to_there_alone(rates, bound):
    """Half as many episodes of rates near 1 tie more often, and a tie on both sides costs nothing."""
    rng, rates = np.random.default_rng(43), np.linspace(*rates, 8)[:, None]
    halves, perfect, tied = [], [], []
    for seed in range(60):
        proxy, target = (table_of(rng.random((8, 10)) < rates) for _ in range(2))
        found = floor_of_halves(target=target, metrics=FIRST, seed=seed)
        halves.append(found.value)
        perfect.append(float(prpv_of_means(proxy.means, target.means, FIRST)))
        scores = np.sort(target.means[:, 0])
        tied.append(np.isclose(scores[:, None], scores)[np.triu_indices(8, 1)].mean())
    assert bool(np.mean(halves) >= np.mean(perfect)) is bound
    assert bool(np.mean(tied) <= 0.2) is bound
    assert found.meaning.endswith("an upper bound of the noise floor where few agents tie")


@pytest.mark.skipif(not SCORES.is_dir(), reason="the measured scores of ../shared/data are not here")
def test_the_real_duckiebots_two_episodes_have_one_split():
    chosen = [Metric("distance"), Metric("survival_time_s")]
    real = read_domains(SCORES / "duckietown_pilot_episodes.csv", [m.name for m in chosen])["real"]
    result = floor_of_halves(target=real, metrics=chosen)
    assert (result.value, result.low, result.high) == (56.0, 56.0, 56.0)
    loose = floor_of_halves(target=real.unpaired(), metrics=chosen)
    assert loose.low < loose.value < loose.high


METRICS = [Metric("success"), Metric("distance")]


def table_of_rates(successes, episodes=10):
    """Agents A, B, … with so many successes each."""
    return ScoreTable.from_episodes(
        {
            ("ABCD"[row], episode): {"success": float(episode < count), "distance": 0.5 * row + 0.1 * episode}
            for row, count in enumerate(successes)
            for episode in range(episodes)
        }
    )


def test_a_rate_has_wilson_s_interval_and_pairs_that_tie_are_counted_and_told_once():
    (rates,) = success_rates(compare(proxy=table_of_rates([8, 10]), target=table_of_rates([0, 10]), metrics=METRICS))
    one = rates.proxy["A"]
    assert (rates.metric, one.value, one.episodes) == ("success", 0.8, 10)
    assert (one.low, one.high) == pytest.approx((0.4902, 0.9433), abs=1e-4), "Brown, Cai, DasGupta (2001), eq. (4)"
    assert rates.target["A"].low == pytest.approx(0.0, abs=1e-12)
    assert 0.2 < rates.target["A"].high < 0.3, "no success in ten is no proof of none"
    sides = {"target": table_of_rates([2, 4, 6]), "metrics": METRICS[:1], "resamples": 100}
    found = assess(proxy=table_of_rates([3, 3, 5]), **sides)
    told = [note for note in found.notes if "tie" in note]
    expected = "success is a success rate: 1 of 3 pairs of agents tie in the proxy, 0 on the target; a tie counts half"
    assert len(told) == 1
    assert told[0].startswith(expected)
    assert found.prpv.value == 1
    assert not [note for note in assess(proxy=table_of_rates([3, 4, 5]), **sides).notes if "tie" in note]


@pytest.mark.parametrize("successes", [[10, 10], [0, 0]])
def test_what_is_always_alike_or_no_zero_or_one_is_no_rate(successes):
    both = {"proxy": table_of_rates(successes), "target": table_of_rates(successes)}
    assert success_rates(compare(**both, metrics=METRICS)) == ()
    assert np.unique(both["proxy"].values[..., 1]).size > 2


def test_three_agents_cannot_exclude_chance_however_well_a_proxy_ranks_them_and_that_is_said():
    agents = {(name, str(k)): {"success": 10.0 * row + k} for row, name in enumerate("abc") for k in range(3)}
    table = ScoreTable.from_episodes(agents)
    metrics = [Metric("success")]
    right = assess(proxy=table, target=table, metrics=metrics)
    assert (right.prpv.value, right.chance.explains, right.chance.too_few) == (0, True, True)
    assert any("these agents cannot exclude chance" in line for line in right.notes)
    turned = ScoreTable.from_episodes(
        {(name, label): {"success": -one["success"]} for (name, label), one in agents.items()}
    )
    wrong = assess(proxy=turned, target=table, metrics=metrics)
    assert (wrong.chance.explains, wrong.chance.too_few) == (True, False)
    more = {(name, str(k)): {"success": 10.0 * row + k} for row, name in enumerate("abcd") for k in range(3)}
    four = assess(proxy=ScoreTable.from_episodes(more), target=ScoreTable.from_episodes(more), metrics=metrics)
    assert (four.chance.explains, four.chance.too_few) == (False, False)
