"""Keeping what is whole of a damaged study.db: its whole rows in a new file, the old one set aside.

A trial is kept with all before it in its search, since it was proposed from these; where an episode of it is lost,
`study` drives that again. Where a fact is lost no trial is kept: what it said, they may depend on.
"""

import shutil
import sqlite3
from collections.abc import Mapping
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path

from proxytune.errors import InputError, StoreError
from proxytune.files import draft_of
from proxytune.storage import database
from proxytune.storage.folder import refuse_links
from proxytune.storage.store import FILE_NAME

KEPT = ("facts", "instances", "episodes", "sweeps", "trials")
"""All but the note of the episode under way, which tells only of a process that ended."""
WITH_A_GAP_BEFORE = """
    number > (SELECT count(*) FROM trials AS other WHERE other.objective = trials.objective
    AND other.number <= trials.number)"""


@dataclass(frozen=True)
class Salvage:
    """Rows kept of a damaged database."""

    problem: str  # what was wrong with it, in one line
    aside: Path  # where the damaged one is now
    kept: Mapping[str, int]  # rows by table
    lost: Mapping[str, int]  # rows by table that were counted or could be read, and are not kept


def salvage(folder: Path) -> Salvage | None:
    """Put what is whole of a study's database in its place; to be held under the study's lock.

    Returns:
        What was kept; None if nothing was damaged, and nothing was done.

    Raises:
        InputError: If there is no database.
        StoreError: If it is another one, of a format that is not read, or cannot be written.
    """
    path = folder / FILE_NAME
    refuse_links(folder)
    if not path.is_file():
        raise InputError(f"{path}: no such file; there is nothing to repair")
    try:
        database.connect(path, writable=False).close()
    except database.DamagedError as problem:
        with database.sqlite_errors_as_store_errors(path):
            return _rebuild(path, str(problem))
    return None


def _rebuild(path: Path, problem: str) -> Salvage:
    draft = path.with_name(f".{path.name}.draft")
    try:
        for left in (draft, draft.with_name(f"{draft.name}-journal")):
            left.unlink(missing_ok=True)
        with (
            closing(database.open_file(path, writable=False)) as damaged,
            closing(database.open_file(draft, writable=True)) as whole,
        ):
            database.make_tables(whole)
            whole.execute("BEGIN")
            there = _copy(damaged, whole)
            database.drop_damaged(whole)
            if whole.execute("SELECT count(*) FROM facts").fetchone()[0] < there["facts"]:
                whole.execute("DELETE FROM facts")
                whole.execute("DELETE FROM trials")
            whole.execute(f"DELETE FROM trials WHERE {WITH_A_GAP_BEFORE}")
            database.seal(whole)
            kept = {table: database.counted(whole)[table] for table in KEPT}
            whole.execute("COMMIT")
        aside = _set_aside(path)
        _take_logs_away(path)
        draft.replace(path)
    except OSError as failure:
        raise StoreError(f"{path}: cannot be replaced ({failure.strerror}); make room, or copy the study") from None
    finally:
        with suppress(OSError):
            draft.unlink()
    return Salvage(problem, aside, kept, {table: there[table] - kept[table] for table in KEPT})


def _copy(damaged: sqlite3.Connection, whole: sqlite3.Connection) -> dict[str, int]:
    """Copy all rows that can be read, and return how many there were of each table, counted or read.

    Where a page of a table is spoilt, the rows before it and those after it are read.
    """
    there = dict.fromkeys(KEPT, 0)
    with database.readable_texts(damaged):
        with suppress(sqlite3.DatabaseError):
            there |= {table: rows for table, rows in database.counted(damaged).items() if table in there}
        for table in KEPT:
            found: dict[tuple[object, ...], None] = {}
            for order in ("1, 2", "1 DESC, 2 DESC"):
                with suppress(sqlite3.DatabaseError):
                    for row in damaged.execute(f"SELECT * FROM main.{table} ORDER BY {order}"):
                        found[row] = None
                    break
            there[table] = max(there[table], len(found))
            for row in found:
                # Text that is none is in a row that is not whole.
                with suppress(UnicodeEncodeError):
                    whole.execute(f"INSERT OR IGNORE INTO {table} VALUES ({', '.join('?' * len(row))})", row)
    return there


def _set_aside(path: Path) -> Path:
    """Copy the damaged file with its logs of writes, each whole or not at all."""
    names = (f"{path.name}.damaged{number or ''}" for number in range(10_000))
    aside = next(path.with_name(name) for name in names if not path.with_name(name).exists())
    for ending in ("-wal", "-journal", ""):
        file = path.with_name(f"{path.name}{ending}")
        if file.exists():
            with draft_of(aside.with_name(f"{aside.name}{ending}")) as draft:
                shutil.copyfile(file, draft)
    return aside


def _take_logs_away(path: Path) -> None:
    """Bring the log's writes into the damaged file, which after a kill is thus there as a whole, and remove the logs.

    SQLite would take a log that is left beside another file for that one's.
    """
    try:
        with closing(database.open_file(path, writable=True)) as damaged:
            busy, *_ = damaged.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
        if busy:
            raise StoreError(f"{path}: another program holds it open; close that and run again")
    except sqlite3.DatabaseError as problem:
        # What SQLite cannot read at all has given no row either
        if problem.sqlite_errorcode & 0xFF not in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR):
            raise
    for ending in ("-wal", "-shm", "-journal"):
        path.with_name(f"{path.name}{ending}").unlink(missing_ok=True)
