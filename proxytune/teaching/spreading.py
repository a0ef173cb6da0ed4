"""The points of learning curves, made by several processes; one that hangs or ends with its process is named."""

import functools
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

from proxytune.errors import EpisodeError, RunError
from proxytune.learning.settings import LEARNER, TeachingSettings
from proxytune.running.apart import Apart, Lost
from proxytune.running.limits import OVERRUN, Noted
from proxytune.running.workers import Rescue, working
from proxytune.teaching.points import Point, TeachingSetup
from proxytune.teaching.supervision import TOGETHER

NOTES = ".under_way"
"""The folder, beside what is kept, where points note what they do; it is there meanwhile only."""


def prepare_points(setup: TeachingSetup, points: Sequence[Point], jobs: int) -> None:
    """Make what these points share with others.

    Raises:
        LearnerError: If an expert cannot drive, or the learner cannot use the samples.
        EpisodeError: If a domain or the learner fails, or takes longer than it may.
        RunError: If a process or the machine fails.
    """
    with _spread(setup, setup.prepare, points, jobs) as made:
        for _ in made:
            pass


def prepare_shared(setup: TeachingSetup, points: Sequence[Point], jobs: int) -> None:
    """Make what several points share before they are scored, so that no two processes make the same.

    Raises:
        InputError, RunError: As prepare_points.
    """
    prepare_points(setup, _shared(setup.settings, points), jobs)


def score_points(
    setup: TeachingSetup, points: Sequence[Point], jobs: int
) -> AbstractContextManager[Iterator[tuple[Point, float]]]:
    """Score the points in parallel, each yielded as soon as it is there.

    Those that take longest begin first: otherwise one of them, begun last, would keep one process busy alone.

    Raises:
        InputError, RunError: As prepare_points.
    """
    ordered = sorted(points, key=lambda point: -point.count)
    return _spread(setup, functools.partial(_score, setup.score), ordered, jobs)


def _score(score: Callable[[Point], float], point: Point) -> tuple[Point, float]:
    return point, score(point)


@contextmanager
def _spread(
    setup: TeachingSetup, work: Callable[[Point], Any], points: Sequence[Point], jobs: int
) -> Iterator[Iterator[Any]]:
    """Do the points, in processes that a limit may end where there is one."""
    with _notes(setup.cache.folder / NOTES) as folder:
        noted = Noted(work, folder)
        rescue = Rescue[Point, Any](_Loss(setup.timeout_s, noted), apart=setup.timeout_s is not None)
        with working(noted, points, jobs, rescue=rescue) as done:
            yield done


@contextmanager
def _notes(folder: Path) -> Iterator[Path]:
    """An empty folder for the points' notes, where there is room for one; a killed command may have left its own."""
    shutil.rmtree(folder, ignore_errors=True)
    with suppress(OSError):
        folder.mkdir(parents=True)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@dataclass(frozen=True)
class _Loss:
    """What becomes of a point that has ended its process."""

    timeout_s: float | None
    noted: Noted

    def __call__(self, point: Point, lost: Lost) -> Any:
        """Make it once more where that tells which episode it is, or say of what it ended.

        Raises:
            EpisodeError: If a lesson or an examination took longer than it may.
            RunError: If the process ended otherwise.
        """
        if self.noted.last(point).endswith(TOGETHER):
            with Apart(self.noted) as apart:
                return apart.do(point, functools.partial(self._refuse, point))
        return self._refuse(point, lost)

    def _refuse(self, point: Point, lost: Lost) -> NoReturn:
        what = f"{point.name}: {self.noted.last(point) or 'a point of a learning curve'}"
        if lost.how == OVERRUN and self.timeout_s is not None:
            limit = f"{what} took longer than {self.timeout_s:g} s; correct the learner or the domain family"
            raise EpisodeError(f"{limit}, or raise episode_timeout_s, and run again to continue")
        why = "; out of memory?" if lost.killed else ""
        raise RunError(f"{what} ended its process ({lost.how}{why}); correct that, and run again to continue")


def _shared(settings: TeachingSettings, points: Sequence[Point]) -> list[Point]:
    """Points whose preparation makes all that these share.

    Where the learner drives in the target, its samples are shared by the points of one learning curve and repetition;
    where the expert does, by all points of a repetition.
    """
    if settings.target_lessons == LEARNER:
        falling = sorted(points, key=lambda point: -point.count)
        return _first_of_each(falling, lambda point: replace(point, count=0))
    last = settings.target_samples[-1]
    repetitions = sorted({point.repetition for point in points})
    targets = [Point("the target", None, repetition, last) for repetition in repetitions]
    taught = [replace(point, count=0) for point in points if point.proxy is not None]
    return targets + _first_of_each(taught, lambda point: point)


def _first_of_each(points: Sequence[Point], kind: Callable[[Point], Point]) -> list[Point]:
    """The first point of each kind."""
    kinds: list[Point] = []
    first = []
    for point in points:
        if kind(point) not in kinds:
            kinds.append(kind(point))
            first.append(point)
    return first
