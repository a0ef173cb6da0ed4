"""Episodes that end their process, never end, take long, or meet the limits of the machine."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from itertools import chain
from pathlib import Path

import pytest
from deadly import Deadly
from processes import ENVIRONMENT

from proxytune.cli.terminal import signals_as_interruptions
from proxytune.domain import make_episode
from proxytune.errors import RunError
from proxytune.extensions import Interrupted
from proxytune.running import Watch, episodes, run_episode, running
from proxytune.running.episodes import MONITOR

EPISODES = [make_episode({"trim": 0.1}, agent=f"agent{a}", start=s, seed=s) for a in range(3) for s in range(3)]
LAST = EPISODES[-1]


def run_all(faults, jobs=1, **watch):
    with running(Deadly(faults=faults), EPISODES, jobs, watch=Watch(**watch)) as fleets:
        return {one.episode: one.metrics if one.metrics else one.failure for one in chain.from_iterable(fleets)}


def but_last(outcomes):
    return {episode: outcome for episode, outcome in outcomes.items() if episode != LAST}


RAISED = {"exits": "SystemExit: 0", "own error": r"OwnError: of its own caf\udce9"}


@pytest.mark.parametrize("fault", RAISED)
def test_what_an_agent_raises_that_is_no_exception_fails_its_episode_alone(fault):
    whole, found = run_all(()), run_all((f"agent2:2:{fault}",))
    assert but_last(found) == but_last(whole)
    assert found[LAST].startswith(f"the agent or the domain family raised {RAISED[fault]} (deadly.py, line ")


class Pressed(Deadly):
    """Ctrl-C is pressed during each episode; the agent may catch that, and raise something of its own."""

    def run(self, episode):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            if self.faults == ("by the agent",):
                raise KeyboardInterrupt from None
            if self.faults == ("for another error",):
                raise RuntimeError("the simulator ended") from None
            if self.faults == ("to exit",):
                sys.exit(0)
            if not self.faults:
                raise
        return Deadly().run(episode)


@pytest.mark.parametrize("place", [contextlib.nullcontext, signals_as_interruptions])
@pytest.mark.parametrize("caught", [(), ("by the agent",)])
def test_ctrl_c_is_nobodys_failure_in_python_and_on_the_command_line(place, caught):
    with pytest.raises(KeyboardInterrupt), place():
        run_episode(Pressed(faults=caught), EPISODES[0])


@pytest.mark.parametrize("caught", [("and goes on",), ("for another error",), ("to exit",)])
def test_ctrl_c_that_an_agent_catches_is_neither_lost_nor_its_failure(caught):
    """Else what the episode came to would be kept for good."""
    with pytest.raises(Interrupted), signals_as_interruptions():
        run_episode(Pressed(faults=caught), EPISODES[0])


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_agent_that_raises_a_keyboard_interrupt_fails_in_that_episode_alone(jobs):
    whole = run_all(())
    with signals_as_interruptions():
        found = run_all(("agent2:2:interrupts",), jobs)
    assert but_last(found) == but_last(whole)
    assert found[LAST].startswith("the agent or the domain family raised KeyboardInterrupt: of its own (deadly.py, ")


def test_a_keyboard_interrupt_in_a_python_session_is_the_users():
    with pytest.raises(KeyboardInterrupt):
        run_all(("agent2:2:interrupts",))


@pytest.mark.parametrize(("fault", "what"), [("memory", "MemoryError: no room"), ("files", "OSError: .*Too many open")])
def test_what_the_machine_lacks_is_no_failure_of_the_agent_that_met_it(fault, what):
    with pytest.raises(RunError, match=rf"agent 'agent2' from start 2: the machine failed \({what}.*run again"):
        run_all((f"agent2:2:{fault}",))


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "how"), [("dies", "exit status 9"), ("aborts", "SIGABRT")])
def test_an_episode_that_ends_two_processes_has_failed_and_the_others_are_what_they_are(fault, how):
    whole, found = run_all(()), run_all((f"agent2:2:{fault}",), jobs=2)
    assert but_last(found) == but_last(whole)
    assert found[LAST] == f"it ended its process twice ({how})"


@pytest.mark.slow
def test_an_episode_whose_process_is_killed_twice_is_named_and_not_called_failed():
    with pytest.raises(RunError, match=r"agent 'agent2' from start 2: its process was killed twice .*out of memory"):
        run_all(("agent2:2:is killed",), jobs=2)


@pytest.mark.slow
def test_an_episode_during_which_an_earlier_process_ended_does_not_end_this_one():
    begun = []
    found = run_all(("agent2:2:dies",), suspect=LAST.__eq__, begins=begun.append)
    assert but_last(found) == but_last(run_all(()))
    assert found[LAST] == "it ended its process twice (exit status 9)"
    assert begun == [(episode,) for episode in EPISODES[:-1]]


def test_nobody_waits_for_what_is_suspect_or_left(soon):
    class Local(Deadly):
        pass

    with running(Local(), EPISODES, 1, watch=Watch(suspect=lambda _: True)) as outcomes:
        assert [one.metrics is not None for (one,) in outcomes] == [True] * len(EPISODES)
    said = []
    with pytest.raises(KeyboardInterrupt), running(Deadly(), FEW, 1, watch=Watch(waits=said.append)):
        raise KeyboardInterrupt
    assert MONITOR not in [thread.name for thread in threading.enumerate()]
    assert said == []


PARENT = """
import sys; sys.path.append({fakes!r})
from deadly import Deadly
from test_endings import EPISODES
from proxytune.running.episodes import running
with running(Deadly(faults={faults}), EPISODES, 2) as outcomes: list(outcomes)
"""


HANGS = ("agent0:*:hangs",)


def descendants(parent):
    """Processes that a process has started, directly or not, by their numbers."""
    parents = {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            parents[int(status.parent.name)] = int(status.read_text().rpartition(")")[2].split()[1])
    family = {parent}
    while more := {one for one, its in parents.items() if its in family and one not in family}:
        family |= more
    return family - {parent}


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="this system does not list processes in /proc")
@pytest.mark.parametrize("delay_s", [0.0, 0.5])
def test_workers_end_with_a_parent_that_is_killed_as_they_start(delay_s):
    folder = Path(__file__).parent
    path = os.pathsep.join([str(folder), ENVIRONMENT["PYTHONPATH"]])
    command = [sys.executable, "-c", PARENT.format(fakes=str(folder.with_name("fakes")), faults=HANGS)]
    parent = subprocess.Popen(command, env={**ENVIRONMENT, "PYTHONPATH": path})
    while len(descendants(parent.pid)) < 2:
        time.sleep(0.005)
    time.sleep(delay_s)
    workers = descendants(parent.pid)
    parent.kill()
    parent.wait()
    for _ in range(600):
        left = {one for one in workers if Path(f"/proc/{one}/cwd").exists()}
        if not left:
            break
        time.sleep(0.1)
    for one in left:
        os.kill(one, signal.SIGKILL)
    assert not left


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="this system does not list processes in /proc")
def test_workers_that_start_leave_the_signals_of_a_terminal_to_their_parent():
    folder = Path(__file__).parent
    path = os.pathsep.join([str(folder), ENVIRONMENT["PYTHONPATH"]])
    command = [sys.executable, "-c", PARENT.format(fakes=str(folder.with_name("fakes")), faults=())]
    told = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    with subprocess.Popen(command, env={**ENVIRONMENT, "PYTHONPATH": path}, **told) as parent:
        reached = set()
        while parent.poll() is None:
            for one in descendants(parent.pid):
                for number in (signal.SIGINT, signal.SIGHUP):
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(one, number)
                        reached.add(one)
        assert (parent.wait(), parent.stdout.read()) == (0, "")
    assert len(reached) >= 2


FEW = [make_episode({"trim": 0.1}, agent=f"agent{a}", start=s, seed=s) for a in range(2) for s in range(2)]
LONG_S = 0.1


def told_of(fault, jobs=1, **more):
    """What is said while these episodes run, of which all but one take no time."""
    said = []
    watch = Watch(waits=lambda *told: said.append(told), **more)
    with running(Deadly(faults=(fault,)), FEW, jobs, watch=watch) as outcomes:
        assert len(list(outcomes)) == len(FEW)
    return said


@pytest.fixture
def soon(monkeypatch):
    monkeypatch.setattr(episodes, "LONG_S", LONG_S)


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_it_is_told_which_episode_has_been_under_way_for_long(soon, jobs):
    said = told_of("agent1:0:lingers", jobs)
    assert "agent 'agent1' from start 0" in [what for what, _ in said]
    assert all(seconds >= LONG_S for _, seconds in said)


@pytest.mark.slow
def test_where_every_episode_is_short_nothing_is_told():
    assert told_of("agent1:0:lingers") == []


@pytest.mark.slow
def test_where_a_limit_ends_them_nothing_is_told(soon):
    assert told_of("agent1:0:lingers", timeout_s=60.0) == []
