"""Opening study.db, and telling what is wrong with it in one line; formats.py says what is in it."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from proxytune.errors import StoreError
from proxytune.storage.checksums import COLUMNS, find_damage, prepare
from proxytune.storage.complaints import corrupt, sqlite_errors_as_store_errors
from proxytune.storage.formats import APPLICATION, BESIDE, FORMAT, convert, make_tables, version_of
from proxytune.storage.own_files import refuse_links

PATIENCE_S = 30.0
WRITING = "PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL; PRAGMA wal_autocheckpoint = 256;"
"""The write-ahead log stays at about 1 MiB: a disk may be small."""
OF_SEVERAL_FILES = bytes.fromhex("d9d505f920a163d7")
"""How a journal of SQLite ends that belongs to a write to several databases."""


def connect(path: Path, *, writable: bool) -> sqlite3.Connection:
    """Open a study's database, whole as it was written; a writable one is made where there is none.

    Raises:
        StoreError: If it is damaged, is something else, comes from a newer proxytune, or cannot be written.
    """
    refuse_links(path.parent)
    if path.exists() and not path.is_file():
        # Opening a pipe would wait for ever.
        what = "a folder" if path.is_dir() else "no file"
        raise StoreError(f"{path}: is {what}, so no study's database; move it away")
    with sqlite_errors_as_store_errors(path):
        undo_broken_write(path)
        connection = open_file(path, writable=writable)
        try:
            _check(connection, path, writable)
            connection = _in_present_format(connection, writable)
            check_tables(connection, path)
            _check_rows(connection, path)
            if writable:
                connection.executescript(WRITING)
        except BaseException:
            connection.close()
            raise
    return connection


def open_file(path: Path, *, writable: bool) -> sqlite3.Connection:
    """Open a file of SQLite, whatever is in it; its schema may call nothing but SQLite's own harmless functions."""
    uri = f"{path.absolute().as_uri()}?mode={'rwc' if writable else 'ro'}"
    connection = sqlite3.connect(uri, uri=True, timeout=PATIENCE_S, isolation_level=None)
    connection.execute("PRAGMA trusted_schema = OFF")
    prepare(connection)
    return connection


def undo_broken_write(path: Path) -> None:
    """Have SQLite undo what a kill broke off between two writes to a database: it does so for writers alone.

    Raises:
        StoreError: If what would be undone was not written by proxytune.
    """
    journal = path.with_name(f"{path.name}-journal")
    if journal.is_file() and path.is_file():
        if journal.read_bytes()[-8:] == OF_SEVERAL_FILES:
            raise StoreError(f"{journal}: names another file for SQLite to delete, so no proxytune wrote it; remove it")
        with suppress(sqlite3.Error), closing(open_file(path, writable=True)) as connection:
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()


def is_begun(path: Path) -> bool:
    """Whether there is a database; not where a kill came before its first table."""
    refuse_links(path.parent)
    undo_broken_write(path)
    return path.is_file() and path.stat().st_size > 0


def check_whole(path: Path) -> None:
    """Refuse a study's database of which anything is damaged.

    Raises:
        StoreError: If it is.
    """
    connect(path, writable=False).close()


def disconnect(connection: sqlite3.Connection) -> None:
    """Close a database, leaving the one file if nobody else has it open."""
    with suppress(sqlite3.Error):
        connection.execute("PRAGMA journal_mode = DELETE")
    connection.close()


def _check(connection: sqlite3.Connection, path: Path, writable: bool) -> None:
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    (tables,) = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    if (application, version, tables) == (0, 0, 0):
        if path.stat().st_size:
            raise corrupt(path, "it has no tables")
        if not writable:
            raise StoreError(f"{path}: is empty; run the study first")
        make_tables(connection)
        return
    if application != APPLICATION:
        raise StoreError(f"{path}: is not a study's database; move it away")
    if version > FORMAT:
        raise StoreError(f"{path}: has format {version}, this proxytune reads up to {FORMAT}; install a newer one")
    _refuse_programs(connection, path)
    if _cut_off(connection, path):
        raise corrupt(path, "its end has been cut off")
    (verdict,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
    if verdict != "ok":
        raise corrupt(path, str(verdict))


def _refuse_programs(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse what runs by itself: proxytune makes tables alone."""
    query = "SELECT type, name FROM sqlite_master WHERE type IN ('trigger', 'view') OR sql LIKE 'CREATE VIRTUAL%'"
    found = connection.execute(query).fetchone()
    if found:
        what, name = found
        raise StoreError(
            f"{path}: has a {what if what != 'table' else 'virtual table'} {name!r:.60}, which no proxytune made; "
            "take its data only from who made it, or move it away"
        )


def _in_present_format(connection: sqlite3.Connection, writable: bool) -> sqlite3.Connection:
    """The database as one of the present format: converted, or, where it is only read, a converted copy in memory."""
    if version_of(connection) == FORMAT:
        return connection
    if not writable:
        return copy_of_earlier(connection)
    convert(connection)
    return connection


def copy_of_earlier(connection: sqlite3.Connection) -> sqlite3.Connection:
    """A copy in memory of a database of an earlier format, in the present one; the database is closed."""
    copy = sqlite3.connect(":memory:", isolation_level=None)
    connection.backup(copy)
    connection.close()
    prepare(copy)
    convert(copy)
    return copy


def check_tables(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse tables that are not as proxytune makes them: others could answer what they like.

    Raises:
        StoreError: If any is missing or another.
    """
    own = sqlite3.connect(":memory:", isolation_level=None)
    make_tables(own)
    for table in BESIDE.values():
        own.execute(table)
    for table in (*COLUMNS, "trials", "chains", *BESIDE):
        query = f"SELECT name, type, pk, hidden FROM pragma_table_xinfo('{table}')"
        found, made = connection.execute(query).fetchall(), own.execute(query).fetchall()
        if found != made and (found or table not in BESIDE):
            raise corrupt(path, f"its table '{table}' is not as proxytune makes it")
    own.close()


def _check_rows(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a database of which any row is not as it was written."""
    connection.execute("BEGIN")
    try:
        damage = find_damage(connection)
    finally:
        connection.execute("COMMIT")
    if damage:
        remedy = f"run: python -m proxytune repair {path.parent}, which keeps all else"
        raise StoreError(f"{path}: is damaged, or was edited by hand: {damage}; {remedy}")


def _cut_off(connection: sqlite3.Connection, path: Path) -> bool:
    """Whether the last page is not whole: SQLite would read zeros where the rest was.

    With a write-ahead log that is no harm: a full disk leaves it so, and the log has the page.
    """
    (page,) = connection.execute("PRAGMA page_size").fetchone()
    log = path.with_name(f"{path.name}-wal")
    return path.stat().st_size % page > 0 and not (log.exists() and log.stat().st_size)


@contextmanager
def transaction(connection: sqlite3.Connection, path: Path) -> Iterator[sqlite3.Connection]:
    """Have all that is written meanwhile be there at once, or nothing of it.

    Raises:
        StoreError: In place of any sqlite3.Error.
    """
    with sqlite_errors_as_store_errors(path):
        connection.execute("BEGIN IMMEDIATE")
        try:
            yield connection
            connection.execute("COMMIT")
        except BaseException:
            # A full disk may have rolled back already.
            with suppress(sqlite3.Error):
                connection.execute("ROLLBACK")
            raise
