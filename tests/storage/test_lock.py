import os
import signal
import subprocess
import sys

import pytest

from proxytune.errors import BusyError, StoreError
from proxytune.storage import locked

HOLD = "import sys, time\nfrom pathlib import Path\nfrom proxytune.storage.lock import locked\n" + (
    "with locked(Path(sys.argv[1])):\n    print('held', flush=True)\n    time.sleep(60)\n"
)


@pytest.fixture
def holder(tmp_path):
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.communicate()


def test_a_second_process_is_told_the_first_one_s_id(tmp_path, holder):
    with pytest.raises(BusyError, match=rf"another process \(process {holder.pid}\) is running this study"):
        locked(tmp_path).__enter__()


def test_the_lock_of_a_killed_process_does_not_stand_in_the_way(tmp_path, holder):
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    assert (tmp_path / "study.lock").exists()
    with locked(tmp_path):
        assert int((tmp_path / "study.lock").read_text()) == os.getpid()


def test_nothing_is_left_of_it_afterwards(tmp_path):
    with locked(tmp_path):
        pass
    assert list(tmp_path.iterdir()) == []
    with locked(tmp_path):
        pass


def test_the_same_process_cannot_hold_it_twice(tmp_path):
    with locked(tmp_path), pytest.raises(BusyError):
        locked(tmp_path).__enter__()


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    with pytest.raises(StoreError, match="cannot be written"):
        locked(tmp_path / "nowhere").__enter__()
