"""Real processes, stopped for real."""

import itertools
import json
import os
import signal
import time

import numpy as np
import pytest
from launched import Launched, launching, never_stopped
from processes import besides_progress, episodes, finished_episodes, start, trials, wait_for

from proxytune.cli.main import COMMANDS, main
from proxytune.search import ENGINE_NAMES

PER_TRIAL = 18
EPISODES = 7 * PER_TRIAL
DOMAIN = {"sleep": "0.03"}
TOLD = {signal.SIGINT: (130, "interrupted"), signal.SIGTERM: (143, "terminated")}


@pytest.fixture(scope="module")
def launcher():
    with launching() as process:
        yield process


def stop(process, number):
    """Send a signal as it comes in life: Ctrl-C reaches a terminal's every process, the others one."""
    (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
    status, printed = process.end()
    if number == signal.SIGKILL:
        assert status == -signal.SIGKILL
    else:
        expected, word = TOLD[number]
        line = f"proxytune study: {word}; {COMMANDS['study'].left}\n"
        assert (status, besides_progress(printed)) == (expected, line)


def in_the_middle(folder):
    """Whether a trial has some of its episodes and not all."""
    known = finished_episodes(folder) % PER_TRIAL
    return trials(folder)[-1][2] == "open" and 0 < known < PER_TRIAL


def moments(random, count):
    """So many numbers of episodes, in rising order, each in the middle of another trial."""
    chosen = np.sort(random.choice(np.arange(7), count, replace=False))
    return (PER_TRIAL * chosen + random.integers(3, 9, count)).tolist()


def stopped_and_resumed(folder, launcher, signals, random):
    """Run a study that each signal stops once, at seeded moments; how often that was within a trial."""
    within = 0
    for number, moment in zip(signals, moments(random, len(signals)), strict=True):
        process = Launched(launcher, folder)
        wait_for(folder, process, moment)
        stop(process, number)
        assert moment <= finished_episodes(folder) < EPISODES
        within += in_the_middle(folder)
    status, printed = Launched(launcher, folder).end()
    assert status == 0, printed
    return within


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "jobs"), list(zip(ENGINE_NAMES, itertools.cycle("12"), strict=False)))
def test_a_study_stopped_at_any_moment_gives_the_trials_of_one_that_was_not(make_study, launcher, engine, jobs):
    """To the last bit, with every engine, of one job or two, by Ctrl-C, SIGTERM and `kill -9`."""
    if engine == "tpe":
        pytest.importorskip("optuna")
    changes = {"engine": f'"{engine}"', "initial": "3"}
    whole = never_stopped(make_study, **changes)
    folder = make_study("stopped", domain=DOMAIN, jobs=jobs, **changes)
    random = np.random.default_rng([ENGINE_NAMES.index(engine), int(jobs)])
    signals = random.permutation([signal.SIGINT, signal.SIGTERM, signal.SIGKILL, signal.SIGKILL]).tolist()
    assert stopped_and_resumed(folder, launcher, signals, random) > 0
    assert (trials(folder), episodes(folder)) == whole
    assert len(whole[1]) == EPISODES
    assert not (folder / "study.lock").exists()


@pytest.mark.slow
def test_a_study_of_two_jobs_terminated_and_killed_within_a_trial_gives_the_trials_of_one_that_was_not(
    make_study, launcher
):
    whole = never_stopped(make_study, initial="3")
    folder = make_study("stopped", domain=DOMAIN, jobs="2", initial="3")
    signals = [signal.SIGTERM, signal.SIGKILL]
    assert stopped_and_resumed(folder, launcher, signals, np.random.default_rng(0)) > 0
    assert (trials(folder), episodes(folder)) == whole


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_study_killed_as_soon_as_it_begins_gives_the_trials_of_one_that_was_not(make_study, launcher, jobs):
    """While it takes the lock, makes the database, starts its workers; and while it draws."""
    whole = never_stopped(make_study)
    folder = make_study("stopped", jobs=jobs)
    for seconds in np.random.default_rng(int(jobs)).uniform(0.0, 0.4, 12):
        process = Launched(launcher, folder)
        time.sleep(seconds)
        if not process.poll():
            os.kill(process.pid, signal.SIGKILL)
        status, printed = process.end()
        assert status in (0, -signal.SIGKILL), printed
    status, printed = Launched(launcher, folder).end()
    assert status == 0, printed
    assert (trials(folder), episodes(folder)) == whole


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_ctrl_c_ends_with_130_one_line_and_no_process_left(make_study, jobs):
    folder = make_study(domain=DOMAIN, jobs=jobs)
    process = start("study", folder)
    wait_for(folder, process, 25)
    os.killpg(process.pid, signal.SIGINT)
    out, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert out == ""
    assert (
        besides_progress(told)
        == "proxytune study: interrupted; every finished trial and episode is kept; run the same command to continue\n"
    )
    assert 25 <= finished_episodes(folder) < EPISODES
    assert not (folder / "study.lock").exists()


@pytest.mark.slow
@pytest.mark.parametrize("send", [os.kill, os.killpg], ids=["process", "group"])
def test_sigterm_ends_with_143_one_line_and_no_process_left(make_study, send):
    """Sent to the process alone or, as schedulers do, to its workers too."""
    folder = make_study(domain=DOMAIN, jobs="2")
    process = start("study", folder)
    wait_for(folder, process, 25)
    send(process.pid, signal.SIGTERM)
    out, told = process.communicate(timeout=60)  # returns only when every process that holds its pipes has ended
    assert (process.returncode, out) == (143, "")
    assert (
        besides_progress(told)
        == "proxytune study: terminated; every finished trial and episode is kept; run the same command to continue\n"
    )
    assert 25 <= finished_episodes(folder) < EPISODES
    assert not (folder / "study.lock").exists()


@pytest.mark.slow
def test_processes_of_a_killed_study_do_not_linger(make_study):
    folder = make_study(domain={"sleep": "0.05"}, jobs="2")
    process = start("study", folder)
    wait_for(folder, process, 5)
    process.kill()
    process.communicate(timeout=60)  # returns only when every process that holds its pipes has ended
    assert process.returncode == -signal.SIGKILL


@pytest.mark.slow
def test_a_second_process_on_the_same_study_is_told_and_the_first_is_not_disturbed(make_study, capsys):
    """A sweep too; looking at it is for everybody."""
    folder = make_study(domain={"sleep": "0.05"}, budget="60")
    first = start("study", folder)
    wait_for(folder, first, PER_TRIAL + 2)
    second = start("study", folder)
    out, told = second.communicate()
    assert (second.returncode, out) == (1, "")
    line = f"{folder}: another process (process {first.pid}) is running this study; wait for it or stop it\n"
    assert told == f"proxytune study: {line}"
    assert main(["sweep", str(folder), "--parameter", "trim"]) == 1
    assert capsys.readouterr() == ("", f"proxytune sweep: {line}")
    assert main(["plot", str(folder), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["trials"]) >= 1
    wait_for(folder, first, finished_episodes(folder) + 2)
    os.killpg(first.pid, signal.SIGINT)
    first.communicate()
    assert first.returncode == 130, "it was running all the while"


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_pre_flight_cut_trials_and_confirmation_survive_being_stopped(make_study, launcher, jobs, capsys):
    """With several jobs, episodes under way when a trial is cut off are kept; no trial stands on them."""
    phases = {"preflight": "true", "confirm": "1", "cut_off": "true", "initial": "4", "budget": "12"}
    whole = make_study("whole", **phases)
    assert main(["study", str(whole), "--json"]) == 0
    expected = json.loads(capsys.readouterr().out)
    total = finished_episodes(whole)
    folder = make_study("stopped", domain={"sleep": "0.01"}, jobs=jobs, **phases)
    random = np.random.default_rng(int(jobs))
    stopped_at = np.sort(random.choice(np.arange(10, total - 10), 4, replace=False)).tolist()
    signals = random.permutation([signal.SIGINT, signal.SIGTERM, signal.SIGKILL, signal.SIGKILL]).tolist()
    for number, moment in zip(signals, stopped_at, strict=True):
        process = Launched(launcher, folder)
        wait_for(folder, process, moment)
        os.kill(process.pid, number)
        status, printed = process.end()
        assert status == (-number if number == signal.SIGKILL else 128 + number), printed
    assert main(["study", str(folder), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert any(trial["prpv"] is None for trial in expected["trials"]), "something was cut off"
    for key in ("trials", "best", "preflight", "confirmation", "stopped"):
        assert found.get(key) == expected.get(key), key


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
@pytest.mark.parametrize("engine", [name for name in ("gp", "outcomes") if name in ENGINE_NAMES])
def test_a_study_killed_within_batches_gives_the_trials_of_one_that_was_not(make_study, launcher, engine, jobs, capsys):
    """To the last bit, with trials cut off and the answer confirmed, by `kill -9` alone."""
    phases = {"initial": "4", "budget": "12", "cut_off": "true", "confirm": "1"}
    keys = {"engine": f'"{engine}"', "batch": "3", "seed": "6", **phases}
    whole = make_study("whole", **keys)
    assert main(["study", str(whole), "--json"]) == 0
    expected = json.loads(capsys.readouterr().out)
    folder = make_study("stopped", domain={"sleep": "0.01"}, jobs=jobs, **keys)
    pending = []
    for moment in np.sort(np.random.default_rng(int(jobs)).choice(np.arange(10, 150), 4, replace=False)).tolist():
        process = Launched(launcher, folder)
        wait_for(folder, process, moment)
        stop(process, signal.SIGKILL)
        pending.append(sum(trial[2] == "open" for trial in trials(folder)))
    assert main(["study", str(folder), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert max(pending) == 3, "it was killed while a whole batch was open"
    assert any(trial["prpv"] is None for trial in expected["trials"]), "something was cut off"
    assert trials(folder) == trials(whole)
    assert found["best"]["fresh"] is not None
    for key in ("trials", "best", "stopped"):
        assert found[key] == expected[key], key
