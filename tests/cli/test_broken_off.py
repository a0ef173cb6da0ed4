"""`sweep` and `teach`, killed or on a full disk, at their first writes to their last: the same is made."""

import itertools
import json
import re
import signal

import numpy as np
import pytest
from failing_disk import HOOKED, forking
from processes import besides_progress, finished_episodes
from taught import make_taught

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not HOOKED, reason="this Python's SQLite hides what its system calls could be replaced by"),
]
SMALL = {"agents": '["agent0", "agent1"]', "metrics": '["distance:max"]', "starts": "1"}
TIMES = re.compile(rb"\d{4}-\d\d-\d\d \d\d:\d\d UTC|\d+(\.\d+)? m?s\b")
TOLD = re.compile(r"proxytune \w+: .*(disk (is )?full|No space left|cannot be written).*\n")
TIMED = {"study.toml", "study.db", "report.html"}
"""What has times in it everywhere, or names the folder; documents are compared instead."""


@pytest.fixture
def swept(make_study):
    def words(called):
        return "sweep", make_study(called, **SMALL), "--parameter", "trim", "--points", "3", "--json"

    return words


@pytest.fixture
def taught(make_study):
    def words(called):
        return "teach", make_taught(make_study, called=called, grid=[0, 20, 40], **SMALL), "--json"

    return words


@pytest.fixture
def broken_off(tmp_path):
    """Runs a command whole, then broken off at so many writes and again to the end; gives the folder at each break."""

    def run(words, count):
        with forking(tmp_path / "printed.txt", *words("warm")) as forker:
            status, changes = forker.run(*words("whole"))
            assert status == 0, forker.printed
            whole = made(forker, words("whole")[1])
            places = np.linspace(2, changes - 2, count).astype(int).tolist()
            for place, how in zip(places, itertools.cycle(["within", "full", "before"]), strict=False):
                once = words(f"{how}{place}")
                check_broken_off(how, *forker.run(*once, last=place, how=how), forker)
                yield once[1]
                assert forker.run(*once)[0] == 0, forker.printed
                assert made(forker, once[1]) == whole

    return run


def check_broken_off(how, status, changes, forker):
    if how == "full":
        assert status in (0, 1), forker.printed
        assert status == 0 or TOLD.fullmatch(besides_progress(forker.printed)), forker.printed
    else:
        assert status == -signal.SIGKILL, forker.printed


def made(forker, folder):
    """The document, and every file, but for times and the drafts that a kill leaves."""
    document = json.loads(
        re.search(r"^\{.*\}$", forker.printed, re.DOTALL | re.MULTILINE)[0].replace(str(folder), "HERE")
    )
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file() and not path.name.startswith(".")]
    files = {str(path.relative_to(folder)): content(path, folder) for path in paths}
    return but_for_times(document), files


def content(path, folder):
    return b"" if path.name in TIMED else TIMES.sub(b"", path.read_bytes().replace(str(folder).encode(), b"HERE"))


def but_for_times(document):
    if isinstance(document, list):
        return [but_for_times(one) for one in document]
    if isinstance(document, dict):
        return {key: but_for_times(value) for key, value in document.items() if key not in ("seconds", "episodes")}
    return document


def test_a_sweep_broken_off_at_any_write_comes_to_the_same_curve(broken_off, swept):
    kept = [finished_episodes(folder) for folder in broken_off(swept, 4)]
    assert set(kept) & set(range(1, 6)), "between the first point and the last"
    assert kept[-1] == 6


def test_teaching_broken_off_at_any_write_comes_to_the_same_table(broken_off, taught):
    found = [kinds(folder) for folder in broken_off(taught, 5)]
    assert [lessons for lessons, exams in found if lessons and not exams], "after a lesson and before examinations"
    assert [exams for _, exams in found if 0 < exams < 34], "between examinations"
    assert found[-1][1] == 34, "those without any sample are the same for all repetitions"


def kinds(folder):
    """How many lessons and how many examinations are kept."""
    return [len(list((folder / "teaching").glob(f"{kind}-*.npz"))) for kind in ("samples", "exam")]
