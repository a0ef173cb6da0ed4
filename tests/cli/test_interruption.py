"""SIGTERM and Ctrl-C, sent to real processes of every long command."""

import json
import os
import pty
import signal
import subprocess
import sys
import time
from contextlib import nullcontext

import pytest
from planted import planted_log, write_log
from processes import ENVIRONMENT, besides_progress, finished_episodes, heeding_ctrl_c, start, wait_for

from proxytune.cli.main import COMMANDS
from proxytune.cli.terminal import Terminated, signals_as_interruptions
from proxytune.extensions import Interrupted
from proxytune.starting import STOPPING

SLOWLY = {"sleep": "0.03"}
FEW = {"budget": "2", "initial": "2"}


def ended(process, number, command):
    """Stop a command, and see that it ends with its one line and no process left."""
    process.send_signal(number)
    out, told = process.communicate(timeout=60)  # returns only when every process that holds its pipes has ended
    assert besides_progress(told) == f"proxytune {command}: {STOPPING[number]}; {COMMANDS[command].left}\n"
    assert (process.returncode, out) == (128 + number, "")


@pytest.mark.slow
def test_a_terminated_diagnosis_is_one_line_and_leaves_no_findings(tmp_path):
    log = write_log(planted_log({}, episodes=6, seconds=20.0), tmp_path / "log")
    process = start("diagnose", log, "--output", tmp_path / "out")
    assert process.stderr.readline()  # it has begun
    ended(process, signal.SIGTERM, "diagnose")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_to_end_is_raised_once_and_cleaning_up_is_left_alone(number):
    before = signal.getsignal(number)
    cleaned = []
    with pytest.raises(Terminated), signals_as_interruptions():
        try:
            os.kill(os.getpid(), number)
        finally:
            os.kill(os.getpid(), signal.SIGTERM)
            os.kill(os.getpid(), signal.SIGHUP)
            cleaned.append(True)
    assert cleaned
    assert signal.getsignal(number) is before


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


@pytest.mark.parametrize("number", STOPPING)
def test_a_signal_that_comes_where_python_drops_what_is_raised_is_raised_after_that(number, kept_handler, capsys):
    class Dropped:
        def __del__(self):
            os.kill(os.getpid(), number)

    with pytest.raises(Interrupted) as raised, signals_as_interruptions():
        Dropped()
        time.sleep(9)
    assert isinstance(raised.value, Terminated) == (number != signal.SIGINT)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("number", STOPPING)
def test_a_signal_while_libraries_are_loaded_is_one_line(tmp_path, number):
    """A rich of our own, which is loaded first, sends it, and catches whatever comes of it."""
    lines = ("import os, time", "try:", f"    os.kill(os.getpid(), {int(number)})", "    time.sleep(9)")
    (tmp_path / "rich.py").write_text("\n".join((*lines, "except BaseException:", "    pass")))
    environment = {**ENVIRONMENT, "PYTHONPATH": f"{tmp_path}{os.pathsep}{ENVIRONMENT['PYTHONPATH']}"}
    command = [sys.executable, "-m", "proxytune", "study", "quickstart"]
    how = {"capture_output": True, "text": True, "env": environment, "preexec_fn": heeding_ctrl_c}
    done = subprocess.run(command, check=False, **how)
    assert (done.returncode, done.stdout) == (128 + number, "")
    assert done.stderr == f"proxytune: {STOPPING[number]} before anything began\n"


HANDLED = """
import os, signal, sys
from proxytune import __main__
number, moment = int(sys.argv.pop()), int(sys.argv.pop())
handle, moments = signal.signal, iter(range(9))

def then_sent(which, handler):
    before = handle(which, handler)
    if next(moments, None) == moment:
        os.kill(os.getpid(), number)
    return before

def watched(handle_all):
    signal.signal = then_sent
    return handle_all()

from proxytune.cli import main, terminal
whole = main.run_command
main.run_command = lambda *given, **more: watched(lambda: whole(*given, **more))
raise SystemExit(__main__.run())
"""


@pytest.mark.slow
@pytest.mark.parametrize("moment", range(6))
def test_a_signal_as_a_command_begins_or_ends_to_hear_of_signals_is_one_line(moment):
    """After each of the three handlers that are set, and after each that is taken back."""
    number = (signal.SIGINT, signal.SIGTERM)[moment % 2]
    words = [sys.executable, "-c", HANDLED, "list", "robots", str(moment), str(int(number))]
    how = {"capture_output": True, "text": True, "env": ENVIRONMENT, "preexec_fn": heeding_ctrl_c}
    done = subprocess.run(words, check=False, **how)
    left = COMMANDS["list"].left
    assert (done.returncode, done.stderr) == (128 + number, f"proxytune list: {STOPPING[number]}; {left}\n")
    assert bool(done.stdout) == (moment > 2)


LATE = """
import os, signal, sys
from proxytune import __main__
class Late:
    def __del__(self, kill=os.kill, process=os.getpid(), number=int(sys.argv.pop())):
        kill(process, number)
late = Late()
raise SystemExit(__main__.run())
"""


@pytest.mark.parametrize("number", STOPPING)
def test_a_signal_as_python_takes_itself_down_changes_no_status(number):
    words = [sys.executable, "-c", LATE, "list", "robots", str(int(number))]
    how = {"capture_output": True, "text": True, "env": ENVIRONMENT, "preexec_fn": heeding_ctrl_c}
    done = subprocess.run(words, check=False, **how)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
def test_what_is_ignored_stays_so_as_after_nohup(make_study):
    folder = make_study(domain=SLOWLY, jobs="2", **FEW)
    process = start("study", folder, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    wait_for(folder, process, 5)
    os.killpg(process.pid, signal.SIGHUP)
    process.communicate(timeout=60)
    assert process.returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_run_goes_on_when_nobody_reads_its_progress_any_more(make_study, jobs):
    """What agents print is lost with it."""
    folder = make_study(domain={**SLOWLY, "faults": '["agent1:*:prints"]'}, jobs=jobs, **FEW)
    process = start("study", folder, "--json")
    wait_for(folder, process, 5)
    process.stderr.close()
    out, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    found = json.loads(out)
    assert (len(found["trials"]), found["failures"]) == (2, [])


@pytest.mark.slow
def test_closed_streams_are_no_reason_to_stop_and_no_file_takes_their_place(make_study):
    folder = make_study(**FEW)
    closed = {"stdin": None, "stdout": None, "stderr": None, "preexec_fn": lambda: os.closerange(0, 3)}
    assert start("study", folder, **closed).wait(timeout=60) == 0
    assert (folder / "report.html").exists()


@pytest.mark.slow
def test_a_terminal_that_goes_away_after_nohup_ends_no_run(make_study):
    folder = make_study(domain=SLOWLY, jobs="2", **FEW)
    ours, theirs = pty.openpty()
    streams = dict.fromkeys(("stdin", "stdout", "stderr"), theirs)
    process = start("study", folder, **streams, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    os.close(theirs)
    while finished_episodes(folder) < 5 and process.poll() is None:
        os.read(ours, 4096)  # a terminal that is full is waited for
    os.close(ours)  # from here on it is EIO that answers
    assert process.wait(timeout=60) == 0
    assert (folder / "report.html").exists()


ENDINGS = {
    "leaves": (1, "code that is not proxytune's ended the process with status 0 (wobbly.py, line "),
    "leaves in C": (1, "code that is not proxytune's ended the process by exit in C"),
    "leaves later": (143, "terminated"),
}


@pytest.mark.slow
@pytest.mark.parametrize("fault", ENDINGS)
def test_a_study_whose_code_ends_the_process_has_not_ended_well(make_study, fault):
    process = start("study", make_study(domain={"faults": f'["agent3:1:{fault}"]'}))
    out, told = process.communicate(timeout=60)
    status, line = ENDINGS[fault]
    assert (process.returncode, out) == (status, "")
    assert besides_progress(told).startswith(f"proxytune study: {line}")
    assert besides_progress(told).endswith(f"; {COMMANDS['study'].left}\n")
    assert besides_progress(told).count("\n") == 1
