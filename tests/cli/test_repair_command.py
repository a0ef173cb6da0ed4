"""What is whole of a damaged study is kept, and the study ends as if nothing had happened."""

import shutil
import sqlite3
import sys
from contextlib import closing

import pytest
from processes import episodes, finished_episodes, trials

from proxytune.cli.main import main
from proxytune.storage import Store, repair

DAMAGES = {
    "a score": ("UPDATE trials SET score = score + 7 WHERE number = 3", 2, 0),
    "a trial that is gone": ("DELETE FROM trials WHERE number = 5", 4, 0),
    "the last trial gone": ("DELETE FROM trials WHERE number = 7", 6, 0),
    "a trial with another number": ("UPDATE trials SET number = 77 WHERE number = 2", 1, 0),
    "an episode": ("UPDATE episodes SET metrics = '{}' WHERE instance = 4 AND agent = 'agent1' AND start = 1", 7, 1),
    "θ": ("UPDATE instances SET theta = '{' WHERE id = 2", 1, 18),
    "text that is none": ("UPDATE instances SET theta = CAST(x'ff61' AS TEXT) WHERE id = 2", 1, 18),
    "a fact": ("UPDATE facts SET value = 'x' WHERE key = 'seed'", 0, 0),
    "a fact that is gone": ("DELETE FROM facts WHERE key = 'seed'", 0, 0),
    "a note": ("INSERT INTO under_way VALUES (1, 'wobbly 1 ()', '{', 'agent1', 1, 1, '')", 7, 0),
    "an episode that is gone": ("DELETE FROM episodes WHERE instance = 3 AND agent = 'agent1' AND start = 1", 7, 1),
    "an episode and a trial": ("DELETE FROM episodes WHERE instance = 2; DELETE FROM trials WHERE number = 4", 3, 18),
}


def damaged(folder, statement):
    with sqlite3.connect(folder / "study.db") as plain:
        plain.executescript(statement)


@pytest.fixture
def driven_again(finished, finished_once, answered):
    """Runs the study, which goes on as if nothing had happened; how many episodes were driven again."""

    def run():
        document = answered("study", finished)
        assert trials(finished) == trials(finished_once)
        assert episodes(finished) == episodes(finished_once)
        return document["episodes"]["run"]

    return run


@pytest.mark.parametrize(
    "damage", [damage if damage == "an episode" else pytest.param(damage, marks=pytest.mark.slow) for damage in DAMAGES]
)
def test_what_is_whole_is_kept_and_the_rest_is_made_again_to_the_bit(finished, driven_again, refused, answered, damage):
    statement, kept, again = DAMAGES[damage]
    damaged(finished, statement)
    before = (finished / "study.db").read_bytes()
    assert f"python -m proxytune repair {finished}" in refused("study", finished, status=1)
    found = answered("repair", finished)
    assert (found["damaged"], found["trials"]) == (True, kept)
    assert (finished / "study.db.damaged").read_bytes() == before
    assert driven_again() == again


def test_looking_at_a_study_whose_lost_episodes_are_not_driven_yet_says_how_to_drive_them(finished, refused, answered):
    damaged(finished, DAMAGES["an episode"][0])
    assert answered("repair", finished)["lost"]["episodes"] == 1
    line = "study.db: lacks episodes of trial 4; drive them again: python -m proxytune study"
    assert line in refused("plot", finished, status=1)


@pytest.mark.slow
def test_a_sweep_that_was_deleted_is_told_and_there_again_after_the_same_command(finished, capsys, refused, answered):
    sweep = ("sweep", finished, "--parameter", "trim", "--points", "2")
    whole = answered(*sweep)["curves"]
    damaged(finished, "DELETE FROM sweeps")
    for command in (("plot", finished), sweep):
        assert "is damaged, or was edited by hand: 1 sweep; run: " in refused(*command, status=1)
    assert main(["repair", str(finished)]) == 0
    assert "lost: 1 sweep\na sweep that is lost is there again after the same sweep command" in capsys.readouterr().out
    again = answered(*sweep)
    assert (again["curves"], again["episodes"]["run"]) == (whole, 0)


def test_a_whole_study_is_left_as_it_is_and_somebody_else_s_refused(finished, capsys, refused):
    before = (finished / "study.db").read_bytes()
    assert main(["repair", str(finished)]) == 0
    assert "study.db is whole; nothing was changed" in capsys.readouterr().out
    assert sorted(path.name for path in finished.iterdir()) == ["study.db", "study.toml", "target.csv"]
    assert (finished / "study.db").read_bytes() == before
    (finished / "study.db").unlink()
    assert "no such file; there is nothing to repair" in refused("repair", finished)
    with sqlite3.connect(finished / "study.db") as plain:
        plain.execute("CREATE TABLE photos (name TEXT)")
    assert "is not a study's database" in refused("repair", finished, status=1)


@pytest.mark.parametrize("share", [*(pytest.param(one, marks=pytest.mark.slow) for one in (0.3, 0.6)), 0.95])
def test_a_database_that_was_cut_off_is_rebuilt_of_what_can_be_read(finished, driven_again, refused, answered, share):
    content = (finished / "study.db").read_bytes()
    (finished / "study.db").write_bytes(content[: int(share * len(content))])
    refused("plot", finished, status=1)
    found = answered("repair", finished)
    assert found["damaged"]
    assert driven_again() == 7 * 18 - found["kept"]["episodes"]


@pytest.mark.slow
def test_a_spoilt_page_costs_what_is_on_it(finished, driven_again, answered):
    content = bytearray((finished / "study.db").read_bytes())
    page = len(content) // 4096 // 2
    content[page * 4096 : (page + 1) * 4096] = b"?" * 4096
    (finished / "study.db").write_bytes(content)
    assert answered("repair", finished)["kept"]["episodes"] > 0
    driven_again()


def test_writes_that_are_still_in_the_log_are_kept_and_the_log_is_set_aside(finished, answered):
    with Store.read(finished) as store:
        before = store.trials()
    plain = sqlite3.connect(finished / "study.db")
    plain.execute("PRAGMA journal_mode = WAL")
    plain.execute("UPDATE facts SET value = '7' WHERE key = 'nothing'")
    plain.execute("UPDATE trials SET score = 0 WHERE number = 7")
    plain.commit()
    copy = finished.with_name("copy")
    shutil.copytree(finished, copy)
    plain.close()
    assert (copy / "study.db-wal").stat().st_size
    assert answered("repair", copy)["trials"] == 6
    assert (copy / "study.db.damaged-wal").exists()
    assert not (copy / "study.db-wal").exists()
    with Store.read(copy) as store:
        assert store.trials() == before[:6]


def test_a_kill_before_any_line_of_a_repair_loses_no_row_that_is_in_the_log_alone(finished, tmp_path):
    """What lay on the disk before each line, repaired anew."""
    with closing(sqlite3.connect(finished / "study.db")) as plain:
        plain.executescript("CREATE TEMP TABLE apart AS SELECT * FROM episodes; PRAGMA journal_mode = WAL")
        plain.executescript("DELETE FROM episodes; UPDATE counts SET rows = 0 WHERE name = 'episodes'")
        plain.executescript("PRAGMA wal_checkpoint(TRUNCATE); INSERT INTO episodes SELECT * FROM apart")
        plain.executescript("UPDATE counts SET rows = 126 WHERE name = 'episodes'; UPDATE trials SET score = 0")
        shutil.copytree(finished, tmp_path / "damaged")
    before = sys.gettrace()
    sys.settrace(copying_before_each_line(repair.__file__, tmp_path / "damaged", tmp_path / "killed"))
    try:
        repair.salvage(tmp_path / "damaged")
    finally:
        sys.settrace(before)
    killed = [tmp_path / "damaged", *(tmp_path / "killed").iterdir()]
    assert len(killed) > 30
    again = [repair.salvage(folder) is not None for folder in killed]
    assert True in again
    assert False in again
    assert {finished_episodes(folder) for folder in killed} == {126}


def copying_before_each_line(code, folder, copies):
    """A trace that copies a folder before each line of some code, unless it has already with the same files."""

    def trace(frame, event, argument):
        if frame.f_code.co_filename != code:
            return None
        files = sorted(f"{path.name}{path.stat().st_size}" for path in folder.glob("study.db*"))
        if not (copy := copies / " ".join((str(frame.f_lineno), *files))).exists():
            shutil.copytree(folder, copy)
        return trace

    return trace


@pytest.mark.slow
def test_what_was_set_aside_before_is_kept(finished, answered):
    for _ in range(2):
        damaged(finished, "UPDATE trials SET score = score + 7 WHERE number = 3 OR number = 1")
        answered("repair", finished)
        assert main(["study", str(finished)]) == 0
    assert {path.name for path in finished.glob("study.db.*")} == {"study.db.damaged", "study.db.damaged1"}
