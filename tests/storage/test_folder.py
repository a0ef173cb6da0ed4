"""One process at a time runs a study, and a stranger's study cannot lead what is written to it elsewhere."""

import os
import signal
import subprocess
import sys

import pytest

from proxytune.errors import BusyError, StoreError
from proxytune.storage import Store, locked
from proxytune.storage.folder import NAMES

HOLD = "import sys, time\nfrom pathlib import Path\nfrom proxytune.storage.folder import locked\n" + (
    "with locked(Path(sys.argv[1])):\n    print('held', flush=True)\n    time.sleep(60)\n"
)


@pytest.fixture
def holder(tmp_path):
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.communicate()


def test_a_second_process_is_told_the_first_one_s_id_and_when_that_is_killed_nothing_is_left(tmp_path, holder):
    with pytest.raises(BusyError, match=rf"another process \(process {holder.pid}\) is running this study"):
        locked(tmp_path).__enter__()
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    assert (tmp_path / "study.lock").exists()
    with locked(tmp_path):
        assert int((tmp_path / "study.lock").read_text()) == os.getpid()
    with locked(tmp_path):
        pass
    assert list(tmp_path.iterdir()) == []
    with locked(tmp_path):
        pass


def test_the_same_process_cannot_hold_it_twice_and_a_folder_that_cannot_be_written_is_told(tmp_path):
    with locked(tmp_path), pytest.raises(BusyError):
        locked(tmp_path).__enter__()
    with pytest.raises(StoreError, match="cannot be written"):
        locked(tmp_path / "nowhere").__enter__()


@pytest.fixture
def study(tmp_path):
    folder = tmp_path / "study"
    folder.mkdir()
    return folder


@pytest.mark.parametrize("name", NAMES)
def test_a_symbolic_link_in_place_of_what_is_written_to_is_refused_and_not_followed(study, write_file, name):
    victim = write_file("mine", "precious")
    (study / name).symlink_to(victim)
    for opening in (locked, Store.open):
        with pytest.raises(StoreError, match=f"{name}: is a symbolic link"), opening(study):
            pass
    assert victim.read_text() == "mine"
    assert [path.name for path in study.iterdir()] == [name]


def test_a_lock_with_another_name_elsewhere_is_refused(study, write_file):
    victim = write_file("mine", "precious")
    os.link(victim, study / "study.lock")
    with pytest.raises(StoreError, match="has another name elsewhere"), locked(study):
        pass
    assert victim.read_text() == "mine"


def test_a_lock_or_database_that_is_no_file_is_refused_and_not_waited_for(study):
    os.mkfifo(study / "study.lock")
    with pytest.raises(StoreError, match="is no file"), locked(study):
        pass
    os.mkfifo(study / "study.db")
    for opening in (Store.open, Store.read):
        with pytest.raises(StoreError, match="is no file"), opening(study):
            pass


def test_a_dangling_link_makes_no_file_elsewhere(study, tmp_path):
    (study / "study.db").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(StoreError, match="is a symbolic link"), Store.open(study):
        pass
    assert not (tmp_path / "elsewhere").exists()


def test_a_study_whose_folder_is_reached_by_a_link_is_fine(study, tmp_path):
    (tmp_path / "link").symlink_to(study)
    with locked(tmp_path / "link"), Store.open(tmp_path / "link") as store:
        assert store.trials() == []


def test_a_link_in_place_of_the_log_of_writes_is_not_followed(study, tmp_path):
    with Store.open(study):
        pass
    (tmp_path / "precious").write_text("mine")
    (study / "study.db-wal").symlink_to(tmp_path / "precious")
    with pytest.raises(StoreError), Store.open(study) as store:
        store.begin({"seed": 1})
    assert (tmp_path / "precious").read_text() == "mine"


@pytest.mark.parametrize("place", ["rescored/distance", "loop/extended", "figures/more"])
def test_a_link_within_what_a_study_makes_is_refused(study, tmp_path, place):
    (study / place).parent.mkdir()
    (study / place).symlink_to(tmp_path)
    with pytest.raises(StoreError, match=f"{place}: is a symbolic link"), Store.open(study):
        pass
