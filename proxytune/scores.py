"""Score tables: how well each agent did, episode by episode, and the metrics that judge it."""

import contextlib
import csv
import io
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from proxytune.errors import InputError, ScoresError
from proxytune.settings import nearest

Array = NDArray[np.float64]
LABELS = ("agent", "episode", "domain")
ROUNDING = 1e-12
"""Differences below this fraction of a column's largest value are rounding, hence ties."""
LARGEST = 1e100
"""A score beyond this is no measurement, and its square would overflow."""


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

    def merits(self, columns: Array) -> tuple[Array, Array]:
        """Put scores on a scale where more is better, and say which differences count.

        A percentage divides each column by its largest absolute value (and takes that from 1 where less is
        better), as the paper's authors did in their pilot, so that their figures come out to the last pair.

        Args:
            columns: One value per agent on the last axis, any number of tables on the others.

        Returns:
            The merits, of the same shape, and the largest difference that is still a tie, shape (…, 1).
        """
        largest = np.abs(columns).max(axis=-1, keepdims=True)
        if not self.percent:
            signed = columns if self.direction == "max" else -columns
            return signed, np.maximum(self.tolerance, ROUNDING * largest)
        shares = columns / np.where(largest > 0, largest, 1.0)
        merits = shares if self.direction == "max" else 1.0 - shares
        return merits, np.full_like(largest, max(self.tolerance / 100, ROUNDING))


def varies(columns: Array) -> NDArray[np.bool_]:
    """Whether agents differ in a metric by more than rounding: one value per agent on the last axis but one."""
    largest = np.abs(columns).max(axis=-2)
    return np.asarray(np.ptp(columns, axis=-2) > ROUNDING * largest, dtype=np.bool_)


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
        agents = tuple(dict.fromkeys(agent for agent, _ in scored))
        episodes = tuple(dict.fromkeys(str(episode) for _, episode in scored))
        metrics = tuple(next(iter(scored.values())))
        rows = {name: row for row, name in enumerate(agents)}
        columns = {label: column for column, label in enumerate(episodes)}
        values = np.full((len(agents), len(episodes), len(metrics)), np.nan)
        for (agent, episode), scores in scored.items():
            cells = [scores.get(name, math.nan) for name in metrics]
            if not all(abs(cell) < LARGEST for cell in cells):
                raise ScoresError(f"agent '{agent}', episode {episode}: not a finite score in each of {list(metrics)}")
            values[rows[agent], columns[str(episode)]] = cells
        values.setflags(write=False)
        return cls(agents, episodes, metrics, values)

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
        rows = [self.agents.index(name) for name in agents]
        columns = [self.episodes.index(label) for label in labels]
        return ScoreTable(tuple(agents), labels, self.metrics, self.values[np.ix_(rows, columns)])


def read_scores(path: Path, metrics: Iterable[str], domain: str | None = None) -> ScoreTable:
    """Read the scores of one domain from a CSV file.

    Args:
        path: CSV with the columns agent, episode (not needed for one row per agent), domain (optional) and metrics.
        metrics: The columns to read; others are ignored.
        domain: Which domain, where the file has several.

    Raises:
        ScoresError: If the file is not such a table, naming line and column.
    """
    tables = read_domains(path, metrics)
    if domain is None:
        if len(tables) > 1:
            example = next(iter(tables))
            raise ScoresError(f"{path}: has the domains {', '.join(tables)}; choose one, as in {path}:{example}")
        return next(iter(tables.values()))
    if "" in tables:
        raise ScoresError(f"{path}: has no column 'domain'; drop ':{domain}'")
    if domain not in tables:
        raise ScoresError(f"{path}: no domain '{domain}'; {nearest(domain, tables)}")
    return tables[domain]


def read_domains(path: Path, metrics: Iterable[str]) -> dict[str, ScoreTable]:
    """Read every domain of a CSV file, in the order of the file; without a domain column the only one is "".

    Raises:
        ScoresError: As in read_scores.
    """
    names = tuple(metrics)
    domains: dict[str, dict[tuple[str, str | int], dict[str, float]]] = {}
    for line, row in _rows(path, names):
        domain, agent, episode = row.get("domain", ""), row["agent"], row.get("episode", "")
        for label in [label for label in LABELS if label in row and not row[label]]:
            raise ScoresError(f"{path}: line {line}, column '{label}': is empty; fill it in")
        scored = domains.setdefault(domain, {})
        if (agent, episode) in scored:
            raise ScoresError(f"{path}: line {line}: {_duplicate(row)}")
        scored[agent, episode] = {name: _number(path, line, name, row[name]) for name in names}
    if not domains:
        raise ScoresError(f"{path}: has no rows; add one per agent and episode")
    return {domain: ScoreTable.from_episodes(scored) for domain, scored in domains.items()}


def write_scores(table: ScoreTable, path: Path) -> None:
    """Write a table as CSV, the same bytes for the same table; an interrupted write leaves the old file.

    Raises:
        ScoresError: If the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["agent", "episode", *table.metrics])
    for row, agent in enumerate(table.agents):
        for column, episode in enumerate(table.episodes):
            if table.driven[row, column]:
                writer.writerow([agent, episode, *(repr(float(value)) for value in table.values[row, column])])
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        draft.write_text(text.getvalue(), encoding="utf-8", newline="")
        draft.replace(path)
    except OSError as problem:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise ScoresError(f"{path}: cannot be written ({problem.strerror})") from None


def _rows(path: Path, metrics: Sequence[str]) -> list[tuple[int, dict[str, str]]]:
    """The file's rows by column name, each with its line number."""
    try:
        reader = csv.reader(io.StringIO(path.read_text(encoding="utf-8-sig"), newline=""), strict=True)
        lines = [(reader.line_num, [cell.strip() for cell in cells]) for cells in reader if cells]
    except FileNotFoundError:
        raise ScoresError(f"{path}: no such file; check the path") from None
    except OSError as problem:
        raise ScoresError(f"{path}: cannot be read ({problem.strerror})") from None
    except (UnicodeDecodeError, csv.Error):
        raise ScoresError(f"{path}: is not a CSV file; save it as comma-separated text (UTF-8)") from None
    if not lines:
        raise ScoresError(f"{path}: is empty; its first line must name the columns, agent and metrics among them")
    header = lines[0][1]
    _check_header(path, header, metrics)
    for line, cells in lines[1:]:
        if len(cells) != len(header):
            raise ScoresError(
                f"{path}: line {line}: has {len(cells)} cells, but the first line names {len(header)} columns"
            )
    return [(line, dict(zip(header, cells, strict=True))) for line, cells in lines[1:]]


def _check_header(path: Path, header: Sequence[str], metrics: Sequence[str]) -> None:
    if "agent" not in header:
        raise ScoresError(
            f"{path}: no column 'agent'; the first line reads '{','.join(header)[:60]}', not columns,by,comma"
        )
    for name in metrics:
        if name not in header:
            others = [column for column in header if column not in LABELS]
            raise ScoresError(f"{path}: no column '{name}'; {nearest(name, others)}")
    for name in (*LABELS, *metrics):
        if header.count(name) > 1:
            raise ScoresError(f"{path}: the first line names the column '{name}' twice; rename one")


def _number(path: Path, line: int, column: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not abs(value) < LARGEST:
        raise ScoresError(f"{path}: line {line}, column '{column}': must be a finite number, got {cell!r}")
    return value


def _duplicate(row: Mapping[str, str]) -> str:
    where = f" in domain '{row['domain']}'" if "domain" in row else ""
    if "episode" in row:
        return f"agent '{row['agent']}' has episode '{row['episode']}' twice{where}; number the episodes"
    return f"agent '{row['agent']}' is there twice{where}; add a column 'episode'"
