"""Text files as tables: separators, decimal commas, comments and the names of the columns."""

import codecs
import csv
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from proxytune.errors import LogError
from proxytune.importing.tables.cells import Table

HEAD_BYTES = 65536
"""How much of a file is looked at to recognise it."""

Lines = list[tuple[int, str]]


def read_text_table(path: Path, names: Sequence[str] = ()) -> Table:
    """Read a text file.

    Args:
        path: The file.
        names: Its columns where it names none itself; its cells are separated by blanks then.

    Raises:
        LogError: If it is not text, is empty, has no names of columns, or a row has another number of cells.
    """
    comments, lines = _split_comments(_read_lines(path))
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
            raise LogError(
                f"{path}: line {number}: has {len(row)} cells, but there are {len(names)} columns: "
                f"{', '.join(names)}; correct that line"
            )
        rows.append(row)
    table = pd.DataFrame(rows, columns=list(names), index=[number for number, _ in lines], dtype=str)
    return Table(path, table)


def first_rows(path: Path, count: int = 4) -> list[list[str]]:
    """The first rows of a file that are no comments, split into cells; none where it is not text."""
    try:
        with path.open("rb") as file:
            text = codecs.getincrementaldecoder("utf-8-sig")().decode(file.read(HEAD_BYTES))
        _, lines = _split_comments(_numbered(text))
        separator = _separator(lines[0][1]) if lines else ""
        return [_cells(path, number, line, separator) for number, line in lines[:count]]
    except (OSError, UnicodeDecodeError, LogError):
        return []


def is_number(cell: str) -> bool:
    """Whether a cell holds a number, with a decimal point or comma."""
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _read_lines(path: Path) -> Lines:
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise LogError(f"{path}: no such file; check the path") from None
    except OSError as problem:
        raise LogError(f"{path}: cannot be read ({problem.strerror})") from None
    except UnicodeDecodeError:
        raise LogError(f"{path}: is not text in UTF-8; save it as a text table in that encoding") from None
    if "\0" in text:
        raise LogError(f"{path}: is a binary file; save it as a text table, such as CSV")
    return _numbered(text)


def _numbered(text: str) -> Lines:
    """Lines that are not blank, with their numbers."""
    return [(number, line) for number, line in enumerate(text.splitlines(), start=1) if line.strip(" \t,;")]


def _split_comments(lines: Lines) -> tuple[Lines, Lines]:
    """The comments before the first row, and all that is no comment."""
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
    repeated = [name for name, count in Counter(names).items() if count > 1]
    if repeated:
        raise LogError(f"{path}: line {number}: names the column '{repeated[0]}' twice; rename one of them")
    return names


def _separator(line: str) -> str:
    """What separates the cells of a line; nothing stands for blanks."""
    return next((mark for mark in (";", "\t", ",") if mark in line), "")


def _cells(path: Path, number: int, line: str, separator: str) -> list[str]:
    if not separator:
        return line.split()
    try:
        row = next(csv.reader([line], delimiter=separator, strict=True, skipinitialspace=True))
        return [cell.strip() for cell in row]
    except csv.Error as problem:
        raise LogError(f"{path}: line {number}: is not a row of a CSV table ({problem}); correct that line") from None
