"""What only waited has not failed; what took too long twice has, which is told, and tried once more by the next run."""

import os
import signal
import threading
import time

import pytest
from launched import Launched, never_stopped
from processes import episodes, trials, wait_for
from wobbly import Wobbly

from proxytune.domain import make_episode
from proxytune.running import run_episode
from proxytune.running.workers import NAP_S, AwakeClock, awake

SLOW = """
import time
from pathlib import Path
from wobbly import Wobbly, wobbly


class Slow(Wobbly):
    def run(self, episode):
        counted = Path(__file__).with_name("slow_times")
        left = int(counted.read_text()) if counted.exists() else 0
        if (episode.agent, episode.start) == ("agent2", 1) and left:
            counted.write_text(str(left - 1))
            time.sleep(600.0)
        return super().run(episode)


def make(domain, *, model):
    return Slow(**vars(wobbly(domain, model=model)))
"""


@pytest.fixture
def slow(make_study):
    """A study of which one episode hangs so many times, with a limit of a second."""

    def make(called, times):
        folder = make_study(called, family='"slow:make"', budget="2", initial="2", episode_timeout_s="1.0")
        (folder / "slow.py").write_text(SLOW)
        (folder / "slow_times").write_text(str(times))
        return folder

    return make


def test_an_episode_takes_no_time_while_the_machine_pauses(monkeypatch):
    paused, now = [0.0], time.monotonic
    monkeypatch.setattr(time, "monotonic", lambda: now() + paused[0])

    class Paused(Wobbly):
        def run(self, episode):
            paused[0] += 3600.0
            return super().run(episode)

    assert run_episode(Paused(), make_episode({}, agent="agent1", start=0, seed=1)).seconds < NAP_S + 1.0


def test_a_clock_counts_work_without_a_word_and_no_pause(monkeypatch):
    now, worked = [0.0], [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    monkeypatch.setattr(time, "process_time", lambda: worked[0])
    with awake() as clock:
        now[0], worked[0] = 60.0, 59.5
    assert clock.seconds() == 60.0

    now[0] = worked[0] = 0.0
    clock = AwakeClock()
    for step in (0.25, 0.25, 3600.0, 0.25):
        now[0] += step
        seconds = clock.seconds()
    assert seconds == 0.75 + NAP_S


def test_clocks_in_use_are_asked_meanwhile_by_one_thread_for_all(monkeypatch):
    monkeypatch.setattr("proxytune.running.workers.ASK_S", 0.01)
    with awake(), awake():  # the thread that is there may still nap for as long as before
        begun, asked = threading.active_count(), []
        monkeypatch.setattr(AwakeClock, "seconds", lambda clock: asked.append(clock))
        with awake() as one, awake() as other:
            while not {one, other} <= set(asked):
                time.sleep(0.01)
            assert threading.active_count() == begun
    del asked[:]
    with awake() as third:
        while third not in asked:
            time.sleep(0.01)
    assert one not in asked
    assert other not in asked


def left(folder):
    return int((folder / "slow_times").read_text())


@pytest.mark.slow
def test_what_takes_too_long_once_is_run_again_and_has_not_failed(slow, answered):
    folder, whole = slow("study", 1), slow("whole", 0)
    document = answered("study", folder)
    assert (left(folder), document["episodes"]["failed"]) == (0, 0)
    answered("study", whole)
    assert trials(folder) == trials(whole)
    assert not [line for line in document["cautions"] if "took longer" in line]


@pytest.mark.slow
def test_what_takes_too_long_twice_is_told_and_tried_again_by_the_next_run(slow, answered):
    folder, whole = slow("study", 2), slow("whole", 0)
    document = answered("study", folder)
    assert document["episodes"]["failed"] == 1
    line = (
        "episodes that failed because they took longer than episode_timeout_s: 1, of 'agent2'; the same command tries"
    )
    assert [one for one in document["cautions"] if one.startswith(line)]
    again = answered("study", folder)
    assert (again["episodes"]["run"], again["episodes"]["failed"], again["cautions"]) == (
        1,
        0,
        answered("study", whole)["cautions"],
    )
    assert trials(folder)[0] == trials(whole)[0]


@pytest.mark.slow
def test_what_takes_too_long_in_two_runs_is_left_alone(slow, answered):
    folder = slow("study", 100)
    first = answered("study", folder)
    second = answered("study", folder)
    assert second["episodes"]["run"] == first["episodes"]["failed"] == 2
    assert any("; in two runs; study --retry-failed" in line for line in second["cautions"])
    third = answered("study", folder)
    assert (third["episodes"]["run"], third["episodes"]["failed"]) == (0, 2)
    assert left(folder) == 100 - 4 * 2


@pytest.mark.slow
def test_a_command_that_was_stopped_with_its_processes_comes_to_the_same(make_study, launcher):
    """As by Ctrl-Z, by a paused container, or by a laptop that sleeps."""
    whole = never_stopped(make_study)
    folder = make_study("stopped", domain={"sleep": "0.05"}, episode_timeout_s="1.0")
    process = Launched(launcher, folder)
    for episode in (10, 40):
        wait_for(folder, process, episode)
        os.killpg(process.pid, signal.SIGSTOP)
        time.sleep(2.0)
        os.killpg(process.pid, signal.SIGCONT)
    status, printed = process.end()
    assert status == 0, printed
    assert (trials(folder), episodes(folder)) == whole
