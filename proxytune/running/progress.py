"""How far a study is: bars on the terminal, nothing anywhere else."""

from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn


class Watcher(Protocol):
    """Hears how a run goes."""

    def begin(self, what: str, known: int) -> None:
        """Something of several episodes begins, so many of which are known already."""
        ...

    def episode(self) -> None:
        """One more episode has been run."""
        ...

    def best(self, score: float) -> None:
        """The lowest score so far."""
        ...


class Silent:
    """Watches without a word."""

    def begin(self, what: str, known: int) -> None:
        """Say nothing."""

    def episode(self) -> None:
        """Say nothing."""

    def best(self, score: float) -> None:
        """Say nothing."""


class Bars:
    """One bar on standard error, of episodes unless said otherwise: what is being done, time left and the best score.

    Use as a context; where standard error is no terminal, nothing is shown.
    """

    def __init__(self, total: int, unit: str = "episodes") -> None:
        console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn(unit),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            TextColumn("{task.fields[best]}"),
            console=console,
            disable=not console.is_terminal,
            speed_estimate_period=900.0,
            transient=True,
        )
        self._task = self._progress.add_task("", total=total, best="")

    def __enter__(self) -> "Bars":
        self._progress.start()
        return self

    def __exit__(self, *problem: object) -> None:
        self._progress.stop()

    def begin(self, what: str, known: int) -> None:
        """Show what is being done; episodes known already need no time, so they are taken off the total."""
        total = self._progress.tasks[0].total or 0.0
        self._progress.update(self._task, description=what, total=max(0.0, total - known))

    def episode(self) -> None:
        """Move the bar by one."""
        self._progress.update(self._task, advance=1)

    def best(self, score: float) -> None:
        """Show the lowest score."""
        self._progress.update(self._task, best=f"best {score:g}")
