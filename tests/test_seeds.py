"""Every seed of every purpose is the number that it has always been: published figures depend on each of them."""

import pytest

from proxytune import seeds

GOLDEN = {
    "episode": (
        seeds.episode_seed,
        {(1, 0): 1835504127, (1, 9): 408484264, (2, 3): 2108521801, (1000004, 2): 156977760},
    ),
    "proposal": (seeds.proposal_seed, {(1, 0): 1835504127, (1, 9): 408484264, (2**40 + 1, 2): 1130176356}),
    "fresh": (seeds.fresh_seed, {(7, 0): 7, (7, 1): 1000010, (7, 3): 3000016}),
    "target": (seeds.target_seed, {(1,): 1001, (42,): 1042}),
    "preflight": (seeds.preflight_seed, {(1, 9, 0): 408484264, (1, 0, 2): 4158717079, (3, 4, 1): 749829806}),
    "preflight's noise": (seeds.preflight_noise_seed, {(1, 0, 0, 0): 3495925559, (3, 4, 1, 5): 2925825705}),
    "lessons in a proxy": (seeds.proxy_lessons_seed, {(1, 0): 1835504127, (1, 4): 877150602}),
    "lessons in the target": (seeds.target_lessons_seed, {(1, 0): 1189033389, (1, 4): 1984606777}),
    "round of lessons": (seeds.round_seed, {(1234567, 0): 1234567, (1234567, 1): 3175512135, (1, 7): 3010086231}),
    "examination": (seeds.exam_seed, {(1, 0): 1596810411, (1, 4): 2327607824}),
    "lesson": (
        seeds.lesson_seeds,
        {(1234567, 0): (1058897929, 2536831675, 2051360301), (1, 8): (2579376181, 1935620157, 385650199)},
    ),
    "reset": (seeds.reset_seed, {(0,): 1926383459, (7,): 963745374}),
    "acting": (seeds.acting_seed, {(1, 0): 3132303469, (5, 2): 3404405215}),
}


@pytest.mark.parametrize(("derive", "known"), GOLDEN.values(), ids=GOLDEN)
def test_a_seed_is_the_number_it_has_always_been(derive, known):
    assert {numbers: derive(*numbers) for numbers in known} == known


def test_a_generator_draws_what_it_has_always_drawn():
    assert seeds.placement_generator(5, 2).standard_normal() == 1.95385576281231
    assert seeds.message_generator(5, 2).random() == 0.23772096442823154
    assert seeds.expert_generator(5, 0).standard_normal() == -0.8019314252534474
    assert seeds.picture_generator(5, 0).standard_normal() == -0.8019314252534474
    assert seeds.course_generator(5, 2).standard_normal() == 0.08497980447159015


def test_what_shares_a_name_space_is_what_the_module_says_and_noise_shares_no_seed_with_places():
    assert seeds.episode_seed(3, 4) == seeds.proposal_seed(3, 4) == seeds.preflight_seed(3, 4, 0)
    lessons_and_exam = (seeds.proxy_lessons_seed(3, 2), seeds.target_lessons_seed(3, 2), seeds.exam_seed(3, 2))
    assert lessons_and_exam == tuple(seeds.preflight_seed(3, start, 2) for start in range(3))
    places = {seeds.preflight_seed(1, start, turn) for start in range(10) for turn in range(5)}
    noise = {seeds.preflight_noise_seed(1, s, t, agent) for s in range(10) for t in range(5) for agent in range(10)}
    assert len(places) == 50
    assert len(noise) == 500
    assert not places & noise
