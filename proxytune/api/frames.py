"""DataFrames given to the readers of files: there is one way to read, and complaints speak of rows."""

import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pandas as pd

from proxytune.errors import InputError

LABELS = ("agent", "episode", "time")
"""What may be an index instead of a column."""


@contextmanager
def as_files(frames: Mapping[str, pd.DataFrame]) -> Iterator[Path]:
    """A folder with each DataFrame as NAME.csv, while a reader reads it.

    Raises:
        InputError: What the reader raises, in terms of the DataFrames; rows are counted from 0.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for title, frame in frames.items():
            _with_labels(title, frame).to_csv(folder / f"{title}.csv", index=False)
        try:
            yield folder
        except InputError as problem:
            raise type(problem)(_in_rows(str(problem).replace(f"{folder}/", ""))) from None


def _with_labels(title: str, frame: pd.DataFrame) -> pd.DataFrame:
    """The DataFrame with the labels of its index as columns."""
    if not isinstance(frame, pd.DataFrame):
        raise InputError(f"{title}: must be a DataFrame, got {type(frame).__name__}")
    return frame.reset_index([name for name in frame.index.names if name in LABELS and name not in frame.columns])


def _in_rows(problem: str) -> str:
    """A complaint about lines of a file as one about rows of a DataFrame."""
    rows = re.sub(r"^(\w+)\.csv: line (\d+)", lambda found: f"{found[1]}: row {int(found[2]) - 2}", problem)
    return re.sub(r"\b(\w+)\.csv\b", r"\1", rows.replace(": row -1:", ":"))
