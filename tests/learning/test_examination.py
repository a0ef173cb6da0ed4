"""Several episodes are examined at once where the classroom offers it, else one by one."""

from dataclasses import dataclass

import numpy as np
import pytest
from schoolroom import Matrix, Schoolroom
from wobbly import Wobbly

from proxytune.domain import make_episode
from proxytune.errors import EpisodeError
from proxytune.learning.examination import examine
from proxytune.learning.learner import policy_of

EPISODES = [make_episode({}, agent="pupil", start=start, seed=7) for start in range(4)]
WEIGHTS = {"matrix": np.ones((3, 2))}


@dataclass(frozen=True)
class Together(Schoolroom):
    """Adds a point, so that it is seen who has been asked; loses some scores."""

    lost: int = 0

    def examine_together(self, episodes, policy):
        return tuple(self.examine(episode, policy) + 1.0 for episode in episodes[self.lost :])


@dataclass(frozen=True)
class Unfinished:
    """Has no finite score from one of its starts."""

    inner: Wobbly
    score: float

    def examine(self, episode, policy):
        return self.score if episode.start == 2 else 1.0


@dataclass(frozen=True)
class Manifold(Matrix):
    def act_many(self, weights, observations):
        return observations @ weights["matrix"]


def test_a_classroom_is_asked_for_all_episodes_at_once_if_it_can_and_else_for_each():
    policy = policy_of(Matrix(), WEIGHTS)
    alone = [Schoolroom(Wobbly()).examine(episode, policy) for episode in EPISODES]
    assert examine(Schoolroom(Wobbly()), EPISODES, policy) == alone
    assert examine(Together(Wobbly()), EPISODES, policy) == [score + 1.0 for score in alone]


def test_missing_scores_are_told_in_one_line():
    with pytest.raises(EpisodeError, match="examine_together gave 3 scores for 4 episodes; give each its own"):
        examine(Together(Wobbly(), lost=1), EPISODES, policy_of(Matrix(), WEIGHTS))


@pytest.mark.parametrize("score", [np.nan, np.inf, -np.inf])
def test_a_score_that_is_no_finite_number_is_told_with_its_start(score):
    with pytest.raises(EpisodeError, match=r"the examination from start 2 gave -?(nan|inf); give a finite score"):
        examine(Unfinished(Wobbly(), score), EPISODES, policy_of(Matrix(), WEIGHTS))


def test_a_policy_answers_many_observations_at_once_only_if_its_learner_does():
    seen = np.arange(12.0).reshape(4, 3)
    one, many = policy_of(Matrix(), WEIGHTS), policy_of(Manifold(), WEIGHTS)
    assert not hasattr(one, "act_many")
    np.testing.assert_array_equal(many.act_many(seen), [one(row) for row in seen])
    np.testing.assert_array_equal(many(seen[0]), one(seen[0]))
