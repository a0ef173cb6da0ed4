"""The test after each rollout, and the plan of rollouts to come."""

import numpy as np
import pytest
from score_tables import table_of

from proxytune.errors import ScoresError
from proxytune.scores import Metric
from proxytune.usefulness import Asked, compare, decide, sequential_test
from proxytune.usefulness.sequential import plan

SUCCESS = [Metric("success")]


def rolled(rates, rollouts, seed=0):
    rng = np.random.default_rng(seed)
    values = (rng.random((len(rates), rollouts)) < np.array(rates)[:, None]).astype(float)
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


def planned(successes, of, bound):
    target = table_of([[1.0] * done + [0.0] * (of - done) for done in successes], metrics=("success",))
    found = decide(compare(proxy=target, target=target, metrics=SUCCESS), Asked(), None)
    return plan(found, bound=bound, made=np.full(len(successes), float(of)), scale=1.0)


def test_a_plan_asks_for_the_agents_that_may_be_best_and_for_none_when_it_is_decided():
    found = planned([2, 18, 20, 3], 25, 0.02)
    assert set(found.rollouts) == {"A1", "A2"}
    assert found.regret_bound > 0.02
    assert not planned([2, 25, 3, 3], 25, 0.05).rollouts


def test_a_smaller_bound_takes_more_rollouts_and_agents_too_much_alike_are_told():
    assert planned([11, 14], 25, 0.02).total > planned([11, 14], 25, 0.05).total > 0
    assert "too much alike" in planned([2500, 2500], 5000, 1e-6).reason
