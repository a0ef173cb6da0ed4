"""A study killed at every write, and on a disk that is full from every write on: it goes on to the same trials."""

import itertools
import re
import signal

import pytest
from failing_disk import HOOKED, forking
from processes import besides_progress, episodes, trials

from proxytune.storage import Store

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not HOOKED, reason="this Python's SQLite hides what its system calls could be replaced by"),
]
SMALL = {
    "agents": '["agent0", "agent1"]',
    "metrics": '["distance:max"]',
    "starts": "1",
    "budget": "2",
    "initial": "1",
    "engine": '"sobol"',
}
EPISODES = 2 * 2
FILES = {"study.toml", "target.csv", "study.db", "report.html"}


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


def goes_on(forker, folder, whole):
    """The next process ends well, with the same trials and no other file."""
    assert forker.run("study", folder)[0] == 0, forker.printed
    assert kept(folder) == whole
    assert files(folder) == FILES


def test_a_study_killed_at_any_write_goes_on_to_the_same_trials(forker, small, driven, never_stopped):
    """Killed before a write is killed after the one before; within it, half of it is there."""
    for folder, status in each_write(forker, small, ("before", "within"), 90):
        assert status == -signal.SIGKILL, forker.printed
        goes_on(forker, folder, never_stopped)
        assert driven.read_text().count("\n") <= EPISODES + 1, "none is driven again but the one under way"


TOLD = re.compile(r"proxytune study: .*(disk (is )?full|No space left|cannot be written).*\n")


def test_a_disk_full_from_any_write_on_is_told_in_a_line_and_nothing_is_lost(forker, small, driven, never_stopped):
    """Where it is full only for the page, or for tidying up, the study ends well. Full, it stays so: every third."""
    failed = 0
    for folder, status in each_write(forker, small, ("", "full", ""), 90):
        failed += status
        assert status in (0, 1), forker.printed
        assert status == 0 or TOLD.fullmatch(besides_progress(forker.printed)), forker.printed
        assert not [path for path in folder.iterdir() if path.name.startswith(".")]
        goes_on(forker, folder, never_stopped)
        assert driven.read_text().count("\n") <= EPISODES + 1, "none is driven again but the one under way"
    assert failed > 50 // 3
