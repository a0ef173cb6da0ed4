"""The family that is a formula, with agents that end their process, never end, or meet the limits of the machine."""

import ctypes
import os
import signal
import sys
import time
from collections.abc import Mapping
from pathlib import Path

from wobbly import Wobbly, wobbly

from proxytune.domain import Episode
from proxytune.errors import EpisodeError
from proxytune.settings import Section


class OwnError(BaseException):
    """No Exception, as sys.exit's is none."""


def _own_error() -> None:
    raise OwnError("of its\nown caf\udce9")


def _interrupts() -> None:
    raise KeyboardInterrupt("of its own")


def _short_of_memory() -> None:
    """As a family tells of what its agent has raised."""
    raise EpisodeError("raised MemoryError at 1.20 s: no room") from MemoryError("no room")


def _short_of_files() -> None:
    raise EpisodeError("raised OSError at 1.20 s: too many") from OSError(24, "Too many open files")


def _hangs_in_c() -> None:
    """Keep the interpreter's lock, so that no Python runs in any thread."""
    ctypes.PyDLL(None).sleep(600)


def _raises() -> None:
    raise ValueError("of\nits own")


ENDINGS = {
    "lingers": lambda: time.sleep(1.3),
    "raises": _raises,
    "hangs in C": _hangs_in_c,
    "exits": lambda: sys.exit(0),
    "own error": _own_error,
    "interrupts": _interrupts,
    "hangs": lambda: time.sleep(600.0),
    "leaves": lambda: os._exit(9),
    "aborts": lambda: os.kill(os.getpid(), signal.SIGABRT),
    "is killed": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "memory": _short_of_memory,
    "files": _short_of_files,
}


class Deadly(Wobbly):
    """Wobbly, with the faults of ENDINGS."""

    def run(self, episode: Episode) -> Mapping[str, float]:
        scores = super().run(episode)
        for agent, start, fault in (one.split(":") for one in self.faults):
            if agent == episode.agent and start in ("*", str(episode.start)):
                ENDINGS[fault]()
        return scores


def deadly(section: Section, *, model: Path | None) -> Deadly:
    """The family that a [domain] table describes."""
    return Deadly(**vars(wobbly(section, model=model)))
