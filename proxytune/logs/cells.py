"""The cells of a CSV file, some rows at a time: as texts they take ten times the memory of the numbers they are."""

import csv
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from proxytune.errors import LogError
from proxytune.settings import read_text

AT_ONCE = 10_000
"""So many rows are read at a time."""

CHARACTERS = 1_000_000
"""At least so many characters of a text are split into lines at a time."""


class Block(NamedTuple):
    """Rows one after another.

    Attributes:
        lines: Line of each in the file.
        cells: Its cells.
    """

    lines: tuple[int, ...]
    cells: tuple[list[str], ...]


def read_cells(path: Path) -> tuple[list[str], Iterator[Block]]:
    """The columns that the first line names, and the rows below it; lines that are blank are passed over.

    Raises:
        LogError: If it is no CSV file, or empty; of what is no CSV further down, when that is read.
    """
    rows = _rows(path)
    _, header = next(rows, (0, []))
    if not header:
        raise LogError(f"{path}: is empty; its first line must name the columns, episode and time first")
    return [cell.strip() for cell in header], _blocks(rows)


def _blocks(rows: Iterator[tuple[int, list[str]]]) -> Iterator[Block]:
    while some := list(itertools.islice(rows, AT_ONCE)):
        yield Block(*zip(*some, strict=True))


def _rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Number and cells of every line that is not blank."""
    try:
        rows = csv.reader(_lines(read_text(path, "utf-8-sig")), strict=True)
        yield from ((line, row) for line, row in enumerate(rows, start=1) if any(row))
    except FileNotFoundError:
        raise LogError(f"{path}: no such file; a log has its samples beside log.toml") from None
    except OSError as problem:
        raise LogError(f"{path}: cannot be read ({problem.strerror})") from None
    except (UnicodeDecodeError, csv.Error):
        raise LogError(f"{path}: is not a CSV file; save it as comma-separated text (UTF-8)") from None


def _lines(text: str) -> Iterator[str]:
    begin = 0
    while begin < len(text):
        end = text.find("\n", begin + CHARACTERS) + 1 or len(text)
        yield from text[begin:end].splitlines()
        begin = end
