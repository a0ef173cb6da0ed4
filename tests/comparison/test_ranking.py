import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from proxytune.comparison.ranking import AGENTS, METRICS, Ranking
from proxytune.search import from_unit, to_unit
from proxytune.search.engine import design_point
from proxytune.usefulness.pairs import prpv

OBJECTIVE = Ranking()


@settings(derandomize=True, max_examples=20, deadline=None)
@given(seed=st.integers(0, 1000), unit=st.tuples(*[st.floats(0, 1)] * 4))
def test_the_score_is_prpv_of_its_episodes_and_what_is_composed_of_its_outcome(seed, unit):
    values = from_unit(OBJECTIVE.space, np.array(unit))
    score = OBJECTIVE.score(values, seed)
    tables = {"proxy": OBJECTIVE.table(values, seed), "target": OBJECTIVE.target(seed)}
    assert score == prpv(**tables, metrics=METRICS).value == OBJECTIVE.score(values, seed)
    outcomes = np.array([OBJECTIVE.outcome(values, seed)] * 3).reshape(3, 1, -1)
    assert np.array_equal(OBJECTIVE.goal(seed).compose(outcomes), np.full((3, 1), score))


@settings(derandomize=True, max_examples=20, deadline=None)
@given(seed=st.integers(0, 1000))
def test_the_optimum_lies_in_the_box_and_has_no_regret_and_no_error(seed):
    optimum = OBJECTIVE.truth(seed)
    assert OBJECTIVE.regret(optimum, seed) == OBJECTIVE.fresh_regret(optimum, seed) == 0.0
    assert OBJECTIVE.error(optimum, seed) == pytest.approx(0.0)
    assert all(0.2 <= unit <= 0.8 for unit in to_unit(OBJECTIVE.space, optimum))


def test_the_floor_is_about_what_the_optimum_scores_on_its_episodes():
    scores = [OBJECTIVE.score(OBJECTIVE.truth(seed), seed) for seed in range(60)]
    assert np.mean(scores) == pytest.approx(OBJECTIVE.tolerance, rel=0.3)


def test_few_points_of_the_box_are_within_the_floor_and_most_are_far_off():
    regrets = [
        OBJECTIVE.regret(design_point(OBJECTIVE.space, index, 7), seed) for seed in (1, 2) for index in range(64)
    ]
    assert np.mean(np.array(regrets) <= OBJECTIVE.tolerance) < 0.05
    assert AGENTS * (AGENTS - 1) / 6 < np.median(regrets) < AGENTS * (AGENTS - 1) / 2


def test_the_noise_is_drawn_anew_at_every_point_and_seed():
    one, other = ((0.05, 20.0, 0.1, trim) for trim in (0.1, 0.1 + 1e-12))
    noise = [OBJECTIVE.table(values, 1).means - OBJECTIVE.means(values, 1) for values in (one, other)]
    assert np.abs(noise[0] - noise[1]).min() > 0
    assert OBJECTIVE.truth(1) != OBJECTIVE.truth(2)
