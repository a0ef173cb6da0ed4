"""A user's modules go along to a process that cannot see their folder."""

import pickle
import subprocess
import sys

from processes import ENVIRONMENT

from proxytune.extensions.beside import folders, import_beside
from proxytune.extensions.travelling import pack

ELSEWHERE = """
import pickle, sys
from proxytune.extensions.travelling import unpack
packed, work = pickle.loads(sys.stdin.buffer.read())
unpack(packed)
unpack(packed)
print(pickle.loads(work)(3))
"""


def test_modules_and_what_they_import_are_found_where_their_folder_is_not(tmp_path):
    home = tmp_path / "travels"
    (home / "deep").mkdir(parents=True)
    (home / "mine.py").write_text("from helper import TWO\n\n\ndef work(x):\n    return x * TWO\n")
    (home / "helper.py").write_text("from deep.one import ONE\n\nTWO = 2 * ONE\n")
    (home / "deep" / "__init__.py").write_text("")
    (home / "deep" / "one.py").write_text("ONE = 1\n")
    (home / "weights.bin").write_bytes(b"stays")
    work = pickle.dumps(import_beside("mine", home).work)
    packed = pack([folder for folder in folders() if folder == str(home.resolve())])
    home.rename(tmp_path / "gone")
    sent = pickle.dumps((packed, work))
    done = subprocess.run([sys.executable, "-c", ELSEWHERE], input=sent, capture_output=True, env=ENVIRONMENT)
    assert done.stdout.decode().strip() == "6", done.stderr.decode()
    assert b"stays" not in sent


def test_the_same_modules_are_the_same_bytes(tmp_path):
    (tmp_path / "mine.py").write_text("ONE = 1\n")
    once = pack([str(tmp_path)])
    (tmp_path / "mine.py").touch()
    assert pack([str(tmp_path)]) == once
