"""The process over learning curves follows the scores of all repetitions, and is as unsure as they are."""

import numpy as np
import pytest

from proxytune.learning.curve_model import Marks, counts_at, fit_curve_model, places

REPETITIONS = 6
AT = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0])


def marks(noise, curves=2, seed=0):
    """Curve 0 rises from 10 to 50, curve 1 is 30 everywhere; `noise` is that of each place."""
    generator = np.random.default_rng(seed)
    rows = [(c, r, p) for c in range(curves) for r in range(REPETITIONS) for p in range(len(AT))]
    curve, repetition, place = np.array(rows).T
    mean = np.where(curve == 0, 10.0 + 40.0 / (1.0 + np.exp(-2.0 * (AT[place] - 2.5))), 30.0)
    return Marks(curve, repetition, AT[place], mean + np.asarray(noise)[place] * generator.normal(size=len(rows)))


def test_no_samples_the_first_count_and_each_doubling_are_about_one_apart_and_turn_back_into_counts():
    counts = np.array([0.0, 50.0, 100.0, 3200.0])
    assert places(counts, 50.0)[:2].tolist() == [0.0, 1.0]
    assert places(np.array([3200.0, 6400.0]), 50.0) == pytest.approx([6.02, 7.01], abs=0.01)
    assert counts_at(places(counts, 50.0), 50.0) == pytest.approx(counts)


def test_the_mean_curves_are_where_the_scores_are_and_surer_there_than_between_curves():
    model = fit_curve_model(marks(np.full(6, 2.0)))
    mean, covariance = model.mean_curves(np.array([0, 0, 1]), np.array([0.0, 5.0, 2.5]))
    assert mean == pytest.approx([10.3, 49.7, 30.0], abs=2.5)
    assert np.sqrt(np.diag(covariance)).max() < 2.0
    _, far = model.mean_curves(np.array([0]), np.array([9.0]))
    assert far[0, 0] > 4.0 * covariance.diagonal().max()


def test_one_more_score_is_expected_to_differ_more_where_scores_do():
    model = fit_curve_model(marks([0.5, 0.5, 8.0, 8.0, 0.5, 0.5]))
    quiet, loud = model.noise_at(np.array([0, 0]), np.array([0.0, 2.5]))
    assert loud > 4.0 * quiet


def test_what_a_repetition_does_to_every_learner_is_no_noise_that_more_curves_average_out():
    generator = np.random.default_rng(3)
    plain = marks(np.full(6, 0.5), curves=2)
    together = plain.score + 6.0 * generator.normal(size=6)[plain.repetition]
    moved = Marks(plain.curve, plain.repetition, plain.place, together)
    models = [fit_curve_model(one) for one in (plain, moved)]
    before, after = (float(one.mean_curves(np.array([1]), np.array([2.5]))[1][0, 0]) for one in models)
    assert np.sqrt(after) > 1.5 > np.sqrt(before)


@pytest.mark.parametrize("score", [0.0, 60.0])
def test_scores_that_are_all_the_same_are_fitted_without_complaint(score):
    rows = marks(np.zeros(6))
    model = fit_curve_model(Marks(rows.curve, rows.repetition, rows.place, np.full(len(rows.score), score)))
    mean, covariance = model.mean_curves(np.array([0, 1]), np.array([1.0, 2.5]))
    assert mean == pytest.approx([score, score])
    assert np.isfinite(covariance).all()


def test_one_repetition_leaves_the_mean_curves_near_their_scores():
    scores = np.array(
        [
            [50.2, 50.2, 54.2, 57.4, 56.4, 57.7, 58.7],
            [57.6, 55.7, 56.6, 58.1, 57.1, 57.9, 58.8],
            [-58.6, 8.9, 21.9, 34.8, 44.8, 51.8, 55.5],
            [51.3, 52.7, 54.1, 56.8, 57.2, 58.0, 58.9],
        ]
    )
    curve, at = np.indices(scores.shape).reshape(2, -1)
    model = fit_curve_model(Marks(curve, np.zeros(scores.size, dtype=int), at.astype(float), scores.ravel()))
    means, covariance = model.mean_curves(np.array([1, 2]), np.array([1.0, 1.0]))
    assert means[0] - means[1] > 20.0
    assert np.sqrt(np.diag(covariance)).min() > 2.0
