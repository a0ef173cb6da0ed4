"""A classroom where whoever errs gets to where its expert never is: balancing a deviation that grows by itself."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from walled import Walled, inside
from wobbly import Wobbly

from proxytune.domain import Demonstration, Episode, Policy
from proxytune.errors import EpisodeError
from proxytune.learning import Weights
from proxytune.settings import Section

STEPS_PER_S = 10
EXAM_STEPS = 60
FALLEN = 1.0
"""The deviation from which on nothing can be done."""


@dataclass(frozen=True)
class Tightrope(Walled):
    """Wobbly, with a deviation that grows by a third per step unless a command counters it."""

    inner: Wobbly  # scores the agents
    silent: bool = False  # whether the expert has no label for what a learner visits
    journal: str = ""  # a file to which each lesson and examination adds a line; empty for none

    @property
    def identity(self) -> str:
        return f"tightrope {self.inner.identity} {self.silent}"

    def demonstrate(self, episode: Episode, seconds: float) -> tuple[Demonstration, int]:
        self._note("lesson", episode)
        asked = round(seconds * STEPS_PER_S)
        return self._labelled(self._walk(episode, self._expert(episode), asked), episode), asked

    def guide(self, episode: Episode, policy: Policy, seconds: float) -> tuple[Demonstration, int]:
        self._note("guided", episode)
        asked = round(seconds * STEPS_PER_S)
        walked = self._walk(episode, policy, asked)
        return self._labelled(walked[:0] if self.silent else walked, episode), asked

    def examine(self, episode: Episode, policy: Policy) -> float:
        self._note("exam", episode)
        return self.best_score * len(self._walk(episode, policy, EXAM_STEPS)) / EXAM_STEPS

    def _walk(self, episode: Episode, policy: Policy, steps: int) -> np.ndarray:
        """The deviations before each step, (steps, 1), until it has fallen."""
        pushes = np.random.default_rng([episode.seed, episode.start]).normal(0.0, 0.1, steps)
        deviation, visited = 0.0, []
        for push in pushes:
            visited.append([deviation])
            command = np.asarray(policy(np.array([deviation])))
            if command.shape != (1,) or not np.isfinite(command).all():
                raise EpisodeError("answered what is no command")
            deviation = self._growth(episode) * deviation + float(command[0]) + float(push)
            if abs(deviation) > FALLEN:
                break
        return np.array(visited)

    def _expert(self, episode: Episode) -> Policy:
        return lambda seen: -(self._growth(episode) - 0.1) * seen

    def _labelled(self, visited: np.ndarray, episode: Episode) -> Demonstration:
        return Demonstration(visited, self._expert(episode)(visited))

    def _growth(self, episode: Episode) -> float:
        theta: Mapping[str, float] = {**dict(self.inner.theta), **dict(episode.theta)}
        return 1.3 + theta.get("trim", 0.0)


def tightrope(section: Section, *, model: Path | None) -> Tightrope:
    """The family that a [domain] table describes."""
    inner, own = inside(section, model, ("silent", "teaching_journal"))
    return Tightrope(inner, own.get("silent", False), own.get("teaching_journal", ""))


@dataclass(frozen=True)
class Cells:
    """Answers by the mean command of each cell of deviation, and with none where it has seen nothing."""

    width: float = 0.5

    def train(self, samples: Demonstration, start: Weights | None, seed: int) -> Weights:
        before = start or {"sums": np.zeros(5), "counts": np.zeros(5)}
        cells = [self._cell(seen) for seen in samples.observations]
        sums, counts = before["sums"].copy(), before["counts"].copy()
        np.add.at(sums, cells, samples.commands[:, 0])
        np.add.at(counts, cells, 1.0)
        return {"sums": sums, "counts": counts}

    def act(self, weights: Weights, observation: np.ndarray) -> np.ndarray:
        cell = self._cell(observation)
        return np.array([weights["sums"][cell] / max(1.0, weights["counts"][cell])])

    def _cell(self, observation: np.ndarray) -> int:
        return int(np.clip(round(float(observation[0]) / self.width), -2, 2)) + 2
