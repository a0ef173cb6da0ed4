"""A study, a sweep and lessons killed at a write, or on a disk that is full from it on, come to the same."""

import itertools
import json
import re
import signal

import numpy as np
import pytest
from failing_disk import HOOKED, forking
from processes import besides_progress, but_for, episodes, finished_episodes, trials
from taught import make_taught

from proxytune.storage import Store

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not HOOKED, reason="this Python's SQLite hides what its system calls could be replaced by"),
]
FEW = {"agents": '["agent0", "agent1"]', "metrics": '["distance:max"]', "starts": "1"}
SMALL = {**FEW, "budget": "2", "initial": "1", "engine": '"sobol"'}
EPISODES = 2 * 2
TOLD = re.compile(r"proxytune \w+: .*(disk (is )?full|No space left|cannot be written).*\n")


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """A file with a line for each episode that the last study drove."""
    return tmp_path_factory.mktemp("driven") / "driven"


@pytest.fixture(scope="module")
def small(make_studies, driven):
    """Makes a small study."""

    def make(called):
        driven.write_text("")
        return make_studies(called, domain={"journal": f'"{driven}"'}, **SMALL)

    return make


@pytest.fixture(scope="module")
def forker(small, tmp_path_factory):
    with forking(tmp_path_factory.mktemp("printed") / "out.txt", "study", small("whole")) as started:
        assert started.run("study", small("whole"))[0] == 0, started.printed
        yield started


@pytest.fixture(scope="module")
def never_stopped(forker, small):
    found = kept(small("whole"))
    assert (len(found[0]), len(found[1])) == (2, EPISODES)
    return found


def kept(folder):
    """Every trial and every episode, to the last bit, once nothing of the database is found damaged."""
    with Store.read(folder):
        pass
    return trials(folder), episodes(folder)


def files(folder):
    """What is in a study's folder, but for a page that a kill broke off: the next has another name."""
    return {path.name for path in folder.iterdir() if not path.name.startswith(".report.html.")}


def each_write(forker, begun, hows, least):
    """A study that stopped at its first write, at its second, and so on until a run ends before: folder and status.

    It stops in one way after the other; a write that has none is left out.
    """
    for last, how in zip(itertools.count(1), itertools.cycle(hows), strict=False):
        if not how:
            continue
        folder = begun(f"{how}{last}")
        status, changes = forker.run("study", folder, last=last, how=how)
        if changes < last:
            assert status == 0, forker.printed
            assert last > least, "all that is written was counted"
            return
        yield folder, status


def assert_broken_off(how, status, forker):
    """A full disk is told in a line, where it matters; a kill tells nothing."""
    if how == "full":
        assert status in (0, 1), forker.printed
        assert status == 0 or TOLD.fullmatch(besides_progress(forker.printed)), forker.printed
    else:
        assert status == -signal.SIGKILL, forker.printed


def goes_on(forker, folder, whole):
    """The next process ends well, with the same trials and no other file."""
    assert forker.run("study", folder)[0] == 0, forker.printed
    assert kept(folder) == whole
    assert files(folder) == {"study.toml", "target.csv", "study.db", "report.html"}


def test_a_study_killed_at_any_write_goes_on_to_the_same_trials(forker, small, driven, never_stopped):
    """Killed before a write is killed after the one before; within it, half of it is there."""
    for folder, status in each_write(forker, small, ("before", "within"), 90):
        assert_broken_off("within", status, forker)
        goes_on(forker, folder, never_stopped)
        assert driven.read_text().count("\n") <= EPISODES + 1, "none is driven again but the one under way"


def test_a_disk_full_from_any_write_on_is_told_in_a_line_and_nothing_is_lost(forker, small, driven, never_stopped):
    """Where it is full only for the page, or for tidying up, the study ends well. Full, it stays so: every third."""
    failed = 0
    for folder, status in each_write(forker, small, ("", "full", ""), 90):
        failed += status
        assert_broken_off("full", status, forker)
        assert not [path for path in folder.iterdir() if path.name.startswith(".")]
        goes_on(forker, folder, never_stopped)
        assert driven.read_text().count("\n") <= EPISODES + 1, "none is driven again but the one under way"
    assert failed > 50 // 3


TIMES = re.compile(rb"\d{4}-\d\d-\d\d \d\d:\d\d UTC|\d+(\.\d+)? m?s\b")
TIMED = {"study.toml", "study.db", "report.html"}
"""What has times in it everywhere, or names the folder; documents are compared instead."""


@pytest.fixture
def swept(make_study):
    def words(called):
        return "sweep", make_study(called, **FEW), "--parameter", "trim", "--points", "3", "--json"

    return words


@pytest.fixture
def taught(make_study):
    def words(called):
        return "teach", make_taught(make_study, called=called, grid=[0, 20, 40], **FEW), "--json"

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
                assert_broken_off(how, forker.run(*once, last=place, how=how)[0], forker)
                yield once[1]
                assert forker.run(*once)[0] == 0, forker.printed
                assert made(forker, once[1]) == whole

    return run


def made(forker, folder):
    """The document, and every file, but for times and the drafts that a kill leaves."""
    document = json.loads(
        re.search(r"^\{.*\}$", forker.printed, re.DOTALL | re.MULTILINE)[0].replace(str(folder), "HERE")
    )
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file() and not path.name.startswith(".")]
    files = {str(path.relative_to(folder)): content(path, folder) for path in paths}
    return but_for(document, ("seconds", "episodes")), files


def content(path, folder):
    return b"" if path.name in TIMED else TIMES.sub(b"", path.read_bytes().replace(str(folder).encode(), b"HERE"))


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
