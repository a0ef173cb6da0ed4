"""A file is the old one or the new one, whatever happens between."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest
from one_line import complaint_of

from proxytune.errors import InputError, SettingsError
from proxytune.files import check_place, draft_of, draft_path, folder_draft_of, shipped, temporary_folder, write_whole


def test_the_draft_takes_the_files_name_once_it_is_written(tmp_path, write_file):
    path = write_file("old", "table.csv")
    with draft_of(path) as draft:
        draft.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_a_place_is_free_where_a_file_or_folder_may_come_to_be(tmp_path):
    (tmp_path / "old.csv").write_text("old")
    (tmp_path / "folder").mkdir()
    (tmp_path / "link.csv").symlink_to(tmp_path / "nowhere")
    for name in ("old.csv", "new.csv", "link.csv", "folder/new.csv", "not/yet/new.csv"):
        check_place(tmp_path / name)
    for name in ("folder", "new", "folder/new", "not/yet/new"):
        check_place(tmp_path / name, folder=True)
    assert "folder: is a folder; give the name of a file in it" in complaint_of(check_place, tmp_path / "folder")
    (tmp_path / "same.csv").symlink_to(tmp_path / "old.csv")
    for name in ("old.csv", "same.csv"):
        with pytest.raises(InputError, match=f"{name}: is read by this command, and would be lost; give another name"):
            check_place(tmp_path / name, inputs=("gone.csv", tmp_path / "old.csv"))


def test_settings_databases_and_modules_of_a_folder_that_is_read_are_kept_and_results_in_it_may_be_replaced(tmp_path):
    for name in ("study.toml", "study.db", "grey.py"):
        (tmp_path / name).touch()
        told = complaint_of(check_place, tmp_path / "." / name, inputs=("old.csv", tmp_path))
        assert f"{name}: is read by this command" in told
    (tmp_path / "found.urdf").touch()
    for name in ("found.urdf", "target.csv", "new.py"):
        check_place(tmp_path / name, inputs=(tmp_path,))


def test_a_text_with_bytes_that_are_no_utf_8_is_written_with_these_spelt_out(tmp_path):
    write_whole(tmp_path / "page.html", "caf\udcff é")
    assert (tmp_path / "page.html").read_text("utf-8") == "caf\\udcff é"


def test_a_pipe_is_not_replaced_and_a_link_in_the_drafts_place_not_followed(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileExistsError, match="a device or a pipe is there"), draft_of(tmp_path / "pipe"):
        pass
    assert [path.is_fifo() for path in tmp_path.iterdir()] == [True]
    victim, path = tmp_path / "precious", tmp_path / "table.csv"
    victim.write_text("mine")
    draft_path(path).symlink_to(victim)
    with draft_of(path) as draft:
        draft.write_text("new")
    assert (victim.read_text(), path.read_text()) == ("mine", "new")


@pytest.mark.parametrize("problem", [KeyboardInterrupt, OSError, ValueError])
def test_what_raises_leaves_the_old_file_and_no_draft(tmp_path, write_file, problem):
    path = write_file("old", "table.csv")
    with pytest.raises(problem), draft_of(path) as draft:
        draft.write_text("half")
        raise problem
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


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


@pytest.mark.parametrize("killed", ["page.html", "weights-1.npz"])
def test_the_next_draft_in_the_folder_removes_what_a_killed_process_left(tmp_path, killed):
    path = tmp_path / "page.html"
    assert left_by_a_killed_process(tmp_path / killed).exists()
    with draft_of(path) as draft:
        draft.write_text("whole")
    assert list(tmp_path.iterdir()) == [path]


def test_what_others_write_is_left_alone(tmp_path):
    path, alive = tmp_path / "table.csv", os.getppid()
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
    assert {entry.name for entry in tmp_path.iterdir()} == {path.name, *theirs}


def test_drafts_of_other_users_count_and_a_number_beyond_all_is_no_process(tmp_path, monkeypatch):
    path = tmp_path / "table.csv"
    draft_path(path).with_name(draft_path(path).name.replace(str(os.getpid()), "9" * 30)).write_text("nobody's")
    with draft_of(path) as draft:
        draft.write_text("new")
    assert list(tmp_path.iterdir()) == [path]

    draft_path(path).with_name(draft_path(path).name.replace(str(os.getpid()), "1")).write_text("theirs")

    def forbidden(process, signal):
        raise PermissionError

    monkeypatch.setattr(os, "kill", forbidden)
    with draft_of(path) as draft:
        draft.write_text("new")
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(("hours", "left"), [(23, True), (25, False)])
def test_a_draft_of_another_machine_goes_once_nobody_has_touched_it_for_a_day(tmp_path, hours, left):
    path = tmp_path / "table.csv"
    theirs = draft_path(path).with_name(".table.csv.node-7-1234.draft")
    theirs.write_text("half")
    touched = time.time() - 3600.0 * hours
    os.utime(theirs, (touched, touched))
    with draft_of(path) as draft:
        draft.write_text("whole")
    assert theirs.exists() == left


KILLED_FOLDER = """
import os, signal, sys
from pathlib import Path
from proxytune.files import folder_draft_of, temporary_folder
with temporary_folder() as home, folder_draft_of(Path(sys.argv[1])) as draft:
    (draft / "half").write_text("half")
    print(home, flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


def killed(path, **environment):
    words = [sys.executable, "-c", KILLED_FOLDER, str(path)]
    done = subprocess.run(words, capture_output=True, text=True, env={**os.environ, **environment}, check=False)
    return Path(done.stdout.strip())


def fill(path, **files):
    with folder_draft_of(path) as draft:
        for name, text in files.items():
            (draft / name).write_text(text)


def test_a_folder_is_there_whole_or_not_at_all_and_a_killed_process_is_no_hindrance(tmp_path):
    path = tmp_path / "log"
    killed(path)
    assert [entry.name.startswith(".log.") for entry in tmp_path.iterdir()] == [True]
    with pytest.raises(ValueError), folder_draft_of(path) as draft:
        (draft / "half").write_text("half")
        raise ValueError
    assert not list(tmp_path.iterdir())
    fill(path, samples="whole")
    assert [entry.name for entry in tmp_path.rglob("*")] == ["log", "samples"]


def test_the_same_folder_again_is_left_alone_and_another_is_not_replaced(tmp_path):
    path = tmp_path / "log"
    path.mkdir()
    fill(path, samples="whole", more="files")
    before = (path / "samples").stat()
    fill(path, samples="whole", more="files")
    assert (path / "samples").stat() == before
    for other in ({"samples": "whole"}, {"samples": "whole", "more": "others"}):
        with pytest.raises(FileExistsError):
            fill(path, **other)
    assert {entry.name for entry in tmp_path.rglob("*")} == {"log", "samples", "more"}


def test_a_temporary_folder_goes_with_its_process_or_when_the_next_is_made(tmp_path, monkeypatch):
    left = killed(tmp_path / "log", TMPDIR=str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    assert left.parent == tmp_path
    with temporary_folder() as mine:
        assert left.exists()  # it is new: its process may be about to lock it
        for folder in (mine, left):
            os.utime(folder, (0.0, 0.0))
        with temporary_folder() as another:
            assert (mine.exists(), another.exists(), left.exists()) == (True, True, False)
    assert not mine.exists()
    assert not another.exists()


def test_shipped_folders_are_found_or_told_in_one_line():
    assert (shipped("robots") / "duckiebot" / "robot.toml").is_file()
    with pytest.raises(SettingsError, match="'unicorns' is missing; install proxytune again"):
        shipped("unicorns")
