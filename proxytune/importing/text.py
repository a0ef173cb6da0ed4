"""Text files as tables: separators, decimal commas, comments, and the names that columns usually have.

Each cell is text or a number; every complaint names file, line and column. `pandas.read_csv(sep=None)` cannot do it: it
takes "score" for two columns cut at s and a row too long for one with an index, and refuses blanks of several widths.
"""

import codecs
import csv
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from proxytune.arrays import Floats
from proxytune.errors import LogError
from proxytune.files import package_table
from proxytune.logs import COMMANDS, ENABLED
from proxytune.settings import table_text

EMPTY = ("", "nan", "NaN", "NAN", "na", "NA", "n/a", "N/A", "null", "NULL", "none", "None")
"""What stands in a cell in which there is nothing."""


@dataclass(frozen=True)
class Table:
    """Columns of one length by name, of numbers, or of texts without blanks around them.

    The index is the number of each row in the file, which is `counted` as "line" or "row".
    """

    path: Path
    cells: pd.DataFrame
    counted: str = "line"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(str(name) for name in self.cells.columns)

    def error(self, row: int, column: str, problem: str) -> LogError:
        """The one-line complaint about a cell, its row counted from 0."""
        return LogError(f"{self.path}: {self.counted} {self.cells.index[row]}, column '{column}': {problem}")

    def labels(self, column: str) -> NDArray[np.str_]:
        """A column as texts (N,)."""
        texts = self.cells[column].astype(str)
        empty = texts.isin(EMPTY).to_numpy()
        if empty.any():
            raise self.error(int(np.argmax(empty)), column, "is empty; name the drive that the row belongs to")
        return texts.to_numpy(dtype=np.str_)

    def filled(self, column: str) -> int:
        """Number of cells of a column that are not empty."""
        cells = self.cells[column]
        return len(cells) - int((cells.isna() | cells.isin(EMPTY)).sum())

    def numbers(self, column: str) -> Floats:
        """A column as numbers (N,), NaN where a cell is empty; decimal commas are read as points."""
        cells = self.cells[column]
        values = pd.to_numeric(cells, errors="coerce").to_numpy(dtype=np.float64, copy=True)
        if not pd.api.types.is_numeric_dtype(cells):
            odd = np.flatnonzero(~np.isfinite(values))
            values[odd] = pd.to_numeric(cells.iloc[odd].str.replace(",", "."), errors="coerce")
        wrong = ~np.isfinite(values) & ~(cells.isna() | cells.isin(EMPTY)).to_numpy()
        if wrong.any():
            row = int(np.argmax(wrong))
            cell = str(cells.iloc[row])[:40]
            problem = f"must be a finite number, or empty where nothing was measured, got '{cell}'"
            raise self.error(row, column, problem)
        return values


HEAD_BYTES = 65536
"""How much of a file is looked at to recognise it."""
Lines = list[tuple[int, str]]


def read_text_table(path: Path, names: Sequence[str] = ()) -> Table:
    """Read a text file; where `names` are given it has none of its own, and blanks between its cells."""
    text = table_text(path, LogError, no_text="is not text in UTF-8; save it as a text table in that encoding")
    if "\0" in text:
        raise LogError(f"{path}: is a binary file; save it as a text table, such as CSV")
    comments, lines = _split_comments(text)
    if not lines:
        raise LogError(f"{path}: is empty; it needs a line of column names and a row for each sample")
    separator = ""
    if not names:
        separator, names, lines = _take_header(path, comments, lines)
    if not lines:
        raise LogError(f"{path}: has column names but no rows; add one for each sample")
    rows = []
    for number, line in lines:
        row = _cells(path, number, line, separator)
        if len(row) != len(names):
            counts = f"has {len(row)} cells, but there are {len(names)} columns: {', '.join(names)}"
            raise LogError(f"{path}: line {number}: {counts}; correct that line")
        rows.append(row)
    table = pd.DataFrame(rows, columns=list(names), index=[number for number, _ in lines], dtype=str)
    return Table(path, table)


def first_rows(path: Path) -> list[list[str]]:
    """The first four rows of a file that are no comments, split into cells; none where it is not text."""
    try:
        with path.open("rb") as file:
            text = codecs.getincrementaldecoder("utf-8-sig")().decode(file.read(HEAD_BYTES))
        _, lines = _split_comments(text)
        separator = _separator(lines[0][1]) if lines else ""
        return [_cells(path, number, line, separator) for number, line in lines[:4]]
    except (OSError, UnicodeDecodeError, LogError):
        return []


def is_number(cell: str) -> bool:
    """True if a cell holds a number, with a decimal point or comma."""
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _split_comments(text: str) -> tuple[Lines, Lines]:
    """Lines that are not blank, with their numbers: the comments before the first row, and all that is no comment."""
    lines = [(number, line) for number, line in enumerate(text.splitlines(), start=1) if line.strip(" \t,;")]
    rows = [line for line in lines if not line[1].lstrip().startswith("#")]
    first = rows[0][0] if rows else 0
    return [line for line in lines if line[0] < first], rows


def _take_header(path: Path, comments: Lines, lines: Lines) -> tuple[str, list[str], Lines]:
    """The separator, the columns' names and the rows; the last comment may hold the names."""
    number, line = lines[0]
    separator = _separator(line)
    cells = _cells(path, number, line, separator)
    if not all(is_number(cell) for cell in cells if cell):
        return separator, _names(path, number, cells), lines[1:]
    if comments:
        number, line = comments[-1][0], comments[-1][1].lstrip().lstrip("#")
        names = _cells(path, number, line, _separator(line)) if line.strip() else []
        if len(names) == len(cells):
            return separator, _names(path, number, names), lines
    raise LogError(f"{path}: line {lines[0][0]}: holds numbers where the columns' names should be; add a line of names")


def _names(path: Path, number: int, cells: list[str]) -> list[str]:
    names = [cell or f"column {place}" for place, cell in enumerate(cells, start=1)]
    if repeated := [name for name, count in Counter(names).items() if count > 1]:
        raise LogError(f"{path}: line {number}: names the column '{repeated[0]}' twice; rename one of them")
    return names


def _separator(line: str) -> str:
    """The separator of the cells of a line; "" stands for blanks."""
    return next((mark for mark in (";", "\t", ",") if mark in line), "")


def _cells(path: Path, number: int, line: str, separator: str) -> list[str]:
    if not separator:
        return line.split()
    try:
        row = next(csv.reader([line], delimiter=separator, strict=True, skipinitialspace=True))
        return [cell.strip() for cell in row]
    except csv.Error as problem:
        raise LogError(f"{path}: line {number}: is not a row of a CSV table ({problem}); correct that line") from None


PLACE = ("x", "y", "z")
QUATERNION = ("qx", "qy", "qz", "qw")
POSE = (*PLACE, "heading", *QUATERNION)
COMMAND_FIELDS = (*(field for pair in COMMANDS.values() for field in pair), ENABLED)
EXAMPLE = "--columns time=stamp_ns:ns,x=pos_x_mm:mm,y=pos_y_mm:mm,heading=yaw_deg:deg,v=cmd_lin,omega=cmd_ang"
"""A column map, for complaints."""
FIELDS = package_table("importing/fields.toml")
QUANTITIES: Mapping[str, str] = {field: known["quantity"] for field, known in FIELDS.items()}
"""What each field measures."""
USUAL = {field: frozenset(known.get("usual", "").split()) for field, known in FIELDS.items()}
"""Usual names of each field."""
