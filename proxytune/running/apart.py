"""A process apart, for pieces of work that may take their process with them or never end."""

import os
import re
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, wait
from dataclasses import dataclass
from typing import Any

from joblib.externals.loky import ProcessPoolExecutor

from proxytune.running.sending import Recipe, do_sent, end_with, load_sent, recipe_of


@dataclass(frozen=True)
class Lost:
    """How a piece ended without a result.

    Attributes:
        how: In one phrase, as "SIGSEGV" or "exit status 3"; empty if it was ended because it took too long.
        seconds: How long it took until then.
    """

    how: str
    seconds: float

    @property
    def killed(self) -> bool:
        """Whether its process was killed from outside: by the machine, where memory ran out, or by somebody."""
        return self.how == "SIGKILL"


class Apart:
    """One process that does one piece at a time; where a piece ends it, the next piece has a new one.

    Use as a context: leaving it ends the process.
    """

    def __init__(self, work: Callable[[Any], Any], timeout_s: float | None = None) -> None:
        self._work, self._timeout_s = work, timeout_s
        self._recipe: Recipe | None = None
        self._process: Any = None

    def __enter__(self) -> "Apart":
        return self

    def __exit__(self, *problem: object) -> None:
        self._end()

    def do(self, piece: Any, lost: Callable[[Lost], Any]) -> Any:
        """Do a piece.

        Args:
            piece: The piece.
            lost: Its result where it ends its process, or takes longer than it may.

        Raises:
            NotSendableError: If the work cannot go to another process.
        """
        if self._process is None:
            self._start()
        how, begun = "", time.perf_counter()
        try:
            result = self._process.submit(do_sent, self._recipe, piece)
            wait([result], self._timeout_s)
            if result.done():
                return result.result()
        except BrokenExecutor as problem:
            how = _how_it_ended(str(problem))
        self._end()
        return lost(Lost(how, time.perf_counter() - begun))

    def _start(self) -> None:
        """Start a process and load the work, which takes none of the pieces' time."""
        self._recipe = self._recipe or recipe_of(self._work)
        self._process = ProcessPoolExecutor(1, initializer=end_with, initargs=(os.getpid(),))
        self._process.submit(load_sent, self._recipe).exception()

    def _end(self) -> None:
        if self._process is not None:
            self._process.shutdown(wait=True, kill_workers=True)
        self._process = None


def _how_it_ended(told: str) -> str:
    """How a process ended, from what loky tells: "The exit codes of the workers are {SIGSEGV(-11)}"."""
    found = re.search(r"\{(\w+)\((-?\d+)\)", told)
    if not found:
        return "for an unknown reason"
    name, number = found.groups()
    return f"exit status {number}" if name == "EXIT" else name
