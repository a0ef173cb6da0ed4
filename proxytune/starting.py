"""What stops a command, what it says then, and a standard error that lasts when its terminal has gone.

Of Python's own library alone, and of that little: it is loaded before anything else.
"""

import contextlib
import os
import signal
import sys
from collections.abc import Iterator
from typing import Any, TextIO, cast

STOPPING = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated", signal.SIGHUP: "hung up"}
"""Signals that stop a command, and what it says then; its exit status is 128 more."""


def tell(line: str) -> None:
    """Write a line to standard error, whatever has become of Python's own."""
    with contextlib.suppress(OSError):
        os.write(2, f"{line}\n".encode(errors="backslashreplace"))


UNDER_WAY = ["proxytune", ""]
"""The command that is under way, and what its end leaves; empty before it."""


class LastingStream:
    """A stream of text that goes on where nobody reads any more, as after a terminal has gone: what is written is lost.

    All else is the stream's own.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write, or lose, a text."""
        try:
            return self._stream.write(text)
        except OSError:
            self._lose()
            return len(text)

    def flush(self) -> None:
        """Bring out, or lose, what was written."""
        try:
            self._stream.flush()
        except OSError:
            self._lose()

    def _lose(self) -> None:
        # Also what other processes and C write, and what is still in the buffer
        with contextlib.suppress(OSError):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())
            os.close(nowhere)


@contextlib.contextmanager
def lasting_stderr() -> Iterator[None]:
    """Have standard error go on meanwhile where its reader has gone."""
    before = sys.stderr
    sys.stderr = cast(TextIO, LastingStream(before))
    try:
        yield
    finally:
        sys.stderr = before
