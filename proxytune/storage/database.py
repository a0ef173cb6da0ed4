"""study.db: its tables, its format, and what tells that it is not as it was written.

The format is `PRAGMA user_version`; docs/reference/study_db.md says what its tables and columns are, for plain SQL.

θ as JSON has its parameters sorted by name and every digit of its numbers. Each row but those of counts has a `digest`,
the last column: BLAKE2 of its other values, as Python writes them in ASCII. So a changed value and a row that moved
are told by its digest, a deleted row by its table's count. This tells damage and careless edits; who wants to deceive
can compute both as well.

While a study runs, what is written goes to `study.db-wal` first (SQLite's write-ahead log: a commit costs no wait for
the disk, and survives a `kill -9`). That file belongs to study.db until the next clean end of a run, which leaves the
one file.

Formats 1 to 6 were never released and are refused. From 7 on each format is converted until version 1.0: formats/ has
what makes it of the one before. It is then verified as it was, read from a converted copy in memory, and becomes the
present one when next written to.
"""

import hashlib
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from proxytune.errors import StoreError
from proxytune.extensions import Interrupted
from proxytune.storage.folder import refuse_links

APPLICATION = 0x70747564  # "ptud"
KEYS: Mapping[str, str] = {
    "facts": "key",
    "instances": "identity, theta",
    "trials": "objective, number",
    "episodes": "instance, agent, start, seed",
    "sweeps": "parameter, base, points, identity, replays",
    "under_way": "place",
}
"""The tables whose rows have digests and are counted, each with the columns of which no two rows have the same."""
FIRST = 7
STEPS = tuple(path.read_text(encoding="utf-8") for path in sorted((Path(__file__).parent / "formats").glob("*.sql")))
"""What makes an empty database one of the first format, and then what makes each format the next."""
FORMAT = FIRST + len(STEPS) - 1
SINGULAR = {"instances": "domain instance", "under_way": "note of the episode under way"}
"""What a row is called where that is not its table's name without the s."""
PATIENCE_S = 30.0
WRITING = "PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL; PRAGMA wal_autocheckpoint = 256;"
"""The write-ahead log stays at about 1 MiB: a disk may be small."""
OF_SEVERAL_FILES = bytes.fromhex("d9d505f920a163d7")
"""How a journal of SQLite ends that belongs to a write to several databases."""


class DamagedError(StoreError):
    """A study.db that is not as it was written; `repair` keeps what is whole of it."""


def connect(path: Path, *, writable: bool) -> sqlite3.Connection:
    """Open a study's database, whole as it was written; a writable one is made where there is none.

    Raises:
        DamagedError: If it is not whole.
        StoreError: If it is something else, has another format than can be read, or cannot be written.
    """
    refuse_links(path.parent)
    if path.exists() and not path.is_file():
        # Opening a pipe would wait for ever.
        what = "a folder" if path.is_dir() else "no file"
        raise StoreError(f"{path}: is {what}, so no study's database; move it away")
    # A kill as it was made leaves it empty too, but then no page has been written.
    if writable and path.exists() and not path.stat().st_size and path.with_name("report.html").exists():
        problem = "is empty, and report.html beside it tells of a run"
        raise StoreError(f"{path}: {problem}; restore a copy, or remove it to begin anew")
    with sqlite_errors_as_store_errors(path):
        undo_broken_write(path)
        connection = open_file(path, writable=writable)
        try:
            version = _check(connection, path, writable)
            if version < FORMAT:
                connection = _converted(connection, version, writable)
            if writable:
                connection.executescript(WRITING)
        except BaseException:
            connection.close()
            raise
    return connection


def disconnect(connection: sqlite3.Connection) -> None:
    """Close a database, leaving the one file if nobody else has it open."""
    with suppress(sqlite3.Error):
        connection.execute("PRAGMA journal_mode = DELETE")
    connection.close()


def open_file(path: Path, *, writable: bool) -> sqlite3.Connection:
    """Open a file of SQLite, whatever is in it; its schema may call nothing but SQLite's own harmless functions."""
    uri = f"{path.absolute().as_uri()}?mode={'rwc' if writable else 'ro'}"
    connection = sqlite3.connect(uri, uri=True, timeout=PATIENCE_S, isolation_level=None)
    connection.execute("PRAGMA trusted_schema = OFF")
    connection.create_function("row_digest", -1, digest_of, deterministic=True)
    return connection


def undo_broken_write(path: Path) -> None:
    """Have SQLite undo what a kill broke off between two writes to a database: it does so for writers alone."""
    journal = path.with_name(f"{path.name}-journal")
    if journal.is_file() and path.is_file():
        if journal.read_bytes()[-8:] == OF_SEVERAL_FILES:
            raise StoreError(f"{journal}: names another file for SQLite to delete, so no proxytune wrote it; remove it")
        with suppress(sqlite3.Error), closing(open_file(path, writable=True)) as connection:
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()


def make_tables(connection: sqlite3.Connection, version: int = FORMAT) -> None:
    """Make an empty database one of a format."""
    steps = "".join(STEPS[: version - FIRST + 1])
    connection.executescript(f"BEGIN;{steps}PRAGMA application_id = {APPLICATION};PRAGMA user_version = {version};")
    connection.executemany("INSERT INTO counts VALUES (?, 0)", [(table,) for table in KEYS])
    connection.execute("COMMIT")


@contextmanager
def transaction(connection: sqlite3.Connection, path: Path) -> Iterator[sqlite3.Connection]:
    """Have all that is written meanwhile be there at once, or nothing of it; one is over before the next begins."""
    with sqlite_errors_as_store_errors(path):
        # Ctrl-C may come between any two lines: before the one that ends a transaction too.
        connection.rollback()
        connection.execute("BEGIN IMMEDIATE")
        try:
            yield connection
            connection.commit()
        except GeneratorExit:
            # Python ends here what Ctrl-C left open, and so late that the transaction now may be another.
            raise
        except BaseException:
            connection.rollback()  # where a full disk has not done so already
            raise


def write_row(connection: sqlite3.Connection, table: str, row: Mapping[str, Any]) -> bool:
    """Write a whole row in place of the one with its key, with its digest, and count it; in a transaction.

    What the row has beside the table's columns is left out. Gives whether there was one with its key.
    """
    delete, insert = _writing(table, FORMAT)
    replaced = connection.execute(delete, row).rowcount
    connection.execute(insert, row)
    if not replaced:
        connection.execute("UPDATE counts SET rows = rows + 1 WHERE name = ?", (table,))
    return bool(replaced)


@cache
def _writing(table: str, version: int) -> tuple[str, str]:
    """SQL that deletes the row with a row's key, and that inserts the row; its digest is of the values as stored."""
    columns = _columns(version)[table]
    where = " AND ".join(f"{name} = :{name}" for name in KEYS[table].split(", "))
    places, stored = (f":{name}" for name in columns), (f"CAST(:{name} AS {kind})" for name, kind in columns.items())
    insert = f"INSERT INTO {table} ({', '.join(columns)}, digest) VALUES ({', '.join(places)}"
    return f"DELETE FROM {table} WHERE {where}", f"{insert}, row_digest({', '.join(stored)}))"


def seal(connection: sqlite3.Connection, *tables: str) -> None:
    """Write the digests and counts of tables that others than write_row have changed; of all if none is named."""
    columns = _columns(FORMAT)
    for table in tables or columns:
        connection.execute(f"UPDATE {table} SET digest = row_digest({', '.join(columns[table])})")
        connection.execute(f"INSERT OR REPLACE INTO counts SELECT '{table}', count(*) FROM {table}")


def drop_damaged(connection: sqlite3.Connection) -> None:
    """Delete the rows that are not as they were written, or belong to a domain instance that is not."""
    for table, columns in _columns(FORMAT).items():
        orphan = "OR instance NOT IN (SELECT id FROM instances)" if "instance" in columns else ""
        connection.execute(f"DELETE FROM {table} WHERE digest IS NOT row_digest({', '.join(columns)}) {orphan}")


def digest_of(*values: Any) -> str:
    """The digest of a row's values."""
    return hashlib.blake2b(ascii(values).encode(), digest_size=8).hexdigest()


def counted(connection: sqlite3.Connection) -> dict[str, int]:
    """Count the rows that the tables had; tables of which that cannot be read are left out."""
    return {name: rows for name, rows in connection.execute("SELECT name, rows FROM counts") if type(rows) is int}


@contextmanager
def readable_texts(connection: sqlite3.Connection) -> Iterator[None]:
    """Have damaged text that is no UTF-8 read too; a text that has become a BLOB remains one."""
    connection.text_factory = lambda text: str(text, "utf-8", "surrogateescape")
    try:
        yield
    finally:
        connection.text_factory = str


@contextmanager
def sqlite_errors_as_store_errors(path: Path) -> Iterator[None]:
    """Raise every error of SQLite as one line with a remedy."""
    try:
        yield
    except sqlite3.Error as problem:
        # `digest_of` fails at nothing: a signal came meanwhile, and SQLite does not tell which.
        if "user-defined function" in str(problem):
            raise Interrupted.latest() from problem
        raise _explained(path, problem) from problem
    except UnicodeDecodeError as problem:
        raise _corrupt(path, "it has text that is no UTF-8") from problem


def _explained(path: Path, problem: sqlite3.Error) -> StoreError:
    code = getattr(problem, "sqlite_errorcode", None) or 0
    match code & 0xFF:
        case sqlite3.SQLITE_FULL:
            why = "the disk is full; make room and run again, everything finished is kept"
        case sqlite3.SQLITE_IOERR:
            why = f"cannot be read or written ({problem}); is the disk full? Everything finished is kept"
        case sqlite3.SQLITE_READONLY | sqlite3.SQLITE_CANTOPEN | sqlite3.SQLITE_PERM:
            why = f"cannot be written ({problem}); check the folder's permissions or copy the study"
        case sqlite3.SQLITE_BUSY | sqlite3.SQLITE_LOCKED:
            why = "another program holds it open for writing; close that and run again"
        case sqlite3.SQLITE_NOTADB | sqlite3.SQLITE_CORRUPT:
            return _corrupt(path, str(problem))
        case _:
            why = f"{problem}; if it is damaged, restore a copy or move it away"
    return StoreError(f"{path}: {why}")


def _corrupt(path: Path, detail: str) -> DamagedError:
    remedy = f"restore a copy, or keep what is whole: python -m proxytune repair {path.parent}"
    return DamagedError(f"{path}: is damaged ({' '.join(detail.split())}); {remedy}")


def _check(connection: sqlite3.Connection, path: Path, writable: bool) -> int:
    """The format of a database that is whole, or was empty and has its tables now."""
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    (tables,) = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    if (application, version, tables) == (0, 0, 0):
        if path.stat().st_size:
            raise _corrupt(path, "it has no tables")
        if not writable:
            raise StoreError(f"{path}: is empty; run the study first")
        make_tables(connection)
        return FORMAT
    if application != APPLICATION:
        raise StoreError(f"{path}: is not a study's database; move it away")
    if version > FORMAT:
        raise StoreError(f"{path}: has format {version}, this proxytune reads up to {FORMAT}; install a newer one")
    if version < FIRST:
        made = f"has format {version}, made by a version of proxytune that was never released"
        raise StoreError(f"{path}: {made}; start the study anew in another folder, or move study.db away")
    _refuse_programs(connection, path)
    # SQLite would read zeros where the rest of the last page was. With a write-ahead log a part of a page is no harm: a
    # full disk leaves it so, and the log has the page.
    (page,) = connection.execute("PRAGMA page_size").fetchone()
    log = path.with_name(f"{path.name}-wal")
    if path.stat().st_size % page > 0 and not (log.exists() and log.stat().st_size):
        raise _corrupt(path, "its end has been cut off")
    (verdict,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
    if verdict != "ok":
        raise _corrupt(path, str(verdict))
    _check_tables(connection, path, version)
    _check_rows(connection, path, version)
    return int(version)


def _refuse_programs(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse what runs by itself: proxytune makes tables alone."""
    query = "SELECT type, name FROM sqlite_master WHERE type IN ('trigger', 'view') OR sql LIKE 'CREATE VIRTUAL%'"
    if found := connection.execute(query).fetchone():
        what, name = found
        has = f"has a {what if what != 'table' else 'virtual table'} {name!r:.60}, which no proxytune made"
        raise StoreError(f"{path}: {has}; take its data only from who made it, or move it away")


def _check_tables(connection: sqlite3.Connection, path: Path, version: int) -> None:
    """Refuse tables that are not as proxytune makes them: others could answer what they like."""
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as own:
        make_tables(own, version)
        for (table,) in own.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall():
            query = f"SELECT name, type, pk, hidden FROM pragma_table_xinfo('{table}')"
            if connection.execute(query).fetchall() != own.execute(query).fetchall():
                raise _corrupt(path, f"its table '{table}' is not as proxytune makes it")


def _check_rows(connection: sqlite3.Connection, path: Path, version: int) -> None:
    """Refuse a database of which any row is not as it was written, or is there no more."""
    # All is read as it was at one moment, whoever writes meanwhile.
    connection.execute("BEGIN")
    with connection, readable_texts(connection):
        rows, damage = counted(connection), []
        for table, columns in _columns(version).items():
            found = connection.execute(f"SELECT digest, {', '.join(columns)} FROM {table}").fetchall()
            count = sum(row[0] != digest_of(*row[1:]) for row in found)
            count += abs(rows[table] - len(found)) if table in rows else 1
            damage += [f"{count} {SINGULAR.get(table, table[:-1])}{'s' * (count > 1)}"] if count else []
    if damage:
        remedy = f"run: python -m proxytune repair {path.parent}, which keeps all else"
        raise DamagedError(f"{path}: is damaged, or was edited by hand: {', '.join(damage)}; {remedy}")


@cache
def _columns(version: int) -> Mapping[str, Mapping[str, str]]:
    """The columns of each table with digests in a format, with their types; instances before what belongs to them."""
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as own:
        make_tables(own, version)
        query = "SELECT name, type FROM pragma_table_info(?)"
        found = {table: own.execute(query, (table,)).fetchall() for table in KEYS}
    return {
        table: {name: kind for name, kind in columns if name != "digest"} for table, columns in found.items() if columns
    }


def _converted(connection: sqlite3.Connection, version: int, writable: bool) -> sqlite3.Connection:
    """A whole database of an earlier format as one of the present; where it is only read, a copy in memory."""
    if not writable:
        copy = sqlite3.connect(":memory:", isolation_level=None)
        connection.backup(copy)
        connection.close()
        copy.create_function("row_digest", -1, digest_of, deterministic=True)
        connection = copy
    steps = "".join(STEPS[version - FIRST + 1 :])
    connection.executescript(f"BEGIN;{steps}PRAGMA user_version = {FORMAT};")
    seal(connection)
    connection.execute("COMMIT")
    return connection
