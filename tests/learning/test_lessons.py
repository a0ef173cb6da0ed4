"""Lessons give as many samples as asked for, from θ drawn as p(θ) says."""

import numpy as np
import pytest
from schoolroom import SAMPLES_PER_S, Schoolroom
from tightrope import Tightrope
from wobbly import Wobbly

from proxytune.errors import LearnerError
from proxytune.learning.lessons import Distribution, collect_samples

ROOM = Schoolroom(Wobbly())
WIDE = Distribution({"delay": (0.0, 0.3), "trim": (0.1, 0.1)})


def test_a_longer_answer_begins_with_every_shorter_one():
    short, long = (collect_samples(ROOM, WIDE, count=count, seed=4, lesson_s=1.0) for count in (17, 60))
    assert len(short.commands) == len(short.observations) == 17
    assert len(long.commands) == 60
    assert np.array_equal(long.observations[:17], short.observations)
    assert np.array_equal(long.commands[:17], short.commands)


def test_another_seed_is_taught_by_other_lessons():
    one, other = (collect_samples(ROOM, WIDE, count=20, seed=seed, lesson_s=1.0) for seed in (1, 2))
    assert not np.array_equal(one.commands, other.commands)


def test_theta_is_drawn_anew_for_every_lesson_and_only_where_it_is_free(tmp_path):
    thetas = []

    class Spying(Schoolroom):
        def demonstrate(self, episode, seconds):
            thetas.append(dict(episode.theta))
            return super().demonstrate(episode, seconds)

    collect_samples(Spying(Wobbly()), WIDE, count=20 * SAMPLES_PER_S, seed=1, lesson_s=1.0)
    delays = [theta["delay"] for theta in thetas]
    assert {theta["trim"] for theta in thetas} == {0.1}
    assert len(set(delays)) == len(delays) == 20
    assert 0.0 <= min(delays) < 0.1 < 0.2 < max(delays) <= 0.3


def test_a_distribution_without_width_is_one_theta():
    fixed = Distribution({"trim": (0.1, 0.1)})
    assert fixed.fixed
    assert not WIDE.fixed
    assert fixed.draw(1) == fixed.centre == {"trim": 0.1}
    assert WIDE.centre == {"delay": 0.15, "trim": 0.1}


@pytest.mark.parametrize("blocked", [0.7, 1.0])
def test_an_expert_that_cannot_drive_ends_it_with_where_and_how_badly(blocked):
    with pytest.raises(LearnerError, match=r"cannot drive here: .*% of \d+ lessons at delay in \[0, 0.3\], trim = 0.1"):
        collect_samples(Schoolroom(Wobbly(), blocked=blocked), WIDE, count=1000, seed=1, lesson_s=1.0)


def still(observation):
    return np.zeros(1)


def test_a_guided_lesson_shows_what_the_policy_visits_with_the_experts_commands():
    room = Tightrope(Wobbly())
    shown, guided = (
        collect_samples(room, Distribution({}), count=30, seed=1, lesson_s=2.0, policy=policy)
        for policy in (None, still)
    )
    assert len(guided.commands) == 30
    assert np.array_equal(guided.commands, -1.2 * guided.observations)
    assert np.abs(guided.observations).max() > 2.0 * np.abs(shown.observations).max()


def test_a_learner_that_falls_at_once_is_given_more_lessons():
    samples = collect_samples(
        Tightrope(Wobbly()), Distribution({}), count=50, seed=1, lesson_s=2.0, policy=lambda seen: np.ones(1) * 5.0
    )
    assert len(samples.commands) == 50


def test_an_expert_without_labels_on_the_learners_states_is_one_line():
    with pytest.raises(
        LearnerError, match=r"^an expert without labels on the learner's states: it labelled 0.0% of 10"
    ):
        collect_samples(
            Tightrope(Wobbly(), silent=True), Distribution({}), count=50, seed=1, lesson_s=2.0, policy=still
        )


def test_steps_off_the_road_are_made_up_for_by_further_lessons():
    samples = collect_samples(Schoolroom(Wobbly(), blocked=0.4), WIDE, count=50, seed=1, lesson_s=1.0)
    assert len(samples.commands) == 50
