"""Real processes, stopped for real."""

import os
import signal
import time

import numpy as np
import pytest
from launched import Launched, never_stopped
from processes import besides_progress, episodes, finished_episodes, trials, wait_for

from proxytune.cli.main import COMMANDS

pytestmark = pytest.mark.slow

PER_TRIAL = 18
EPISODES = 7 * PER_TRIAL
STOPS = ((signal.SIGINT, os.killpg), (signal.SIGTERM, os.kill), (signal.SIGTERM, os.killpg), (signal.SIGKILL, os.kill))
"""As they come in life: Ctrl-C reaches a terminal's every process, SIGTERM one or, of a scheduler, its workers too."""


def stop(process, number, send=os.kill):
    """Send a signal: but for kill -9, the study says one line."""
    send(process.pid, number)
    status, printed = process.end()
    if number == signal.SIGKILL:
        assert status == -signal.SIGKILL
    else:
        expected, word = {signal.SIGINT: (130, "interrupted"), signal.SIGTERM: (143, "terminated")}[number]
        line = f"proxytune study: {word}; {COMMANDS['study'].left}\n"
        assert (status, besides_progress(printed)) == (expected, line)


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_study_stopped_at_any_moment_gives_the_trials_of_one_that_was_not(make_study, launcher, jobs):
    """To the last bit, by Ctrl-C, SIGTERM and `kill -9`; and none of its processes lingers."""
    whole = never_stopped(make_study)
    folder = make_study("stopped", domain={"sleep": "0.015"}, jobs=jobs)
    random, stopped, within = np.random.default_rng(int(jobs)), [], 0
    chosen = np.sort(random.choice(np.arange(6), len(STOPS), replace=False))
    moments = PER_TRIAL * chosen + random.integers(3, 9, len(STOPS))
    for place, moment in zip(random.permutation(len(STOPS)), moments, strict=True):
        process = Launched(launcher, folder)
        wait_for(folder, process, moment)
        stop(process, *STOPS[place])
        assert moment <= finished_episodes(folder) < EPISODES
        within += trials(folder)[-1][2] == "open" and finished_episodes(folder) % PER_TRIAL > 0
        assert (folder / "study.lock").exists() == (STOPS[place][0] == signal.SIGKILL)
        stopped.append(process)
    assert within > 0
    status, printed = Launched(launcher, folder).end()
    assert status == 0, printed
    assert (trials(folder), episodes(folder)) == whole
    assert len(whole[1]) == EPISODES
    assert not (folder / "study.lock").exists()
    assert all(process.leaves_nothing() for process in stopped)


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_study_killed_as_soon_as_it_begins_gives_the_trials_of_one_that_was_not(make_study, launcher, jobs):
    """While it takes the lock, makes the database, starts its workers; and while it draws."""
    whole = never_stopped(make_study)
    folder = make_study("stopped", jobs=jobs)
    for seconds in np.random.default_rng(int(jobs)).uniform(0.0, 0.4, 8):
        process = Launched(launcher, folder)
        time.sleep(seconds)
        if not process.poll():
            os.kill(process.pid, signal.SIGKILL)
        status, printed = process.end()
        assert status in (0, -signal.SIGKILL), printed
    status, printed = Launched(launcher, folder).end()
    assert status == 0, printed
    assert (trials(folder), episodes(folder)) == whole


def test_a_second_process_on_the_same_study_is_told_and_the_first_goes_on(make_study, launcher, refused, answered):
    """A sweep too; looking at it is for everybody."""
    folder = make_study(domain={"sleep": "0.05"}, budget="60")
    first = Launched(launcher, folder)
    wait_for(folder, first, PER_TRIAL + 2)
    line = f"{folder}: another process (process {first.pid}) is running this study; wait for it or stop it\n"
    for words in (("study", folder), ("sweep", folder, "--parameter", "trim")):
        assert refused(*words, status=1) == f"proxytune {words[0]}: {line}"
    assert len(answered("plot", folder)["trials"]) >= 1
    wait_for(folder, first, finished_episodes(folder) + 2)
    stop(first, signal.SIGINT)  # it was running all the while


@pytest.mark.parametrize(("engine", "jobs"), [("gp", "1"), ("outcomes", "2")])
def test_pre_flight_batches_cut_trials_and_confirmation_survive_a_stop(make_study, launcher, engine, jobs, answered):
    """With several jobs, episodes under way when a trial is cut off are kept; no trial stands on them."""
    phases = {"preflight": "true", "confirm": "1", "cut_off": "true", "initial": "4", "budget": "9"}
    keys = {"engine": f'"{engine}"', "batch": "3", "seed": "6", **phases}
    whole = make_study("whole", **keys)
    expected = answered("study", whole)
    folder = make_study("stopped", domain={"sleep": "0.01"}, jobs=jobs, **keys)
    opened = []
    for moment, number in ((40, signal.SIGKILL), (90, signal.SIGTERM), (155, signal.SIGKILL), (260, signal.SIGKILL)):
        process = Launched(launcher, folder)
        wait_for(folder, process, moment)
        stop(process, number)
        opened.append(sum(trial[2] == "open" for trial in trials(folder)))
    assert opened[0] == opened[3] == 0, "in the pre-flight and in the confirmation"
    assert opened[1:3] == [3, 3], "while a whole batch was open"
    found = answered("study", folder)
    assert any(trial["prpv"] is None for trial in expected["trials"]), "something was cut off"
    assert trials(folder) == trials(whole)
    assert found["best"]["fresh"] is not None
    for key in ("trials", "best", "preflight", "confirmation", "stopped"):
        assert found.get(key) == expected.get(key), key
