"""The tables of study.db, and how those of earlier formats become the present ones.

For plain SQL (`sqlite3 study.db`); the format is `PRAGMA user_version`:

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
               digest                             of this trial and the digest of the one before
    chains     objective, trials, digest          how many trials a search has, and the digest of the last one
    episodes   instance, agent, start, seed       what determines an episode: the key, so none is ever run twice
               metrics (JSON) or failure          what it scored, or why it failed
               seconds                            how long it took
               code                               of a failure: digest of the user's code that failed; NULL if not known
    sweeps     number, parameter, base (JSON), points (JSON), identity     the curves asked for, the last one last
               target_model                       the target's model.toml as it was; empty without POD
               replays                            identity of the instances whose episodes are POD's replays, or empty
    under_way  place (1), identity, theta (JSON)  the episode that runs in the study's own process; no row between runs.
               agent, start, seed                 The table is made when it is first needed
    sweep_count  place (1), sweeps                how many sweeps there are, so that a deleted one is missed. The table
                                                  is made with the first of them; without it that is not known

Each row of facts, instances, episodes and sweeps has a `checksum` (checksums.py): who edits one by hand is told that it
is damaged.

θ as JSON has its parameters sorted by name and every digit of its numbers. While a study runs, what is written goes to
`study.db-wal` first (SQLite's write-ahead log: a commit costs no wait for the disk, and survives a `kill -9`). That
file belongs to study.db until the next clean end of a run, which leaves the one file.

Earlier formats are still read, from a converted copy in memory, and become the present one when next written to.
Format 1 had neither `target_model`
nor `replays`; its sweeps are drawn again without POD until they are asked for once more, which simulates nothing anew.
Up to format 2 no trial was cut off. Up to format 3 the objective of every trial was PRPV, and its measures were two
columns. Up to format 4 nothing was known of the code of a failure. Up to format 5 nothing told a damaged row.
"""

import json
import sqlite3

from proxytune.storage.checksums import SWEEP_COUNT, seal_all

FORMAT = 6
APPLICATION = 0x70747564  # "ptud"

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
OF_5 = f"""
CREATE TABLE facts (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE instances (
    id INTEGER PRIMARY KEY, identity TEXT NOT NULL, theta TEXT NOT NULL, UNIQUE (identity, theta));
{TRIALS}
CREATE TABLE episodes (
    instance INTEGER NOT NULL REFERENCES instances (id), agent TEXT NOT NULL, start INTEGER NOT NULL,
    seed INTEGER NOT NULL, metrics TEXT, failure TEXT, seconds REAL NOT NULL, code TEXT,
    PRIMARY KEY (instance, agent, start, seed), CHECK ((metrics IS NULL) <> (failure IS NULL))) WITHOUT ROWID;
{SWEEPS}"""
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
FROM_5 = """
ALTER TABLE facts ADD COLUMN checksum INTEGER NOT NULL DEFAULT 0;
ALTER TABLE instances ADD COLUMN checksum INTEGER NOT NULL DEFAULT 0;
ALTER TABLE episodes ADD COLUMN checksum INTEGER NOT NULL DEFAULT 0;
ALTER TABLE sweeps ADD COLUMN checksum INTEGER NOT NULL DEFAULT 0;
ALTER TABLE trials ADD COLUMN digest TEXT NOT NULL DEFAULT '';
CREATE TABLE chains (objective TEXT PRIMARY KEY, trials INTEGER NOT NULL, digest TEXT NOT NULL) WITHOUT ROWID;
"""
UNDER_WAY = """
CREATE TABLE IF NOT EXISTS under_way (
    place INTEGER PRIMARY KEY CHECK (place = 1), identity TEXT NOT NULL, theta TEXT NOT NULL, agent TEXT NOT NULL,
    start INTEGER NOT NULL, seed INTEGER NOT NULL)"""
BESIDE = {"under_way": UNDER_WAY, "sweep_count": SWEEP_COUNT}
"""Tables that are made when they are first needed."""
STEPS = (FROM_1, FROM_2, FROM_3, FROM_4, FROM_5)
"""From each format to the next."""
SCHEMA = f"{OF_5}{FROM_5}PRAGMA application_id = {APPLICATION};"
"""Of a new database: tables made and tables converted are the same to the letter."""


def version_of(connection: sqlite3.Connection) -> int:
    """The format of a database."""
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    return int(version)


def make_tables(connection: sqlite3.Connection) -> None:
    """Make an empty database one of the present format."""
    connection.executescript(f"BEGIN;{SCHEMA}PRAGMA user_version = {FORMAT};COMMIT;")


def convert(connection: sqlite3.Connection) -> None:
    """Make a database of an earlier format one of the present, at once; what it has is taken to be whole."""
    # SQLite's own JSON would round the numbers.
    connection.create_function("measures_json", 2, lambda prpv, ppv: json.dumps({"prpv": prpv, "ppv": ppv}))
    steps = "".join(STEPS[version_of(connection) - 1 :])
    connection.executescript(f"BEGIN;{steps}PRAGMA user_version = {FORMAT};")
    seal_all(connection)
    connection.execute("COMMIT")
