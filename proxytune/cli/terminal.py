"""Output of every command, one JSON document or the same for people, its progress, and the signals that end it.

Standard output holds a command's answer and nothing else: what agents print goes to standard error. Progress of unknown
length is a spinner on a terminal (`waiting`), of steps a bar (`steps`); elsewhere it is lines.
"""

import errno
import io
import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout, suppress
from dataclasses import dataclass
from types import FrameType
from typing import Any

from rich.console import Console, RenderableType

from proxytune.errors import RunError
from proxytune.extensions import Interrupted, describe, interrupt, is_users, place_of
from proxytune.running import Lines, progress_bar
from proxytune.starting import STOPPING


@dataclass(frozen=True)
class Answer:
    """What `--json` prints, plain values, and what a person reads; of a plain text no line is broken."""

    document: dict[str, Any]
    text: RenderableType


class Terminated(Interrupted):
    """SIGTERM, or SIGHUP as its terminal went away, was received; raised in the main thread."""


ANEW_S = 0.01
"""After so long a signal is sent anew [s]."""


@contextmanager
def signals_as_interruptions() -> Iterator[None]:
    """Raise Interrupted at every Ctrl-C and Terminated at the first SIGTERM or SIGHUP.

    Later ones of the latter are ignored, so that cleaning up is not interrupted; so is what is ignored already, as
    Ctrl-C for a command that a script has put into the background, and SIGHUP after nohup. One that comes within
    `__del__`, or a function that C calls, out of which Python lets nothing be raised, is sent anew.
    """
    handlers = {signal.SIGTERM: _terminate, signal.SIGHUP: _terminate, signal.SIGINT: interrupt}
    heard = [number for number in handlers if signal.getsignal(number) is not signal.SIG_IGN]
    before = {number: signal.getsignal(number) for number in heard}
    told = sys.unraisablehook

    def tell(dropped: Any) -> None:
        if not isinstance(dropped.exc_value, Interrupted):
            told(dropped)
            return
        number = _number_of(dropped.exc_value)
        signal.signal(number, handlers[number])
        # Not here, where it would be dropped too
        threading.Timer(ANEW_S, os.kill, (os.getpid(), number)).start()

    try:
        sys.unraisablehook = tell
        for number in heard:
            signal.signal(number, handlers[number])
        yield
    finally:
        sys.unraisablehook = told
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


def _terminate(number: int, frame: FrameType | None) -> None:
    for later in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(later, signal.SIG_IGN)
    raise Terminated(number)


def _number_of(problem: BaseException) -> signal.Signals:
    return signal.Signals(problem.args[0]) if isinstance(problem, Terminated) else signal.SIGINT


FAILED = 1
REMEDIES = {
    errno.EMFILE: "; allow more open files (ulimit -n 1024), or take fewer jobs",
    errno.ENFILE: "; close other programs, or take fewer jobs",
    errno.ENOMEM: "; close other programs, or take fewer jobs",
    errno.ENOSPC: "; make room",
}
"""What helps where the system lacks something."""


def stopped_by(problem: KeyboardInterrupt | SystemExit | MemoryError | OSError) -> tuple[str, int]:
    """Say what stopped a command, in one phrase, and its exit status."""
    if is_users(problem):
        number = _number_of(problem)
        return STOPPING[number], 128 + number
    if isinstance(problem, MemoryError):
        return f"memory ran out ({describe(problem)}); ask for less", FAILED
    if isinstance(problem, OSError):
        remedy = REMEDIES.get(problem.errno or 0, "")
        return f"the system refused something ({describe(problem)}){place_of(problem)}{remedy}", FAILED
    return f"code that is not proxytune's ended the command ({describe(problem)}){place_of(problem)}", FAILED


OUT, ERR = 1, 2
"""The descriptors, which code in C writes to, and which other processes inherit."""


@contextmanager
def prints_to_stderr() -> Iterator[None]:
    """Send to standard error whatever this process, and those that it starts, write to standard output meanwhile."""
    sys.stdout.flush()
    kept = None
    with suppress(OSError):  # One of the two is closed: then nothing is to be parted
        kept = os.dup(OUT)
        os.dup2(ERR, OUT)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        if kept is not None:
            os.dup2(kept, OUT)
            os.close(kept)


def print_answer(answer: Answer, *, as_json: bool) -> None:
    """Print a command's answer; a reader that has gone is no error, and letters that a terminal lacks are escaped."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        if as_json:
            text = json.dumps(answer.document, indent=2, allow_nan=False, ensure_ascii=False)
            try:
                text.encode(sys.stdout.encoding or "utf-8")
            except UnicodeEncodeError:  # In ASCII, as JSON escapes what standard output cannot hold
                text = json.dumps(answer.document, indent=2, allow_nan=False)
            print(text)
        elif isinstance(answer.text, str):
            print(answer.text)
        else:
            console = Console()
            # What is piped is not broken at a width: a path may have blanks
            console.print(answer.text, crop=False, soft_wrap=not console.is_terminal)
        sys.stdout.flush()
    except OSError as problem:
        # What is still in the buffer would raise once more when Python ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if problem.errno in (errno.EPIPE, errno.EIO):  # The reader, or the terminal, has gone
            return
        raise RunError(f"standard output: cannot be written ({problem.strerror}); make room and run again") from None


@contextmanager
def waiting(what: str) -> Iterator[Callable[[str], None]]:
    """Show what is being done; gives what hears how far it is."""
    lines = Lines()
    with lines.console.status(what) as status:

        def tell(line: str) -> None:
            lines.say(line)
            status.update(line)

        yield tell


@contextmanager
def steps(shares: Mapping[str, float]) -> Iterator[Callable[[str], None]]:
    """Show each step as it begins: of each beginning of a step's line is told what share of the time is over then."""
    lines = Lines()
    with progress_bar(lines.console, speed_estimate_period=3600.0) as bar:
        task = bar.add_task("", total=1.0)

        def begin(step: str) -> None:
            lines.say(step)
            share = max((over for start, over in shares.items() if step.startswith(start)), default=0.0)
            bar.update(task, description=step, completed=max(share, bar.tasks[0].completed))  # It never goes back

        yield begin
