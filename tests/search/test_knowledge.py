"""What is known of θ after a search: the truth is inside, who tells what is told, and nothing depends on order."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from steps import SPACE, goal

from proxytune.search import Trial, fit_surrogate, from_unit, importances, learn_theta, to_unit
from proxytune.search.engine import design_point
from proxytune.search.posterior import Misfit, posterior_of
from proxytune.space import Interval, Space

IMPORTANCE_SPACE = Space((Interval("strong", 0.0, 1.0), Interval("weak", -1.0, 1.0), Interval("dead", 0.0, 5.0)))


def found(score, count):
    points = [design_point(IMPORTANCE_SPACE, index, 5) for index in range(count)]
    return importances(fit_surrogate(IMPORTANCE_SPACE, [Trial(point, score(point)) for point in points]))


def planted(values):
    """A sum whose terms have variances 400/12 and 100/12 over the box: shares 0.8 and 0.2."""
    return 20.0 * values[0] + 5.0 * values[1]


def test_shares_are_those_of_terms_or_of_parameters_together_and_next_to_none_of_a_dead_one():
    for importance, share in zip(found(planted, 60), (0.8, 0.2, 0.0), strict=True):
        assert importance.share == pytest.approx(share, abs=0.02)
        assert importance.alone == pytest.approx(importance.share, abs=0.02)
    strong, weak, dead = found(lambda values: 30.0 * (values[0] - 0.5) * values[1], 60)
    assert min(strong.share, weak.share) > 0.9
    assert max(strong.alone, weak.alone) < 0.1
    assert dead.share < 0.05
    noise = np.random.default_rng(1)
    strong, weak, dead = found(lambda values: planted(values) + noise.normal(0.0, 2.0), 60)
    assert dead.share < 0.05
    assert dead.interval[1] < 0.15
    assert dead.interval[1] < weak.interval[0] < weak.interval[1] < strong.interval[0]
    for importance in found(lambda values: 4.0, 8):
        assert importance.share == importance.alone == 0.0
        assert importance.interval[1] > 0.5


def test_the_interval_holds_the_planted_share_and_narrows_with_trials():
    noise = np.random.default_rng(2)
    few, many = (found(lambda values: planted(values) + noise.normal(0.0, 2.0), count)[:2] for count in (12, 60))
    for importance, share in zip((*few, *many), (0.8, 0.2, 0.8, 0.2), strict=True):
        assert importance.interval[0] <= share <= importance.interval[1]
    for wide, narrow in zip(few, many, strict=True):
        assert np.diff(narrow.interval) < np.diff(wide.interval)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_after_a_few_trials_shares_are_still_shares(count):
    for importance in found(planted, count):
        low, high = importance.interval
        assert 0.0 <= low <= importance.share <= high <= 1.0
        assert 0.0 <= importance.alone <= importance.share


SENSITIVE = np.array([[3.0, 0.0], [0.0, 3.0], [2.0, 2.0], [1.0, -2.0]])
"""What an agent's output makes of each parameter: the first sees the delay alone, the second the trim alone."""


def outputs(values, seed=0):
    return np.sin(SENSITIVE @ to_unit(SPACE, values)) + np.random.default_rng(seed).normal(0.0, 0.02, 4)


def truth_of(seed):
    return from_unit(SPACE, np.random.default_rng(seed).uniform(0.2, 0.5, 2))


def known(seed, count=14, lost=()):
    target = outputs(truth_of(seed), 1000 + seed)
    target[list(lost)] = np.nan

    def compose(found):
        return np.abs(found - outputs(truth_of(seed), 1000 + seed)).sum(axis=-1)

    points = [design_point(SPACE, index, seed) for index in range(count)]
    told = [outputs(values, 50 * seed + row) for row, values in enumerate(points)]
    trials = [Trial(v, float(compose(o)), tuple(o.tolist())) for v, o in zip(points, told, strict=True)]
    return learn_theta(SPACE, trials, goal(compose, target, 2 * 0.02**2), seed)


@pytest.mark.slow
def test_the_region_holds_the_truth_and_is_small():
    found = [known(seed) for seed in range(20)]
    assert sum(one.holds(truth_of(seed)) for seed, one in enumerate(found)) >= 18
    assert np.median([one.posterior.share for one in found]) < 0.10
    for one in found:
        assert {name: low < high for name, (low, high) in one.intervals.items()} == {"delay": True, "trim": True}


def test_the_region_ends_where_the_box_does():
    one = known(3)
    # Of a flat density every θ would be in the region.
    vars(one).update(_posterior_if_it_fits=posterior_of(lambda points: np.zeros(len(points)), 2))
    vars(one).update(likelihood=SimpleNamespace(log=lambda points: np.zeros(len(points))), misfit=Misfit(1.0, 1.0, 0.5))
    ends = [(box.low, box.high) for box in SPACE.intervals]
    assert all(one.holds(corner) for corner in itertools.product(*ends))
    assert not one.holds((ends[0][1] + 1e-9, ends[1][0]))
    assert not one.holds((ends[0][0], ends[1][0] - 1e-9))


def test_the_answer_has_the_lowest_expected_score_with_what_is_as_good_and_who_tells_of_a_parameter():
    one = known(3)
    visited = [trial.values for trial in one.trials]
    assert one.answer in visited
    composed, _ = one.scores(visited)
    halves = {t.values: (t.score + c) / 2 for t, c in zip(one.trials, composed, strict=True)}
    assert one.expected == pytest.approx(halves)
    assert one.answer == min(halves, key=halves.__getitem__)
    share, ends = one.as_good
    assert 0.0 < share < 0.5
    for name, value in zip(SPACE.names, one.answer, strict=True):
        assert ends[name][0] <= value <= ends[name][1]
    delay, trim = known(3).information
    assert dict(delay.agents)["agent0"] > 0.3
    assert dict(delay.agents)["agent1"] < 0.02
    assert dict(trim.agents)["agent1"] > 0.3
    for one in (delay, trim):
        assert sum(share for _, share in one.agents) == pytest.approx(1.0)
    one = known(5)
    drawn = one.fresh_scores(one.answer)
    assert drawn.std() > 0.0
    assert np.percentile(drawn, 2.5) < one.expected[one.answer] < np.percentile(drawn, 97.5)


@pytest.mark.slow
def test_few_trials_limit_what_is_told_then_noise_and_without_any_output_it_is_unidentified():
    assert {one.limit for one in known(3, count=5).information} == {"trials"}
    assert {one.limit for one in known(3, count=48).information} == {"starts"}
    assert known(3, count=32, lost=(1, 2, 3)).unidentified == ("trim",)
    assert known(3).unidentified == ()
