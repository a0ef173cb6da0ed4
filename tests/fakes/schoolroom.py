"""A classroom that is a formula: an expert answers three numbers by a matrix that θ turns, and a learner fits it."""

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

SAMPLES_PER_S = 10
NOISE = 0.3


def answers(theta: Mapping[str, float]) -> np.ndarray:
    """What the expert multiplies an observation (3,) by, (3, 2)."""
    trim, delay = theta.get("trim", 0.0) / 0.3, theta.get("delay", 0.0) / 0.3
    return np.array([[1.0 + trim, 1.0 - trim], [delay, -delay], [0.5, 0.5]])


@dataclass(frozen=True)
class Schoolroom(Walled):
    """Wobbly, and an expert in it."""

    inner: Wobbly  # scores the agents
    blocked: float = 0.0  # share of a lesson that the expert is off the road
    journal: str = ""  # a file to which each lesson and examination adds a line; empty for none

    @property
    def identity(self) -> str:
        return f"schoolroom {self.inner.identity} {self.blocked}"

    def demonstrate(self, episode: Episode, seconds: float) -> tuple[Demonstration, int]:
        self._note("lesson", episode)
        asked = round(seconds * SAMPLES_PER_S)
        generator = np.random.default_rng([episode.seed, episode.start])
        seen = generator.normal(size=(asked, 3))
        wanted = seen @ answers({**dict(self.inner.theta), **dict(episode.theta)})
        kept = round(asked * (1.0 - self.blocked))
        noisy = wanted + NOISE * generator.normal(size=wanted.shape)
        return Demonstration(seen[:kept], noisy[:kept]), asked

    def examine(self, episode: Episode, policy: Policy) -> float:
        self._note("exam", episode)
        seen = np.random.default_rng([episode.seed, episode.start]).normal(size=(20, 3))
        answered = np.array([policy(one) for one in seen])
        if not np.isfinite(answered).all():
            raise EpisodeError("answered what is no command")
        wrong = np.abs(answered - seen @ answers({**dict(self.inner.theta), **dict(episode.theta)})).mean()
        return self.best_score * (1.0 - 2.0 * min(1.0, float(wrong)))


def schoolroom(section: Section, *, model: Path | None) -> Schoolroom:
    """The family that a [domain] table describes."""
    inner, own = inside(section, model, ("blocked", "teaching_journal"))
    return Schoolroom(inner, own.get("blocked", 0.0), own.get("teaching_journal", ""))


@dataclass(frozen=True)
class Matrix:
    """Fits the matrix, held back to the weights it starts from as if these were so many samples."""

    held: float = 20.0

    def train(self, samples: Demonstration, start: Weights | None, seed: int) -> Weights:
        before = np.zeros((3, 2)) if start is None else start["matrix"]
        seen, held = samples.observations, self.held if start is not None else 1e-6
        square = seen.T @ seen + held * np.eye(3)
        return {"matrix": np.linalg.solve(square, seen.T @ samples.commands + held * before)}

    def act(self, weights: Weights, observation: np.ndarray) -> np.ndarray:
        return observation @ weights["matrix"]
