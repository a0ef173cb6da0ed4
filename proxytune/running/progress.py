"""How far a command is: a bar on the terminal, a plain line for each trial, point or step anywhere else."""

import time
from contextlib import AbstractContextManager, nullcontext
from typing import Protocol

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Column

WHOLE = Column(no_wrap=True)
WITH_BAR, WITH_ALL = 60, 80
"""Columns of a terminal from which on a bar has room, and from which on units and the time so far have."""


class Watcher(Protocol):
    """Hears how a run goes."""

    def begin(self, what: str, known: int) -> None:
        """Something of several episodes begins, so many of which are known already."""

    def episode(self) -> None:
        """One more episode has been run."""

    def best(self, score: float) -> None:
        """The lowest score so far."""

    def finished(self, what: str) -> None:
        """A trial, a point or a run is finished; what became of it, in one line."""

    def waiting(self, episode: str, seconds: float) -> None:
        """An episode that nothing ends has been under way for so long, and still is; told by another thread."""


class Silent:
    """Watches without a word."""

    def begin(self, *told: object) -> None:
        """Say nothing, whatever is told."""

    episode = best = finished = waiting = begin


class Bars:
    """One bar on standard error, of episodes unless said otherwise: what is being done, time left and the best score.

    Use as a context. Where standard error is no terminal, there is a line for whatever is finished instead.
    """

    def __init__(self, total: int, unit: str = "episodes") -> None:
        self._lines, self._unit, self._patience_s = Lines(), unit, 0.0
        count, best = MofNCompleteColumn(table_column=WHOLE), TextColumn("{task.fields[best]}")
        self._progress = progress_bar(self._lines.console, count, unit=unit, last=best, speed_estimate_period=900.0)
        self._task = self._progress.add_task("", total=total, best="")

    def __enter__(self) -> "Bars":
        self._progress.start()
        return self

    def __exit__(self, *problem: object) -> None:
        self._progress.stop()

    def begin(self, what: str, known: int) -> None:
        """Show what is being done; episodes known already need no time, so they are taken off the total."""
        total = self._progress.tasks[0].total or 0.0
        if not (known or self._progress.tasks[0].description):
            self._lines.say(f"{what} begins; at most {total:.0f} {self._unit}")
        self._progress.update(self._task, description=what, total=max(0.0, total - known))

    def episode(self) -> None:
        """Move the bar by one."""
        self._progress.update(self._task, advance=1)

    def best(self, score: float) -> None:
        """Show the lowest score."""
        self._progress.update(self._task, best=f"best {score:g}")

    def finished(self, what: str) -> None:
        """Say what became of it, with the episodes so far; nothing of what was known before the first of them."""
        task = self._progress.tasks[0]
        if task.completed:
            self._lines.say(f"{what}; {task.completed:.0f} of at most {task.total:.0f} {self._unit}")

    def waiting(self, episode: str, seconds: float) -> None:
        """Say so, and then only what has waited twice as long: where all episodes are long, that is once."""
        if seconds >= self._patience_s:
            self._patience_s = 2.0 * seconds
            minutes = f"{seconds / 60.0:.0f} min"
            self._lines.put(f"{episode} has been under way for {minutes}; episode_timeout_s in study.toml would end it")


def watching(progress: bool, total: int, unit: str = "episodes") -> AbstractContextManager[Watcher]:
    """A bar of so many, if progress is to be shown; else silence."""
    return Bars(total, unit) if progress else nullcontext(Silent())


class Lines:
    """Plain lines on standard error, each after the seconds so far; on a terminal few, since a bar is there."""

    def __init__(self) -> None:
        self.console = Console(stderr=True)
        self._began = time.monotonic()

    def say(self, line: str) -> None:
        """Write one line; a log that is followed shows it at once."""
        if not self.console.is_terminal:
            self.put(line)

    def put(self, line: str) -> None:
        """Write one line on a terminal too, above its bar."""
        told = f"{time.monotonic() - self._began:.0f} s: {line}"
        self.console.print(told, highlight=False, markup=False, soft_wrap=True)


def progress_bar(
    console: Console,
    *counts: ProgressColumn,
    unit: str = "",
    last: ProgressColumn | None = None,
    speed_estimate_period: float,
) -> Progress:
    """A bar with what is being done, these counts and the time left, which vanishes when it ends.

    No figure is cut on a narrow terminal: the bar, the unit and the time so far are left out there, and what is being
    done is broken into lines.
    """
    width = console.width
    what = TextColumn("{task.description}", table_column=Column(no_wrap=width >= WITH_BAR, overflow="fold"))
    bar = [BarColumn()] if width >= WITH_BAR else []
    more = [TextColumn(unit), TimeElapsedColumn(table_column=WHOLE)] if width >= WITH_ALL else []
    left = (TextColumn("left"), TimeRemainingColumn(table_column=WHOLE), *([last] if last else ()))
    return Progress(
        *(what, *bar, *counts, *more, *left),
        console=console,
        disable=not console.is_terminal,
        speed_estimate_period=speed_estimate_period,
        transient=True,
    )
