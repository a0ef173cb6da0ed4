"""A schoolroom and a learner in which what an ENDING of deadly does can happen at a chosen moment."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from deadly import ENDINGS
from schoolroom import Matrix, Schoolroom
from walled import inside

from proxytune.domain import Demonstration, Episode, Policy
from proxytune.learning import Weights
from proxytune.settings import Section


@dataclass(frozen=True)
class StuckRoom(Schoolroom):
    """Its faults are "moment:start:ending", of the moments lesson, exam and together."""

    def demonstrate(self, episode: Episode, seconds: float) -> tuple[Demonstration, int]:
        self._meet("lesson", episode)
        return super().demonstrate(episode, seconds)

    def examine(self, episode: Episode, policy: Policy) -> float:
        self._meet("exam", episode)
        return super().examine(episode, policy)

    def _meet(self, moment: str, episode: Episode) -> None:
        for fated, start, ending in (fault.split(":") for fault in self.inner.faults):
            if fated == moment and start in ("*", str(episode.start)):
                ENDINGS[ending]()


@dataclass(frozen=True)
class StuckTogether(StuckRoom):
    """Examines several at once."""

    def examine_together(self, episodes: Sequence[Episode], policy: Policy) -> list[float]:
        for episode in episodes:
            self._meet("together", episode)
        return [self.examine(episode, policy) for episode in episodes]


def stuck(section: Section, *, model: Path | None) -> StuckRoom:
    """The family that a [domain] table describes."""
    inner, own = inside(section, model, ("blocked", "teaching_journal"))
    return StuckRoom(inner, own.get("blocked", 0.0), own.get("teaching_journal", ""))


@dataclass(frozen=True)
class StuckMatrix(Matrix):
    """A learner that meets an ending in training, or as it acts."""

    in_training: str = ""
    in_acting: str = ""

    def train(self, samples: Demonstration, start: Weights | None, seed: int) -> Weights:
        if self.in_training:
            ENDINGS[self.in_training]()
        return super().train(samples, start, seed)

    def act(self, weights: Weights, observation: np.ndarray) -> Any:
        if self.in_acting:
            ENDINGS[self.in_acting]()
        return super().act(weights, observation)


def trains(ending: str) -> StuckMatrix:
    """A learner that meets it in training."""
    return StuckMatrix(in_training=ending)


def acts(ending: str) -> StuckMatrix:
    """A learner that meets it as it acts."""
    return StuckMatrix(in_acting=ending)
