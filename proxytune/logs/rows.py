"""Rows of samples.csv, commands.csv and frames.csv: read strictly, every complaint with file, line and column.

Cells are read some rows at a time: as texts they take ten times the memory of the numbers that they are.
"""

import csv
import itertools
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from proxytune.arrays import Flags, Floats, Whole
from proxytune.errors import LogError
from proxytune.settings import NO_CSV, nearest, table_text

AT_ONCE = 10_000
"""So many rows are read at a time."""
CHARACTERS = 1_000_000
"""At least so many characters of a text are split into lines at a time."""


class Block(NamedTuple):
    """Rows one after another: the line of each in the file, and its cells."""

    lines: tuple[int, ...]
    cells: tuple[list[str], ...]


def read_cells(path: Path) -> tuple[list[str], Iterator[Block]]:
    """The columns that the first line names, and the rows below it; lines that are blank are passed over."""
    rows = _rows(path)
    _, header = next(rows, (0, []))
    if not header:
        raise LogError(f"{path}: is empty; its first line must name the columns, episode and time first")
    blocks = iter(lambda: list(itertools.islice(rows, AT_ONCE)), [])
    return [cell.strip() for cell in header], (Block(*zip(*some, strict=True)) for some in blocks)


def _rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Number and cells of every line that is not blank."""
    text = table_text(path, LogError, missing="a log has its samples beside log.toml")
    try:
        rows = csv.reader(_lines(text), strict=True)
        yield from ((line, row) for line, row in enumerate(rows, start=1) if any(row))
    except csv.Error:
        raise LogError(f"{path}: {NO_CSV}") from None


def _lines(text: str) -> Iterator[str]:
    begin = 0
    while begin < len(text):
        end = text.find("\n", begin + CHARACTERS) + 1 or len(text)
        yield from text[begin:end].splitlines()
        begin = end


LARGEST = 1e50
"""Beyond this the square of a number's square is not finite."""


@dataclass(frozen=True)
class Rows:
    """The rows of samples.csv, commands.csv or frames.csv, N of them in E episodes, and the line of each (N,).

    The first row of each episode is known (E,); columns are by name (N,), NaN where a cell is empty.
    """

    path: Path
    lines: Whole
    names: tuple[str, ...]
    firsts: Whole
    values: Mapping[str, Floats]

    @property
    def ends(self) -> Whole:
        """The row behind the last one of each episode (E,)."""
        return np.append(self.firsts[1:], len(self.lines))

    @property
    def episode(self) -> Whole:
        """Episode of each row (N,)."""
        return np.repeat(np.arange(len(self.firsts)), self.ends - self.firsts)

    @property
    def follows(self) -> Flags:
        """True for each row from the second on that is of the same episode as the one before (N − 1,)."""
        return np.asarray(np.diff(self.episode) == 0)

    def columns(self, names: tuple[str, ...]) -> Floats:
        """Some columns side by side (N, len(names))."""
        return np.stack([self.values[name] for name in names], axis=1) if names else np.empty((len(self.lines), 0))

    def error(self, row: int, column: str, problem: str) -> LogError:
        """The one-line complaint about a cell."""
        return LogError(f"{self.path}: line {self.lines[row]}, column '{column}': {problem}")


Names = tuple[str, ...]


def read_rows(
    path: Path,
    needed: Names,
    why: str,
    *,
    together: Names = (),
    optional: Names = (),
    may_lack: Names = (),
    fewest: int = 1,
) -> Rows:
    """Read a table with these columns besides `episode` and `time`, and so many rows an episode at the fewest.

    Columns that belong `together` are there all or none, those that are `optional` may be left out, and cells of those
    that `may_lack` some may be empty. For a complaint, `why` says what needs the columns.
    """
    header, blocks = read_cells(path)
    _check_header(path, header, ("episode", "time", *needed), why, together, optional)
    parts = [_part(path, header, may_lack, block) for block in blocks]
    if not parts:
        raise LogError(f"{path}: has no rows; add one per sample")
    labels = np.concatenate([part.labels for part in parts])
    changes = np.flatnonzero(np.append(True, labels[1:] != labels[:-1]))
    names = tuple(str(label) for label in labels[changes])
    rows = Rows(path, np.concatenate([part.lines for part in parts]), names, changes, {})
    _check_episodes(rows, fewest)
    for name in parts[0].values:
        # The first cell of the first column that has any which is no number
        if wrong := next((part.wrong[name] for part in parts if name in part.wrong), None):
            allowed = ", or empty where nothing was measured" if name in may_lack else ""
            line, text = wrong
            raise LogError(f"{path}: line {line}, column '{name}': must be a finite number{allowed}, got '{text}'")
    values = {name: np.concatenate([part.values[name] for part in parts]) for name in parts[0].values}
    rows = replace(rows, values=values)
    time = values["time"]
    stuck = rows.follows & (np.diff(time) <= 0)
    if stuck.any():
        row = int(np.argmax(stuck)) + 1
        late = f"{time[row]:.12g} s does not come after {time[row - 1]:.12g} s of the row before"
        remedy = "take one of them out" if time[row] == time[row - 1] else "sort the rows by time"
        raise rows.error(row, "time", f"{late}; {remedy}")
    return rows


def check_known_episodes(rows: Rows, names: Sequence[str]) -> None:
    """Refuse episodes that samples.csv does not have."""
    for name, first in zip(rows.names, rows.firsts, strict=True):
        if name not in names:
            raise rows.error(int(first), "episode", f"'{name}' is not in samples.csv; add its poses, or leave it out")


class _Part(NamedTuple):
    """Some of the rows, all (N,): line in the file, episode, and columns by name, NaN where a cell is no number.

    Of each column `wrong` has line and text of the first cell that is neither a number nor may be empty.
    """

    lines: Whole
    labels: NDArray[np.object_]
    values: Mapping[str, Floats]
    wrong: Mapping[str, tuple[int, str]]


def _part(path: Path, header: Sequence[str], may_lack: Names, block: Block) -> _Part:
    for line, row in zip(*block, strict=True):
        if len(row) != len(header):
            counts = f"has {len(row)} cells, but the first line names {len(header)} columns"
            raise LogError(f"{path}: line {line}: {counts}")
    columns = dict(zip(header, zip(*block.cells, strict=True), strict=True))
    # One text for all rows of an episode, not one for each.
    labels = np.array([sys.intern(cell.strip()) for cell in columns.pop("episode")], dtype=object)
    texts = {name: np.array([cell.strip() for cell in cells], dtype=object) for name, cells in columns.items()}
    values = {name: pd.to_numeric(own, errors="coerce").astype(np.float64) for name, own in texts.items()}
    odd = {name: ~(np.abs(own) < LARGEST) for name, own in values.items()}
    for name in set(may_lack) & set(odd):
        odd[name] &= texts[name] != ""
    firsts = {name: int(np.argmax(own)) for name, own in odd.items() if own.any()}
    wrong = {name: (block.lines[row], str(texts[name][row])) for name, row in firsts.items()}
    return _Part(np.array(block.lines), labels, values, wrong)


def _check_header(path: Path, header: Sequence[str], needed: Names, why: str, together: Names, optional: Names) -> None:
    known = (*needed, *together, *optional)
    needed = (*needed, *together) if set(together) & set(header) else needed
    for name in header:
        if name not in known:
            parted = len(header) == 1 and any(mark in name for mark in ";\t")
            remedy = "separate columns by commas, or have `import` read it" if parted else nearest(name, known)
            raise LogError(f"{path}: line 1: unknown column '{name}'; {remedy}")
        if list(header).count(name) > 1:
            raise LogError(f"{path}: line 1: names the column '{name}' twice; take one of them out")
    for name in needed:
        if name not in header:
            raise LogError(f"{path}: line 1: no column '{name}'; {why} need {','.join(needed)}")


def _check_episodes(samples: Rows, fewest: int) -> None:
    for name, first in zip(samples.names, samples.firsts, strict=True):
        if not name:
            raise samples.error(int(first), "episode", "is empty; name the drive")
    repeated = pd.Series(samples.names).duplicated().to_numpy()
    if repeated.any():
        again = int(np.argmax(repeated))
        problem = f"'{samples.names[again]}' comes back after another episode; keep each episode's rows together"
        raise samples.error(int(samples.firsts[again]), "episode", problem)
    short = samples.ends - samples.firsts < fewest
    if short.any():
        single = int(np.argmax(short))
        problem = f"'{samples.names[single]}' has a single row; a drive needs two or more, so leave it out"
        raise samples.error(int(samples.firsts[single]), "episode", problem)
