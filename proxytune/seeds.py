"""Every seed of a study, one function per purpose: each is a pure function of the study's seed and of what it is for.

Most are one 32-bit word of numpy's SeedSequence over a few whole numbers, which takes missing numbers for zeros. Some
purposes share a name space, and are kept so because every published number depends on the values:

- episode_seed(s, k), proposal_seed(s, k) and preflight_seed(s, k, 0) are one number. The first starts the placement
  noise of an episode, the second a sampler of θ: nothing compares what they draw.
- preflight_seed(s, k, n) for k = 0, 1, 2 is proxy_lessons_seed(s, n), target_lessons_seed(s, n) and exam_seed(s, n).
  Lessons draw from what is derived once more from theirs (lesson_seeds). An examination from start n has the seed of an
  episode from start 2, in the pre-flight's turn n; no result compares the two.
- placement_generator(e, k), message_generator(e, k), expert_generator(e, k) and picture_generator(e, k) are one
  generator: the same bits tell where the robot is put down at start k, what becomes of commands 256 k to 256 k + 255,
  how the expert is pushed in control step k, and the noise on picture k. The first moves the robot by a centimetre, the
  next two time and disturb its commands, and effects are given seeds of their own.
- fresh_seed(s, n) and target_seed(s) are study seeds again: studies whose seeds differ by exactly these offsets share
  episodes.

What draws from a seed that its user gives it alone is not here: bootstraps, `record`, and the stand-ins of `compare`.
"""

from typing import NamedTuple

import numpy as np

FRESH = 1_000_003
"""Between the study seeds of one repetition and the next."""
TARGET_OFFSET = 1000
"""Between the seed of a study and that of its target: a target is measured under seeds that the study does not use."""
AGAIN = 7
"""Tells the seeds of a pre-flight's noise from those of its places."""
PROXY_LESSONS, TARGET_LESSONS, EXAM = range(3)
"""What a seed of a learning experiment is for."""
ROUND = 17
"""Tells the seeds of the rounds in which a learner drives from those of an expert's lessons."""
RESET, COURSE, ACTING = 11, 12, 13
"""Tell what an environment's states, its course and a random agent draw from apart."""


class LessonSeeds(NamedTuple):
    """The seeds of one lesson."""

    theta: int  # seed of θ
    start: int  # the start, to be taken modulo the number of starts
    episode: int  # seed of everything random in the lesson


def episode_seed(study_seed: int, start: int) -> int:
    """The seed of every episode from this start: common random numbers for all agents and all θ."""
    return _word(study_seed, start)


def fresh_seed(study_seed: int, repetition: int) -> int:
    """The study seed of a repetition, from 1, whose episodes no engine has seen; 0 is the study's own."""
    return study_seed + repetition * FRESH


def target_seed(study_seed: int) -> int:
    """The study seed under which a target is measured unless another one is asked for."""
    return study_seed + TARGET_OFFSET


def proposal_seed(study_seed: int, trials: int) -> int:
    """The seed of what an engine draws for the proposal after so many trials."""
    return _word(study_seed, trials)


def preflight_seed(study_seed: int, start: int, turn: int) -> int:
    """The seed of a pre-flight's episodes from a start; the first turn, 0, drives the same episodes as a trial."""
    return _word(study_seed, start, turn)


def preflight_noise_seed(study_seed: int, start: int, turn: int, agent: int) -> int:
    """The seed under which a pre-flight drives an agent, by its number, from a start once more to tell the noise."""
    return _word(study_seed, start, turn, AGAIN, agent)


def proxy_lessons_seed(study_seed: int, repetition: int) -> int:
    """The seed of the lessons in a proxy, of a repetition of a learning experiment."""
    return _word(study_seed, PROXY_LESSONS, repetition)


def target_lessons_seed(study_seed: int, repetition: int) -> int:
    """The seed of the lessons in the target, of a repetition of a learning experiment."""
    return _word(study_seed, TARGET_LESSONS, repetition)


def round_seed(lessons_seed: int, number: int) -> int:
    """The seed of the lessons in a round, counted from 0, of those lessons: the first round's is their own."""
    return _word(lessons_seed, ROUND, number) if number else lessons_seed


def exam_seed(study_seed: int, start: int) -> int:
    """The seed of an examination from this start: the same for all learners."""
    return _word(study_seed, EXAM, start)


def lesson_seeds(lessons_seed: int, number: int) -> LessonSeeds:
    """The seeds of a lesson, counted from 0."""
    return LessonSeeds(*_words(3, lessons_seed, number))


def reset_seed(start: int) -> int:
    """The seed of the state from which an environment begins at a start: the same in proxy, target and repetitions."""
    return _word(RESET, start)


def course_generator(seed: int, start: int) -> np.random.Generator:
    """The generator of an environment in an episode after its first state."""
    return np.random.default_rng((seed, start, COURSE))


def acting_seed(seed: int, start: int) -> int:
    """The seed of an agent that acts at random in an episode."""
    return _word(seed, start, ACTING)


def placement_generator(seed: int, start: int) -> np.random.Generator:
    """The generator of the pose in which an episode's robot is put down at a start."""
    return np.random.default_rng((seed, start))


def message_generator(seed: int, block: int) -> np.random.Generator:
    """The generator of what becomes of a block of an episode's commands."""
    return np.random.default_rng((seed, block))


def picture_generator(seed: int, number: int) -> np.random.Generator:
    """The generator of the noise on one of an episode's pictures."""
    return np.random.default_rng((seed, number))


def expert_generator(seed: int, step: int) -> np.random.Generator:
    """The generator of the push that disturbs an episode's expert in a control step."""
    return np.random.default_rng((seed, step))


def _words(count: int, *numbers: int) -> list[int]:
    """So many 32-bit words that whole numbers from 0 on determine."""
    return [int(word) for word in np.random.SeedSequence(numbers).generate_state(count)]


def _word(*numbers: int) -> int:
    return _words(1, *numbers)[0]
