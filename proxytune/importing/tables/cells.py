"""Tables of others: named columns, each cell text or a number, every complaint with file, line and column."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from proxytune.errors import LogError
from proxytune.importing.source import Floats

EMPTY = ("", "nan", "NaN", "NAN", "na", "NA", "n/a", "N/A", "null", "NULL", "none", "None")
"""What stands in a cell in which there is nothing."""


@dataclass(frozen=True)
class Table:
    """Columns of one length.

    Attributes:
        path: The file.
        cells: The columns by name, of numbers, or of texts without blanks around them; the index is the number of each
            row in the file.
        counted: What that number counts, "line" or "row".
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
        """A column as texts (N,).

        Raises:
            LogError: If one is empty.
        """
        texts = self.cells[column].astype(str)
        empty = texts.isin(EMPTY).to_numpy()
        if empty.any():
            raise self.error(int(np.argmax(empty)), column, "is empty; name the drive that the row belongs to")
        return texts.to_numpy(dtype=np.str_)

    def filled(self, column: str) -> int:
        """How many cells of a column are not empty."""
        cells = self.cells[column]
        return len(cells) - int((cells.isna() | cells.isin(EMPTY)).sum())

    def numbers(self, column: str) -> Floats:
        """A column as numbers (N,), NaN where a cell is empty; decimal commas are read as points.

        Raises:
            LogError: If a cell holds something else.
        """
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
