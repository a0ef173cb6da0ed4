import numpy as np
from hypothesis import given, settings, strategies as st

from proxytune.comparison.calibrated import COMPARED, LONGEST, METRICS, Calibrated, replaced
from proxytune.comparison.courses import course, simulated
from proxytune.search import from_unit, to_unit
from proxytune.search.engine import design_point
from proxytune.usefulness import prpv_of_means

OBJECTIVE = Calibrated()
BOX_POINTS = [design_point(OBJECTIVE.space, index, 7) for index in range(64)]


@settings(derandomize=True, max_examples=15, deadline=None)
@given(seed=st.integers(0, 1000), unit=st.tuples(*[st.floats(0, 1)] * 4))
def test_the_score_is_what_its_outcome_is_composed_to_and_prpv_of_two_metrics(seed, unit):
    values = from_unit(OBJECTIVE.space, np.array(unit))
    outcome, goal = np.array(OBJECTIVE.outcome(values, seed)), OBJECTIVE.goal(seed)
    means = [outputs.reshape(12, len(METRICS))[:, :2] for outputs in (outcome, goal.values)]
    assert OBJECTIVE.score(values, seed) == goal.compose(outcome) == prpv_of_means(*means, COMPARED)


def test_the_goal_has_every_agents_every_metric_with_the_noise_that_was_measured():
    goal = OBJECTIVE.goal(1)
    assert len(goal.outputs) == 12 * len(METRICS) == len(OBJECTIVE.outcome(BOX_POINTS[0], 1))
    assert goal.outputs[:2] == (("stroller", "distance"), ("stroller", "survival_time"))
    assert np.array_equal(goal.noise, (simulated().placements ** 2).mean(axis=0))
    assert (goal.noise >= 0.0).all()
    assert np.median(goal.noise) > 0.0


def test_a_course_passes_the_simulated_points_as_closely_as_their_roughness_says():
    known = simulated()
    for seed in (1, 2):
        apart = [course(seed)(point) - row for point, row in zip(known.points, known.standardised, strict=True)]
        assert 0.5 < np.std(apart) / np.sqrt(known.roughness) < 1.5
    away = np.std([course(seed)(np.full(4, 0.5)) for seed in range(30)], axis=0)
    assert away[known.smooth > 0.0].min() > 0.0, "between the points seeds differ"


def test_the_truth_lies_in_the_middle_of_the_box_and_has_no_regret_and_no_error():
    for seed in range(20):
        truth = OBJECTIVE.truth(seed)
        assert OBJECTIVE.regret(truth, seed) == OBJECTIVE.fresh_regret(truth, seed) == 0.0
        assert OBJECTIVE.error(truth, seed) == 0.0
        assert all(0.1 <= unit <= 0.9 for unit in to_unit(OBJECTIVE.space, truth))


def test_the_truth_scores_about_what_it_does_in_the_simulator_and_few_other_points_do():
    """There the proxy at 24 θ, against other placements of itself, scored 6.2 on average."""
    scores = [OBJECTIVE.score(OBJECTIVE.truth(seed), seed) for seed in range(40)]
    assert 4.0 < np.mean(scores) < 9.0
    regrets = [OBJECTIVE.regret(values, seed) for seed in (1, 2) for values in BOX_POINTS]
    assert np.mean(np.array(regrets) <= OBJECTIVE.tolerance) < 0.05
    assert np.median(regrets) > 20.0


def test_as_many_agents_are_tied_at_the_end_as_in_the_simulator():
    survival = np.array([OBJECTIVE.outcome(values, 1) for values in BOX_POINTS]).reshape(-1, 12, len(METRICS))[:, :, 1]
    there = simulated().means.reshape(-1, 12, len(METRICS))[:, :, 1]
    assert survival.max() == LONGEST
    assert abs((survival == LONGEST).mean() - (there == LONGEST).mean()) < 0.1


def test_another_placement_stops_nobody_who_is_not_stopped_and_changes_the_others_as_simulated():
    means = np.array(OBJECTIVE.outcome(BOX_POINTS[3], 1))
    fresh = replaced(means, 50, np.random.default_rng(0)).reshape(50, 12, len(METRICS))
    tied = means.reshape(12, len(METRICS))[:, 1] == LONGEST
    assert tied.any()
    assert not tied.all()
    assert (fresh[:, tied, 1] == LONGEST).all()
    assert (fresh[:, ~tied, 1].std(axis=0) > 0.0).all()


def test_everything_is_drawn_from_seed_and_point_alone():
    one, other = BOX_POINTS[:2]
    assert OBJECTIVE.outcome(one, 1) == Calibrated().outcome(one, 1)
    assert OBJECTIVE.fresh_score(one, 1) == Calibrated().fresh_score(one, 1)
    assert OBJECTIVE.outcome(one, 1) != OBJECTIVE.outcome(one, 2)
    assert OBJECTIVE.outcome(one, 1) != OBJECTIVE.outcome(other, 1)
    assert OBJECTIVE.truth(1) != OBJECTIVE.truth(2)
