"""The cells of a score table's file: by commas, semicolons or tabs, with decimal points or commas."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from proxytune.errors import ScoresError
from proxytune.scores.table import LARGEST
from proxytune.settings import nearest, read_text

LABELS = ("agent", "episode", "domain")
SEPARATORS = (",", ";", "\t")
Columns = Mapping[str, str]
"""What a column is called in a file, by what it is called here: `{"agent": "policy"}`."""


@dataclass(frozen=True)
class Cells:
    """What stands in a file.

    Attributes:
        path: The file.
        named: Its columns, as the file names them.
        header: The same, those of a column map by the names they have here.
        rows: Line number and cells by column name.
        decimal: What numbers have before their fractions.
    """

    path: Path
    named: Sequence[str]
    header: Sequence[str]
    rows: Sequence[tuple[int, Mapping[str, str]]]
    decimal: str = "."

    def number(self, line: int, column: str, cell: str) -> float:
        """The number in a cell.

        Raises:
            ScoresError: If it is none, or its square would not be.
        """
        value = _number(cell.replace(self.decimal, "."))
        if not abs(value) < LARGEST:
            remedy = "; give it in another unit" if math.isfinite(value) else ""
            problem = f"must be a finite number, got {cell!r}{remedy}"
            raise ScoresError(f"{self.path}: line {line}, column '{column}': {problem}")
        return value


def read_cells(path: Path, metrics: Sequence[str], columns: Columns | None = None) -> Cells:
    """Read a file of scores.

    Args:
        path: CSV, its columns separated by commas, semicolons or tabs; with the latter two, decimals may have commas.
        metrics: The columns that it must have besides that of the agents.
        columns: What columns are called in the file; one that is not there may have its name from here.

    Raises:
        ScoresError: If it cannot be read, or lacks a column.
    """
    text = _text(path)
    separator = _separator(text)
    lines = _lines(path, text, separator)
    header = _renamed(path, lines[0][1], columns or {})
    _check_header(path, header, metrics)
    for line, cells in lines[1:]:
        if len(cells) != len(header):
            raise ScoresError(
                f"{path}: line {line}: has {len(cells)} cells, but the first line names {len(header)} columns"
            )
    rows = [(line, dict(zip(header, cells, strict=True))) for line, cells in lines[1:]]
    return Cells(path, lines[0][1], header, rows, _decimal(path, rows, metrics) if separator != "," else ".")


def _number(text: str) -> float:
    """A number as tables have it; NaN for what is none, be it one to Python, as 1_000 is."""
    try:
        return float(text) if text.isascii() and "_" not in text else math.nan
    except ValueError:
        return math.nan


def column_names(path: Path) -> list[str]:
    """The columns of a file, as its first line names them.

    Raises:
        ScoresError: If it cannot be read.
    """
    text = _text(path)
    return _lines(path, text, _separator(text))[0][1]


def _text(path: Path) -> str:
    try:
        return read_text(path, "utf-8-sig")
    except FileNotFoundError:
        raise ScoresError(f"{path}: no such file; check the path") from None
    except OSError as problem:
        raise ScoresError(f"{path}: cannot be read ({problem.strerror})") from None
    except UnicodeDecodeError:
        raise _no_csv(path) from None


def _separator(text: str) -> str:
    """What separates the columns that the first line names; a comma where nothing does."""
    first = next((line for line in text.splitlines() if line.strip()), "")
    return max(SEPARATORS, key=first.count)


def _lines(path: Path, text: str, separator: str) -> list[tuple[int, list[str]]]:
    """Line number and cells of each line that is not empty, at least one."""
    try:
        reader = csv.reader(io.StringIO(text, newline=""), strict=True, delimiter=separator)
        lines = [(reader.line_num, [cell.strip() for cell in cells]) for cells in reader if cells]
    except csv.Error:
        raise _no_csv(path) from None
    if not lines:
        raise ScoresError(f"{path}: is empty; its first line must name the columns, agent and metrics among them")
    return lines


def _no_csv(path: Path) -> ScoresError:
    return ScoresError(f"{path}: is not a CSV file; save it as comma-separated text (UTF-8)")


def _renamed(path: Path, header: Sequence[str], columns: Columns) -> list[str]:
    """The columns by their names here; another column that has such a name is out of the way."""
    ours = {theirs: name for name, theirs in columns.items() if theirs in header}
    return [ours.get(name, f"{name} of the file" if name in ours.values() else name) for name in header]


def _check_header(path: Path, header: Sequence[str], metrics: Sequence[str]) -> None:
    found = f"columns found: {', '.join(header)[:60]}"
    if "agent" not in header:
        remedy = f"rename the one that names the agents, or give its name: --columns agent={header[0][:20]}"
        remedy = f"{remedy} (in study.toml: target_columns)" if len(header) > 1 else "separate columns by commas"
        raise ScoresError(f"{path}: no column 'agent'; {found}; {remedy}")
    for name in metrics:
        if name not in header:
            others = [column for column in header if column not in LABELS]
            raise ScoresError(f"{path}: no column '{name}'; {nearest(name, others)}")
    for name in (*LABELS, *metrics):
        if header.count(name) > 1:
            raise ScoresError(f"{path}: the first line names the column '{name}' twice; rename one")


def _decimal(path: Path, rows: Sequence[tuple[int, Mapping[str, str]]], metrics: Sequence[str]) -> str:
    """What the numbers of a file have before their fractions.

    Raises:
        ScoresError: If some have a comma and some a point: one of them may separate thousands.
    """
    numbers = [(line, name, row[name]) for line, row in rows for name in metrics]
    commas, points = ([one for one in numbers if mark in one[2]] for mark in ",.")
    if commas and points:
        line, name, cell = commas[0]
        other = f"line {points[0][0]} has {points[0][2]!r}"
        raise ScoresError(f"{path}: line {line}, column '{name}': {cell!r} has a comma, but {other}; write all alike")
    return "," if commas else "."
