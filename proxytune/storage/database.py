"""Opening study.db, and telling what is wrong with it in one line.

The tables, for plain SQL (`sqlite3 study.db`); the format is `PRAGMA user_version`:

    facts      key, value (JSON)                  what determines the trials: settings, target and domain family
    instances  id, identity, theta (JSON)         domain instances S_θ: the family's identity and the parameters
    trials     objective, number (from 1)         which search it belongs to, and its place there
               instance, state                    'open', 'finished', 'failed' or 'cut'
               score                              what the search makes small (of one that was cut off: the estimate)
               measures (JSON)                    every measure by name, the objective's among them
               failed_episodes, failure           how many of its episodes failed; why it has no score
               decided (JSON), bound              of one that was cut off: the agents driven, what its PRPV cannot be
                                                  below
               seconds                            how long it took, where its episodes do not tell
    episodes   instance, agent, start, seed       what determines an episode: the key, so none is ever run twice
               metrics (JSON) or failure          what it scored, or why it failed
               seconds                            how long it took
               code                               of a failure: digest of the user's code that failed; NULL if not known
    sweeps     number, parameter, base (JSON), points (JSON), identity     the curves asked for, the last one last
               target_model                       the target's model.toml as it was; empty without POD
               replays                            identity of the instances whose episodes are POD's replays, or empty

θ as JSON has its parameters sorted by name and every digit of its numbers. While a study runs, what is written goes to
`study.db-wal` first (SQLite's write-ahead log: a commit costs no wait for the disk, and survives a `kill -9`). That
file belongs to study.db until the next clean end of a run, which leaves the one file.

Earlier formats are still read, from a converted copy in memory, and become the present one when next written to.
Format 1 had neither `target_model`
nor `replays`; its sweeps are drawn again without POD until they are asked for once more, which simulates nothing anew.
Up to format 2 no trial was cut off. Up to format 3 the objective of every trial was PRPV, and its measures were two
columns. Up to format 4 nothing was known of the code of a failure.
"""

import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from proxytune.errors import StoreError

FORMAT = 5
APPLICATION = 0x70747564  # "ptud"
PATIENCE_S = 30.0

SWEEPS = """
CREATE TABLE sweeps (
    number INTEGER PRIMARY KEY, parameter TEXT NOT NULL, base TEXT NOT NULL, points TEXT NOT NULL,
    identity TEXT NOT NULL, target_model TEXT NOT NULL DEFAULT '', replays TEXT NOT NULL DEFAULT '',
    UNIQUE (parameter, base, points, identity, replays));"""
TRIALS_3 = """
CREATE TABLE trials (
    number INTEGER PRIMARY KEY, instance INTEGER NOT NULL REFERENCES instances (id),
    state TEXT NOT NULL CHECK (state IN ('open', 'finished', 'failed', 'cut')),
    prpv REAL, ppv REAL, failed_episodes INTEGER NOT NULL DEFAULT 0, failure TEXT NOT NULL DEFAULT '',
    decided TEXT NOT NULL DEFAULT '[]', bound REAL, estimate REAL);"""
TRIALS = """
CREATE TABLE trials (
    objective TEXT NOT NULL, number INTEGER NOT NULL, instance INTEGER NOT NULL REFERENCES instances (id),
    state TEXT NOT NULL CHECK (state IN ('open', 'finished', 'failed', 'cut')),
    score REAL, measures TEXT NOT NULL DEFAULT '{}', failed_episodes INTEGER NOT NULL DEFAULT 0,
    failure TEXT NOT NULL DEFAULT '', decided TEXT NOT NULL DEFAULT '[]', bound REAL, seconds REAL NOT NULL DEFAULT 0,
    PRIMARY KEY (objective, number)) WITHOUT ROWID;"""
SCHEMA = f"""
BEGIN;
CREATE TABLE facts (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE instances (
    id INTEGER PRIMARY KEY, identity TEXT NOT NULL, theta TEXT NOT NULL, UNIQUE (identity, theta));
{TRIALS}
CREATE TABLE episodes (
    instance INTEGER NOT NULL REFERENCES instances (id), agent TEXT NOT NULL, start INTEGER NOT NULL,
    seed INTEGER NOT NULL, metrics TEXT, failure TEXT, seconds REAL NOT NULL, code TEXT,
    PRIMARY KEY (instance, agent, start, seed), CHECK ((metrics IS NULL) <> (failure IS NULL))) WITHOUT ROWID;
{SWEEPS}
PRAGMA application_id = {APPLICATION};
PRAGMA user_version = {FORMAT};
COMMIT;
"""
FROM_1 = f"""
ALTER TABLE sweeps RENAME TO sweeps_1;
{SWEEPS}
INSERT INTO sweeps (parameter, base, points, identity)
    SELECT parameter, base, points, identity FROM sweeps_1 ORDER BY parameter, base, points, identity;
DROP TABLE sweeps_1;
"""
FROM_2 = f"""
ALTER TABLE trials RENAME TO trials_2;
{TRIALS_3}
INSERT INTO trials (number, instance, state, prpv, ppv, failed_episodes, failure)
    SELECT number, instance, state, prpv, ppv, failed_episodes, failure FROM trials_2;
DROP TABLE trials_2;
"""
FROM_3 = f"""
ALTER TABLE trials RENAME TO trials_3;
{TRIALS}
INSERT INTO trials
    SELECT 'prpv', number, instance, state, coalesce(estimate, prpv),
        CASE state WHEN 'finished' THEN measures_json(prpv, ppv) ELSE '{{}}' END,
        failed_episodes, failure, decided, bound, 0.0 FROM trials_3;
DROP TABLE trials_3;
"""
FROM_4 = "ALTER TABLE episodes ADD COLUMN code TEXT;"
STEPS = (FROM_1, FROM_2, FROM_3, FROM_4)
"""From each format to the next."""


def connect(path: Path, *, writable: bool) -> sqlite3.Connection:
    """Open a study's database; a writable one is made where there is none.

    Raises:
        StoreError: If it is corrupt, is something else, comes from a newer proxytune, or cannot be written.
    """
    if path.is_dir():
        raise StoreError(f"{path}: is a folder, not a study's database; move it away")
    uri = f"{path.absolute().as_uri()}?mode={'rwc' if writable else 'ro'}"
    with sqlite_errors_as_store_errors(path):
        connection = sqlite3.connect(uri, uri=True, timeout=PATIENCE_S, isolation_level=None)
        try:
            _check(connection, path, writable)
            connection = _in_present_format(connection, writable)
            if writable:
                connection.execute("PRAGMA journal_mode = WAL")
                connection.execute("PRAGMA synchronous = NORMAL")
        except BaseException:
            connection.close()
            raise
    return connection


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
            raise _corrupt(path, "it has no tables")
        if not writable:
            raise StoreError(f"{path}: is empty; run the study first")
        connection.executescript(SCHEMA)
        return
    if application != APPLICATION:
        raise StoreError(f"{path}: is not a study's database; move it away")
    if version > FORMAT:
        raise StoreError(f"{path}: has format {version}, this proxytune reads up to {FORMAT}; install a newer one")
    (verdict,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if verdict != "ok":
        raise _corrupt(path, str(verdict))
    if _cut_off(connection, path):
        raise _corrupt(path, "its end has been cut off")


def _in_present_format(connection: sqlite3.Connection, writable: bool) -> sqlite3.Connection:
    """The database as one of the present format: converted, or, where it is only read, a converted copy in memory."""
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version == FORMAT:
        return connection
    if not writable:
        copy = sqlite3.connect(":memory:", isolation_level=None)
        connection.backup(copy)
        connection.close()
        connection = copy
    # SQLite's own JSON would round the numbers.
    connection.create_function("measures_json", 2, lambda prpv, ppv: json.dumps({"prpv": prpv, "ppv": ppv}))
    steps = "".join(STEPS[version - 1 :])
    connection.executescript(f"BEGIN;{steps}PRAGMA user_version = {FORMAT};\nCOMMIT;")
    return connection


def _cut_off(connection: sqlite3.Connection, path: Path) -> bool:
    """Whether the last page is not whole: SQLite would read zeros where the rest was.

    With a write-ahead log that is no harm: a full disk leaves it so, and the log has the page.
    """
    (page,) = connection.execute("PRAGMA page_size").fetchone()
    log = path.with_name(f"{path.name}-wal")
    return path.stat().st_size % page > 0 and not (log.exists() and log.stat().st_size)


@contextmanager
def sqlite_errors_as_store_errors(path: Path) -> Iterator[None]:
    """Raise every error of SQLite as one line with a remedy.

    Raises:
        StoreError: In place of any sqlite3.Error.
    """
    try:
        yield
    except sqlite3.Error as problem:
        raise _explained(path, problem) from problem


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
            return _corrupt(path, str(problem))
        case _:
            return StoreError(f"{path}: {problem}; if it is damaged, restore a copy or move it away")


def _corrupt(path: Path, detail: str) -> StoreError:
    return StoreError(
        f"{path}: is damaged ({' '.join(detail.split())}); restore a copy, or move it away to start again"
    )
