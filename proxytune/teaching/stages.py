"""Learning in one domain: its lessons' samples, and the weights they lead to, each cached by what determines it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from proxytune.domain import Classroom, Demonstration, Policy
from proxytune.learning.cache import Arrays, Cache, digest
from proxytune.learning.learner import Learner, Weights, policy_of
from proxytune.learning.lessons import Distribution, collect_samples
from proxytune.learning.rehearsal import mix_samples
from proxytune.learning.settings import LEARNER
from proxytune.seeds import round_seed
from proxytune.teaching.supervision import watching


@dataclass(frozen=True)
class Trainee:
    """Who learns, and where what it has learnt is kept.

    Attributes:
        learner: What is trained.
        identity: A digest of its code and settings.
        seed: Of its initial weights and the order of its samples.
        cache: Where samples and weights are kept.
    """

    learner: Learner
    identity: str
    seed: int
    cache: Cache


@dataclass(frozen=True)
class Lessons:
    """The lessons in one domain, in rounds: one where the expert drives, several where the learner does.

    Attributes:
        room: The domain family.
        domain: Its identity.
        where: p(θ), drawn anew for every lesson.
        seed: Of the lessons.
        lesson_s: How long each takes [s].
        grid: Number of samples after each round, rising.
        by: Who drives. LEARNER: in each round as it has learnt to in those before, as long as there is nothing, the
            expert. EXPERT: there is one round.
    """

    room: Classroom
    domain: str
    where: Distribution
    seed: int
    lesson_s: float
    grid: tuple[int, ...]
    by: str

    @property
    def on_policy(self) -> bool:
        """Whether the learner drives."""
        return self.by == LEARNER

    @property
    def ends(self) -> tuple[int, ...]:
        """Number of samples after each round."""
        return self.grid if self.on_policy else self.grid[-1:]

    def begin(self, number: int) -> int:
        """Number of samples before a round, counted from 0."""
        return self.ends[number - 1] if number else 0

    def rounds(self, count: int) -> range:
        """The rounds that the first samples, so many, come from."""
        return range(sum(self.begin(number) < count for number in range(len(self.ends))))

    def facts(self, number: int) -> dict[str, Any]:
        """All that determines a round's samples, but for who drives."""
        return {
            "domain": self.domain,
            "theta": {name: list(pair) for name, pair in self.where.bounds.items()},
            "count": self.ends[number] - self.begin(number),
            "seed": round_seed(self.seed, number),
            "lesson_s": self.lesson_s,
        }

    def collect(self, number: int, policy: Policy | None) -> Demonstration:
        """A round's samples: of the policy's driving, labelled by the expert, or without one of the expert's own."""
        facts, lesson_s = self.facts(number), self.lesson_s
        return collect_samples(
            self.room, self.where, count=facts["count"], seed=facts["seed"], lesson_s=lesson_s, policy=policy
        )


@dataclass(frozen=True)
class Stage:
    """What a trainee learns in one domain, after what it has learnt in another.

    Facts of what comes before enter those of what comes after as their digest: each key is short and complete.

    Attributes:
        trainee: Who learns.
        lessons: From what.
        before: The stage from whose weights it goes on; None from scratch.
        rehearsal: Share of that stage's samples among those it learns from here.
    """

    trainee: Trainee
    lessons: Lessons
    before: "Stage | None" = None
    rehearsal: float = 0.0

    def weights_facts(self, count: int) -> dict[str, Any] | None:
        """All that determines the weights after so many samples; None where nothing has been learnt."""
        start = self.before.final_facts() if self.before else None
        if not count:
            return start
        return {
            "learner": self.trainee.identity,
            "seed": self.trainee.seed,
            "start": digest(start) if start else None,
            "samples": digest(self.round_facts(self.lessons.rounds(count)[-1])),
            "count": count,
            **({"rehearsal": self.rehearsal} if self.before and self.rehearsal else {}),
        }

    def final_facts(self) -> dict[str, Any] | None:
        """All that determines the weights after its last sample."""
        return self.weights_facts(self.lessons.ends[-1])

    def weights(self, count: int) -> Weights | None:
        """The weights after so many samples; None where nothing has been learnt."""
        if not count:
            return self.before.weights(self.before.lessons.ends[-1]) if self.before else None
        facts = self.weights_facts(count)
        assert facts is not None
        return self.trainee.cache.get("weights", facts, lambda: self._train(count))

    def samples(self, count: int) -> Demonstration:
        """The first samples, so many; more of them begin with the same ones."""
        rounds = [self.collect(number) for number in self.lessons.rounds(count)]
        observations = np.concatenate([one.observations for one in rounds])[:count]
        return Demonstration(observations, np.concatenate([one.commands for one in rounds])[:count])

    def round_facts(self, number: int) -> dict[str, Any]:
        """All that determines a round's samples: the policy that drives stands for the rounds before."""
        policy = self.weights_facts(self.lessons.begin(number)) if self.lessons.on_policy else None
        return {**self.lessons.facts(number), **({"policy": digest(policy)} if policy else {})}

    def collect(self, number: int) -> Demonstration:
        """The samples of a round."""

        def make() -> Arrays:
            policy = self._policy(number)
            with watching("a lesson"):
                return self.lessons.collect(number, policy)._asdict()

        return Demonstration(**self.trainee.cache.get("samples", self.round_facts(number), make))

    def _policy(self, number: int) -> Policy | None:
        """Who drives in a round; None for the expert."""
        weights = self.weights(self.lessons.begin(number)) if self.lessons.on_policy else None
        return None if weights is None else policy_of(self.trainee.learner, weights)

    def _train(self, count: int) -> Weights:
        samples = self.samples(count)
        if self.before and self.rehearsal:
            samples = mix_samples(samples, self.before.samples(self.before.lessons.ends[-1]), self.rehearsal)
        start = self.weights(0)
        with watching("the learner's training"):
            return self.trainee.learner.train(samples, start, self.trainee.seed)


def equal_rounds(count: int, rounds: int) -> tuple[int, ...]:
    """Number of samples after each of so many equal rounds; fewer where there are too few samples."""
    return tuple(sorted({round(count * number / rounds) for number in range(1, rounds + 1)} - {0}))
