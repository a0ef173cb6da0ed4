"""The pieces of a learning experiment, each cached by all that determines it: samples, weights, scores."""

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from proxytune.domain import Classroom, Demonstration, make_episode
from proxytune.errors import EpisodeError, LearnerError
from proxytune.learning.cache import Arrays, Cache, digest
from proxytune.learning.examination import examine
from proxytune.learning.learner import Learner, Weights, policy_of
from proxytune.learning.lessons import Distribution, collect_samples
from proxytune.learning.settings import TeachingSettings
from proxytune.running.workers import working
from proxytune.seeds import exam_seed, proxy_lessons_seed, target_lessons_seed

PUPIL = "pupil"
"""Who drives in an examination, in place of an agent."""


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
    """

    proxy: Classroom
    target: Classroom
    learner: Learner
    learner_identity: str
    settings: TeachingSettings
    seed: int
    starts: int
    cache: Cache

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
        """Make what several points share: the target's samples, or the weights that the proxy alone has taught."""
        with _name_proxy_in_errors(point), threadpool_limits(limits=1):
            if point.proxy is None:
                self._target_samples(point.repetition)
            else:
                self._weights(replace(point, count=0))

    def is_cached(self, point: Point) -> bool:
        """Whether the point's scores are in the cache."""
        return self.cache.has("exam", self.exam_facts(point))

    def exam_facts(self, point: Point) -> dict[str, Any]:
        """All that determines a point's scores: what is missing here would return stale scores."""
        weights = self._weights_facts(point)
        return {
            "target": self.identities[1],
            "starts": self.starts,
            "seed": exam_seed(self.seed, 0),
            "weights": digest(weights) if weights else None,
        }

    def _weights_facts(self, point: Point) -> dict[str, Any] | None:
        """All that determines the weights after this many target samples; None where nothing has been learnt.

        The facts of what comes before enter as their digest, so that each key is short and complete.
        """
        start = self._start_facts(point)
        if not point.count:
            return start
        return {
            "learner": self.learner_identity,
            "seed": point.repetition,
            "start": digest(start) if start else None,
            "samples": digest(self._target_facts(point.repetition)),
            "count": point.count,
        }

    def _start_facts(self, point: Point) -> dict[str, Any] | None:
        """All that determines the weights that a proxy alone has taught; None without one."""
        if point.proxy is None:
            return None
        return {
            "learner": self.learner_identity,
            "seed": point.repetition,
            "start": None,
            "samples": digest(self._proxy_facts(point.proxy, point.repetition)),
            "count": self.settings.proxy_samples,
        }

    def _proxy_facts(self, proxy: Distribution, repetition: int) -> dict[str, Any]:
        domain, seed = self.identities[0], proxy_lessons_seed(self.seed, repetition)
        return self._lessons_facts(domain, proxy.bounds, self.settings.proxy_samples, seed)

    def _target_facts(self, repetition: int) -> dict[str, Any]:
        domain, seed = self.identities[1], target_lessons_seed(self.seed, repetition)
        return self._lessons_facts(domain, {}, self.settings.target_samples[-1], seed)

    def _lessons_facts(self, domain: str, bounds: Mapping[str, Any], count: int, seed: int) -> dict[str, Any]:
        theta = {name: list(pair) for name, pair in bounds.items()}
        return {
            "domain": domain,
            "theta": theta,
            "count": count,
            "seed": seed,
            "lesson_s": self.settings.lesson_s,
        }

    def _examine(self, point: Point) -> Arrays:
        weights = self._weights(point)
        if weights is None:
            return {"scores": np.full(self.starts, np.nan)}
        seeds = [exam_seed(self.seed, start) for start in range(self.starts)]
        episodes = [make_episode({}, agent=PUPIL, start=start, seed=seed) for start, seed in enumerate(seeds)]
        return {"scores": np.array(examine(self.target, episodes, policy_of(self.learner, weights)))}

    def _weights(self, point: Point) -> Weights | None:
        facts = self._weights_facts(point)
        return None if facts is None else self.cache.get("weights", facts, lambda: self._train(point))

    def _train(self, point: Point) -> Weights:
        if not point.count:
            assert point.proxy is not None
            return self.learner.train(self._proxy_samples(point.proxy, point.repetition), None, point.repetition)
        samples = self._target_samples(point.repetition)
        first = Demonstration(samples.observations[: point.count], samples.commands[: point.count])
        start = self._weights(replace(point, count=0))
        return self.learner.train(first, start, point.repetition)

    def _proxy_samples(self, proxy: Distribution, repetition: int) -> Demonstration:
        facts = self._proxy_facts(proxy, repetition)
        return self._samples(facts, self.proxy, proxy)

    def _target_samples(self, repetition: int) -> Demonstration:
        return self._samples(self._target_facts(repetition), self.target, Distribution({}))

    def _samples(self, facts: Mapping[str, Any], room: Classroom, where: Distribution) -> Demonstration:
        def make() -> Arrays:
            count, seed = facts["count"], facts["seed"]
            return collect_samples(room, where, count=count, seed=seed, lesson_s=self.settings.lesson_s)._asdict()

        return Demonstration(**self.cache.get("samples", facts, make))


@contextmanager
def _name_proxy_in_errors(point: Point) -> Iterator[None]:
    """Put the proxy's name in front of an error."""
    try:
        yield
    except (LearnerError, EpisodeError) as problem:
        raise type(problem)(f"{point.name}: {problem}") from None


def prepare_shared(setup: TeachingSetup, points: Sequence[Point], jobs: int) -> AbstractContextManager[Iterator[None]]:
    """Make what several points share before they are scored, so that no two processes make the same."""
    shared = [Point("the target", None, repetition, 0) for repetition in sorted({p.repetition for p in points})]
    for point in points:
        before = replace(point, count=0)
        if point.proxy is not None and before not in shared:
            shared.append(before)
    return working(setup.prepare, shared, jobs)


def score_points(
    setup: TeachingSetup, points: Sequence[Point], jobs: int
) -> AbstractContextManager[Iterator[tuple[Point, float]]]:
    """Score the points in parallel, each yielded as soon as it is there.

    Those that take longest begin first: otherwise one of them, begun last, would keep one process busy alone.
    """
    ordered = sorted(points, key=lambda point: -point.count)
    return working(functools.partial(_score, setup.score), ordered, jobs)


def _score(score: Callable[[Point], float], point: Point) -> tuple[Point, float]:
    return point, score(point)
