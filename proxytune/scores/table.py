"""A score table: how well each agent did, episode by episode; and its metrics: when two agents differ in one."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from proxytune.arrays import Floats
from proxytune.errors import InputError, ScoresError
from proxytune.settings import nearest

ROUNDING = 1e-12
"""Differences below this fraction of a column's largest value are rounding, hence ties."""


@dataclass(frozen=True)
class Metric:
    """One figure of merit and how two agents are compared on it.

    Attributes:
        name: The column of the score table.
        direction: Whether more ("max") or less ("min") is better.
        tolerance: Differences up to this much are ties: in the metric's unit, or in percent.
        percent: Whether the tolerance is a percentage of the column's largest value in each domain.

    Raises:
        InputError: If the direction is unknown or the tolerance is negative or not finite.
    """

    name: str
    direction: Literal["max", "min"] = "max"
    tolerance: float = 0.0
    percent: bool = False

    def __post_init__(self) -> None:
        if self.direction not in ("max", "min"):
            raise InputError(f"metric '{self.name}': the direction is max or min, got '{self.direction}'")
        if not (math.isfinite(self.tolerance) and self.tolerance >= 0):
            raise InputError(f"metric '{self.name}': the tolerance must be zero or more, got {self.tolerance}")

    @classmethod
    def parse(cls, text: str) -> "Metric":
        """Read NAME:max, NAME:min:0.5 (in the metric's unit) or NAME:max:5%.

        Raises:
            InputError: If the text is of another form.
        """
        form = re.fullmatch(r"\s*([^:]+?)\s*:\s*(max|min)\s*(?::\s*([^:%]+?)\s*(%?)\s*)?", text)
        if form is None:
            raise InputError(f"metric '{text}': write NAME:max or NAME:min, with :0.5 or :5% for a tolerance")
        name, direction, tolerance, percent = form.groups()
        try:
            return cls(name, "max" if direction == "max" else "min", float(tolerance or 0), bool(percent))
        except ValueError:
            raise InputError(f"metric '{text}': the tolerance must be a number or a percentage") from None

    def __str__(self) -> str:
        """The text that parse reads."""
        tolerance = f":{self.tolerance:g}{'%' if self.percent else ''}" if self.tolerance else ""
        return f"{self.name}:{self.direction}{tolerance}"

    def merits(self, columns: Floats) -> tuple[Floats, Floats]:
        """Put scores on a scale where more is better, and say which differences count.

        A percentage divides each column by its largest absolute value (and takes that from 1 where less is
        better), as the paper's authors did in their pilot, so that their figures come out to the last pair.

        Agents are on the last axis (…, agents); the largest difference that is still a tie is of shape (…, 1).
        """
        largest = np.abs(columns).max(axis=-1, keepdims=True)
        if not self.percent:
            signed = columns if self.direction == "max" else -columns
            return signed, self.tolerance + ROUNDING * largest
        shares = columns / np.where(largest > 0, largest, 1.0)
        merits = shares if self.direction == "max" else 1.0 - shares
        return merits, np.full_like(largest, max(self.tolerance / 100, ROUNDING))


def varies(columns: Floats) -> NDArray[np.bool_]:
    """True if agents differ in a metric by more than rounding: one value per agent on the last axis but one."""
    return np.asarray(np.ptp(columns, axis=-2) > ROUNDING * np.abs(columns).max(axis=-2), dtype=np.bool_)


LARGEST = 1e70
"""A score beyond this is no measurement, and its square would overflow."""
MOST_CELLS = 10**8
"""More scores, driven or not, fit into no table: 0.8 GB."""


@dataclass(frozen=True, eq=False)
class ScoreTable:
    """The scores of every agent in every episode of one domain.

    Attributes:
        agents: Names, one per row.
        episodes: Labels of the episodes; the same label for two agents means the same start.
        metrics: Names of the metrics.
        values: Shape (agents, episodes, metrics); NaN throughout an episode that an agent did not drive.
        errors: Published standard errors of the means, shape (agents, metrics); None where there are none.
    """

    agents: tuple[str, ...]
    episodes: tuple[str, ...]
    metrics: tuple[str, ...]
    values: Floats
    errors: Floats | None = None

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
        """Build a table from the finite scores (rows, metrics) of each agent's each episode, given once.

        Raises:
            ScoresError: If agents have so many episodes of their own that the table would fill the memory.
        """
        rows, columns = _places(agents), _places(episodes)
        table = _empty(len(rows), len(columns), len(metrics))
        table[[rows[name] for name in agents], [columns[label] for label in episodes]] = values
        table.setflags(write=False)
        return cls(tuple(rows), tuple(columns), tuple(metrics), table)

    @cached_property
    def driven(self) -> NDArray[np.bool_]:
        """True where an agent drove an episode, shape (agents, episodes)."""
        return ~np.isnan(self.values[:, :, 0])

    @cached_property
    def counts(self) -> NDArray[np.int64]:
        """Episodes per agent."""
        return np.asarray(self.driven.sum(axis=1), dtype=np.int64)

    @cached_property
    def means(self) -> Floats:
        """Mean over each agent's episodes, shape (agents, metrics)."""
        return np.asarray(np.nansum(self.values, axis=1) / self.counts[:, None], dtype=np.float64)

    @property
    def complete(self) -> bool:
        """True if every agent drove every episode, so that episodes are paired across agents."""
        return bool(self.driven.all())

    def unpaired(self) -> "ScoreTable":
        """Give the same scores with a number of its own for each agent's every episode, so that no start is shared.

        Raises:
            ScoresError: If that table would fill the memory.
        """
        rows, columns = np.nonzero(self.driven)
        labels = tuple(map(str, range(len(rows))))
        values = _empty(len(self.agents), len(labels), len(self.metrics))
        values[rows, np.arange(len(labels))] = self.values[rows, columns]
        return ScoreTable(self.agents, labels, self.metrics, values, self.errors)

    def select(self, metrics: Iterable[str]) -> "ScoreTable":
        """Give the same table with these metrics only, in this order.

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
        errors = None if self.errors is None else self.errors[:, columns]
        return ScoreTable(self.agents, self.episodes, names, self.values[:, :, columns], errors)

    def arrange(self, *, agents: Sequence[str], episodes: Sequence[str] | None = None) -> "ScoreTable":
        """Give the same table with its agents, and its episodes if given, in this order; names must be known."""
        labels = self.episodes if episodes is None else tuple(episodes)
        if tuple(agents) == self.agents and labels == self.episodes:
            return self
        rows, columns = _places(self.agents), _places(self.episodes)
        order = [rows[name] for name in agents]
        values = self.values[np.ix_(order, [columns[label] for label in labels])]
        errors = None if self.errors is None else self.errors[order]
        return ScoreTable(tuple(agents), labels, self.metrics, values, errors)


def _places(names: Iterable[str]) -> dict[str, int]:
    """The place of each name among them, each once."""
    return {name: place for place, name in enumerate(dict.fromkeys(names))}


def _empty(agents: int, episodes: int, metrics: int) -> Floats:
    if agents * episodes * metrics > MOST_CELLS:
        few = "compare fewer agents, or label by the same start what is from the same start"
        raise ScoresError(f"{agents} agents × {episodes} episodes that they do not share are too large a table; {few}")
    return np.full((agents, episodes, metrics), np.nan)
