"""Pieces of work in other processes: those that overrun a limit within them end there, and it is known in what."""

import functools
import importlib
import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from deadly import ENDINGS

from proxytune.running import OVERRUN, IsolatedWorker, Rescue, TracedTask, WorkerExit, limited, was_ended_in, working


def meet(ending, piece):
    """Do something quick, then something that does not end, unless an earlier process did not end there."""
    with limited("the quick part", 60.0):
        quick = os.getpid()
    if piece == "again" and was_ended_in("the slow part"):
        return "not again"
    with limited("the slow part", 0.5):
        ENDINGS[ending]()
    return quick


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["hangs", "hangs in C"])
def test_what_hangs_is_ended_and_traced_wherever_it_hangs(ending, tmp_path):
    traced = TracedTask(functools.partial(meet, ending), tmp_path)
    with IsolatedWorker(traced) as isolated:
        assert isolated.do("piece", lambda end: end.how) == OVERRUN
    assert traced.last("piece") == "the slow part"
    assert traced.last("another") == ""


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_piece_knows_what_an_earlier_process_ended_in(jobs, tmp_path):
    traced = TracedTask(functools.partial(meet, "hangs"), tmp_path)
    rescue = Rescue(lambda piece, end: f"{end.how} in {traced.last(piece)}", isolated=True)
    with working(traced, ["again", "never"], jobs, rescue=rescue) as done:
        first = "not again" if jobs == 2 else f"{OVERRUN} in the slow part"
        assert sorted(done) == sorted([first, f"{OVERRUN} in the slow part"])


@pytest.mark.slow
def test_what_ends_in_time_is_let_go_on_also_where_notes_cannot_be_written(tmp_path):
    with IsolatedWorker(TracedTask(_in_time, tmp_path / "not there")) as isolated:
        assert isolated.do("piece", lambda end: end) == "done"


def _in_time(piece):
    with limited("the quick part", 1.0):
        pass
    time.sleep(1.5)
    return "done"


def test_outside_a_piece_there_is_no_limit_and_pieces_that_may_end_their_process_are_done_elsewhere(tmp_path):
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(TracedTask(_too_slow, tmp_path), "piece").result() == "done"
    with limited("anything", 0.01):
        time.sleep(0.05)
    with working(_where, [1], 1, rescue=Rescue(_lost, isolated=True)) as done:
        assert list(done) != [os.getpid()]


def _too_slow(piece):
    with limited("anything", 0.01):
        time.sleep(0.05)
    return "done"


def _where(piece):
    return os.getpid()


def _lost(piece, end: WorkerExit):
    raise AssertionError(end)


def folder_of(module):
    return Path(importlib.import_module(module).__file__).parent.name


def in_processes(work, pieces):
    with working(work, pieces, jobs=2) as results:
        return list(results)


def test_a_process_that_has_done_other_work_looks_for_modules_where_its_work_now_does(tmp_path, monkeypatch):
    for name in ("before", "now"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "twice_there.py").touch()
    installed = list(sys.path)
    monkeypatch.setattr(sys, "path", [*installed, str(tmp_path / "before")])
    in_processes(str, range(4))
    monkeypatch.setattr(sys, "path", [*installed, str(tmp_path / "now"), str(tmp_path / "before")])
    assert in_processes(folder_of, ["twice_there"] * 4) == ["now"] * 4
