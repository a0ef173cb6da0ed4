"""What tells a damaged study.db: a checksum over every row, and a chain over the trials of each search.

A row's checksum is the CRC-32 of its values as Python writes them in ASCII. That of an episode covers the θ of its
instance, so that it holds wherever instances are numbered anew. A trial's digest is the SHA-256 of its values and of
the digest before it: a trial that is changed, deleted or renumbered breaks the chain from there on. This tells damage
and careless edits; who wants to deceive can compute it as well.
"""

import hashlib
import sqlite3
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from proxytune.storage.records import under_way_of

COLUMNS: Mapping[str, str] = {
    "facts": "key, value",
    "instances": "identity, theta",
    "episodes": (
        "(SELECT theta FROM instances WHERE id = instance), agent, start, seed, metrics, failure, seconds, code"
    ),
    "sweeps": "number, parameter, base, points, identity, target_model, replays",
}
"""What the checksum of a table's rows covers."""
LINKED = (
    "number, (SELECT theta FROM instances WHERE id = instance),"
    " state, score, measures, failed_episodes, failure, decided, bound, seconds"
)
"""What a trial's digest covers."""
SWEEP_COUNT = """
CREATE TABLE IF NOT EXISTS sweep_count (place INTEGER PRIMARY KEY CHECK (place = 1), sweeps INTEGER NOT NULL)"""
SINGULAR = {
    "facts": "fact",
    "instances": "domain instance",
    "episodes": "episode",
    "sweeps": "sweep",
    "under_way": "note of the episode under way",
}


@dataclass(frozen=True)
class Damage:
    """What of a study.db is not as it was written.

    Attributes:
        rows: How many rows of which table.
        trials: By search, the first trial from which on the chain does not hold, and how many trials there were.
    """

    rows: Mapping[str, int]
    trials: Mapping[str, tuple[int, int]]

    def __bool__(self) -> bool:
        """Whether there is any."""
        return bool(self.rows or self.trials)

    def __str__(self) -> str:
        """In one phrase."""
        rows = [f"{count} {SINGULAR[table]}{'s' * (count > 1)}" for table, count in self.rows.items()]
        trials = [f"{name_trials(*ends)} by {name}" for name, ends in self.trials.items()]
        return ", ".join([*rows, *trials])


def name_trials(first: int, last: int) -> str:
    """Trials from one to another, in one phrase."""
    return f"trial {first}" if first == last else f"trials {first} to {last}"


@contextmanager
def readable_texts(connection: sqlite3.Connection) -> Iterator[None]:
    """Have damaged text that is no UTF-8 read too; a text that has become a BLOB remains one."""
    connection.text_factory = lambda text: str(text, "utf-8", "surrogateescape")
    try:
        yield
    finally:
        connection.text_factory = str


def checksum(*values: Any) -> int:
    """The checksum of a row's values."""
    return zlib.crc32(ascii(values).encode())


def link(before: str, row: tuple[Any, ...]) -> str:
    """The digest of a trial, of its values as LINKED has them, after the trial with another digest."""
    return hashlib.sha256(ascii((before, *row)).encode()).hexdigest()[:16]


def prepare(connection: sqlite3.Connection) -> None:
    """Let SQL compute checksums."""
    connection.create_function("row_checksum", -1, checksum, deterministic=True)


def seal(connection: sqlite3.Connection, table: str, where: str = "TRUE", values: tuple[Any, ...] = ()) -> None:
    """Write the checksums of a table's rows, as they are stored.

    Args:
        connection: Of the database, in a transaction.
        table: Its name.
        where: Which rows.
        values: Of the placeholders of `where`.
    """
    connection.execute(f"UPDATE {table} SET checksum = row_checksum({COLUMNS[table]}) WHERE {where}", values)


def chain(connection: sqlite3.Connection, objective: str, first: int = 1) -> None:
    """Write the digests of a search's trials from one on, and that of the last as the end of its chain."""
    before = connection.execute(
        "SELECT digest FROM trials WHERE objective = ? AND number < ? ORDER BY number DESC", (objective, first)
    ).fetchone()
    digest = before[0] if before else ""
    for row in _trials(connection, objective, first):
        digest = link(digest, row)
        values = (digest, objective, row[0])
        connection.execute("UPDATE trials SET digest = ? WHERE objective = ? AND number = ?", values)
    (count,) = connection.execute("SELECT count(*) FROM trials WHERE objective = ?", (objective,)).fetchone()
    connection.execute("DELETE FROM chains WHERE objective = ?", (objective,))
    if count:
        connection.execute("INSERT INTO chains VALUES (?, ?, ?)", (objective, count, digest))


def count_sweeps(connection: sqlite3.Connection) -> None:
    """Write how many sweeps there are."""
    connection.execute(SWEEP_COUNT)
    connection.execute("INSERT OR REPLACE INTO sweep_count SELECT 1, count(*) FROM sweeps")


def missing_sweeps(connection: sqlite3.Connection) -> int:
    """How many sweeps are there no more; none where they were not counted."""
    if not _has(connection, "sweep_count"):
        return 0
    query = "SELECT max(0, sweeps - (SELECT count(*) FROM sweeps)) FROM sweep_count"
    return sum(int(missing) for (missing,) in connection.execute(query))


def seal_all(connection: sqlite3.Connection) -> None:
    """Write the checksums and digests of all that a database has."""
    for table in COLUMNS:
        seal(connection, table)
    for (objective,) in connection.execute("SELECT DISTINCT objective FROM trials").fetchall():
        chain(connection, objective)


def find_damage(connection: sqlite3.Connection) -> Damage:
    """What is not as it was written."""
    with readable_texts(connection):
        counts = {table: _broken_rows(connection, table) for table in COLUMNS}
        counts["sweeps"] += missing_sweeps(connection)
        counts["under_way"] = _unreadable_notes(connection)
        ends = {name: (count, digest) for name, count, digest in connection.execute("SELECT * FROM chains")}
        names = [name for (name,) in connection.execute("SELECT DISTINCT objective FROM trials")]
        ends = {**dict.fromkeys(names, (0, "")), **ends}
        first = {name: _first_broken(connection, name, *end) for name, end in ends.items()}
    trials = {name: (number, max(number, ends[name][0])) for name, number in first.items() if number is not None}
    return Damage({table: count for table, count in counts.items() if count}, trials)


def _broken_rows(connection: sqlite3.Connection, table: str) -> int:
    rows = connection.execute(f"SELECT checksum, {COLUMNS[table]} FROM {table}")
    return sum(row[0] != checksum(*row[1:]) for row in rows)


def _unreadable_notes(connection: sqlite3.Connection) -> int:
    """How many episodes are noted as under way that are none."""
    count = 0
    for row in _rows_under_way(connection):
        try:
            under_way_of(*row)
        except (ValueError, RecursionError):
            count += 1
    return count


def _rows_under_way(connection: sqlite3.Connection) -> list[tuple[Any, ...]]:
    if not _has(connection, "under_way"):
        return []
    return connection.execute("SELECT theta, agent, start, seed FROM under_way").fetchall()


def _has(connection: sqlite3.Connection, table: str) -> bool:
    query = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = ?"
    return bool(connection.execute(query, (table,)).fetchone()[0])


def _first_broken(connection: sqlite3.Connection, objective: str, count: int, end: str) -> int | None:
    """The number of the first trial from which on the chain does not hold; None if it holds."""
    digest, number, whole = "", 0, 0
    for row in _trials(connection, objective, 1, "digest"):
        expected = link(digest, row[:-1])
        if row[-1] != expected:
            return number + 1
        digest, number, whole = expected, row[0], whole + 1
    return None if (whole, digest) == (count, end) else number + 1


def _trials(connection: sqlite3.Connection, objective: str, first: int, *more: str) -> list[tuple[Any, ...]]:
    columns = ", ".join([LINKED, *more])
    query = f"SELECT {columns} FROM trials WHERE objective = ? AND number >= ? ORDER BY number"
    return connection.execute(query, (objective, first)).fetchall()
