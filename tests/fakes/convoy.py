"""The family that is a formula, whose episodes also run side by side, tick by tick, as those of robots do.

Each agent is asked at every tick with the memory that it gave back, and its faults come at the seventh. Each fleet adds
a line to the journal, if there is one.
"""

import os
import random
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from deadly import ENDINGS
from wobbly import Wobbly, formula, wobbly

from proxytune.domain import Episode
from proxytune.errors import EpisodeError
from proxytune.settings import Section

TICKS, FAULTY = 10, 7


class Forgetful:
    """Keeps what it remembers in its class."""

    last = 0.0

    @classmethod
    def act(cls, seen: float) -> float:
        cls.last, before = seen, cls.last
        return seen - before


MOODS = {"hides": Forgetful.act, "draws": lambda seen: random.random() * seen}
"""What an agent adds to its command from elsewhere than its memory."""


class Convoy(Wobbly):
    """Wobbly side by side, with the faults of ENDINGS and agents with MOODS.

    `formula` tells what an agent sees; what it scores depends on every command, each of which on its memory.
    """

    def run(self, episode: Episode) -> Mapping[str, float]:
        (result,) = self._drive([episode])
        if isinstance(result, EpisodeError):
            raise result
        return result

    def run_many(self, episodes: Sequence[Episode]) -> list[Any]:
        return self._drive(episodes)

    def _drive(self, episodes: Sequence[Episode]) -> list[Any]:
        if self.journal:
            with open(self.journal, "a") as journal:
                journal.write(f"{len(episodes)} {os.getpid()} {'+'.join(one.agent for one in episodes)}\n")
        memories, failed = [0.0] * len(episodes), dict[int, EpisodeError]()
        for tick in range(TICKS):
            time.sleep(self.sleep / TICKS)
            for robot, episode in enumerate(episodes):
                if robot not in failed:
                    try:
                        memories[robot] = self._command(episode, memories[robot], tick)
                    except ValueError as problem:
                        failed[robot] = EpisodeError(f"agent '{episode.agent}' raised ValueError at {tick} s: no way")
                        failed[robot].__cause__ = problem
        return [failed.get(robot) or self._scores(one, memories[robot]) for robot, one in enumerate(episodes)]

    def _command(self, episode: Episode, memory: float, tick: int) -> float:
        for agent, start, fault in (one.split(":") for one in self.faults):
            if agent == episode.agent and start in ("*", str(episode.start)):
                if fault in MOODS:
                    memory += MOODS[fault](self._scores(episode, tick)["distance"])
                elif tick == FAULTY:
                    ENDINGS[fault]()
        return 0.9 * memory + self._scores(episode, tick)["survival_time"]

    def _scores(self, episode: Episode, memory: float) -> dict[str, float]:
        scores = formula({**dict(self.theta), **dict(episode.theta)}, episode)
        return {**scores, "distance": scores["distance"] + 1e-4 * memory}


def convoy(section: Section, *, model: Path | None) -> Convoy:
    """The family that a [domain] table describes."""
    return Convoy(**vars(wobbly(section, model=model)))
