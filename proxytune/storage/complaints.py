"""What is said of a study.db that cannot be read or written: always one line, with a remedy."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from proxytune.errors import StoreError


@contextmanager
def sqlite_errors_as_store_errors(path: Path) -> Iterator[None]:
    """Raise every error of SQLite as one line with a remedy.

    Raises:
        StoreError: In place of any sqlite3.Error, and of text that is none.
    """
    try:
        yield
    except sqlite3.Error as problem:
        raise _explained(path, problem) from problem
    except UnicodeDecodeError as problem:
        raise corrupt(path, "it has text that is no UTF-8") from problem


def _explained(path: Path, problem: sqlite3.Error) -> StoreError:
    code = getattr(problem, "sqlite_errorcode", None) or 0
    match code & 0xFF:
        case sqlite3.SQLITE_FULL:
            return StoreError(f"{path}: the disk is full; make room and run again, everything finished is kept")
        case sqlite3.SQLITE_IOERR:
            return StoreError(
                f"{path}: cannot be read or written ({problem}); is the disk full? Everything finished is kept"
            )
        case sqlite3.SQLITE_READONLY | sqlite3.SQLITE_CANTOPEN | sqlite3.SQLITE_PERM:
            return StoreError(
                f"{path}: cannot be written ({problem}); check the folder's permissions or copy the study"
            )
        case sqlite3.SQLITE_BUSY | sqlite3.SQLITE_LOCKED:
            return StoreError(f"{path}: another program holds it open for writing; close that and run again")
        case sqlite3.SQLITE_NOTADB | sqlite3.SQLITE_CORRUPT:
            return corrupt(path, str(problem))
        case _:
            return StoreError(f"{path}: {problem}; if it is damaged, restore a copy or move it away")


def corrupt(path: Path, detail: str) -> StoreError:
    """What to say of a database that is not whole."""
    return StoreError(
        f"{path}: is damaged ({' '.join(detail.split())}); restore a copy, "
        f"or keep what is whole: python -m proxytune repair {path.parent}"
    )


def not_ours(path: Path, problem: Exception) -> StoreError:
    """What to say of a row that is whole, and none that proxytune writes."""
    detail = " ".join(str(problem).split())[:120]
    return StoreError(f"{path}: has a row that no proxytune wrote ({detail}); restore a copy, or move it away")
