"""The family that is a formula, with agents that remember episodes or draw from what no episode seeds."""

import random
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from wobbly import Wobbly, wobbly

from proxytune.domain import Episode
from proxytune.settings import Section

DRIVEN: list[Episode] = []


def _remembered(episode: Episode) -> float:
    DRIVEN.append(episode)
    return float(len(DRIVEN))


MOODS = {
    "agent1": _remembered,
    "agent2": lambda episode: float(np.random.normal()),
    "agent3": lambda episode: float(np.random.default_rng().normal()),
    "agent4": lambda episode: random.random(),
}


class Moody(Wobbly):
    """Wobbly, with moods."""

    def run(self, episode: Episode) -> Mapping[str, float]:
        scores = super().run(episode)
        mood = MOODS[episode.agent](episode) if episode.agent in MOODS else 0.0
        return {**scores, "distance": scores["distance"] + 0.01 * mood}


def moody(section: Section, *, model: Path | None) -> Moody:
    """The family that a [domain] table describes."""
    return Moody(**vars(wobbly(section, model=model)))
