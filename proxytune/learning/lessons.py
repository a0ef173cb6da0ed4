"""Lessons: θ drawn from p(θ) for each, and the expert's samples of many, whether it drives itself or a learner does."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

import numpy as np

from proxytune.domain import Classroom, Demonstration, Episode, OnPolicyClassroom, Policy, make_episode
from proxytune.errors import LearnerError
from proxytune.seeds import lesson_seeds
from proxytune.space import Theta

EXPERT = "expert"
"""Who drives in a lesson, in place of an agent."""

LEAST_SHARE = 0.5
"""An expert that keeps to the road for less than this share of its lessons has nothing to teach."""

LEAST_LABELLED = 0.01
"""An expert that labels less than this share of a learner's lessons has no label for where it drives."""

TRIED = 10
"""Lessons after which that is judged."""


@dataclass(frozen=True)
class Distribution:
    """p(θ): every parameter uniform within its bounds, or fixed where these are equal; S_θ where all are.

    Attributes:
        bounds: Lowest and highest value of each parameter that is not nominal, by name.
    """

    bounds: Mapping[str, tuple[float, float]]

    def draw(self, seed: int) -> Theta:
        """θ of one lesson."""
        shares = np.random.default_rng(seed).random(len(self.bounds))
        pairs = zip(sorted(self.bounds.items()), shares, strict=True)
        return {name: low + float(share) * (high - low) for (name, (low, high)), share in pairs}

    @property
    def centre(self) -> Theta:
        """Its middle, which is θ itself where nothing is drawn."""
        return {name: (low + high) / 2.0 for name, (low, high) in self.bounds.items()}

    @property
    def fixed(self) -> bool:
        """Whether it is one θ."""
        return all(low == high for low, high in self.bounds.values())


def collect_samples(
    classroom: Classroom,
    where: Distribution,
    *,
    count: int,
    seed: int,
    lesson_s: float,
    policy: Policy | None = None,
) -> Demonstration:
    """Collect this many of the expert's samples, lesson by lesson; more samples begin with the same ones.

    Args:
        classroom: Where the lessons are; with a policy, an `OnPolicyClassroom`.
        where: p(θ), drawn anew for every lesson.
        count: How many samples.
        seed: Of θ, of the starts and of the lessons.
        lesson_s: How long a lesson takes [s].
        policy: Who drives, and has what it visits labelled by the expert; None for the expert itself.

    Raises:
        LearnerError: If the expert cannot drive there, or has no label where the policy drives.
        EpisodeError: If the domain or the policy fails.
    """
    observations, commands = [], []
    found = asked = lessons = 0
    least = LEAST_SHARE if policy is None else LEAST_LABELLED
    while found < count:
        samples, wanted = _teach(classroom, _lesson(classroom, where, seed, lessons), lesson_s, policy)
        observations.append(samples.observations)
        commands.append(samples.commands)
        found, asked, lessons = found + len(samples.commands), asked + wanted, lessons + 1
        if found < least * asked and (lessons >= TRIED or found >= count):
            raise LearnerError(_complaint(policy, found / asked, lessons, describe(where)))
    return Demonstration(np.concatenate(observations)[:count], np.concatenate(commands)[:count])


def _teach(classroom: Classroom, episode: Episode, lesson_s: float, policy: Policy | None) -> tuple[Demonstration, int]:
    if policy is None:
        return classroom.demonstrate(episode, lesson_s)
    return cast(OnPolicyClassroom, classroom).guide(episode, policy, lesson_s)


def _complaint(policy: Policy | None, share: float, lessons: int, where: str) -> str:
    if policy is None:
        return (
            f"the expert cannot drive here: it kept to the road for {share:.0%} of {lessons} lessons at {where}; "
            "move θ closer to where the robot can be driven"
        )
    return (
        f"an expert without labels on the learner's states: it labelled {share:.1%} of {lessons} lessons at {where}; "
        "have it label wherever the learner gets to, or let the expert drive"
    )


def _lesson(classroom: Classroom, where: Distribution, seed: int, number: int) -> Episode:
    drawn = lesson_seeds(seed, number)
    start = drawn.start % classroom.starts
    return make_episode(where.draw(drawn.theta), agent=EXPERT, start=start, seed=drawn.episode)


def describe(where: Distribution) -> str:
    """p(θ) in words."""
    spans = [
        f"{name} = {low:.3g}" if low == high else f"{name} in [{low:.3g}, {high:.3g}]"
        for name, (low, high) in where.bounds.items()
    ]
    return ", ".join(spans) or "nominal θ"
