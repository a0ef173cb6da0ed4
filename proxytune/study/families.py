"""Several tuned domain families beside one another: what each predicts, teaches and costs.

`tuned_family` is one of them, `ComparedFamilies` holds all. What each is worth as a teacher is kept in a file
(`save_lessons`, `read_lessons`), so that it can be shown again without running any code.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from proxytune.arrays import Floats
from proxytune.errors import StoreError
from proxytune.files import write_whole
from proxytune.learning import LearningEstimate
from proxytune.seeds import fresh_seed
from proxytune.settings import is_finite
from proxytune.space import Theta
from proxytune.storage import FAMILIES
from proxytune.study.result import StudyResult
from proxytune.study.run import seconds_of
from proxytune.study.settings import StudySettings
from proxytune.study.study_run import StudyRun, plan_episodes
from proxytune.usefulness import Assessment, Difference, Expectation, expected_differences, interval

RESAMPLES = 1000

NOTICEABLE = 1.005
"""Episodes that are shown to take this many times as long are called longer: a smaller ratio is told as 1."""


@dataclass(frozen=True)
class TunedFamily:
    """A domain family at the best θ that was found in its time."""

    name: str  # what study.toml calls it
    result: StudyResult  # what its study has found
    seconds: float  # how long the episodes of its trials took, divided by the processes that ran them [s]
    episode_seconds: tuple[float, ...]  # how long each episode at its best θ took [s], as in all families

    @property
    def theta(self) -> Theta:
        """Its best θ."""
        return self.result.best.trial.theta

    @property
    def fresh(self) -> Assessment | None:
        """Its usefulness there in fresh episodes; None while these are not driven, or where an agent fails in all."""
        return self.result.confirmation.answer.assessment if self.result.confirmation else None

    @property
    def expected(self) -> Expectation | None:
        """What is expected of it there in more episodes; None likewise."""
        return self.result.confirmation.expected if self.result.confirmation else None


@dataclass(frozen=True)
class Lesson:
    """The worth of a family at its best θ as a teacher."""

    theta: Theta  # the best θ that taught
    zero_shot: float | None = None  # score on the target before any target sample; None where it could not teach
    needed: LearningEstimate | None = None  # target samples needed after it
    plv: LearningEstimate | None = None  # target samples saved
    more: LearningEstimate | None = None  # needed beyond the family of highest PLV; None of that one
    failure: str = ""  # why it could not teach, empty if it could


@dataclass(frozen=True)
class BestFamilies:
    """The family that is best at something."""

    best: str | None = None  # its name; None where that is not known
    alike: tuple[str, ...] = ()  # the others that cannot be told from it


@dataclass(frozen=True)
class ComparedFamilies:
    """Several tuned families."""

    settings: StudySettings  # of the study that they are of
    families: tuple[TunedFamily, ...]  # in the order of study.toml
    lessons: Mapping[str, Lesson] = field(default_factory=dict)  # by name; empty where not asked for, or not known

    @cached_property
    def differences(self) -> tuple[Difference, ...]:
        """How much lower the PRPV expected of one is than another's, of every two that have fresh episodes."""
        return expected_differences({one.name: one.expected for one in self.families if one.expected})

    @property
    def predicts(self) -> BestFamilies:
        """The one that predicts best: the lowest PRPV expected by fresh episodes."""
        known = {one.name: one.expected.prpv.value.value for one in self.families if one.expected}
        if not known:
            return BestFamilies()
        best, *others = sorted(known, key=known.__getitem__)
        worse = {one.worse for one in self.differences if one.better == best and one.beyond_noise}
        return BestFamilies(best, tuple(name for name in others if name not in worse))

    @property
    def teaches(self) -> BestFamilies:
        """The one that teaches best: the highest PLV."""

        def may_be_as_good(one: Lesson) -> bool:
            # Not where it is shown that more samples are needed after it: if they never suffice, that is shown too.
            if one.more is None or one.needed is None or one.needed.low is None:
                return False
            return one.more.low is None or one.more.low <= 0.0

        if (best := best_teaching_family(self.lessons)) is None:
            return BestFamilies()
        others = [name for name, one in self.lessons.items() if name != best and may_be_as_good(one)]
        return BestFamilies(best, tuple(others))

    @property
    def cheapest(self) -> BestFamilies:
        """The one whose episodes take the shortest."""
        best = min(self._costs, key=lambda name: self._costs[name][0])
        alike = [name for name, (_, low, _) in self.times_cheapest(best).items() if name != best and low <= NOTICEABLE]
        return BestFamilies(best, tuple(alike))

    def seconds_per_episode(self) -> dict[str, tuple[float, float, float]]:
        """Mean seconds of an episode of each family, and the ends of its 95 % interval."""
        return {name: (mean, *interval(drawn)) for name, (mean, drawn) in self._costs.items()}

    def times_cheapest(self, cheapest: str) -> dict[str, tuple[float, float, float]]:
        """The ratio of each one's mean seconds of an episode to this family's, with 95 % intervals, paired."""
        shortest, resampled = self._costs[cheapest]
        return {name: (mean / shortest, *interval(drawn / resampled)) for name, (mean, drawn) in self._costs.items()}

    @cached_property
    def _costs(self) -> dict[str, tuple[float, Floats]]:
        """The mean of each family's episodes' seconds, and such means when episodes are drawn, alike in all."""
        costs = {}
        for one in self.families:
            # Episodes of one fleet were timed together: they have the same seconds, and are drawn together
            seconds, sizes = np.unique(one.episode_seconds, return_counts=True)
            count = len(seconds)
            drawn = sizes * np.random.default_rng(0).multinomial(count, np.full(count, 1 / count), size=RESAMPLES)
            costs[one.name] = float(np.mean(one.episode_seconds)), np.asarray(drawn @ seconds / drawn.sum(axis=1))
        return costs


def tuned_family(run: StudyRun, result: StudyResult) -> TunedFamily:
    """A family's study as it stands, with what its episodes cost."""
    settings = run.settings
    # The search's own and the fresh ones
    seeds = [fresh_seed(settings.seed, repetition) for repetition in range(settings.confirm + 1)]
    planned = [one for seed in seeds for one in plan_episodes(settings, result.best.trial.theta, seed)]
    seconds = tuple(outcome.seconds for outcome in run.known(planned).values())
    return TunedFamily(settings.family_name, result, seconds_of(run, result.trials), seconds)


def best_teaching_family(lessons: Mapping[str, Lesson]) -> str | None:
    """The family of highest PLV; None where none is known."""
    known = {name: one.plv.value for name, one in lessons.items() if one.plv and one.plv.value is not None}
    return max(known, key=known.__getitem__) if known else None


ESTIMATES = ("needed", "plv", "more")


def save_lessons(settings: StudySettings, lessons: Mapping[str, Lesson]) -> None:
    """Write what each family is worth as a teacher into the folder of all; a StoreError if that cannot be."""
    text = json.dumps({name: asdict(one) for name, one in lessons.items()}, indent=2, allow_nan=False) + "\n"
    write_whole(_file(settings), text, kind=StoreError)


def read_lessons(settings: StudySettings) -> dict[str, Lesson]:
    """The lessons that were written, none where nothing was; a StoreError if the file is none that we wrote."""
    path = _file(settings)
    try:
        return {name: _lesson(one) for name, one in json.loads(path.read_bytes()).items()}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        raise StoreError(f"{path}: is not as proxytune writes it; delete it, and run the study again") from None


def _lesson(kept: Mapping[str, Any]) -> Lesson:
    def number(value: Any) -> float:
        if type(value) not in (int, float) or not is_finite(value):
            raise ValueError("not a number")
        return float(value)

    def estimate(value: Any, low: Any, high: Any) -> LearningEstimate:
        return LearningEstimate(*(None if one is None else number(one) for one in (value, low, high)))

    estimates = {name: None if kept[name] is None else estimate(**kept[name]) for name in ESTIMATES}
    theta = {str(name): number(value) for name, value in kept["theta"].items()}
    zero_shot = None if kept["zero_shot"] is None else number(kept["zero_shot"])
    return Lesson(theta, zero_shot, failure=str(kept["failure"]), **estimates)


def _file(settings: StudySettings) -> Path:
    return settings.folder / FAMILIES / "lessons.json"
