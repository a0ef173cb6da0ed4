"""Both learners learn what pictures show, the same under the same seed, and cloning goes on from other weights."""

from dataclasses import replace

import numpy as np
import pytest
from leaning import error, pictures
from sklearn.neural_network import MLPRegressor

from proxytune.domain import Demonstration
from proxytune.errors import LearnerError
from proxytune.learning.cloning import BehaviourCloning, grey_cells
from proxytune.learning.ridge import RandomFeatures

SMALL = BehaviourCloning(rows=3, columns=4, hidden=(12,), steps=600, passes=10)
FEATURES = RandomFeatures(rows=3, columns=4, features=200)
each = pytest.mark.parametrize("learner", [SMALL, FEATURES], ids=["cloning", "ridge"])


@each
def test_it_learns_a_planted_steering_far_better_than_a_constant_would(learner):
    weights = learner.train(pictures(400, 1), None, 1)
    fresh = pictures(100, 2)
    assert error(learner, weights, fresh) < 0.1 * np.abs(fresh.commands - 0.3).mean()


@each
def test_the_same_seed_gives_the_same_weights_to_the_last_bit_and_another_does_not(learner):
    one, again, other = (learner.train(pictures(60, 1), None, seed) for seed in (1, 1, 2))
    assert all(np.array_equal(one[name], again[name]) for name in one)
    varied = "slopes" if learner is FEATURES else "weight0"
    assert not np.array_equal(one[varied], other[varied])


@pytest.mark.slow
def test_its_answer_is_that_of_scikit_learns_network():
    weights = SMALL.train(pictures(80, 1), None, 1)
    network = MLPRegressor(hidden_layer_sizes=SMALL.hidden, random_state=0)
    network.partial_fit(SMALL.features(pictures(80, 1).observations), np.zeros((80, 2)))
    network.coefs_ = [weights["weight0"], weights["weight1"]]
    network.intercepts_ = [weights["bias0"], weights["bias1"]]
    picture = pictures(1, 5).observations[0]
    expected = weights["centre"] + weights["spread"] * network.predict(SMALL.features(picture[None]))[0]
    assert SMALL.act(weights, picture) == pytest.approx(np.clip(expected, -1, 1), abs=1e-12)


@pytest.mark.slow
def test_starting_from_weights_a_few_samples_do_not_make_it_forget():
    start = SMALL.train(pictures(400, 1), None, 1)
    fresh = pictures(100, 2)
    one_sided = [place for place, command in enumerate(fresh.commands) if command[0] > 0.36][:8]
    few = Demonstration(fresh.observations[one_sided], fresh.commands[one_sided])
    tuned, scratch = SMALL.train(few, start, 1), SMALL.train(few, None, 1)
    assert not np.array_equal(tuned["weight0"], start["weight0"])
    assert error(SMALL, tuned, fresh) < 0.5 * error(SMALL, scratch, fresh)


@pytest.mark.parametrize("learner", [pytest.param(replace(SMALL, passes=100), marks=pytest.mark.slow), FEATURES])
def test_starting_from_weights_it_follows_samples_that_say_otherwise(learner):
    start = learner.train(pictures(400, 1), None, 1)
    turned = pictures(400, 4)
    turned = turned._replace(commands=turned.commands[:, ::-1].copy())
    assert error(learner, learner.train(turned, start, 1), turned) < 0.3 * error(learner, start, turned)


def test_training_leaves_what_it_started_from_and_one_sample_is_enough():
    start = SMALL.train(pictures(60, 1), None, 1)
    before = {name: values.copy() for name, values in start.items()}
    SMALL.train(pictures(60, 2), start, 1)
    assert all(np.array_equal(start[name], before[name]) for name in before)
    assert np.isfinite(SMALL.act(SMALL.train(pictures(1, 1), None, 1), pictures(1, 1).observations[0])).all()


@each
def test_no_sample_is_nothing_to_learn_from(learner):
    with pytest.raises(LearnerError, match="no sample"):
        learner.train(Demonstration(np.zeros((0, 12, 16, 3), np.uint8), np.zeros((0, 2))), None, 1)


@pytest.mark.parametrize(
    ("learner", "other", "says"),
    [
        (SMALL, replace(SMALL, hidden=(7,), steps=50), r"weight0 is \(12, 7\) where these samples need \(12, 12\)"),
        (FEATURES, replace(FEATURES, features=50), r"slopes is \(50, 2\) where these samples need \(200, 2\)"),
    ],
)
def test_weights_of_another_network_or_other_features_are_refused_with_both_shapes(learner, other, says):
    with pytest.raises(LearnerError, match=says):
        learner.train(pictures(30, 1), other.train(pictures(30, 1), None, 1), 1)


@pytest.mark.parametrize("learner", [SMALL, replace(SMALL, hidden=(7, 5)), replace(SMALL, rows=5, columns=7)])
def test_many_pictures_are_answered_to_the_bit_as_each_by_itself(learner):
    samples = pictures(33, 4)
    weights = learner.train(samples, None, 1)
    alone = np.array([learner.act(weights, picture) for picture in samples.observations])
    for count in (1, 2, 10, 33):
        np.testing.assert_array_equal(learner.act_many(weights, samples.observations[:count]), alone[:count])


def test_cells_are_means_of_grey_also_of_unequal_size():
    picture = np.zeros((1, 12, 16, 3), dtype=np.uint8)
    picture[0, :3] = 255
    picture[0, 3:6, :4] = (255, 0, 0)
    cells = grey_cells(picture, top=0.25, rows=3, columns=4)[0].reshape(3, 4)
    assert cells[0, 0] == pytest.approx(1 / 3 - 0.5)
    assert (np.delete(cells.ravel(), 0) == -0.5).all()
    picture = np.zeros((1, 5, 3, 3), dtype=np.uint8)
    picture[0, :2, :2] = 255
    assert grey_cells(picture, top=0.0, rows=2, columns=2)[0] == pytest.approx([0.5, -0.5, -0.5, -0.5])


@pytest.mark.parametrize("shape", [(2, 2, 3), (48, 64), (3, 16, 3)])
def test_pictures_of_the_wrong_size_are_one_line(shape):
    with pytest.raises(LearnerError, match="pictures have shape .*do not fit in; give"):
        grey_cells(np.zeros((1, *shape), dtype=np.uint8), top=0.25, rows=3, columns=4)
