"""A study.db as earlier versions wrote it, made of a present one."""

import json
import sqlite3

from proxytune.storage.checksums import COLUMNS
from proxytune.storage.formats import TRIALS_3

WITHOUT_CHECKSUMS = "DROP TABLE chains; ALTER TABLE trials DROP COLUMN digest;" + "".join(
    f"ALTER TABLE {table} DROP COLUMN checksum;" for table in COLUMNS
)
WITHOUT_CODE = "ALTER TABLE episodes DROP COLUMN code;"
WITH_PRPV_ALONE = f"""
ALTER TABLE trials RENAME TO trials_4;
{TRIALS_3}
INSERT INTO trials SELECT number, instance, state, measure(measures, 'prpv'), measure(measures, 'ppv'), failed_episodes,
    failure, decided, bound, NULL FROM trials_4 ORDER BY number;
DROP TABLE trials_4;"""
WITHOUT_CUTTING = """
ALTER TABLE trials RENAME TO trials_3;
CREATE TABLE trials (
    number INTEGER PRIMARY KEY, instance INTEGER NOT NULL REFERENCES instances (id),
    state TEXT NOT NULL CHECK (state IN ('open', 'finished', 'failed')),
    prpv REAL, ppv REAL, failed_episodes INTEGER NOT NULL DEFAULT 0, failure TEXT NOT NULL DEFAULT '');
INSERT INTO trials SELECT number, instance, state, prpv, ppv, failed_episodes, failure FROM trials_3;
DROP TABLE trials_3;"""
WITHOUT_POD = """
ALTER TABLE sweeps RENAME TO sweeps_2;
CREATE TABLE sweeps (
    parameter TEXT NOT NULL, base TEXT NOT NULL, points TEXT NOT NULL, identity TEXT NOT NULL,
    PRIMARY KEY (parameter, base, points, identity)) WITHOUT ROWID;
INSERT INTO sweeps SELECT parameter, base, points, identity FROM sweeps_2;
DROP TABLE sweeps_2;"""
BACK = {
    5: f"DROP TABLE IF EXISTS under_way; DROP TABLE IF EXISTS sweep_count; {WITHOUT_CHECKSUMS}",
    4: WITHOUT_CODE,
    3: WITH_PRPV_ALONE,
    2: WITHOUT_CUTTING,
    1: WITHOUT_POD,
}
"""To each format from the one after it."""


def make_earlier(path, version):
    """Make a database of the present format one of an earlier, of trials by PRPV that were not cut off."""
    plain = sqlite3.connect(path, isolation_level=None)
    plain.create_function("measure", 2, lambda measures, name: json.loads(measures).get(name))
    for number, script in BACK.items():
        if number >= version:
            plain.executescript(script)
    plain.execute(f"PRAGMA user_version = {version}")
    plain.close()
