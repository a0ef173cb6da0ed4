"""The family that is a formula, whose agents end their process, never end, remember, or meet the machine's limits."""

import ctypes
import os
import random
import signal
import sys
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np
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
    "remembers": lambda: DRIVEN.append(1) or len(DRIVEN),
    "draws": lambda: np.random.default_rng().normal(),
    "draws by NumPy": lambda: np.random.normal(),
    "draws by Python": random.random,
}
"""What they do; what agents remember, or draw from what no episode seeds, moves their scores a little."""
DRIVEN: list[int] = []


class Deadly(Wobbly):
    """Wobbly, with the faults of ENDINGS."""

    def run(self, episode: Episode) -> Mapping[str, float]:
        scores = super().run(episode)
        moved = [ENDINGS[one.split(":")[2]]() or 0.0 for one in self.faults if self._hits(one, episode)]
        return {**scores, "distance": scores["distance"] + 0.01 * sum(moved)}


def deadly(section: Section, *, model: Path | None) -> Deadly:
    """The family that a [domain] table describes."""
    return Deadly(**vars(wobbly(section, model=model)))
