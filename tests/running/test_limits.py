"""A piece of work that overruns a limit within it is ended with its process, and what it was doing is known."""

import functools
import os
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from deadly import ENDINGS

from proxytune.running import OVERRUN, Apart, Lost, Noted, Rescue, limited, was_ended_in, working


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
def test_what_hangs_is_ended_and_noted_wherever_it_hangs(ending, tmp_path):
    noted = Noted(functools.partial(meet, ending), tmp_path)
    with Apart(noted) as apart:
        assert apart.do("piece", lambda lost: lost.how) == OVERRUN
    assert noted.last("piece") == "the slow part"
    assert noted.last("another") == ""


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_piece_knows_what_an_earlier_process_ended_in(jobs, tmp_path):
    noted = Noted(functools.partial(meet, "hangs"), tmp_path)
    rescue = Rescue(lambda piece, lost: f"{lost.how} in {noted.last(piece)}", apart=True)
    with working(noted, ["again", "never"], jobs, rescue=rescue) as done:
        first = "not again" if jobs == 2 else f"{OVERRUN} in the slow part"
        assert sorted(done) == sorted([first, f"{OVERRUN} in the slow part"])


@pytest.mark.slow
def test_what_ends_in_time_is_let_go_on_also_where_notes_cannot_be_written(tmp_path):
    with Apart(Noted(_in_time, tmp_path / "not there")) as apart:
        assert apart.do("piece", lambda lost: lost) == "done"


def _in_time(piece):
    with limited("the quick part", 1.0):
        pass
    time.sleep(1.5)
    return "done"


def test_in_a_thread_of_somebody_elses_process_there_is_no_limit(tmp_path):
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(Noted(_too_slow, tmp_path), "piece").result() == "done"


def _too_slow(piece):
    with limited("anything", 0.01):
        time.sleep(0.05)
    return "done"


def test_outside_a_piece_there_is_no_limit():
    with limited("anything", 0.01):
        time.sleep(0.05)


def test_pieces_that_may_end_their_process_are_never_done_in_this_one():
    with working(_where, [1], 1, rescue=Rescue(_lost, apart=True)) as done:
        assert list(done) != [os.getpid()]


def _where(piece):
    return os.getpid()


def _lost(piece, lost: Lost):
    raise AssertionError(lost)
