"""study.db as a file: what it is made of, what is refused, and what is told of a damaged one."""

import random
import shutil
import sqlite3
from contextlib import closing, contextmanager
from dataclasses import replace

import pytest
from hypothesis import given, settings, strategies as some

from proxytune.domain import Outcome, make_episode
from proxytune.errors import StoreError
from proxytune.extensions import Interrupted, interrupt
from proxytune.storage import Store, SweepRecord, TrialRecord, database, salvage


@contextmanager
def edited(path):
    """A connection to edit study.db with as a test needs it, with digests that fit, as if a study had been run so."""
    with closing(database.open_file(path, writable=True)) as plain:
        yield plain
        database.seal(plain)


def made(path):
    database.disconnect(database.connect(path, writable=True))
    return path


def add_fact(connection, key, value):
    database.write_row(connection, "facts", {"key": key, "value": value})


def test_a_database_is_made_and_left_clean_as_one_file(tmp_path):
    path = made(tmp_path / "study.db")
    with sqlite3.connect(path) as plain:
        assert plain.execute("PRAGMA user_version").fetchone() == (database.FORMAT,)
        names = {name for (name,) in plain.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    assert names == {"facts", "instances", "trials", "episodes", "sweeps", "under_way", "counts"}
    connection = database.connect(tmp_path / "study.db", writable=True)
    add_fact(connection, "seed", "1")
    database.disconnect(connection)
    assert [path.name for path in tmp_path.iterdir()] == ["study.db"]
    with sqlite3.connect(tmp_path / "study.db") as plain:
        assert plain.execute("SELECT key, value FROM facts").fetchall() == [("seed", "1")]


def test_it_can_be_read_while_it_is_written(tmp_path):
    writer = database.connect(tmp_path / "study.db", writable=True)
    add_fact(writer, "seed", "1")
    writer.execute("BEGIN IMMEDIATE")
    add_fact(writer, "starts", "3")
    reader = database.connect(tmp_path / "study.db", writable=False)
    assert reader.execute("SELECT key FROM facts").fetchall() == [("seed",)]
    reader.close()
    writer.execute("COMMIT")
    database.disconnect(writer)


def test_an_empty_file_beside_the_page_of_a_run_is_not_begun_anew(tmp_path):
    (tmp_path / "study.db").touch()
    (tmp_path / "report.html").touch()
    with pytest.raises(StoreError, match="is empty, and report.html beside it tells of a run; restore a copy, or"):
        database.connect(tmp_path / "study.db", writable=True)
    assert (tmp_path / "study.db").stat().st_size == 0
    (tmp_path / "study.db").unlink()
    database.connect(tmp_path / "study.db", writable=True).close()


def test_an_empty_file_left_by_a_kill_says_to_run_the_study_and_becomes_a_database(tmp_path):
    (tmp_path / "study.db").touch()
    with pytest.raises(StoreError, match="is empty; run the study first"):
        database.connect(tmp_path / "study.db", writable=False)
    connection = database.connect(tmp_path / "study.db", writable=True)
    assert connection.execute("SELECT count(*) FROM trials").fetchone() == (0,)
    connection.close()


def refused(path, expected, writable=True):
    before = path.read_bytes()
    with pytest.raises(StoreError) as caught:
        database.connect(path, writable=writable)
    told = str(caught.value)
    assert expected in told
    assert str(path) in told
    assert "\n" not in told
    assert path.read_bytes() == before, "a refused database must stay as it was"


def test_a_newer_format_is_refused(tmp_path):
    path = made(tmp_path / "study.db")
    with sqlite3.connect(path) as plain:
        plain.execute(f"PRAGMA user_version = {database.FORMAT + 1}")
    refused(
        path, f"has format {database.FORMAT + 1}, this proxytune reads up to {database.FORMAT}; install a newer one"
    )


@pytest.mark.parametrize("version", range(1, 7))
@pytest.mark.parametrize("writable", [True, False])
def test_formats_that_were_never_released_are_refused_with_what_to_do(tmp_path, version, writable):
    path = made(tmp_path / "study.db")
    with sqlite3.connect(path) as plain:
        plain.execute(f"PRAGMA user_version = {version}")
    line = f"has format {version}, made by a version of proxytune that was never released; start the study anew in"
    refused(path, line, writable)
    with pytest.raises(StoreError, match=line):
        salvage(tmp_path)


NEXT = "ALTER TABLE facts ADD COLUMN source TEXT NOT NULL DEFAULT 'here'; CREATE TABLE notes (text TEXT);"


@pytest.fixture
def with_next_format(tmp_path, monkeypatch):
    """A database of this format, with a fact, before a proxytune whose format is the next."""
    path = made(tmp_path / "study.db")
    with edited(path) as plain:
        plain.execute("INSERT INTO facts (key, value) VALUES ('seed', '1')")
    monkeypatch.setattr(database, "STEPS", (*database.STEPS, NEXT))
    monkeypatch.setattr(database, "FORMAT", database.FORMAT + 1)
    return path


def facts_in(path):
    with closing(database.connect(path, writable=False)) as connection:
        (version,) = connection.execute("PRAGMA user_version").fetchone()
        return version, connection.execute("SELECT key, value, source FROM facts").fetchall()


def test_the_next_format_reads_this_one_converts_it_when_it_writes_and_takes_nothing_damaged(with_next_format):
    before = with_next_format.read_bytes()
    assert facts_in(with_next_format) == (database.FORMAT, [("seed", "1", "here")])
    assert with_next_format.read_bytes() == before
    database.disconnect(database.connect(with_next_format, writable=True))
    assert facts_in(with_next_format) == (database.FORMAT, [("seed", "1", "here")])
    assert with_next_format.read_bytes() != before
    with sqlite3.connect(with_next_format) as plain:
        plain.execute("UPDATE facts SET value = '2'")
    for writable in (False, True):
        refused(with_next_format, "is damaged, or was edited by hand: 1 fact", writable)


def photos(path):
    with sqlite3.connect(path) as plain:
        plain.execute("CREATE TABLE photos (name TEXT)")


def spoil_a_page(path):
    content = bytearray(filled(path).read_bytes())
    content[15 * 4096 : 16 * 4096] = b"?" * 4096
    path.write_bytes(content)


NONE = {
    "somebody else's": (photos, "is not a study's database; move it away"),
    "text": (lambda path: path.write_text("trial,prpv\n" * 200), "is damaged (file is not a database); restore a copy"),
    "one without tables": (lambda path: path.write_bytes(b"S"), "is damaged (it has no tables)"),
    "one with a spoilt page": (spoil_a_page, "is damaged"),
}


@pytest.mark.parametrize(("make", "expected"), NONE.values(), ids=NONE)
def test_what_is_no_whole_database_is_refused_and_not_begun_anew(tmp_path, make, expected):
    make(tmp_path / "study.db")
    refused(tmp_path / "study.db", expected)


def filled(path):
    connection = database.connect(path, writable=True)
    rows = [(f"identity {number}", "{}") for number in range(3000)]
    with database.transaction(connection, path):
        connection.executemany("INSERT INTO instances (identity, theta) VALUES (?, ?)", rows)
        database.seal(connection)
    database.disconnect(connection)
    return path


def test_folders_and_what_cannot_be_written_are_told(tmp_path):
    with pytest.raises(StoreError, match=r"cannot be written \(unable to open database file\)"):
        database.connect(tmp_path / "nowhere" / "study.db", writable=True)
    (tmp_path / "study.db").mkdir()
    with pytest.raises(StoreError, match=r"study\.db: is a folder, so no study's database; move it away"):
        database.connect(tmp_path / "study.db", writable=True)


def test_a_full_disk_is_told_and_what_was_committed_stays(tmp_path):
    path = tmp_path / "study.db"
    connection = database.connect(path, writable=True)
    (pages,) = connection.execute("PRAGMA page_count").fetchone()
    connection.execute(f"PRAGMA max_page_count = {pages + 2}")
    written = 0
    with (
        pytest.raises(StoreError, match="the disk is full; make room and run again"),
        database.sqlite_errors_as_store_errors(path),
    ):
        for number in range(10_000):
            with database.transaction(connection, path):
                database.write_row(
                    connection, "instances", {"id": number, "identity": f"identity {number}", "theta": "{}"}
                )
            written += 1
    connection.close()
    again = database.connect(path, writable=True)
    assert again.execute("SELECT count(*) FROM instances").fetchone() == (written,)
    assert written > 10
    again.close()


def test_a_database_that_another_program_writes_to_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("proxytune.storage.database.PATIENCE_S", 0.05)
    path = made(tmp_path / "study.db")
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    with pytest.raises(StoreError, match="another program holds it open"):
        database.connect(path, writable=True)
    other.close()


def test_a_part_of_a_page_is_refused_but_not_beside_the_log_that_has_the_whole_one(tmp_path):
    """A full disk may leave it so."""
    path = filled(tmp_path / "study.db")
    content = path.read_bytes()
    path.write_bytes(content[:-1])
    refused(path, "is damaged (its end has been cut off)")
    path.write_bytes(content)
    writer = database.connect(path, writable=True)
    add_fact(writer, "seed", "1")
    with path.open("ab") as main_file:
        main_file.write(b"?" * 100)
    reader = database.connect(path, writable=False)
    assert reader.execute("SELECT key, value FROM facts").fetchall() == [("seed", "1")]
    assert reader.execute("SELECT count(*) FROM instances").fetchall() == [(3000,)]
    reader.close()
    writer.close()


def test_a_stranger_s_schema_may_not_call_our_functions(tmp_path):
    path = made(tmp_path / "study.db")
    with sqlite3.connect(path) as plain:
        plain.create_function("row_digest", -1, lambda *values: 0, deterministic=True)
        plain.execute("CREATE VIEW evil AS SELECT row_digest(key) FROM facts")
    connection = database.open_file(path, writable=True)
    with pytest.raises(sqlite3.OperationalError, match="unsafe use of row_digest"):
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


@pytest.mark.parametrize("first", ["write", "look", "repair"])
def test_a_write_that_a_kill_broke_off_is_undone_also_by_who_only_looks_or_repairs(broken_off, first):
    assert first != "repair" or salvage(broken_off.parent) is None
    connection = database.connect(broken_off, writable=first == "write")
    assert connection.execute("SELECT count(*) FROM instances").fetchone() == (3000,)
    connection.close()
    assert salvage(broken_off.parent) is None, "nothing is damaged"


@pytest.mark.parametrize("writable", [True, False])
def test_a_journal_that_would_have_another_file_deleted_is_refused(broken_off, write_file, writable):
    """SQLite takes that for the journal of a write to several databases, and deletes it once all is undone."""
    victim = write_file("mine", "precious")
    name = str(victim).encode()
    place, length, total = (number.to_bytes(4, "big") for number in [(1 << 30) // 4096 + 1, len(name), sum(name)])
    with (broken_off.parent / "study.db-journal").open("ab") as journal:
        journal.write(place + name + length + total + database.OF_SEVERAL_FILES)
    with pytest.raises(StoreError, match="study.db-journal: names another file"):
        database.connect(broken_off, writable=writable)
    assert victim.read_text() == "mine"


THETAS = [{"trim": 0.1 * number, "delay": 1 / 3} for number in range(4)]


def small_study(folder):
    with Store.open(folder) as store:
        store.begin({"seed": 1, "identity": "i"})
        for number, theta in enumerate(THETAS, start=1):
            episode = make_episode(theta, agent="agent1", start=2, seed=11)
            store.save_outcome("i", Outcome(episode, {"distance": number + 0.1}, "", 1.5), code="code")
            store.save_outcome("i", Outcome(replace(episode, start=3), None, "it fell", 0.5), code="code")
            store.save_trial("i", TrialRecord(number, theta))
            store.save_trial("i", TrialRecord(number, theta, "finished", 4.0, {"prpv": 4.0, "ppv": 1 / 3}))
        store.save_trial("i", TrialRecord(1, THETAS[0], "finished", -3.0, {"plv": 3.0}), objective="plv")
        store.save_sweep("i", SweepRecord("trim", {"delay": 0.1}, (0.0, 0.1)))
        store.begin_episode("i", make_episode(THETAS[1], agent="agent1", start=2, seed=11))
    return folder / "study.db"


def opened(folder, writable):
    with Store.open(folder) if writable else Store.read(folder) as store:
        return store.trials()


@pytest.mark.parametrize("writable", [True, False])
def test_what_was_written_is_whole(tmp_path, writable):
    small_study(tmp_path)
    assert [trial.number for trial in opened(tmp_path, writable)] == [1, 2, 3, 4]


DAMAGES = {
    "UPDATE trials SET score = score + 7 WHERE number = 3": "1 trial",
    "UPDATE trials SET measures = replace(measures, '4.0', '5.0') WHERE number = 2": "1 trial",
    "UPDATE trials SET score = 'abc' WHERE number = 4 AND objective = 'prpv'": "1 trial",
    "UPDATE trials SET instance = 1 WHERE number = 3": "1 trial",
    "UPDATE trials SET instance = 99 WHERE number = 3": "1 trial",
    "UPDATE trials SET number = 77 WHERE number = 3": "1 trial",
    "UPDATE trials SET score = 0 WHERE objective = 'plv'": "1 trial",
    "DELETE FROM trials WHERE number = 2": "1 trial",
    "DELETE FROM trials WHERE number = 4": "1 trial",
    "DELETE FROM trials WHERE objective = 'plv'": "1 trial",
    "UPDATE facts SET value = 'x' WHERE key = 'seed'": "1 fact",
    "DELETE FROM facts WHERE key = 'seed'": "1 fact",
    "UPDATE episodes SET metrics = '[]' WHERE metrics IS NOT NULL": "4 episodes",
    "UPDATE episodes SET seconds = 1.25 WHERE instance = 1 AND start = 2": "1 episode",
    "UPDATE episodes SET code = 'other' WHERE instance = 1 AND start = 3": "1 episode",
    "UPDATE episodes SET agent = CAST(x'ff61' AS TEXT) WHERE instance = 1 AND start = 3": "1 episode",
    "UPDATE episodes SET instance = 10 + instance WHERE instance > 2": "4 episodes",
    "DELETE FROM episodes WHERE instance = 2": "2 episodes",
    "UPDATE sweeps SET points = '[0.0, 0.2]'": "1 sweep",
    "DELETE FROM sweeps": "1 sweep",
    "DELETE FROM sweeps; UPDATE facts SET value = 'x' WHERE key = 'seed'": "1 fact, 1 sweep",
    "UPDATE under_way SET theta = '{'": "1 note of the episode under way",
    "UPDATE under_way SET start = 'first'": "1 note of the episode under way",
    "UPDATE instances SET identity = 'j' WHERE id = 1": "1 domain instance",
    "UPDATE instances SET theta = '{}' WHERE id = 4": "1 domain instance",
    "UPDATE counts SET rows = 7 WHERE name = 'episodes'": "1 episode",
    "UPDATE counts SET rows = 'x' WHERE name = 'facts'": "1 fact",
    "DELETE FROM counts WHERE name = 'sweeps'": "1 sweep",
}


@pytest.mark.parametrize("writable", [True, False])
@pytest.mark.parametrize("damage", DAMAGES)
def test_damage_is_told_with_what_is_lost_and_what_to_do(tmp_path, damage, writable):
    path = small_study(tmp_path)
    with sqlite3.connect(path) as plain:
        plain.executescript(damage)
    lost = f"{path}: is damaged, or was edited by hand: {DAMAGES[damage]}; run: python -m proxytune repair {tmp_path}"
    with pytest.raises(StoreError) as complaint:
        opened(tmp_path, writable)
    assert str(complaint.value) == f"{lost}, which keeps all else"


@pytest.mark.parametrize(
    "edit",
    [
        "UPDATE facts SET value = 'x'",
        "UPDATE trials SET decided = '{' WHERE number = 2",
        "UPDATE trials SET measures = '[]' WHERE number = 2",
        "UPDATE trials SET score = 'abc' WHERE number = 2",
        "UPDATE trials SET failed_episodes = 'many' WHERE number = 2",
        "UPDATE instances SET theta = '[1]' WHERE id = 2",
        'UPDATE instances SET theta = \'{"trim": "x"}\' WHERE id = 2',
        "UPDATE episodes SET metrics = '{\"distance\": null}' WHERE start = 2",
        "UPDATE episodes SET metrics = '" + "[" * 3000 + "' WHERE start = 2",
        "UPDATE sweeps SET points = '7'",
        "UPDATE under_way SET theta = '[1, 2]'",
        "UPDATE under_way SET start = 'first'",
    ],
)
def test_json_of_another_shape_is_a_store_error_also_where_its_digest_fits(tmp_path, edit):
    with edited(small_study(tmp_path)) as plain:
        plain.execute(edit)
    with pytest.raises(StoreError, match="has a row that no proxytune wrote"), Store.read(tmp_path) as store:
        store.facts(), store.trials(), store.sweeps(), store.under_way("i")
        for theta in THETAS:
            store.outcomes("i", theta)


VALUES = some.lists(some.none() | some.integers() | some.floats() | some.text(), min_size=1, max_size=4)


@settings(max_examples=100)
@given(VALUES, VALUES)
def test_other_values_have_another_digest(one, other):
    assert (database.digest_of(*one) == database.digest_of(*other)) == (ascii(one) == ascii(other))


def test_sweeps_asked_for_again_are_not_missed(tmp_path):
    path = small_study(tmp_path)
    sweep = SweepRecord("trim", {"delay": 0.1}, (0.0, 0.1))
    with Store.open(tmp_path) as store:
        store.save_sweep("i", sweep)
        store.save_sweep("i", sweep)
    with Store.read(tmp_path) as store:
        assert store.sweeps() == [("i", sweep)]
    with sqlite3.connect(path) as plain:
        plain.execute("DELETE FROM sweeps")
    with pytest.raises(StoreError, match="1 sweep"):
        opened(tmp_path, writable=False)


@pytest.mark.parametrize("writable", [True, False])
@pytest.mark.parametrize(
    ("statement", "what"),
    [
        ("CREATE TRIGGER evil AFTER INSERT ON trials BEGIN DELETE FROM trials; END", "a trigger 'evil'"),
        ("ALTER TABLE trials RENAME TO own; CREATE VIEW trials AS SELECT * FROM own", "a view 'trials'"),
        ("CREATE VIRTUAL TABLE notes USING fts5(text)", "a virtual table 'notes'"),
        ("ALTER TABLE facts ADD COLUMN more TEXT", r"its table 'facts' is not as proxytune makes it"),
        ("ALTER TABLE trials ADD COLUMN more AS (score + 7)", r"its table 'trials' is not as proxytune makes it"),
        ("DROP TABLE counts; CREATE TABLE counts (n)", r"its table 'counts' is not as proxytune makes it"),
        ("DROP TABLE sweeps", r"its table 'sweeps' is not as proxytune makes it"),
    ],
)
def test_what_runs_by_itself_in_a_database_is_refused(tmp_path, statement, what, writable):
    with sqlite3.connect(small_study(tmp_path)) as plain:
        plain.executescript(statement)
    with pytest.raises(StoreError, match=what):
        opened(tmp_path, writable)


def told_or_unchanged(folder, whole):
    """Whether damage is told in one line; else, whether what is read is what was written."""
    try:
        with Store.read(folder) as store:
            return all_of(store) == whole
    except StoreError as problem:
        return "\n" not in str(problem)


def all_of(store):
    outcomes = [dict(store.outcomes("i", theta)) for theta in THETAS]
    return store.facts(), store.trials(), store.trials("plv"), store.sweeps(), outcomes, store.seconds()


@pytest.mark.parametrize("seed", range(4))
def test_a_flipped_bit_is_told_or_changes_nothing_that_is_read(tmp_path, seed):
    rng, path = random.Random(seed), small_study(tmp_path)
    content = path.read_bytes()
    with Store.read(tmp_path) as store:
        whole = all_of(store)
    used = [place for place, byte in enumerate(content) if byte]
    for _ in range(60):
        damaged, place = bytearray(content), rng.choice(used)
        damaged[place] ^= 1 << rng.randrange(8)
        path.write_bytes(damaged)
        assert told_or_unchanged(tmp_path, whole), place


def test_a_database_that_was_cut_off_anywhere_is_told(tmp_path):
    path = small_study(tmp_path)
    content = path.read_bytes()
    for size in random.Random(1).sample(range(1, len(content)), 60):
        path.write_bytes(content[:size])
        for writable in (False, True):
            with pytest.raises(StoreError, match="is damaged|is not a study's database"):
                opened(tmp_path, writable)
            assert path.stat().st_size == size, "a refused database must stay as it was"


def test_a_signal_that_comes_while_sqlite_asks_for_a_digest_is_no_damage(tmp_path, monkeypatch):
    monkeypatch.setattr(database, "digest_of", lambda *values: interrupt(2, None))
    with pytest.raises(Interrupted), Store.open(tmp_path) as store:
        store.save_fact("budget", 12)


def test_a_write_that_a_signal_left_open_takes_nothing_from_a_later_one_as_python_ends_it(tmp_path):
    with Store.open(tmp_path) as store, closing(database.connect(tmp_path / "study.db", writable=True)) as connection:
        left = database.transaction(connection, store.path)
        left.__enter__()
        with database.transaction(connection, store.path):
            database.write_row(connection, "facts", {"key": "budget", "value": "12"})
            del left
        assert store.facts() == {"budget": 12}
