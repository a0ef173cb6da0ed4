"""Which agent to deploy, the test after each rollout, and the plan of those to come."""

import numpy as np
import pytest
from scipy import stats
from score_tables import table_of

from proxytune.errors import InputError, ScoresError
from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import Asked, compare, decide, decision, mmrv_conventions, sequential, sequential_test
from proxytune.usefulness.comparison import by_start, independence
from proxytune.usefulness.noise import chance, success_rates
from proxytune.usefulness.sequential import plan

SUCCESS = [Metric("success")]


def counted(successes, of):
    """A table of so many successes, every agent with as many rollouts."""
    rows = {
        (f"agent {row}", f"{row} {place}"): {"success": float(place < done)}
        for row, done in enumerate(successes)
        for place in range(of)
    }
    return ScoreTable.from_episodes(rows)


def means(columns, **scores):
    rows = {(agent, "1"): dict(zip(columns, own, strict=True)) for agent, own in scores.items()}
    return ScoreTable.from_episodes(rows)


def decided(proxy, target, metrics=SUCCESS, **asked):
    return decide(compare(proxy=proxy, target=target, metrics=metrics), Asked(**asked), None, 1)


def test_the_best_of_agents_is_told_with_its_probability_and_standard_errors_published_or_shared():
    found = decided(counted([5, 9], 10), counted([5, 9], 10))
    rng = np.random.default_rng(0)
    one, other = rng.beta(6, 6, 400_000), rng.beta(10, 2, 400_000)
    assert found.winner == "agent 1"
    assert found.probability_best == pytest.approx((other > one).mean(), abs=0.01)
    assert found.expected_regret["agent 1"] == pytest.approx(np.maximum(one - other, 0).mean(), abs=0.003)
    assert found.expected_regret["agent 0"] == pytest.approx(np.maximum(other - one, 0).mean(), abs=0.005)
    found = decided(counted([1, 20, 21, 22], 25), counted([1, 20, 21, 22], 25))
    kept = {found.winner, *found.not_told_apart}
    assert kept == {"agent 1", "agent 2", "agent 3"}
    assert sum(found.best_probabilities[agent] for agent in kept) >= 0.95
    assert not decided(counted([1, 24], 25), counted([1, 24], 25)).not_told_apart
    target = ScoreTable(("a", "b"), ("1",), ("success",), np.array([[[0.5]], [[0.7]]]), np.array([[0.1], [0.1]]))
    found = decided(means(["success"], a=(0.5,), b=(0.7,)), target)
    assert found.probability_best == pytest.approx(0.921, abs=0.01)  # Φ(0.2 / (0.1 √2))
    rng = np.random.default_rng(3)
    values = np.array([0.0, 0.0, 3.0])[:, None, None] + rng.normal(size=(3, 2, 1))
    target = ScoreTable(("a", "b", "c"), ("1", "2"), ("success",), values).unpaired()
    assert decided(target, target).winner == "c"


def test_means_without_rollouts_give_the_observed_regret_also_where_less_is_better_or_ties():
    proxy, target = means(["success"], a=(0.9,), b=(0.8,)), means(["success"], a=(0.5,), b=(0.75,))
    found = decided(proxy, target)
    assert (found.winner, found.probability_best, found.best_probabilities) == ("b", None, None)
    assert found.observed.regret == found.expected_regret["a"] == 0.25
    assert "number of rollouts" in found.notes[0]
    assert decided(proxy, target, rollouts=100).probability_best > 0.99
    with pytest.raises(InputError, match="has each rollout; leave that out"):
        decided(*[rolled([0.8, 0.4], 60)] * 2, rollouts=3)
    proxy = means(["seconds"], a=(1.0,), b=(2.0,))
    found = decided(proxy, means(["seconds"], a=(5.0,), b=(4.0,)), [Metric("seconds", "min")])
    assert (found.winner, found.observed.proxy_winners, found.observed.regret) == ("b", ("a",), 1.0)
    proxy, target = means(["success"], a=(0.9,), b=(0.9,), c=(0.1,)), means(["success"], a=(0.5,), b=(0.7,), c=(0.1,))
    observed = decided(proxy, target).observed
    assert observed.agrees is None
    assert observed.regret == pytest.approx(0.2)


def test_agents_that_tie_without_noise_share_the_probability_to_be_the_best():
    table = table_of([[1.5] * 3, [1.5] * 3, [1.0] * 3])
    found = decided(table, table, [Metric("m")])
    assert found.best_probabilities == {"A0": 0.5, "A1": 0.5, "A2": 0.0}
    assert found.not_told_apart == ("A1",)


def test_the_interval_of_a_score_is_by_its_own_spread_over_starts_also_where_these_move_all_agents_alike():
    rng = np.random.default_rng(0)
    values = rng.normal(0.0, 3.0, 8) + 0.1 * rng.normal(size=(4, 8))
    table = table_of(values)
    found = decided(table, table, [Metric("m")])
    for row, (mean, (low, high)) in enumerate(found.scores.values()):
        own = stats.t.interval(0.95, 7, values[row].mean(), stats.sem(values[row]))
        assert (mean, low, high) == pytest.approx((values[row].mean(), *own))
    assert found.regret_interval["A0"][1] < 0.5


def test_tasks_also_by_their_starts_are_averaged_and_left_out_one_at_a_time_each_with_a_regret():
    proxy = means(["x", "y", "z"], a=(0.9, 0.1, 0.1), b=(0.2, 0.3, 0.3))
    target = means(["x", "y", "z"], a=(0.9, 0.0, 0.1), b=(0.1, 0.3, 0.3))
    found = decided(proxy, target, [Metric(name) for name in "xyz"])
    assert found.chosen_on == "mean of x, y, z"
    assert [panel.agrees for panel in found.tasks] == [True, True, True]
    assert [panel.proxy_winners for panel in found.without] == [("b",), ("a",), ("a",)]
    assert decided(proxy, target, [Metric(name) for name in "xyz"], decide_on="y").winner == "b"
    metrics = [Metric(name) for name in "xyz"]
    found = decided(target, target, metrics, rollouts=50)
    assert found.tasks[0].expected_regret["b"] == pytest.approx(0.77, abs=0.02)
    assert found.without[0].expected_regret["a"] == pytest.approx((0.31 + 0.19) / 2 - 0.01, abs=0.03)
    assert decided(target, target, metrics).tasks[0].expected_regret is None
    rows = {
        (agent, f"{task}/{place}"): {"success": float(place < done)}
        for agent, each in {"a": (9, 2), "b": (3, 5)}.items()
        for task, done in zip(("lift", "open"), each, strict=True)
        for place in range(10)
    }
    table = ScoreTable.from_episodes(rows)
    found = {panel.name: panel.expected_regret for panel in decided(table, table).tasks}
    assert found["lift"]["b"] > 0.4
    assert found["lift"]["a"] < 0.02
    assert found["open"]["a"] == pytest.approx(0.25, abs=0.04)


def test_the_regret_of_equal_agents_is_held_as_often_as_is_said(monkeypatch):
    monkeypatch.setattr(decision, "DRAWS", 1000)
    rng, held = np.random.default_rng(5), []
    for seed in range(150):
        values = (rng.random((4, 10)) < 0.5).astype(float)[..., None]
        table = ScoreTable(tuple("abcd"), tuple(map(str, range(10))), ("success",), values)
        found = decide(compare(proxy=table, target=table, metrics=SUCCESS), Asked(), None, seed)
        held += [low <= 1e-9 for low, _ in found.regret_interval.values()]
    assert np.mean(held) > 0.93


def test_the_mean_of_stages_of_one_episode_holds_the_truth_as_often_as_is_said(monkeypatch):
    monkeypatch.setattr(decision, "DRAWS", 1000)
    rng, stages, scores, regrets = np.random.default_rng(6), [Metric("reached"), Metric("placed")], [], []
    for _ in range(200):
        rates = rng.uniform(0.2, 0.9, (4, 1)) ** [0.8, 1.25]
        values = (rng.random((4, 25, 1)) < rates[:, None, :]).astype(float)
        table, truth = table_of(values, metrics=("reached", "placed")), rates.mean(axis=1)
        found, regret = decided(table, table, stages), truth.max() - truth
        scores += [low <= own <= high for own, (_, (low, high)) in zip(truth, found.scores.values(), strict=True)]
        spans = found.regret_interval.values()
        regrets += [low - 1e-9 <= own <= high for own, (low, high) in zip(regret, spans, strict=True)]
        assert 0.0 <= found.draws.min() <= found.draws.max() <= 1.0
    assert np.mean(scores) >= 0.93  # 0.86 where stages are drawn each by itself
    assert np.mean(regrets) >= 0.93
    cells = table_of(np.sort(values, axis=1)[:, ::-1], metrics=("reached", "placed"))
    found = {name: decided(one, one, stages).least_told for name, one in (("rows", table), ("cells", cells))}
    assert found["cells"] < 0.9 * found["rows"]


def test_repeats_of_a_start_that_always_turn_out_alike_make_nobody_surer():
    fixed = np.array([[1, 1, 0, 1, 1, 1], [0, 1, 0, 1, 0, 0]], dtype=float)
    labels = tuple(f"{start}/{repeat}" for start in range(6) for repeat in range(5))
    table = ScoreTable(("a", "b"), labels, ("success",), np.repeat(fixed, 5, axis=1)[..., None])
    inputs, once = (compare(proxy=one, target=one, metrics=SUCCESS) for one in (table, by_start(table)))
    many, few = decide(inputs, Asked(), None, 1), decide(once, Asked(), None, 1)
    assert many.best_probabilities == pytest.approx(few.best_probabilities)
    assert many.scores["a"][1] == pytest.approx(few.scores["a"][1])
    assert many.regret_interval["b"] == pytest.approx(few.regret_interval["b"])
    rates = [success_rates(one)[0].target["a"] for one in (inputs, once)]
    assert rates[0].low == pytest.approx(rates[1].low)
    assert rates[0].episodes == 30
    assert plan(many, bound=0.001, made=np.full(2, 30.0), scale=1.0).total > 0
    rng = np.random.default_rng(0)
    rolled_anew = table_of((rng.random((2, 30)) < 0.5).astype(float), metrics=("success",))
    assert independence(rolled_anew, 0).tolist() == [1.0, 1.0]
    values = (rng.random((40, 30, 1)) < 0.5).astype(float)
    chance_alone = ScoreTable(tuple(map(str, range(40))), labels, ("success",), values)
    assert independence(chance_alone, 0).min() > 0.8


def test_the_expected_regret_is_within_its_interval_also_where_few_draws_have_any():
    table = table_of([[0.0, 0.5, 1.0], [2.4, 2.7, 3.4], [0.1, 0.2, 1.1]])
    found = decided(table, table, [Metric("m")])
    assert found.expected_regret["A1"] > 0.0
    for agent, (low, high) in found.regret_interval.items():
        assert low <= found.expected_regret[agent] <= high


@pytest.mark.parametrize("direction", ["max", "min"])
def test_the_regret_of_an_agent_that_never_succeeded_may_be_all_that_there_is(direction):
    """The uniform prior alone holds that of rates of 1 and 0 after 10 rollouts in half of the cases."""
    scores = counted([10, 0, 5], 10)
    found = decided(scores, scores, [Metric("success", direction)])
    worst = "agent 1" if direction == "max" else "agent 0"
    assert found.regret_interval[worst][1] >= 1.0
    assert found.regret_interval["agent 2"][1] < 0.9


def test_an_interval_holds_its_own_rate_of_rollouts_stated_or_of_several_tasks_at_the_end_of_what_can_be():
    stated = means(["success"], a=(1.0,), b=(0.0,))
    found, made = decided(stated, stated, rollouts=20), decided(counted([20, 0], 20), counted([20, 0], 20))
    for agent, old in (("a", "agent 0"), ("b", "agent 1")):
        assert found.scores[agent][1] == pytest.approx(made.scores[old][1])
        assert found.regret_interval[agent] == pytest.approx(made.regret_interval[old], abs=0.01)
    tasks = [Metric("x"), Metric("y")]
    rolled = table_of(np.repeat([[1.0], [0.0]], 20, axis=1)[..., None] * [1.0, 1.0], metrics=("x", "y"))
    found = decided(rolled, rolled, tasks)
    assert found.scores["A0"][1] == (pytest.approx(0.902, abs=0.001), 1.0)
    assert found.scores["A1"][1] == (0.0, pytest.approx(0.098, abs=0.001))
    assert found.regret_interval["A1"][1] >= 1.0


def test_a_mean_without_its_error_has_no_interval_and_nobody_a_probability():
    values, errors = np.array([[[0.6]], [[0.62]], [[0.5]]]), np.array([[0.1], [0.0], [0.1]])
    target = ScoreTable(tuple("abc"), ("1",), ("success",), values, errors)
    found = decided(target, target)
    assert (found.winner, found.probability_best, found.scores) == ("b", None, None)
    assert found.notes == (found.reason,)
    assert "no standard error above 0, nor the number of rollouts, of b: no probability" in found.reason
    assert decided(target, target, rollouts=30).scores["b"][1][0] < 0.5


@pytest.mark.parametrize(
    ("asked", "complaint"),
    [({"rollouts": 0}, "rollouts must be"), ({"bound": 0.0}, "above 0"), ({"decide_on": "succes"}, "did you mean")],
)
def test_what_cannot_be_asked_is_said(asked, complaint):
    with pytest.raises(InputError, match=complaint):
        decided(counted([1, 2], 4), counted([1, 2], 4), **asked)


def test_chance_of_up_to_seven_agents_is_exact_and_not_below_one_in_all_orders():
    for agents, orders in ((2, 2), (3, 6), (4, 24), (5, 120), (7, 5040)):
        table = means(["success"], **{f"a{row}": (row / 10,) for row in range(agents)})
        found = chance(compare(proxy=table, target=table, metrics=SUCCESS))
        assert (found.p_value, found.permutations, found.exact) == (pytest.approx(1 / orders), orders, True)
    table = means(["success"], **{f"a{row}": (row / 10,) for row in range(8)})
    assert not chance(compare(proxy=table, target=table, metrics=SUCCESS)).exact


def test_mmrv_has_every_published_convention():
    proxy = means(["success"], a=(0.9,), b=(0.8,), c=(0.8,))
    target = means(["success"], a=(0.5,), b=(0.75,), c=(0.45,))
    found = mmrv_conventions(compare(proxy=proxy, target=target, metrics=SUCCESS))["success"]
    thrice = {"simpler": 0.25 + 0.3, "strictly_less": 0.25 + 0.25 + 0.3, "sign_product": 0.25 + 0.25, "proxy_gap": 0.2}
    assert found == pytest.approx({name: value / 3 for name, value in thrice.items()})


def rolled(rates, rollouts, seed=0):
    values = (np.random.default_rng(seed).random((len(rates), rollouts)) < np.array(rates)[:, None]).astype(float)
    return table_of(values, metrics=("success",))


def looked_at(target, proxy):
    return sequential_test(compare(proxy=proxy, target=target, metrics=SUCCESS))


def test_a_winner_is_shown_before_the_end_and_sooner_with_a_proxy():
    target = rolled([0.9, 0.3], 60)
    found = looked_at(target, target)
    assert found.winner == "A0"
    assert 5 < found.decided_at < 60
    target = rolled([0.5, 0.5], 60)
    assert looked_at(target, target).winner is None
    found = looked_at(rolled([0.7, 0.5, 0.3], 20), rolled([0.7, 0.5, 0.3], 500, seed=9))
    assert found.expected_rounds["with proxy"] <= found.expected_rounds["without proxy"]
    both = looked_at(rolled([0.8, 0.4], 60), table_of([[1.5, 1.5], [0.5, 0.5]], metrics=("success",))).expected_rounds
    assert both["with proxy"] == pytest.approx(both["without proxy"], rel=0.4)


def test_equal_agents_are_told_apart_no_oftener_where_each_start_is_repeated_with_one_outcome(monkeypatch):
    monkeypatch.setattr(sequential, "PATHS", 1)
    rng, wrong = np.random.default_rng(8), 0
    labels = tuple(f"{start}/{repeat}" for start in range(40) for repeat in range(4))
    for _ in range(60):
        values = np.repeat(rng.random((2, 40)) < 0.5, 4, axis=1).astype(float)[..., None]
        target = ScoreTable(("a", "b"), labels, ("success",), values)
        found = looked_at(target, target.unpaired())
        wrong += found.winner is not None
    assert wrong <= 6  # 40 where each repeat is bet on
    assert (found.rounds, found.independent) == (40, 0.25)


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ([[5.0, 1.0], [0.0, 1.0]], "goes beyond 0 and 1"),
        ([[1.0], [0.0]], "row per rollout"),
        ([[1.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]], "sorted by value"),
    ],
)
def test_what_bears_no_test_is_refused(values, complaint):
    table = table_of(values, metrics=("success",))
    with pytest.raises(ScoresError, match=complaint):
        looked_at(table, table)


def planned(successes, of, bound, scale=1.0):
    target = table_of([[1.0] * done + [0.0] * (of - done) for done in successes], metrics=("success",))
    found = decide(compare(proxy=target, target=target, metrics=SUCCESS), Asked(), None)
    return plan(found, bound=bound, made=np.full(len(successes), float(of)), scale=scale)


def test_a_plan_asks_for_the_agents_that_may_be_best_more_for_a_smaller_bound_and_none_when_decided():
    found = planned([2, 18, 20, 3], 25, 0.02)
    assert set(found.rollouts) == {"A1", "A2"}
    assert found.regret_bound > 0.02
    assert not planned([2, 25, 3, 3], 25, 0.05).rollouts
    assert planned([11, 14], 25, None, 0.4).total > planned([11, 14], 25, 0.05).total > 0
    assert "too much alike" in planned([2500, 2500], 5000, 1e-6).reason


def scattered(middles, spreads, seed, of=10):
    """A table of agents whose scores scatter so widely each, from starts of their own."""
    rng = np.random.default_rng(seed)
    values = np.array(middles)[:, None] + np.array(spreads)[:, None] * rng.normal(size=(len(middles), of))
    names = tuple(f"agent {row}" for row in range(len(middles)))
    return ScoreTable(names, tuple(map(str, range(of))), ("success",), values[..., None]).unpaired()


def test_agents_that_scatter_unlike_are_told_apart_each_by_its_own_spread():
    """With one spread for all, two equal noisy agents were "best" by 0.95 in a third of tables, quiet ones in none."""
    tables = [scattered([0.0, 0.0, *[-3.0] * 6], [1.0, 1.0, *[0.05] * 6], seed) for seed in range(60)]
    sure = [decided(one, one).probability_best > 0.95 for one in tables]
    assert np.mean(sure) < 0.17  # 0.1 is expected of two that are equal
    tables = [scattered([0.0, 0.03, 0.5, 0.6], [0.005, 0.005, 0.1, 0.1], seed) for seed in range(20)]
    quiet = [decided(one, one, [Metric("success", "min")]) for one in tables]
    assert np.mean([one.winner == "agent 0" and one.probability_best > 0.95 for one in quiet]) > 0.8


def test_spreads_that_differ_no_more_than_chance_are_pooled():
    own, degrees = np.array([1.0, 1.2, 0.9, 1.1]), np.full(4, 9.0)
    moderated, common = decision.moderate(own, degrees, 1.05)
    assert (moderated.tolist(), common) == ([1.05] * 4, np.inf)
    rng = np.random.default_rng(5)
    true = 1.0 / rng.gamma(2.0, 1.0, 400)  # inverse gamma: 4 degrees of freedom
    moderated, common = decision.moderate(true * rng.chisquare(6, 400) / 6, np.full(400, 6.0), 1.0)
    assert common == pytest.approx(4.0, rel=0.35)
    assert np.abs(np.log(moderated / true)).mean() < 0.85 * np.abs(np.log(rng.chisquare(6, 400) / 6)).mean()
