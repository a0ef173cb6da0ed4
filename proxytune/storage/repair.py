"""Keeping what is whole of a damaged study.db: its whole rows in a new file, the old one set aside."""

import shutil
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from proxytune.errors import InputError, StoreError
from proxytune.storage.checksums import chain, checksum, count_sweeps, link, missing_sweeps, readable_texts
from proxytune.storage.complaints import sqlite_errors_as_store_errors
from proxytune.storage.database import check_whole, copy_of_earlier, open_file
from proxytune.storage.formats import APPLICATION, FORMAT, make_tables, version_of
from proxytune.storage.own_files import refuse_links
from proxytune.storage.store import FILE_NAME

KEYS: Mapping[str, str] = {
    "facts": "key",
    "instances": "id",
    "episodes": "instance, agent, start, seed",
    "sweeps": "number",
    "trials": "objective, number",
}
Row = tuple[Any, ...]


@dataclass(frozen=True)
class Salvage:
    """What was kept of a damaged database.

    Attributes:
        aside: Where the damaged one is now.
        kept: Rows by table.
        lost: Rows by table that could be read and were not whole, or stand on what was not, and sweeps that are gone;
            others could not be read.
    """

    aside: Path
    kept: Mapping[str, int]
    lost: Mapping[str, int]


def salvage(folder: Path) -> Salvage | None:
    """Put what is whole of a study's database in its place; to be held under the study's lock.

    Trials are kept up to the first that is not whole: a study proposes the others again, the same ones.

    Returns:
        What was kept; None if nothing was damaged, and nothing was done.

    Raises:
        InputError: If there is no database.
        StoreError: If it is another one, of a newer format, of an earlier one and damaged, or cannot be written.
    """
    path = folder / FILE_NAME
    refuse_links(folder)
    if not path.is_file():
        raise InputError(f"{path}: no such file; there is nothing to repair")
    try:
        check_whole(path)
    except StoreError:
        with sqlite_errors_as_store_errors(path):
            return _rebuild(path)
    return None


def _rebuild(path: Path) -> Salvage:
    rows, gone = _rows(path)
    whole = dict(_whole(rows))
    draft = path.with_name(f".{path.name}.draft")
    try:
        for left in (draft, draft.with_name(f"{draft.name}-journal")):
            left.unlink(missing_ok=True)
        _write(draft, whole)
        aside = _set_aside(path)
        draft.replace(path)
    except OSError as problem:
        raise StoreError(f"{path}: cannot be replaced ({problem.strerror}); make room, or copy the study") from None
    finally:
        with suppress(OSError):
            draft.unlink()
    kept = {table: len(whole[table]) for table in KEYS}
    lost = {table: len(rows[table]) - kept[table] for table in KEYS}
    return Salvage(aside, kept, {**lost, "sweeps": lost["sweeps"] + gone})


def _rows(path: Path) -> tuple[dict[str, list[Row]], int]:
    """All rows that can be read, and how many sweeps are there no more."""
    connection = open_file(path, writable=False)
    try:
        connection = _ours(connection, path)
        with readable_texts(connection):
            gone = 0
            with suppress(sqlite3.DatabaseError):
                gone = missing_sweeps(connection)
            return {table: _readable(connection, table) for table in KEYS}, gone
    finally:
        connection.close()


def _ours(connection: sqlite3.Connection, path: Path) -> sqlite3.Connection:
    """The database in the present format, if it is a study's or none at all.

    Raises:
        StoreError: If it is another one, or newer.
    """
    try:
        (application,) = connection.execute("PRAGMA application_id").fetchone()
        version = version_of(connection)
    except sqlite3.DatabaseError:
        return connection
    if application != APPLICATION:
        raise StoreError(f"{path}: is not a study's database; move it away")
    if version > FORMAT:
        raise StoreError(f"{path}: has format {version}, this proxytune reads up to {FORMAT}; install a newer one")
    return copy_of_earlier(connection) if 0 < version < FORMAT else connection


def _readable(connection: sqlite3.Connection, table: str) -> list[Row]:
    """The rows of a table; where a page between is spoilt, those before and those after it."""
    found: dict[Row, Row] = {}
    columns = KEYS[table].split(", ")
    for direction in ("ASC", "DESC"):
        order = ", ".join(f"{column} {direction}" for column in columns)
        try:
            for row in connection.execute(f"SELECT * FROM main.{table} ORDER BY {order}"):
                found[row[: len(columns)]] = row
            break
        except sqlite3.DatabaseError:
            continue
    return sorted(found.values(), key=_by_number if table == "trials" else repr)


def _by_number(trial: Row) -> tuple[str, int]:
    return repr(trial[0]), trial[1] if isinstance(trial[1], int) else 0


def _whole(rows: Mapping[str, list[Row]]) -> Iterator[tuple[str, list[Row]]]:
    """The rows of each table that are as they were written, and stand on others that are."""
    instances = [row for row in rows["instances"] if len(row) == 4 and checksum(*row[1:3]) == row[3]]
    theta = {row[0]: row[2] for row in instances}
    yield "instances", instances
    yield "sweeps", [row for row in rows["sweeps"] if checksum(*row[:-1]) == row[-1]]
    episodes = [row for row in rows["episodes"] if row[0] in theta]
    yield "episodes", [row for row in episodes if checksum(theta[row[0]], *row[1:-1]) == row[-1]]
    facts = [row for row in rows["facts"] if checksum(*row[:-1]) == row[-1]]
    # What a lost fact said, trials may depend on.
    known = len(facts) == len(rows["facts"])
    yield "facts", facts if known else []
    yield "trials", list(_linked(rows["trials"], theta)) if known and facts else []


def _linked(trials: list[Row], theta: Mapping[Any, str]) -> Iterator[Row]:
    """The trials of each search up to the first that does not follow from the one before."""
    digests: dict[Any, str | None] = {}
    for row in trials:
        objective, number, instance, *values, digest = row
        before = digests.get(objective, "")
        if before is None:
            continue
        expected = link(before, (number, theta.get(instance), *values))
        follows = instance in theta and digest == expected
        digests[objective] = expected if follows else None
        if follows:
            yield row


def _write(path: Path, rows: Mapping[str, list[Row]]) -> None:
    connection = open_file(path, writable=True)
    try:
        make_tables(connection)
        connection.execute("BEGIN")
        for table, kept in rows.items():
            for row in kept:
                connection.execute(f"INSERT INTO {table} VALUES ({', '.join('?' * len(row))})", row)
        for (objective,) in connection.execute("SELECT DISTINCT objective FROM trials").fetchall():
            chain(connection, objective)
        count_sweeps(connection)
        connection.execute("COMMIT")
    finally:
        connection.close()


def _set_aside(path: Path) -> Path:
    """Copy the damaged file with its logs of writes, and take the logs away: they belong to no other file."""
    names = (f"{path.name}.damaged{number or ''}" for number in range(10_000))
    aside = next(path.with_name(name) for name in names if not path.with_name(name).exists())
    shutil.copyfile(path, aside)
    for ending in ("-wal", "-journal"):
        log = path.with_name(f"{path.name}{ending}")
        if log.exists():
            shutil.copyfile(log, aside.with_name(f"{aside.name}{ending}"))
    for ending in ("-wal", "-shm", "-journal"):
        path.with_name(f"{path.name}{ending}").unlink(missing_ok=True)
    return aside
