"""Rows of samples.csv, commands.csv and frames.csv: read strictly, every complaint with file, line and column."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from proxytune.errors import LogError
from proxytune.logs.log import Floats, Whole
from proxytune.settings import nearest, read_text

LARGEST = 1e50
"""Beyond this the square of a number's square is not finite."""


@dataclass(frozen=True)
class Rows:
    """The rows of samples.csv, commands.csv or frames.csv, N of them in E episodes.

    Attributes:
        path: The file.
        lines: Line of each row in the file (N,).
        names: Episodes in order (E,).
        firsts: First row of each episode (E,).
        values: Columns by name (N,), NaN where a cell is empty.
    """

    path: Path
    lines: Whole
    names: tuple[str, ...]
    firsts: Whole
    values: Mapping[str, Floats]

    @property
    def episode(self) -> Whole:
        """Episode of each row (N,)."""
        begins = np.zeros(len(self.lines), dtype=np.int64)
        begins[self.firsts[1:]] = 1
        return np.cumsum(begins)

    @property
    def follows(self) -> NDArray[np.bool_]:
        """Whether each row from the second on is of the same episode as the one before (N − 1,)."""
        return np.asarray(np.diff(self.episode) == 0)

    def columns(self, names: tuple[str, ...]) -> Floats:
        """Some columns side by side (N, len(names))."""
        return np.stack([self.values[name] for name in names], axis=1) if names else np.empty((len(self.lines), 0))

    def error(self, row: int, column: str, problem: str) -> LogError:
        """The one-line complaint about a cell."""
        return LogError(f"{self.path}: line {self.lines[row]}, column '{column}': {problem}")


@dataclass(frozen=True)
class Layout:
    """What a table of rows must hold.

    Attributes:
        needed: Its columns besides `episode` and `time`.
        together: Columns that are there all or none.
        may_lack: Columns whose cells may be empty.
        fewest: Rows that an episode has at least.
        why: What needs the columns, for a complaint.
    """

    needed: tuple[str, ...]
    together: tuple[str, ...]
    may_lack: tuple[str, ...]
    fewest: int
    why: str


def read_rows(path: Path, layout: Layout) -> Rows:
    """Read a table.

    Raises:
        LogError: If it is not such a table.
    """
    lines, cells = _read_cells(path)
    header = cells[0]
    _check_header(path, header, layout)
    if len(cells) == 1:
        raise LogError(f"{path}: has no rows; add one per sample")
    for line, row in zip(lines, cells, strict=True):
        if len(row) != len(header):
            counts = f"has {len(row)} cells, but the first line names {len(header)} columns"
            raise LogError(f"{path}: line {line}: {counts}")
    table = pd.DataFrame(cells[1:], columns=header, dtype=str)
    labels = table["episode"].str.strip()
    changes = np.flatnonzero(labels.ne(labels.shift()).to_numpy())
    names = tuple(str(label) for label in labels.iloc[changes])
    rows = Rows(path, np.array(lines[1:]), names, changes, {})
    _check_episodes(rows, layout.fewest)
    measures = [name for name in header if name != "episode"]
    rows = replace(rows, values={name: _numbers(rows, table[name], layout.may_lack) for name in measures})
    _check_times(rows)
    return rows


def check_known_episodes(rows: Rows, names: Sequence[str]) -> None:
    """Refuse episodes that samples.csv does not have.

    Raises:
        LogError: If there is one.
    """
    for name, first in zip(rows.names, rows.firsts, strict=True):
        if name not in names:
            raise rows.error(int(first), "episode", f"'{name}' is not in samples.csv; add its poses, or leave it out")


def _read_cells(path: Path) -> tuple[list[int], list[list[str]]]:
    """Every line that is not blank, with its number; the first has the columns."""
    try:
        text = read_text(path, "utf-8-sig")
        rows = list(csv.reader(text.splitlines(), strict=True))
    except FileNotFoundError:
        raise LogError(f"{path}: no such file; a log has its samples beside log.toml") from None
    except OSError as problem:
        raise LogError(f"{path}: cannot be read ({problem.strerror})") from None
    except (UnicodeDecodeError, csv.Error):
        raise LogError(f"{path}: is not a CSV file; save it as comma-separated text (UTF-8)") from None
    lines = [line for line, row in enumerate(rows, start=1) if any(row)]
    if not lines:
        raise LogError(f"{path}: is empty; its first line must name the columns, episode and time first")
    header = [cell.strip() for cell in rows[lines[0] - 1]]
    return lines, [header, *(rows[line - 1] for line in lines[1:])]


def _check_header(path: Path, header: Sequence[str], layout: Layout) -> None:
    needed = ("episode", "time", *layout.needed)
    together = layout.together if set(layout.together) & set(header) else ()
    for name in header:
        if name not in (*needed, *layout.together):
            raise LogError(f"{path}: line 1: unknown column '{name}'; {nearest(name, (*needed, *layout.together))}")
        if list(header).count(name) > 1:
            raise LogError(f"{path}: line 1: names the column '{name}' twice; take one of them out")
    for name in (*needed, *together):
        if name not in header:
            columns = ",".join((*needed, *together))
            raise LogError(f"{path}: line 1: no column '{name}'; {layout.why} need {columns}")


def _check_episodes(samples: Rows, fewest: int) -> None:
    for name, first in zip(samples.names, samples.firsts, strict=True):
        if not name:
            raise samples.error(int(first), "episode", "is empty; name the drive")
    repeated = pd.Series(samples.names).duplicated().to_numpy()
    if repeated.any():
        again = int(np.argmax(repeated))
        problem = f"'{samples.names[again]}' comes back after another episode; keep each episode's rows together"
        raise samples.error(int(samples.firsts[again]), "episode", problem)
    lengths = np.diff(np.append(samples.firsts, len(samples.lines)))
    if (lengths < fewest).any():
        single = int(np.argmax(lengths < fewest))
        problem = f"'{samples.names[single]}' has a single row; a drive needs two or more, so leave it out"
        raise samples.error(int(samples.firsts[single]), "episode", problem)


def _numbers(samples: Rows, cells: pd.Series, may_lack_any: Sequence[str]) -> Floats:
    """A column's values, NaN where a pose's or wheel's cell is empty."""
    texts = cells.str.strip()
    values = pd.to_numeric(texts, errors="coerce").to_numpy(dtype=np.float64)
    may_lack = cells.name in may_lack_any
    wrong = ~(np.abs(values) < LARGEST)
    if may_lack:
        wrong &= (texts != "").to_numpy()
    if wrong.any():
        row = int(np.argmax(wrong))
        rule = "must be a finite number, or empty where nothing was measured" if may_lack else "must be a finite number"
        raise samples.error(row, str(cells.name), f"{rule}, got '{texts.iloc[row]}'")
    return values


def _check_times(rows: Rows) -> None:
    time = rows.values["time"]
    stuck = rows.follows & (np.diff(time) <= 0)
    if stuck.any():
        row = int(np.argmax(stuck)) + 1
        problem = (
            f"{time[row]:.12g} s does not come after {time[row - 1]:.12g} s of the row before; sort the rows by time"
        )
        raise rows.error(row, "time", problem)
