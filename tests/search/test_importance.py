import numpy as np
import pytest

from proxytune.search.design import design_point
from proxytune.search.knowledge.importance import importances
from proxytune.search.proposer import Trial
from proxytune.search.surrogate import fit_surrogate
from proxytune.space import Interval, Space

SPACE = Space((Interval("strong", 0.0, 1.0), Interval("weak", -1.0, 1.0), Interval("dead", 0.0, 5.0)))


def found(score, count):
    points = [design_point(SPACE, index, 5) for index in range(count)]
    return importances(fit_surrogate(SPACE, [Trial(point, score(point)) for point in points]))


def planted(values):
    """A sum whose terms have variances 400/12 and 100/12 over the box: shares 0.8 and 0.2."""
    return 20.0 * values[0] + 5.0 * values[1]


def test_the_shares_of_a_sum_are_those_of_its_terms_variances():
    for importance, share in zip(found(planted, 60), (0.8, 0.2, 0.0), strict=True):
        assert importance.share == pytest.approx(share, abs=0.02)
        assert importance.alone == pytest.approx(importance.share, abs=0.02)


def test_a_dead_parameter_has_next_to_nothing_also_under_noise():
    noise = np.random.default_rng(1)
    strong, weak, dead = found(lambda values: planted(values) + noise.normal(0.0, 2.0), 60)
    assert dead.share < 0.05
    assert dead.interval[1] < 0.15
    assert dead.interval[1] < weak.interval[0] < weak.interval[1] < strong.interval[0]


def test_the_interval_holds_the_planted_share_and_narrows_with_trials():
    noise = np.random.default_rng(2)
    few, many = (found(lambda values: planted(values) + noise.normal(0.0, 2.0), count)[:2] for count in (12, 60))
    for importance, share in zip((*few, *many), (0.8, 0.2, 0.8, 0.2), strict=True):
        assert importance.interval[0] <= share <= importance.interval[1]
    for wide, narrow in zip(few, many, strict=True):
        assert np.diff(narrow.interval) < np.diff(wide.interval)


def test_parameters_that_count_only_together_have_all_the_share_and_none_alone():
    strong, weak, dead = found(lambda values: 30.0 * (values[0] - 0.5) * values[1], 60)
    assert min(strong.share, weak.share) > 0.9
    assert max(strong.alone, weak.alone) < 0.1
    assert dead.share < 0.05


def test_a_constant_score_gives_no_parameter_a_share_and_says_that_little_is_known():
    for importance in found(lambda values: 4.0, 8):
        assert importance.share == importance.alone == 0.0
        assert importance.interval[1] > 0.5


@pytest.mark.parametrize("count", [1, 2, 5])
def test_after_a_few_trials_shares_are_still_shares(count):
    for importance in found(planted, count):
        low, high = importance.interval
        assert 0.0 <= low <= importance.share <= high <= 1.0
        assert 0.0 <= importance.alone <= importance.share


def test_the_same_trials_in_another_order_give_the_same_importances():
    trials = [Trial(point, planted(point)) for point in (design_point(SPACE, index, 5) for index in range(9))]
    assert importances(fit_surrogate(SPACE, trials)) == importances(fit_surrogate(SPACE, trials[::-1]))
