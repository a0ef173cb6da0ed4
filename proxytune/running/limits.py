"""Time limits within a piece of work: one that overruns a limit ends its process, and a note says what was under way.

Code that is not ours may hang where no Python runs any more; only the end of its process ends that.
"""

import signal
import threading
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Any

OVERRUN = "SIGALRM"
"""How the process of a piece ends that overruns a limit."""


@dataclass(frozen=True)
class Note:
    """What a piece says of itself.

    Attributes:
        path: Where it says it.
        before: What it was doing when an earlier process ended with it; empty if none did.
    """

    path: Path
    before: str


_note: ContextVar[Note | None] = ContextVar("note", default=None)


@dataclass(frozen=True)
class Noted:
    """Work whose pieces note what they do.

    Attributes:
        work: Does a piece, in a process that may be ended if a limit is set in it.
        folder: Where the notes are; another machine need not have it.
    """

    work: Callable[[Any], Any]
    folder: Path

    def __call__(self, piece: Any) -> Any:
        """Do a piece."""
        before = _note.set(Note(self._path(piece), self.last(piece)))
        try:
            return self.work(piece)
        finally:
            _note.reset(before)

    def last(self, piece: Any) -> str:
        """What a piece noted last; empty if nothing."""
        with suppress(OSError):
            return self._path(piece).read_text(encoding="utf-8")
        return ""

    def _path(self, piece: Any) -> Path:
        return self.folder / f"{zlib.crc32(repr(piece).encode()):08x}"


@contextmanager
def limited(what: str, timeout_s: float | None) -> Iterator[None]:
    """Note what is done meanwhile, and end this process if that takes longer than it may [s].

    Outside a piece of noted work there is no limit, nor in a cluster's worker, which is not ours to end: that does its
    pieces in a thread of their own.
    """
    note = _note.get()
    if note is not None:
        with suppress(OSError):
            note.path.write_text(what, encoding="utf-8")
    ours = threading.current_thread() is threading.main_thread()
    if note is None or timeout_s is None or not ours:
        yield
        return
    signal.setitimer(signal.ITIMER_REAL, timeout_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def was_ended_in(what: str) -> bool:
    """Whether an earlier process ended with this piece while it was doing this."""
    note = _note.get()
    return note is not None and note.before == what
