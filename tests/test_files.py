"""A file is the old one or the new one, whatever happens between.

Robots and studies are found beside the package.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from proxytune.errors import SettingsError
from proxytune.files import draft_of, draft_path, shipped


def test_the_draft_takes_the_files_name_once_it_is_written(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("old")
    with draft_of(path) as draft:
        draft.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("problem", [KeyboardInterrupt, OSError, ValueError])
def test_what_raises_leaves_the_old_file_and_no_draft(tmp_path, problem):
    path = tmp_path / "table.csv"
    path.write_text("old")
    with pytest.raises(problem), draft_of(path) as draft:
        draft.write_text("half")
        raise problem
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_in_the_drafts_place_is_not_followed(tmp_path):
    victim, path = tmp_path / "precious", tmp_path / "table.csv"
    victim.write_text("mine")
    draft_path(path).symlink_to(victim)
    with draft_of(path) as draft:
        draft.write_text("new")
    assert (victim.read_text(), path.read_text()) == ("mine", "new")


KILLED = """
import os, signal, sys
from pathlib import Path
from proxytune.files import draft_of
with draft_of(Path(sys.argv[1])):
    os.kill(os.getpid(), signal.SIGKILL)
"""


def left_by_a_killed_process(path: Path) -> Path:
    subprocess.run([sys.executable, "-c", KILLED, str(path)], check=False)
    (left,) = (entry for entry in path.parent.iterdir() if entry.name.startswith(f".{path.name}"))
    return left


def test_the_next_draft_of_the_same_file_removes_what_a_killed_process_left(tmp_path):
    path = tmp_path / "page.html"
    assert left_by_a_killed_process(path).exists()
    with draft_of(path) as draft:
        draft.write_text("whole")
    assert list(tmp_path.iterdir()) == [path]


def test_what_others_write_is_left_alone(tmp_path):
    path, alive = tmp_path / "table.csv", os.getppid()
    dead = left_by_a_killed_process(tmp_path / "table.csv.gz")
    mine = draft_path(path).name
    theirs = [
        mine.replace(str(os.getpid()), str(alive)),  # a process that still writes
        mine.replace(".table.csv.", ".table.csv.another-"),  # the same file from another machine
        f".{path.name}.bak",
        mine.replace(str(os.getpid()), "old"),
        mine.replace(str(os.getpid()), "²"),
    ]
    for name in theirs:
        (tmp_path / name).write_text("theirs")
    with draft_of(path) as draft:
        draft.write_text("new")
    assert {entry.name for entry in tmp_path.iterdir()} == {path.name, dead.name, *theirs}


def test_a_process_number_beyond_all_is_no_process(tmp_path):
    path = tmp_path / "table.csv"
    draft_path(path).with_name(draft_path(path).name + "9" * 30).write_text("nobody's")
    with draft_of(path) as draft:
        draft.write_text("new")
    assert list(tmp_path.iterdir()) == [path]


def test_another_users_process_still_writes(tmp_path, monkeypatch):
    path = tmp_path / "table.csv"
    draft_path(path).with_name(draft_path(path).name + "1").write_text("theirs")

    def forbidden(process, signal):
        raise PermissionError

    monkeypatch.setattr(os, "kill", forbidden)
    with draft_of(path) as draft:
        draft.write_text("new")
    assert len(list(tmp_path.iterdir())) == 2


def test_robots_are_found():
    assert (shipped("robots") / "duckiebot" / "robot.toml").is_file()


def test_a_lost_folder_is_one_line():
    with pytest.raises(SettingsError, match="'unicorns' is missing; install proxytune again"):
        shipped("unicorns")
