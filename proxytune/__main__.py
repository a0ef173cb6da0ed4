"""`python -m proxytune`, and `proxytune`: a command's process from its first moment to its exit status.

A signal may come while libraries are imported, which takes a second or two. Code of a study may end the process as if
all were done (`os._exit(0)`, or `exit(0)` of a simulator in C): until the command is through, its status is then
another, and one line says so. Nothing can be done about `_exit` called in C.
"""

import atexit
import contextlib
import os
import signal
import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

from proxytune.starting import STOPPING, UNDER_WAY, tell

# Numba reads a file of settings in the current folder, and its cache is pickled; what is set here comes before that
UNSET = ("NUMBA_CACHE_DIR", "NUMBA_CACHE_LOCATOR_CLASSES")
_exit = os._exit


def run() -> int:
    """Run the command line; its exit status."""
    _open_descriptors()
    _on_signals(_end_at_once)
    # Comes last of all that is registered so: thereafter Python heeds no handler, and a signal would be the status
    atexit.register(_on_signals, signal.SIG_IGN)
    for name in UNSET:
        os.environ.setdefault(name, "")
    if os.path.lexists("matplotlibrc"):
        load_matplotlib()
    with _Guard() as guard:
        try:
            from proxytune.cli.main import main

            guard.status = main()
        except SystemExit as problem:  # of argparse
            guard.status = problem.code if isinstance(problem.code, int) else 1
    # What comes in now finds all said and done
    status = guard.status
    _on_signals(lambda number, frame: _exit(status))
    return status


def load_matplotlib() -> None:
    """Load Matplotlib without settings of the current folder, which may be a stranger's: they can have LaTeX run."""
    here = os.open(".", os.O_RDONLY)
    os.chdir(os.path.dirname(os.path.abspath(__file__)))
    try:
        import matplotlib  # noqa: F401
    finally:
        os.fchdir(here)
        os.close(here)


def _open_descriptors() -> None:
    """Open what the caller has closed of the standard three: else the next file, as study.db, takes its number."""
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        with contextlib.suppress(OSError):
            os.fstat(number)
            continue
        os.open(os.devnull, os.O_RDWR)
        setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))  # noqa: SIM115


def _on_signals(handler: Callable[[int, FrameType | None], object] | signal.Handlers) -> None:
    """Handle the signals that stop a command; one that is ignored, as after nohup, stays so."""
    for number in STOPPING:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)


def _end_at_once(number: int, frame: FrameType | None) -> None:
    """End before a command is under way, or after: an exception might be caught by a library that is being imported."""
    program, left = UNDER_WAY
    said = f"{program}: {STOPPING[signal.Signals(number)]}"
    tell(f"{said}; {left}" if left else f"{said} before anything began")
    _exit(128 + number)


class _Guard:
    """Sees to it that nothing but the command itself ends it with status 0; use as a context."""

    def __init__(self) -> None:
        self.status: int | None = None  # while it is under way
        self._process = os.getpid()

    def __enter__(self) -> "_Guard":
        os._exit = self._python_exits  # type: ignore[assignment]
        self._forget = self._guard_c()
        return self

    def __exit__(self, *problem: object) -> None:
        if self.status is None:  # an exception passes: Python tells of it, and taking the guard back calls it
            self.status = 1
        self._forget()

    def _python_exits(self, status: int) -> None:
        """Stand in for os._exit, also for what is to happen as Python ends."""
        if os.getpid() != self._process:
            _exit(status)
        if self.status is None:
            caller = sys._getframe(1)
            where = f"{os.path.basename(caller.f_code.co_filename)}, line {caller.f_lineno}"
            self._told(f"with status {status} ({where})")
        _exit(status or (1 if self.status is None else self.status))

    def _told(self, how: str) -> None:
        program, left = UNDER_WAY
        tell(f"{program}: code that is not proxytune's ended the process {how}; {left or 'run it again'}")

    def _guard_c(self) -> Callable[[], object]:
        """Be told of `exit` in C; gives what takes that back, which must be before Python ends."""
        import ctypes

        libc = ctypes.CDLL(None)
        if not hasattr(libc, "gnu_get_libc_version"):  # Elsewhere it cannot be taken back
            return lambda: None

        def exits(_: Any) -> None:
            if os.getpid() == self._process and self.status is None:
                self._told("by exit in C")
                _exit(1)

        kept = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(exits)
        mark = ctypes.create_string_buffer(1)
        libc["__cxa_atexit"](kept, None, mark)
        return lambda: (libc["__cxa_finalize"](mark), kept)


if __name__ == "__main__":
    raise SystemExit(run())
