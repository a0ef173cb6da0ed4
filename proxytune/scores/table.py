"""A score table: how well each agent did, episode by episode."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from proxytune.errors import ScoresError
from proxytune.scores.metric import Array
from proxytune.settings import nearest

LARGEST = 1e70
"""A score beyond this is no measurement, and its square would overflow."""


@dataclass(frozen=True, eq=False)
class ScoreTable:
    """What every agent scored in every episode of one domain.

    Attributes:
        agents: Names, one per row.
        episodes: Labels of the episodes; the same label for two agents means the same start.
        metrics: Names of the metrics.
        values: Shape (agents, episodes, metrics); NaN throughout an episode that an agent did not drive.
    """

    agents: tuple[str, ...]
    episodes: tuple[str, ...]
    metrics: tuple[str, ...]
    values: Array

    @classmethod
    def from_episodes(cls, scored: Mapping[tuple[str, str | int], Mapping[str, float]]) -> "ScoreTable":
        """Build a table from (agent, episode) to metric values, all in the same metrics.

        Raises:
            ScoresError: If there is no episode, or a value is missing or not finite.
        """
        if not scored:
            raise ScoresError("no episode has been scored")
        metrics = tuple(next(iter(scored.values())))
        rows = [[scores.get(name, math.nan) for name in metrics] for scores in scored.values()]
        for (agent, episode), cells in zip(scored, rows, strict=True):
            if not all(abs(cell) < LARGEST for cell in cells):
                raise ScoresError(f"agent '{agent}', episode {episode}: not a finite score in each of {list(metrics)}")
        return cls.from_rows([agent for agent, _ in scored], [str(label) for _, label in scored], metrics, rows)

    @classmethod
    def from_rows(
        cls, agents: Sequence[str], episodes: Sequence[str], metrics: Sequence[str], values: ArrayLike
    ) -> "ScoreTable":
        """Build a table from the scores of each agent's each episode, given once.

        Args:
            agents: The agent of each row.
            episodes: The episode of each row.
            metrics: What was scored.
            values: Finite, shape (rows, metrics).
        """
        rows, columns = _places(agents), _places(episodes)
        table = np.full((len(rows), len(columns), len(metrics)), np.nan)
        table[[rows[name] for name in agents], [columns[label] for label in episodes]] = values
        table.setflags(write=False)
        return cls(tuple(rows), tuple(columns), tuple(metrics), table)

    @cached_property
    def driven(self) -> NDArray[np.bool_]:
        """Which agent drove which episode, shape (agents, episodes)."""
        return ~np.isnan(self.values[:, :, 0])

    @cached_property
    def counts(self) -> NDArray[np.int64]:
        """Episodes per agent."""
        return np.asarray(self.driven.sum(axis=1), dtype=np.int64)

    @cached_property
    def means(self) -> Array:
        """Mean over each agent's episodes, shape (agents, metrics)."""
        return np.asarray(np.nansum(self.values, axis=1) / self.counts[:, None], dtype=np.float64)

    @property
    def complete(self) -> bool:
        """Whether every agent drove every episode, so that episodes are paired across agents."""
        return bool(self.driven.all())

    def unpaired(self) -> "ScoreTable":
        """The same scores with a number of its own for each agent's every episode, so that no start is shared."""
        rows, columns = np.nonzero(self.driven)
        labels = tuple(map(str, range(len(rows))))
        values = np.full((len(self.agents), len(labels), len(self.metrics)), np.nan)
        values[rows, np.arange(len(labels))] = self.values[rows, columns]
        return ScoreTable(self.agents, labels, self.metrics, values)

    def select(self, metrics: Iterable[str]) -> "ScoreTable":
        """The same table with these metrics only, in this order.

        Raises:
            ScoresError: If a metric is unknown; the nearest name is given.
        """
        names = tuple(metrics)
        for name in names:
            if name not in self.metrics:
                raise ScoresError(f"no metric '{name}' in the scores; {nearest(name, self.metrics)}")
        if names == self.metrics:
            return self
        columns = [self.metrics.index(name) for name in names]
        return ScoreTable(self.agents, self.episodes, names, self.values[:, :, columns])

    def arrange(self, *, agents: Sequence[str], episodes: Sequence[str] | None = None) -> "ScoreTable":
        """The same table with its agents, and its episodes if given, in this order; names must be known."""
        labels = self.episodes if episodes is None else tuple(episodes)
        if tuple(agents) == self.agents and labels == self.episodes:
            return self
        rows, columns = _places(self.agents), _places(self.episodes)
        values = self.values[np.ix_([rows[name] for name in agents], [columns[label] for label in labels])]
        return ScoreTable(tuple(agents), labels, self.metrics, values)


def _places(names: Iterable[str]) -> dict[str, int]:
    """The place of each name among them, each once."""
    return {name: place for place, name in enumerate(dict.fromkeys(names))}
