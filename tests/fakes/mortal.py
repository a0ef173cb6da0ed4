"""The classrooms and their learners, which kill the command at a chosen moment, as kill -9 would.

The file that the environment variable FATE names says at which, and what is killed: "exam 5 command" is the fifth
examination of a run, in whichever process; without that file, none. Every moment adds a line to the file `moments`
beside it. Run as a script it is the launcher, and the rule that chooses examinations is such a moment too.
"""

import functools
import os
import runpy
import signal
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from schoolroom import Matrix, schoolroom
from tightrope import Cells, tightrope

from proxytune.domain import Demonstration
from proxytune.learning import Weights
from proxytune.settings import Section

MOMENTS = {"demonstrate": "lesson", "guide": "guided", "examine": "exam", "run": "episode"}
"""What each method of a family is a moment of."""
KILLS = {
    "all": lambda: os.killpg(0, signal.SIGKILL),
    "command": lambda: os.kill(os.getpgrp(), signal.SIGKILL),
    "process": lambda: os.kill(os.getpid(), signal.SIGKILL),
}
"""The command with its processes; itself alone, so that these go on a while; or only the process of the moment."""


def meet(moment: str) -> None:
    """Note a moment; at the fated one, kill."""
    fate = Path(os.environ["FATE"])
    noted = fate.with_name("moments")
    with noted.open("a") as journal:
        journal.write(f"{moment}\n")
    # Where a process alone is killed, the first to take the file away is.
    with suppress(FileNotFoundError):
        fated, count, whom = fate.read_text().split()
        if moment == fated and noted.read_text().splitlines().count(moment) >= int(count):
            if whom == "process":
                fate.unlink()
            KILLS[whom]()


def meeting(moment: str, do: Any) -> Any:
    """A function that is such a moment."""

    @functools.wraps(do)
    def done(*words: Any, **how: Any) -> Any:
        meet(moment)
        return do(*words, **how)

    return done


@dataclass(frozen=True)
class Mortal:
    """A classroom whose lessons, examinations and episodes are moments."""

    inner: Any

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name == "inner":
            raise AttributeError(name)
        value = getattr(self.inner, name)
        return meeting(MOMENTS[name], value) if name in MOMENTS else value


def mortal_schoolroom(section: Section, *, model: Path | None) -> Mortal:
    """The family that a [domain] table describes."""
    return Mortal(schoolroom(section, model=model))


def mortal_tightrope(section: Section, *, model: Path | None) -> Mortal:
    """The same of the tightrope."""
    return Mortal(tightrope(section, model=model))


class Training:
    """Its trainings are moments."""

    def train(self, samples: Demonstration, start: Weights | None, seed: int) -> Weights:
        meet("training")
        return super().train(samples, start, seed)


@dataclass(frozen=True)
class MortalMatrix(Training, Matrix):
    """Fits the matrix."""


@dataclass(frozen=True)
class MortalCells(Training, Cells):
    """Answers by cells."""


if __name__ == "__main__":
    from proxytune import learning

    learning.next_examinations = meeting("rule", learning.next_examinations)
    runpy.run_module("launcher", run_name="__main__")
