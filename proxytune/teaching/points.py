"""The pieces of a learning experiment, each cached by all that determines it: samples, weights, scores."""

import functools
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from threadpoolctl import threadpool_limits

from proxytune.domain import Classroom, OnPolicyClassroom, make_episode
from proxytune.errors import EpisodeError, LearnerError
from proxytune.learning.cache import Arrays, Cache, digest
from proxytune.learning.examination import examine
from proxytune.learning.learner import Learner, policy_of
from proxytune.learning.lessons import Distribution
from proxytune.learning.settings import TeachingSettings
from proxytune.seeds import exam_seed, proxy_lessons_seed, target_lessons_seed
from proxytune.teaching.stages import Lessons, Stage, Trainee, equal_rounds
from proxytune.teaching.supervision import Supervised, watching

PUPIL = "pupil"
"""Who drives in an examination, in place of an agent."""

PROXY_ROUNDS = 4
"""Rounds in which a proxy teaches where the learner drives in it."""


@dataclass(frozen=True)
class Point:
    """One point of a learning curve under one seed.

    Attributes:
        name: What the proxy is called, for error lines only.
        proxy: p(θ) of the proxy that taught first, None without one.
        repetition: Which repetition, from 0: learners with and without a proxy share its target samples.
        count: How many target samples come after that.
    """

    name: str
    proxy: Distribution | None
    repetition: int
    count: int


@dataclass(frozen=True)
class TeachingSetup:
    """A learning experiment ready to run: both domains, the learner, how much of what, and the cache.

    Attributes:
        proxy: The proxy's domain family.
        target: The target's.
        learner: What is trained.
        learner_identity: A digest of its code and settings.
        settings: Numbers of samples, seeds and seconds.
        seed: The study's.
        starts: Number of starts in an examination.
        cache: Where samples, weights and scores are kept.
        timeout_s: How long an episode of a lesson or an examination may take [s]; None for as long as it takes.
    """

    proxy: Classroom
    target: Classroom
    learner: Learner
    learner_identity: str
    settings: TeachingSettings
    seed: int
    starts: int
    cache: Cache
    timeout_s: float | None = None

    @functools.cached_property
    def identities(self) -> tuple[str, str]:
        """Identities of the proxy's and the target's domain family, read once: reading digests the user's modules."""
        return self.proxy.identity, self.target.identity

    def score(self, point: Point) -> float:
        """Mean score in the target over all starts; NaN where nothing has been learnt, so nothing can drive.

        Raises:
            LearnerError: If the proxy's expert cannot drive, or the learner cannot use the samples.
            EpisodeError: If a domain or the policy fails.
        """
        with _name_proxy_in_errors(point), threadpool_limits(limits=1):
            found = self.cache.get("exam", self.exam_facts(point), lambda: self._examine(point))
            return float(np.mean(found["scores"]))

    def prepare(self, point: Point) -> None:
        """Make what a point shares with others: what the proxy alone has taught, and the target's samples."""
        with _name_proxy_in_errors(point), threadpool_limits(limits=1):
            stage = self._stage(point)
            stage.weights(0)
            for number in stage.lessons.rounds(point.count):
                stage.collect(number)

    def is_cached(self, point: Point) -> bool:
        """Whether the point's scores are in the cache."""
        return self.cache.has("exam", self.exam_facts(point))

    def exam_facts(self, point: Point) -> dict[str, Any]:
        """All that determines a point's scores: what is missing here would return stale scores."""
        weights = self._stage(point).weights_facts(point.count)
        return {
            "target": self.identities[1],
            "starts": self.starts,
            "seed": exam_seed(self.seed, 0),
            "weights": digest(weights) if weights else None,
        }

    def _stage(self, point: Point) -> Stage:
        """What a point's learner learns in the target, after its proxy if it has one."""
        trainee = Trainee(self.learner, self.learner_identity, point.repetition, self.cache)
        in_proxy = None if point.proxy is None else self._proxy_lessons(point.proxy, point.repetition)
        before = None if in_proxy is None else Stage(trainee, in_proxy)
        return Stage(trainee, self._target_lessons(point.repetition), before, self.settings.rehearsal)

    def _proxy_lessons(self, proxy: Distribution, repetition: int) -> Lessons:
        by, count = self.settings.proxy_lessons, self.settings.proxy_samples
        seed, ends = proxy_lessons_seed(self.seed, repetition), equal_rounds(count, PROXY_ROUNDS)
        room = cast(OnPolicyClassroom, Supervised(self.proxy, "proxy", self.timeout_s))
        return Lessons(room, self.identities[0], proxy, seed, self.settings.lesson_s, ends, by)

    def _target_lessons(self, repetition: int) -> Lessons:
        by, ends = self.settings.target_lessons, self.settings.target_samples[1:]
        seed, nominal = target_lessons_seed(self.seed, repetition), Distribution({})
        room = cast(OnPolicyClassroom, Supervised(self.target, "target", self.timeout_s))
        return Lessons(room, self.identities[1], nominal, seed, self.settings.lesson_s, ends, by)

    def _examine(self, point: Point) -> Arrays:
        weights = self._stage(point).weights(point.count)
        if weights is None:
            return {"scores": np.full(self.starts, np.nan)}
        seeds = [exam_seed(self.seed, start) for start in range(self.starts)]
        episodes = [make_episode({}, agent=PUPIL, start=start, seed=seed) for start, seed in enumerate(seeds)]
        room, policy = Supervised(self.target, "target", self.timeout_s), policy_of(self.learner, weights)
        with watching("an examination"):
            return {"scores": np.array(examine(cast(Classroom, room), episodes, policy))}


@contextmanager
def _name_proxy_in_errors(point: Point) -> Iterator[None]:
    """Put the proxy's name in front of an error."""
    try:
        yield
    except (LearnerError, EpisodeError) as problem:
        raise type(problem)(f"{point.name}: {problem}") from None
