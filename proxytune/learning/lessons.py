"""Lessons and examinations: samples of an expert from θ drawn from p(θ), a policy's scores, and what is kept of both.

`collect_samples` has the expert drive, or a learner whose states the expert labels; `mix_samples` rehearses what a
proxy taught beside the target's samples; `examine_policy` scores a policy. `Cache` keeps arrays on disk by all that
determines them: made once, found again after any interruption; `learner_identity` is one of these facts. `Costs` are
those of a target sample, by which PLV becomes a price.
"""

import inspect
import json
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Floats
from proxytune.domain import Classroom, Demonstration, Episode, OnPolicyClassroom, Policy, make_episode
from proxytune.errors import EpisodeError, InputError, LearnerError, StoreError
from proxytune.files import write_whole
from proxytune.identity import digest, meaning_of
from proxytune.learning.learner import Learner
from proxytune.lineage import named
from proxytune.seeds import lesson_seeds
from proxytune.settings import Section
from proxytune.space import Theta
from proxytune.unpacking import read_arrays

EXPERT = "expert"
"""Who drives in a lesson, in place of an agent."""
LESSONS_MB = 4000
"""Kept samples may be pictures."""
LEAST_SHARE = 0.5
"""An expert that keeps to the road for less than this share of its lessons has nothing to teach."""
LEAST_LABELLED = 0.01
"""An expert that labels less than this share of a learner's lessons has no label for where it drives."""
TRIED = 10
"""Lessons after which that is judged."""


@dataclass(frozen=True)
class Distribution:
    """p(θ): every parameter uniform within its bounds, or fixed where these are equal; S_θ where all are."""

    bounds: Mapping[str, tuple[float, float]]  # lowest and highest value of each parameter that is not nominal, by name

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
        """True if it is one θ."""
        return all(low == high for low, high in self.bounds.values())


def collect_samples(
    classroom: Classroom, where: Distribution, *, count: int, seed: int, lesson_s: float, policy: Policy | None = None
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
        drawn = lesson_seeds(seed, lessons)
        start = drawn.start % classroom.starts
        episode = make_episode(where.draw(drawn.theta), agent=EXPERT, start=start, seed=drawn.episode)
        if policy is None:
            samples, wanted = classroom.demonstrate(episode, lesson_s)
        else:
            samples, wanted = cast(OnPolicyClassroom, classroom).guide(episode, policy, lesson_s)
        observations.append(samples.observations)
        commands.append(samples.commands)
        found, asked, lessons = found + len(samples.commands), asked + wanted, lessons + 1
        if found < least * asked and (lessons >= TRIED or found >= count):
            raise LearnerError(_complaint(policy, found / asked, lessons, describe_distribution(where)))
    return Demonstration(np.concatenate(observations)[:count], np.concatenate(commands)[:count])


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


def describe_distribution(where: Distribution) -> str:
    """p(θ) in words."""
    spans = [
        f"{name} = {low:.3g}" if low == high else f"{name} in [{low:.3g}, {high:.3g}]"
        for name, (low, high) in where.bounds.items()
    ]
    return ", ".join(spans) or "nominal θ"


Arrays = Mapping[str, NDArray[Any]]
FACTS = "facts"
"""The array in each file that says, as JSON, what determines the others."""
NOT_KEPT = (FACTS, "file", "allow_pickle")
"""Names that arrays cannot be kept under: ours, and those of savez's own arguments."""


@dataclass(frozen=True)
class Cache:
    """A folder of `KIND-DIGEST.npz`, each with its arrays and, as JSON, what determines them."""

    folder: Path  # where it is; made when first written to

    def get(self, kind: str, facts: Mapping[str, Any], make: Callable[[], Arrays]) -> Arrays:
        """The arrays that these facts determine, made and kept where they are not there yet.

        A file is whole or not there at all, so several processes may use one cache, and a killed one leaves no harm. A
        StoreError if the folder cannot be written, or a file in it is damaged.
        """
        path = self.path(kind, facts)
        if not path.exists():
            _write(path, {**make(), FACTS: np.array(_text(facts))})
        return _read(path)

    def path(self, kind: str, facts: Mapping[str, Any]) -> Path:
        """The file where the arrays of these facts are, or would be."""
        return self.folder / f"{kind}-{facts_digest(facts)}.npz"

    def has(self, kind: str, facts: Mapping[str, Any]) -> bool:
        """Tell whether they are there."""
        return self.path(kind, facts).exists()


def facts_digest(facts: Mapping[str, Any]) -> str:
    """A short name for facts, the same whatever their order."""
    return digest(_text(facts), length=20)


def _text(facts: Mapping[str, Any]) -> str:
    return json.dumps(facts, sort_keys=True, allow_nan=False)


def _write(path: Path, arrays: Arrays) -> None:
    def write(draft: Path) -> None:
        with draft.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)

    write_whole(path, write, kind=StoreError)


def _read(path: Path) -> Arrays:
    try:
        return {name: array for name, array in read_arrays(path, LESSONS_MB).items() if name != FACTS}
    except InputError as problem:
        raise StoreError(str(problem)) from None
    # A damaged file fails in many ways: zipfile's, zlib's and numpy's own.
    except Exception as problem:
        raise StoreError(f"{path}: is damaged ({problem}); delete it, and run again to make it anew") from None


def examine_policy(classroom: Classroom, episodes: Sequence[Episode], policy: Policy) -> list[float]:
    """The score of a policy in each episode, together where that can be; an EpisodeError where one has none."""
    if (together := getattr(classroom, "examine_together", None)) is None:
        scores = [classroom.examine(episode, policy) for episode in episodes]
    else:
        scores = list(together(episodes, policy))
    if len(scores) != len(episodes):
        problem = f"examine_together gave {len(scores)} scores for {len(episodes)} episodes"
        raise EpisodeError(f"{problem}; give each its own")
    for start, score in enumerate(scores):
        if not math.isfinite(score):
            raise EpisodeError(f"the examination from start {start} gave {score!r}; give a finite score")
    return scores


def mix_samples(new: Demonstration, earlier: Demonstration, share: float) -> Demonstration:
    """The new samples, then so many of the earlier ones that these are this share (below 1) of all, or all there are.

    Those taken lie evenly over the earlier ones, and so over their lessons.
    """
    wanted = min(len(earlier.commands), round(len(new.commands) * share / (1.0 - share)))
    rows = np.linspace(0, len(earlier.commands) - 1, wanted).round().astype(int)
    observations = np.concatenate((new.observations, earlier.observations[rows]))
    return Demonstration(observations, np.concatenate((new.commands, earlier.commands[rows])))


KEYS = ("off_policy", "on_policy", "label")


@dataclass(frozen=True)
class Costs:
    """The costs of one target sample, in any one unit."""

    off_policy: float = 1.0  # one that the expert's driving gives
    on_policy: float = 1.0  # one that the learner's own driving gives
    label: float = 0.0  # one answer of the expert, on top of either

    @property
    def per_sample(self) -> tuple[float, float]:
        """All that one on-policy sample costs, and one off-policy sample."""
        return self.on_policy + self.label, self.off_policy + self.label


def read_costs(section: Section) -> Costs:
    """Read the table [teaching.costs]."""
    section.only(KEYS)
    return Costs(**{key: section.number(key, getattr(Costs, key), low=0.0) for key in KEYS})


def split_samples(count: Floats | float, expert_drives: float) -> tuple[Floats, Floats]:
    """On-policy and off-policy samples among so many, of which the first ones, or all, are driven by the expert."""
    off = np.minimum(count, expert_drives)
    with np.errstate(invalid="ignore"):
        return np.where(off < count, np.subtract(count, off), 0.0), off


def cost_saved(costs: Costs, *, without: tuple[Floats, Floats], with_proxy: tuple[Floats, Floats]) -> Floats:
    """PLV in cost (eq. 6, as we read it): the price of on- and off-policy target samples that a proxy saves."""

    def with_a_price(samples: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        """Samples without those that cost nothing, of which there may be infinitely many."""
        on, off = (np.where(price > 0.0, count, 0.0) for price, count in zip(costs.per_sample, samples, strict=True))
        return on, off

    # With an off-policy cost of 1, and without on-policy samples, it is eq. 5.
    cost_on, cost_off = costs.per_sample
    (on, off), (on_with, off_with) = with_a_price(without), with_a_price(with_proxy)
    return cost_on * (on - on_with) + cost_off * (off - off_with)  # eq. (6)


def learner_identity(learner: Learner) -> str:
    """A digest of a learner's settings, as its `repr` tells them, and of what its code means.

    Its code is its class's module and the modules in the same folder from which that has taken classes or functions.
    """
    module = sys.modules[type(learner).__module__]
    source = Path(inspect.getfile(type(learner)))
    taken = {getattr(value, "__module__", None) for value in vars(module).values()}
    files = {Path(file) for name in taken if (file := getattr(sys.modules.get(str(name)), "__file__", None))}
    code = meaning_of({source, *(file for file in files if file.parent == source.parent)}, source.parent)
    return digest(named(f"learner {type(learner).__module__}", code) + repr(learner))
