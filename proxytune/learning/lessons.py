"""Demonstrations: θ drawn from p(θ) for each lesson, and the expert's samples of many lessons."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from proxytune.domain import Classroom, Demonstration, Episode, make_episode
from proxytune.errors import LearnerError
from proxytune.seeds import lesson_seeds
from proxytune.space import Theta

EXPERT = "expert"
"""Who drives in a lesson, in place of an agent."""

LEAST_SHARE = 0.5
"""An expert that keeps to the road for less than this share of its lessons has nothing to teach."""

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
    classroom: Classroom, where: Distribution, *, count: int, seed: int, lesson_s: float
) -> Demonstration:
    """Collect this many samples from the expert, lesson by lesson; more samples begin with the same ones.

    Args:
        classroom: Where the expert drives.
        where: p(θ), drawn anew for every lesson.
        count: How many samples.
        seed: Of θ, of the starts and of the lessons.
        lesson_s: How long the expert drives from one start [s].

    Raises:
        LearnerError: If the expert cannot drive there.
        EpisodeError: If the domain fails.
    """
    observations, commands = [], []
    found = asked = lessons = 0
    while found < count:
        samples, wanted = classroom.demonstrate(_lesson(classroom, where, seed, lessons), lesson_s)
        observations.append(samples.observations)
        commands.append(samples.commands)
        found, asked, lessons = found + len(samples.commands), asked + wanted, lessons + 1
        if found < LEAST_SHARE * asked and (lessons >= TRIED or found >= count):
            raise LearnerError(
                f"the expert cannot drive here: it kept to the road for {found / asked:.0%} of {lessons} lessons at "
                f"{describe(where)}; move θ closer to where the robot can be driven"
            )
    return Demonstration(np.concatenate(observations)[:count], np.concatenate(commands)[:count])


def _lesson(classroom: Classroom, where: Distribution, seed: int, number: int) -> Episode:
    drawn = lesson_seeds(seed, number)
    start = drawn.start % classroom.starts
    return make_episode(where.draw(drawn.theta), agent=EXPERT, start=start, seed=drawn.episode)


def describe(where: Distribution) -> str:
    """p(θ) in words."""
    spans = [
        f"{n} = {low:g}" if low == high else f"{n} in [{low:g}, {high:g}]" for n, (low, high) in where.bounds.items()
    ]
    return ", ".join(spans) or "nominal θ"
