"""SIGTERM and Ctrl-C, sent to real processes of every long command."""

import json
import os
import signal
import time
from contextlib import nullcontext
from pathlib import Path

import pytest
from planted import planted_log, write_log
from processes import besides_progress, finished_episodes, start, wait_for

from proxytune.cli.main import COMMANDS, main
from proxytune.cli.terminal import Terminated, signals_as_interruptions
from proxytune.extensions import Interrupted

SLOWLY = {"sleep": "0.03"}


def ended(process, number, command):
    """Stop a command, and see that it ends with its one line and no process left."""
    process.send_signal(number)
    out, told = process.communicate(timeout=60)  # returns only when every process that holds its pipes has ended
    word, status = {signal.SIGTERM: ("terminated", 143), signal.SIGINT: ("interrupted", 130)}[number]
    assert besides_progress(told) == f"proxytune {command}: {word}; {COMMANDS[command].left}\n"
    assert (process.returncode, out) == (status, "")


@pytest.mark.slow
@pytest.mark.parametrize(("number", "jobs"), [(signal.SIGTERM, "1"), (signal.SIGINT, "2")])
def test_a_stopped_sweep_goes_on_to_the_same_curve(make_study, capsys, number, jobs):
    folder, whole = make_study(domain=SLOWLY, jobs=jobs), make_study("whole")
    arguments = ("--parameter", "trim", "--points", "5", "--json")
    process = start("sweep", folder, *arguments)
    wait_for(folder, process, 30)
    ended(process, number, "sweep")
    kept = finished_episodes(folder)
    assert 30 <= kept < 5 * 18
    documents = []
    for home in (folder, whole):
        assert main(["sweep", str(home), *arguments]) == 0
        documents.append(json.loads(capsys.readouterr().out))
    assert documents[0]["curves"] == documents[1]["curves"]
    assert documents[0]["episodes"]["run"] == 5 * 18 - kept


@pytest.mark.slow
def test_a_terminated_diagnosis_is_one_line_and_leaves_no_findings(tmp_path):
    log = write_log(planted_log({}, episodes=6, seconds=20.0), tmp_path / "log")
    process = start("diagnose", log, "--output", tmp_path / "out")
    wait_until_heeding(process)
    ended(process, signal.SIGTERM, "diagnose")
    assert not (tmp_path / "out").exists()


def wait_until_heeding(process):
    """Until SIGTERM has a handler: the command has begun."""
    status = Path(f"/proc/{process.pid}/status")
    if not status.exists():
        pytest.skip("this system does not tell which signals a process handles")
    while process.poll() is None:
        caught = next(line for line in status.read_text().splitlines() if line.startswith("SigCgt"))
        if int(caught.split()[1], 16) >> (signal.SIGTERM - 1) & 1:
            return
        time.sleep(0.005)


def test_sigterm_is_raised_once_and_cleaning_up_is_left_alone():
    before = signal.getsignal(signal.SIGTERM)
    cleaned = []
    with pytest.raises(Terminated), signals_as_interruptions():
        try:
            os.kill(os.getpid(), signal.SIGTERM)
        finally:
            os.kill(os.getpid(), signal.SIGTERM)
            cleaned.append(True)
    assert cleaned
    assert signal.getsignal(signal.SIGTERM) is before


@pytest.mark.parametrize("before", [signal.default_int_handler, signal.SIG_IGN])
def test_ctrl_c_is_told_apart_from_what_other_code_raises_unless_it_is_ignored(before, kept_handler):
    signal.signal(signal.SIGINT, before)
    with nullcontext() if before is signal.SIG_IGN else pytest.raises(Interrupted), signals_as_interruptions():
        os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


@pytest.fixture
def kept_handler():
    before = signal.getsignal(signal.SIGINT)
    yield
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_while_libraries_are_loaded_is_one_line(tmp_path):
    """A rich of our own, which is loaded first, presses it."""
    (tmp_path / "rich.py").write_text("import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(9)\n")
    process = start("study", tmp_path, cwd=tmp_path)
    out, told = process.communicate(timeout=60)
    assert (process.returncode, out, told) == (130, "", "proxytune: interrupted\n")
