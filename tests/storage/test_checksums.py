"""What tells damage: every change of every row, and a trial that is changed, deleted or renumbered."""

import random
import sqlite3
from dataclasses import replace

import pytest
from edited import edited
from hypothesis import given, settings, strategies as some

from proxytune.domain import Outcome, make_episode
from proxytune.errors import StoreError
from proxytune.storage import Store, SweepRecord, TrialRecord
from proxytune.storage.checksums import checksum

THETAS = [{"trim": 0.1 * number, "delay": 1 / 3} for number in range(4)]


def filled(folder):
    with Store.open(folder) as store:
        store.begin({"seed": 1, "identity": "i"})
        for number, theta in enumerate(THETAS, start=1):
            episode = make_episode(theta, agent="agent1", start=2, seed=11)
            store.save_outcome("i", Outcome(episode, {"distance": number + 0.1}, "", 1.5), "code")
            store.save_outcome("i", Outcome(replace(episode, start=3), None, "it fell", 0.5), "code")
            store.save_trial("i", TrialRecord(number, theta))
            store.save_trial("i", TrialRecord(number, theta, "finished", 4.0, {"prpv": 4.0, "ppv": 1 / 3}))
        store.save_trial("i", TrialRecord(1, THETAS[0], "finished", -3.0, {"plv": 3.0}), objective="plv")
        store.save_sweep("i", SweepRecord("trim", {"delay": 0.1}, (0.0, 0.1)))
        store.under_way("i").begin(make_episode(THETAS[1], agent="agent1", start=2, seed=11))
    return folder / "study.db"


def opened(folder, writable):
    with Store.open(folder) if writable else Store.read(folder) as store:
        return store.trials()


@pytest.mark.parametrize("writable", [True, False])
def test_what_was_written_is_whole(tmp_path, writable):
    filled(tmp_path)
    assert [trial.number for trial in opened(tmp_path, writable)] == [1, 2, 3, 4]


NOTE = "1 note of the episode under way"
DAMAGES = {
    "UPDATE trials SET score = score + 7 WHERE number = 3": "trials 3 to 4 by prpv",
    "UPDATE trials SET measures = replace(measures, '4.0', '5.0') WHERE number = 2": "trials 2 to 4 by prpv",
    "UPDATE trials SET score = 'abc' WHERE number = 4 AND objective = 'prpv'": "trial 4 by prpv",
    "UPDATE trials SET instance = 1 WHERE number = 3": "trials 3 to 4 by prpv",
    "UPDATE trials SET number = 77 WHERE number = 3": "trials 3 to 4 by prpv",
    "UPDATE trials SET score = 0 WHERE objective = 'plv'": "trial 1 by plv",
    "DELETE FROM trials WHERE number = 2": "trials 2 to 4 by prpv",
    "DELETE FROM trials WHERE number = 4": "trial 4 by prpv",
    "DELETE FROM trials WHERE objective = 'plv'": "trial 1 by plv",
    "UPDATE facts SET value = 'x' WHERE key = 'seed'": "1 fact",
    "UPDATE episodes SET metrics = '[]' WHERE metrics IS NOT NULL": "4 episodes",
    "UPDATE episodes SET seconds = 1.25 WHERE instance = 1 AND start = 2": "1 episode",
    "UPDATE episodes SET code = 'other' WHERE instance = 1 AND start = 3": "1 episode",
    "UPDATE episodes SET agent = CAST(x'ff61' AS TEXT) WHERE instance = 1 AND start = 3": "1 episode",
    "UPDATE sweeps SET points = '[0.0, 0.2]'": "1 sweep",
    "DELETE FROM sweeps": "1 sweep",
    "DELETE FROM sweeps; UPDATE facts SET value = 'x' WHERE key = 'seed'": "1 fact, 1 sweep",
    "UPDATE under_way SET theta = '{'": NOTE,
    "UPDATE under_way SET theta = '[1, 2]'": NOTE,
    f"UPDATE under_way SET theta = '{{\"trim\": {'9' * 400}}}'": NOTE,
    'UPDATE under_way SET theta = \'{"trim": "x"}\'': NOTE,
    "UPDATE under_way SET theta = x'ff61'": NOTE,
    "UPDATE under_way SET agent = CAST(x'ff61' AS TEXT)": NOTE,
    "UPDATE under_way SET start = 'first'": NOTE,
    "UPDATE instances SET identity = 'j' WHERE id = 1": "1 domain instance",
    "UPDATE instances SET theta = '{}' WHERE id = 4": "1 domain instance, 2 episodes, trial 4 by prpv",
}


@pytest.mark.parametrize("writable", [True, False])
@pytest.mark.parametrize("damage", DAMAGES)
def test_damage_is_told_with_what_is_lost_and_what_to_do(tmp_path, damage, writable):
    path = filled(tmp_path)
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
    ],
)
def test_json_of_another_shape_is_a_store_error_also_where_its_checksum_fits(tmp_path, edit):
    with edited(filled(tmp_path)) as plain:
        plain.execute(edit)
    with pytest.raises(StoreError, match="has a row that no proxytune wrote"), Store.read(tmp_path) as store:
        store.facts(), store.trials(), store.sweeps()
        for theta in THETAS:
            store.outcomes("i", theta)


VALUES = some.lists(some.none() | some.integers() | some.floats() | some.text(), min_size=1, max_size=4)


@settings(max_examples=300, deadline=None)
@given(VALUES, VALUES)
def test_other_values_have_another_checksum(one, other):
    assert (checksum(*one) == checksum(*other)) == (ascii(one) == ascii(other))


def test_what_earlier_versions_wrote_is_taken_as_it_is_and_sealed(tmp_path):
    path = filled(tmp_path)
    with sqlite3.connect(path) as plain:
        plain.executescript("DROP TABLE chains; ALTER TABLE trials DROP COLUMN digest; PRAGMA user_version = 5;")
        for table in ("facts", "instances", "episodes", "sweeps"):
            plain.execute(f"ALTER TABLE {table} DROP COLUMN checksum")
    before = opened(tmp_path, writable=False)
    assert opened(tmp_path, writable=True) == before
    with sqlite3.connect(path) as plain:
        assert plain.execute("PRAGMA user_version").fetchone() == (6,)
        plain.execute("UPDATE trials SET score = 0 WHERE number = 4")
    with pytest.raises(StoreError, match="trial 4 by prpv"):
        opened(tmp_path, writable=True)


def test_sweeps_asked_for_again_or_renamed_are_not_missed(tmp_path):
    path = filled(tmp_path)
    sweep = SweepRecord("trim", {"delay": 0.1}, (0.0, 0.1))
    with Store.open(tmp_path) as store:
        store.save_sweep("i", sweep)
        store.save_sweep("j", sweep)
        store.rename_identity(("i",), "j")
    with Store.read(tmp_path) as store:
        assert store.sweeps() == [("j", sweep)]
    with sqlite3.connect(path) as plain:
        plain.execute("DELETE FROM sweeps")
    with pytest.raises(StoreError, match="1 sweep"):
        opened(tmp_path, writable=False)


@pytest.mark.parametrize("writable", [True, False])
def test_sweeps_that_nobody_has_counted_are_taken_as_they_are_and_counted_with_the_next(tmp_path, writable):
    path = filled(tmp_path)
    with sqlite3.connect(path) as plain:
        plain.execute("DROP TABLE sweep_count")
    assert [trial.number for trial in opened(tmp_path, writable)] == [1, 2, 3, 4]
    with Store.open(tmp_path) as store:
        store.save_sweep("i", SweepRecord("delay", {}, (0.0, 0.1)))
    with sqlite3.connect(path) as plain:
        plain.execute("DELETE FROM sweeps WHERE parameter = 'trim'")
    with pytest.raises(StoreError, match="1 sweep"):
        opened(tmp_path, writable)


@pytest.mark.parametrize("writable", [True, False])
@pytest.mark.parametrize(
    ("statement", "what"),
    [
        ("CREATE TRIGGER evil AFTER INSERT ON trials BEGIN DELETE FROM trials; END", "a trigger 'evil'"),
        ("ALTER TABLE trials RENAME TO own; CREATE VIEW trials AS SELECT * FROM own", "a view 'trials'"),
        ("CREATE VIRTUAL TABLE notes USING fts5(text)", "a virtual table 'notes'"),
        ("ALTER TABLE facts ADD COLUMN more TEXT", r"its table 'facts' is not as proxytune makes it"),
        ("ALTER TABLE trials ADD COLUMN more AS (score + 7)", r"its table 'trials' is not as proxytune makes it"),
        (
            "DROP TABLE sweep_count; CREATE TABLE sweep_count (n)",
            r"its table 'sweep_count' is not as proxytune makes it",
        ),
        ("DROP TABLE sweeps", r"its table 'sweeps' is not as proxytune makes it"),
    ],
)
def test_what_runs_by_itself_in_a_database_is_refused(tmp_path, statement, what, writable):
    path = filled(tmp_path)
    with sqlite3.connect(path) as plain:
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
    rng, path = random.Random(seed), filled(tmp_path)
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
    path = filled(tmp_path)
    content = path.read_bytes()
    for size in random.Random(1).sample(range(1, len(content)), 60):
        path.write_bytes(content[:size])
        with pytest.raises(StoreError, match="is damaged|is not a study's database"):
            opened(tmp_path, writable=False)
