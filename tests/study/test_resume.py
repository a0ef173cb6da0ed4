"""Real processes, killed for real."""

import os
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

FAKES = Path(__file__).parents[1] / "fakes"
ROOT = Path(__file__).parents[2]
EPISODES = 7 * 18
DOMAIN = {"sleep": "0.02"}


def start(folder, *options):
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{FAKES}", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "proxytune", "study", str(folder), *options]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, env=environment, start_new_session=True, **pipes)


def finished_episodes(folder):
    try:
        with sqlite3.connect(f"file:{folder}/study.db?mode=ro", uri=True) as plain:
            return plain.execute("SELECT count(*) FROM episodes").fetchone()[0]
    except sqlite3.Error:
        return 0


def wait_for(folder, process, episodes):
    while finished_episodes(folder) < episodes and process.poll() is None:
        time.sleep(0.005)


def trials(folder):
    with sqlite3.connect(folder / "study.db") as plain:
        query = "SELECT number, theta, state, prpv, ppv FROM trials JOIN instances ON instances.id = instance"
        return plain.execute(query).fetchall()


def episodes(folder):
    with sqlite3.connect(folder / "study.db") as plain:
        query = "SELECT theta, agent, start, seed, metrics FROM episodes JOIN instances ON instances.id = instance"
        return sorted(plain.execute(query).fetchall())


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_study_killed_at_any_moment_gives_the_trials_of_one_that_was_not(make_study, jobs):
    """To the last bit, with one job and with two, however often it is killed."""
    whole = make_study("whole", domain=DOMAIN)
    start(whole).communicate()
    killed = make_study("killed", domain=DOMAIN, jobs=jobs)
    for moment in np.sort(np.random.default_rng(int(jobs)).integers(1, EPISODES - 40, 4)):
        process = start(killed)
        wait_for(killed, process, moment)
        process.kill()
        process.communicate()
        assert process.returncode == -signal.SIGKILL
        assert moment <= finished_episodes(killed) < EPISODES
    last = start(killed)
    _, told = last.communicate()
    assert last.returncode == 0, told
    assert trials(killed) == trials(whole)
    assert episodes(killed) == episodes(whole)
    assert len(episodes(killed)) == EPISODES


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_ctrl_c_ends_with_130_one_line_and_no_process_left(make_study, jobs):
    folder = make_study(domain=DOMAIN, jobs=jobs)
    process = start(folder)
    wait_for(folder, process, 25)
    os.killpg(process.pid, signal.SIGINT)
    out, told = process.communicate(timeout=20)
    assert process.returncode == 130
    assert out == ""
    assert told.count("\n") == 1
    assert "the same command goes on" in told
    assert 25 <= finished_episodes(folder) < EPISODES
    assert not (folder / "study.lock").exists()


def test_processes_of_a_killed_study_do_not_linger(make_study):
    folder = make_study(domain={"sleep": "0.05"}, jobs="2")
    process = start(folder)
    wait_for(folder, process, 5)
    process.kill()
    process.communicate(timeout=20)  # returns only when every process that holds its pipes has ended
    assert process.returncode == -signal.SIGKILL


def test_a_second_process_on_the_same_study_is_told_and_the_first_is_not_disturbed(make_study):
    folder = make_study(domain={"sleep": "0.2"})
    first = start(folder)
    wait_for(folder, first, 2)
    second = start(folder)
    _, told = second.communicate()
    assert second.returncode == 1
    assert f"another process (process {first.pid}) is running this study" in told
    assert told.count("\n") == 1
    wait_for(folder, first, finished_episodes(folder) + 2)
    os.killpg(first.pid, signal.SIGINT)
    first.communicate()
    assert first.returncode == 130, "it was running all the while"
