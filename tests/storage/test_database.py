import json
import shutil
import sqlite3

import pytest

from proxytune.errors import StoreError
from proxytune.storage import salvage
from proxytune.storage.checksums import COLUMNS
from proxytune.storage.database import OF_SEVERAL_FILES, connect, disconnect, open_file, sqlite_errors_as_store_errors
from proxytune.storage.formats import FORMAT, TRIALS_3


def made(path):
    disconnect(connect(path, writable=True))
    return path


def test_a_database_is_made_with_its_format_and_plain_tables(tmp_path):
    path = made(tmp_path / "study.db")
    with sqlite3.connect(path) as plain:
        assert plain.execute("PRAGMA user_version").fetchone() == (FORMAT,)
        names = {name for (name,) in plain.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    assert names == {"facts", "instances", "trials", "chains", "episodes", "sweeps"}


def test_a_clean_end_leaves_the_one_file(tmp_path):
    connection = connect(tmp_path / "study.db", writable=True)
    connection.execute("INSERT INTO facts VALUES ('seed', '1', row_checksum('seed', '1'))")
    disconnect(connection)
    assert [path.name for path in tmp_path.iterdir()] == ["study.db"]
    with sqlite3.connect(tmp_path / "study.db") as plain:
        assert plain.execute("SELECT key, value FROM facts").fetchall() == [("seed", "1")]


def test_it_can_be_read_while_it_is_written(tmp_path):
    writer = connect(tmp_path / "study.db", writable=True)
    writer.execute("INSERT INTO facts VALUES ('seed', '1', row_checksum('seed', '1'))")
    writer.execute("BEGIN IMMEDIATE")
    writer.execute("INSERT INTO facts VALUES ('starts', '3', row_checksum('starts', '3'))")
    reader = connect(tmp_path / "study.db", writable=False)
    assert reader.execute("SELECT key FROM facts").fetchall() == [("seed",)]
    reader.close()
    writer.execute("COMMIT")
    disconnect(writer)


def test_an_empty_file_left_by_a_kill_becomes_a_database(tmp_path):
    (tmp_path / "study.db").touch()
    connection = connect(tmp_path / "study.db", writable=True)
    assert connection.execute("SELECT count(*) FROM trials").fetchone() == (0,)
    connection.close()


def test_reading_an_empty_file_says_to_run_the_study(tmp_path):
    (tmp_path / "study.db").touch()
    with pytest.raises(StoreError, match="is empty; run the study first"):
        connect(tmp_path / "study.db", writable=False)


def refused(path, expected, writable=True):
    before = path.read_bytes()
    with pytest.raises(StoreError) as told_error:
        connect(path, writable=writable)
    assert expected in str(told_error.value)
    assert str(path) in str(told_error.value)
    assert "\n" not in str(told_error.value)
    assert path.read_bytes() == before, "a refused database must stay as it was"


def test_a_newer_format_is_refused(tmp_path):
    path = made(tmp_path / "study.db")
    with sqlite3.connect(path) as plain:
        plain.execute(f"PRAGMA user_version = {FORMAT + 1}")
    refused(path, f"has format {FORMAT + 1}, this proxytune reads up to {FORMAT}; install a newer one")


UNDO_5 = "DROP TABLE chains; ALTER TABLE trials DROP COLUMN digest;" + "".join(
    f"ALTER TABLE {table} DROP COLUMN checksum;" for table in COLUMNS
)
"""Makes a database of format 5 of a new one."""

OLD_TRIALS = f"""
{UNDO_5}
ALTER TABLE episodes DROP COLUMN code;
DROP TABLE trials;
CREATE TABLE trials (
    number INTEGER PRIMARY KEY, instance INTEGER NOT NULL REFERENCES instances (id),
    state TEXT NOT NULL CHECK (state IN ('open', 'finished', 'failed')),
    prpv REAL, ppv REAL, failed_episodes INTEGER NOT NULL DEFAULT 0, failure TEXT NOT NULL DEFAULT '');
INSERT INTO instances VALUES (1, 'identity', '{{}}');
INSERT INTO trials VALUES (1, 1, 'finished', 4.0, 0.25, 1, ''), (2, 1, 'failed', NULL, NULL, 3, 'it fell');
PRAGMA user_version = 2;
"""
TRIAL = "objective, number, instance, state, score, measures, failed_episodes, failure, decided, bound, seconds"
TRIALS_OF_2 = f"SELECT {TRIAL} FROM trials ORDER BY number"
CONVERTED_TRIALS = [
    ("prpv", 1, 1, "finished", 4.0, '{"prpv": 4.0, "ppv": 0.25}', 1, "", "[]", None, 0.0),
    ("prpv", 2, 1, "failed", None, "{}", 3, "it fell", "[]", None, 0.0),
]
TRIALS_OF_3 = f"""
{UNDO_5}
ALTER TABLE episodes DROP COLUMN code;
DROP TABLE trials;
{TRIALS_3}
INSERT INTO instances VALUES (1, 'identity', '{{}}');
INSERT INTO trials VALUES (1, 1, 'finished', 4.0, {1 / 3!r}, 1, '', '[]', NULL, NULL),
    (2, 1, 'cut', NULL, NULL, 0, '', '["agent1"]', 5.0, 12.5), (3, 1, 'open', NULL, NULL, 0, '', '[]', NULL, NULL);
PRAGMA user_version = 3;
"""
OLD_SWEEPS = """
DROP TABLE sweeps;
CREATE TABLE sweeps (
    parameter TEXT NOT NULL, base TEXT NOT NULL, points TEXT NOT NULL, identity TEXT NOT NULL,
    PRIMARY KEY (parameter, base, points, identity)) WITHOUT ROWID;
INSERT INTO sweeps VALUES ('trim', '{}', '[-0.3, 0.3]', 'identity'), ('blur', '{}', '[0.0, 0.1]', 'identity');
INSERT INTO facts VALUES ('seed', '1');
PRAGMA user_version = 1;
"""
SWEEPS_OF_1 = "SELECT number, parameter, base, points, identity, target_model, replays FROM sweeps ORDER BY number"
CONVERTED = [
    (1, "blur", "{}", "[0.0, 0.1]", "identity", "", ""),
    (2, "trim", "{}", "[-0.3, 0.3]", "identity", "", ""),
]


@pytest.fixture
def of_format_2(tmp_path):
    path = made(tmp_path / "study.db")
    with sqlite3.connect(path) as plain:
        plain.executescript(OLD_TRIALS)
    return path


@pytest.fixture
def of_format_1(of_format_2):
    with sqlite3.connect(of_format_2) as plain:
        plain.executescript(OLD_SWEEPS)
    return of_format_2


def test_format_1_is_read_as_it_is(of_format_1):
    before = of_format_1.read_bytes()
    connection = connect(of_format_1, writable=False)
    assert connection.execute(SWEEPS_OF_1).fetchall() == CONVERTED
    assert connection.execute(TRIALS_OF_2).fetchall() == CONVERTED_TRIALS
    connection.close()
    assert of_format_1.read_bytes() == before


def test_format_2_is_read_as_it_is(of_format_2):
    before = of_format_2.read_bytes()
    connection = connect(of_format_2, writable=False)
    assert connection.execute(TRIALS_OF_2).fetchall() == CONVERTED_TRIALS
    assert connection.execute(SWEEPS_OF_1).fetchall() == []
    connection.close()
    assert of_format_2.read_bytes() == before


def test_format_2_becomes_the_present_one_when_opened_for_writing_and_keeps_what_it_had(of_format_2):
    disconnect(connect(of_format_2, writable=True))
    with sqlite3.connect(of_format_2) as plain:
        assert plain.execute("PRAGMA user_version").fetchone() == (FORMAT,)
        assert plain.execute(TRIALS_OF_2).fetchall() == CONVERTED_TRIALS
        plain.execute("UPDATE trials SET state = 'cut'")


def test_format_1_becomes_the_present_one_when_opened_for_writing_and_keeps_what_it_had(of_format_1):
    disconnect(connect(of_format_1, writable=True))
    with sqlite3.connect(of_format_1) as plain:
        assert plain.execute("PRAGMA user_version").fetchone() == (FORMAT,)
        assert plain.execute(SWEEPS_OF_1).fetchall() == CONVERTED
        assert plain.execute(TRIALS_OF_2).fetchall() == CONVERTED_TRIALS
        assert plain.execute("SELECT key, value FROM facts").fetchall() == [("seed", "1")]
        names = {name for (name,) in plain.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    assert names == {"facts", "instances", "trials", "chains", "episodes", "sweeps"}


@pytest.mark.parametrize("writable", [True, False])
def test_trials_of_format_3_have_their_scores_and_measures_to_the_last_bit(tmp_path, writable):
    path = made(tmp_path / "study.db")
    with sqlite3.connect(path) as plain:
        plain.executescript(TRIALS_OF_3)
    connection = connect(path, writable=writable)
    rows = connection.execute("SELECT number, state, score, measures, bound FROM trials ORDER BY number").fetchall()
    connection.close()
    assert json.loads(rows[0][3]) == {"prpv": 4.0, "ppv": 1 / 3}
    assert [(*row[:3], row[4]) for row in rows] == [
        (1, "finished", 4.0, None),
        (2, "cut", 12.5, 5.0),
        (3, "open", None, None),
    ]


def test_a_new_database_and_a_converted_one_have_the_same_tables(of_format_1, tmp_path):
    disconnect(connect(of_format_1, writable=True))
    new = made(tmp_path / "new.db")
    tables = []
    for path in (of_format_1, new):
        with sqlite3.connect(path) as plain:
            tables.append(sorted(plain.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL")))
    assert tables[0] == tables[1]


def test_somebody_else_s_database_is_refused(tmp_path):
    with sqlite3.connect(tmp_path / "study.db") as plain:
        plain.execute("CREATE TABLE photos (name TEXT)")
    refused(tmp_path / "study.db", "is not a study's database; move it away")


def test_a_text_file_is_refused(tmp_path):
    (tmp_path / "study.db").write_text("trial,prpv\n" * 200)
    refused(tmp_path / "study.db", "is damaged (file is not a database); restore a copy")


def filled(path):
    connection = connect(path, writable=True)
    rows = [(number, f"identity {number}", "{}") for number in range(3000)]
    connection.execute("BEGIN")
    connection.executemany("INSERT INTO instances VALUES (?1, ?2, ?3, row_checksum(?2, ?3))", rows)
    connection.execute("COMMIT")
    disconnect(connection)
    return path


def test_a_database_with_a_spoilt_page_is_refused(tmp_path):
    path = filled(tmp_path / "study.db")
    content = bytearray(path.read_bytes())
    content[15 * 4096 : 16 * 4096] = b"?" * 4096
    path.write_bytes(content)
    refused(path, "is damaged")


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_a_truncated_database_is_refused(tmp_path, share):
    path = filled(tmp_path / "study.db")
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    refused(path, "is damaged")
    refused(path, "is damaged", writable=False)


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    with pytest.raises(StoreError, match=r"cannot be written \(unable to open database file\)"):
        connect(tmp_path / "nowhere" / "study.db", writable=True)


ONE_MORE = "INSERT INTO instances VALUES (?1, ?2, '{}', row_checksum(?2, '{}'))"


def test_a_full_disk_is_told_and_what_was_committed_stays(tmp_path):
    path = tmp_path / "study.db"
    connection = connect(path, writable=True)
    (pages,) = connection.execute("PRAGMA page_count").fetchone()
    connection.execute(f"PRAGMA max_page_count = {pages + 2}")
    written = 0
    with (
        pytest.raises(StoreError, match="the disk is full; make room and run again"),
        sqlite_errors_as_store_errors(path),
    ):
        for number in range(10_000):
            connection.execute(ONE_MORE, (number, f"identity {number}"))
            written += 1
    connection.close()
    again = connect(path, writable=True)
    assert again.execute("SELECT count(*) FROM instances").fetchone() == (written,)
    assert written > 10
    again.close()


def test_a_database_that_another_program_writes_to_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("proxytune.storage.database.PATIENCE_S", 0.05)
    path = made(tmp_path / "study.db")
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    with pytest.raises(StoreError, match="another program holds it open"):
        connect(path, writable=True)
    other.close()


def test_a_part_of_a_page_is_refused_but_not_beside_the_log_that_has_the_whole_one(tmp_path):
    """A full disk may leave it so."""
    path = filled(tmp_path / "study.db")
    content = path.read_bytes()
    path.write_bytes(content[:-1])
    refused(path, "is damaged (its end has been cut off)")
    path.write_bytes(content)
    writer = connect(path, writable=True)
    writer.execute("INSERT INTO facts VALUES ('seed', '1', row_checksum('seed', '1'))")
    with path.open("ab") as main_file:
        main_file.write(b"?" * 100)
    reader = connect(path, writable=False)
    assert reader.execute("SELECT key, value FROM facts").fetchall() == [("seed", "1")]
    assert reader.execute("SELECT count(*) FROM instances").fetchall() == [(3000,)]
    reader.close()
    writer.close()


def test_a_file_without_tables_is_refused_and_not_begun_anew(tmp_path):
    (tmp_path / "study.db").write_bytes(b"S")
    refused(tmp_path / "study.db", "is damaged (it has no tables)")


def test_a_folder_is_refused(tmp_path):
    (tmp_path / "study.db").mkdir()
    with pytest.raises(StoreError, match=r"study\.db: is a folder, so no study's database; move it away"):
        connect(tmp_path / "study.db", writable=True)


def test_format_4_knew_nothing_of_the_code_of_failures(tmp_path):
    path = made(tmp_path / "study.db")
    with sqlite3.connect(path) as plain:
        plain.executescript(
            f"{UNDO_5} ALTER TABLE episodes DROP COLUMN code; PRAGMA user_version = 4;"
            " INSERT INTO instances VALUES (1, 'i', '{}');"
            " INSERT INTO episodes VALUES (1, 'a', 0, 1, NULL, 'it fell', 0.5), (1, 'a', 1, 1, '{}', NULL, 0.5);"
        )
    disconnect(connect(path, writable=True))
    with sqlite3.connect(path) as plain:
        assert plain.execute("PRAGMA user_version").fetchone() == (FORMAT,)
        rows = plain.execute("SELECT start, failure, code FROM episodes ORDER BY start").fetchall()
    assert rows == [(0, "it fell", None), (1, None, None)]


def test_a_stranger_s_schema_may_not_call_our_functions(tmp_path):
    path = made(tmp_path / "study.db")
    with sqlite3.connect(path) as plain:
        plain.create_function("row_checksum", -1, lambda *values: 0, deterministic=True)
        plain.execute("CREATE VIEW evil AS SELECT row_checksum(key) FROM facts")
    connection = open_file(path, writable=True)
    with pytest.raises(sqlite3.OperationalError, match="unsafe use of row_checksum"):
        connection.execute("SELECT * FROM evil").fetchall()
    connection.close()


@pytest.fixture
def broken_off(tmp_path):
    """A database with 3000 instances, killed in the middle of deleting them all."""
    path, killed = filled(tmp_path / "study.db"), tmp_path / "killed" / "study.db"
    killed.parent.mkdir()
    writer = sqlite3.connect(path, isolation_level=None)
    writer.executescript("PRAGMA cache_size = 1; BEGIN; DELETE FROM instances;")
    for ending in ("", "-journal"):
        shutil.copy(f"{path}{ending}", f"{killed}{ending}")
    writer.close()
    return killed


@pytest.mark.parametrize("writable", [True, False])
def test_a_write_that_a_kill_broke_off_is_undone_also_by_who_only_looks(broken_off, writable):
    connection = connect(broken_off, writable=writable)
    assert connection.execute("SELECT count(*) FROM instances").fetchone() == (3000,)
    connection.close()
    assert salvage(broken_off.parent) is None, "nothing is damaged"


def test_a_broken_off_write_is_no_damage_to_a_repair(broken_off):
    assert salvage(broken_off.parent) is None
    connection = connect(broken_off, writable=False)
    assert connection.execute("SELECT count(*) FROM instances").fetchone() == (3000,)
    connection.close()


@pytest.mark.parametrize("writable", [True, False])
def test_a_journal_that_would_have_another_file_deleted_is_refused(broken_off, tmp_path, writable):
    """SQLite takes that for the journal of a write to several databases, and deletes it once all is undone."""
    victim = tmp_path / "precious"
    victim.write_text("mine")
    name = str(victim).encode()
    numbers = [(1 << 30) // 4096 + 1, len(name), sum(name)]
    place, length, total = (number.to_bytes(4, "big") for number in numbers)
    with (broken_off.parent / "study.db-journal").open("ab") as journal:
        journal.write(place + name + length + total + OF_SEVERAL_FILES)
    with pytest.raises(StoreError, match="study.db-journal: names another file"):
        connect(broken_off, writable=writable)
    assert victim.read_text() == "mine"
