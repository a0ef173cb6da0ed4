import numpy as np
import pytest
from steps import SPACE, search, steps

from proxytune.errors import RunError
from proxytune.search import Trial, fit_surrogate, make_proposer, unit_array
from proxytune.search.engine import design_point


@pytest.mark.slow
def test_it_never_proposes_a_point_twice_even_on_a_flat_score():
    trials = search(make_proposer("gp", 4), 25, seed=1, score=lambda values: 3.0)
    units = np.array([[v / 0.3 for v in trial.values] for trial in trials])
    distances = np.abs(units[:, None] - units[None]).max(axis=2) + np.eye(len(units))
    assert distances.min() > 1e-3


@pytest.mark.slow
def test_it_finds_the_lowest_step_that_the_design_alone_misses():
    lowest = [min(trial.score for trial in search(make_proposer("gp", 6), 18, seed=seed)) for seed in range(4)]
    design = [min(steps(design_point(SPACE, index, seed)) for index in range(18)) for seed in range(4)]
    assert np.mean(lowest) < np.mean(design)
    assert max(lowest) <= 1


@pytest.mark.parametrize("seed", [0, 2**53])
def test_any_seed_of_a_study_can_be_used(seed):
    assert search(make_proposer("gp", 3), 5, seed)[4].score >= 0


def visited(count, score=steps):
    points = [design_point(SPACE, index, 5) for index in range(count)]
    return [Trial(values, score(values)) for values in points]


def test_the_posterior_is_the_same_to_the_last_bit_in_whatever_order_trials_are_given():
    trials = visited(15)
    there, back = fit_surrogate(SPACE, trials), fit_surrogate(SPACE, trials[::-1])
    assert np.array_equal(there.predict(np.eye(2)), back.predict(np.eye(2)))


def test_the_incumbent_is_not_the_luckiest_and_points_are_of_the_unit_cube():
    """One freak zero among high scores does not win over a valley of low ones."""
    trials = visited(40)
    lucky = Trial(tuple(value + 1e-3 for value in max(trials, key=lambda trial: trial.score).values), 0.0)
    values, mean = fit_surrogate(SPACE, [*trials, lucky]).incumbent()
    assert values != lucky.values
    assert steps(values) <= 3
    assert mean < 5
    assert np.allclose(unit_array(SPACE, [(0.0, -0.3), (0.3, 0.0)]), [[0.0, 0.0], [1.0, 0.5]])
    assert unit_array(SPACE, []).shape == (0, 2)


def test_noise_never_vanishes_length_scales_keep_off_their_bounds_and_failed_trials_are_left_out():
    surrogate = fit_surrogate(SPACE, visited(30, lambda values: 10 * values[0]))
    assert surrogate.model.noise_ > 0.0099
    surrogate = fit_surrogate(SPACE, [trial for trial in visited(30) if trial.values[0] < 0.15])
    _, at_trials = surrogate.at_visited()
    _, elsewhere = surrogate.predict(np.array([[1.0, 0.0], [1.0, 1.0]]))
    assert at_trials.max() < elsewhere.min()
    # Fitted without a prior, some of these are at 0.05 or at 20 widths of the box.
    for seed in range(5):
        scores = np.random.default_rng(seed).integers(0, 30, 10).tolist()
        trials = [Trial(design_point(SPACE, index, seed), float(score)) for index, score in enumerate(scores)]
        scales = fit_surrogate(SPACE, trials).model.kernel_.k1.k2.length_scale
        assert 0.1 < min(scales) <= max(scales) < 1.6
    trials = visited(9)
    assert len(fit_surrogate(SPACE, [*trials, Trial((0.1, 0.1), None)]).visited) == 9
    with pytest.raises(RunError, match="no trial has a score"):
        fit_surrogate(SPACE, [Trial((0.1, 0.1), None)])


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_few_trials_or_equal_scores_still_give_finite_predictions(count):
    for score in (steps, lambda values: 4.0):
        mean, deviation = fit_surrogate(SPACE, visited(count, score)).predict(np.array([[0.3, 0.7]]))
        assert np.isfinite(mean).all()
        assert np.isfinite(deviation).all()
