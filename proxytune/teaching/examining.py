"""The examinations of a learning experiment: all of a grid, or those that tell most, batch by batch.

A batch is a pure function of the scores of the batches before it, and every score is cached by all that determines it:
an experiment that is stopped at any moment goes on where it was, to the same scores. Points of learning curves are made
by several processes (`prepare_points`, `score_points`); one that hangs or ends with its process is named.
"""

import functools
import itertools
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, replace
from typing import Any, NoReturn

import numpy as np

from proxytune import learning
from proxytune.errors import EpisodeError, RunError
from proxytune.running import OVERRUN, IsolatedWorker, Rescue, TracedTask, Watcher, WorkerExit, working
from proxytune.teaching.points import TOGETHER, CurvePoint, TeachingSetup

TRACES = ".under_way"
"""The folder, beside what is kept, where points keep what they do; it is there meanwhile only."""


def prepare_points(setup: TeachingSetup, points: Sequence[CurvePoint], jobs: int) -> None:
    """Make what these points share with others.

    A LearnerError if an expert cannot drive or samples cannot be used, an EpisodeError if a domain or the learner fails
    or takes too long, a RunError if a process or the machine fails.
    """
    with _spread(setup, setup.prepare, points, jobs) as made:
        for _ in made:
            pass


def score_points(
    setup: TeachingSetup, points: Sequence[CurvePoint], jobs: int
) -> AbstractContextManager[Iterator[tuple[CurvePoint, float]]]:
    """Score the points in parallel, each yielded as soon as it is there."""
    # Otherwise one of those that take longest, begun last, would keep one process busy alone.
    ordered = sorted(points, key=lambda point: -point.count)
    return _spread(setup, functools.partial(_score, setup.score), ordered, jobs)


def _score(score: Callable[[CurvePoint], float], point: CurvePoint) -> tuple[CurvePoint, float]:
    return point, score(point)


@contextmanager
def _spread(
    setup: TeachingSetup, work: Callable[[CurvePoint], Any], points: Sequence[CurvePoint], jobs: int
) -> Iterator[Iterator[Any]]:
    """Do the points, in processes that a limit may end where there is one, with traces where there is room for them."""
    folder = setup.cache.folder / TRACES
    # A killed command may have left its own.
    shutil.rmtree(folder, ignore_errors=True)
    with suppress(OSError):
        folder.mkdir(parents=True)
    traced = TracedTask(work, folder)
    rescue = Rescue[CurvePoint, Any](_Loss(setup.timeout_s, traced), isolated=setup.timeout_s is not None)
    try:
        with working(traced, points, jobs, rescue=rescue) as done:
            yield done
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@dataclass(frozen=True)
class _Loss:
    """The handling of a point that has ended its process."""

    timeout_s: float | None
    traced: TracedTask

    def __call__(self, point: CurvePoint, end: WorkerExit, first: bool = True) -> Any:
        """Make the point once more if it took too long or drove several episodes at once; else say what ended it.

        Of several episodes it is not known which one ended the process; made again, they are driven one by one.
        """
        if self.traced.last(point).endswith(TOGETHER) or (first and end.how == OVERRUN):
            again = functools.partial(self, first=False) if first else self._refuse
            with IsolatedWorker(self.traced) as isolated:
                return isolated.do(point, functools.partial(again, point))
        return self._refuse(point, end)

    def _refuse(self, point: CurvePoint, end: WorkerExit) -> NoReturn:
        what = f"{point.name}: {self.traced.last(point) or 'a point of a learning curve'}"
        if end.how == OVERRUN and self.timeout_s is not None:
            limit = f"{what} took longer than {self.timeout_s:g} s; correct the learner or the domain family"
            raise EpisodeError(f"{limit}, or raise episode_timeout_s, and run again to continue")
        why = "; out of memory?" if end.killed else ""
        raise RunError(f"{what} ended its process ({end.how}{why}); correct that, and run again to continue")


def _shared(settings: learning.TeachingSettings, points: Sequence[CurvePoint]) -> list[CurvePoint]:
    """Points whose preparation makes all that these share.

    Where the learner drives in the target, its samples are shared by the points of one learning curve and repetition;
    where the expert does, by all points of a repetition.
    """

    def first_of_each(points: Sequence[CurvePoint]) -> list[CurvePoint]:
        """The first point of each learning curve and repetition."""
        first: list[CurvePoint] = []
        for point in points:
            if not any(replace(point, count=known.count) == known for known in first):
                first.append(point)
        return first

    if settings.target_lessons == learning.LEARNER:
        return first_of_each(sorted(points, key=lambda point: -point.count))
    last = settings.target_samples[-1]
    repetitions = sorted({point.repetition for point in points})
    targets = [CurvePoint("the target", None, repetition, last) for repetition in repetitions]
    return targets + first_of_each([replace(point, count=0) for point in points if point.proxy is not None])


BATCH = 12
"""So many examinations are chosen at once, however many processes there are."""
DRAWS = 500
"""So many draws of the learning curves choose the next examinations."""


def examine_curves(
    setup: TeachingSetup,
    proxies: Mapping[str, learning.Distribution | None],
    jobs: int,
    watcher: Watcher,
    known: learning.ExaminationScores | None = None,
) -> dict[learning.Examination, float]:
    """Examine learners of these proxies, None of the one without, if that is not cached; `known` scores come along."""
    taught, scores = setup.settings, dict(known or {})
    if taught.examinations is None:
        every = itertools.product(proxies, range(taught.seeds), taught.target_samples)
        grid = list(itertools.starmap(learning.Examination, every))
        return {**scores, **_examine(setup, proxies, grid, jobs, watcher)}
    wanted = len(scores) + count_examinations(taught, len(proxies))
    design = learning.AdaptiveDesign(taught.target_samples, taught.seeds, BATCH)
    batch = learning.first_examinations(list(proxies), design)
    while batch and len(scores) < wanted:
        scores |= _examine(setup, proxies, batch[: wanted - len(scores)], jobs, watcher)
        if len(scores) < wanted:
            needs = needs_of(setup, learning.curves_of(taught.target_samples, scores), DRAWS)
            batch = learning.next_examinations(needs, list(proxies), design)
    return scores


def count_examinations(taught: learning.TeachingSettings, curves: int) -> int:
    """The number of examinations that this many learning curves take."""
    return curves * (taught.examinations or taught.seeds * len(taught.target_samples))


def needs_of(
    setup: TeachingSetup, curves: Mapping[str, learning.LearningCurve], draws: int = learning.POSTERIOR_DRAWS
) -> learning.SampleNeeds:
    """The target samples that each learner needs, by what [teaching] says of convergence."""
    taught, best = setup.settings, setup.target.best_score
    return learning.sample_needs(curves, best_score=best, tolerance=taught.tolerance, level=taught.level, draws=draws)


def _examine(
    setup: TeachingSetup,
    proxies: Mapping[str, learning.Distribution | None],
    batch: list[learning.Examination],
    jobs: int,
    watcher: Watcher,
) -> dict[learning.Examination, float]:
    points = {one: CurvePoint(one.curve, proxies[one.curve], one.repetition, one.samples) for one in batch}
    missing = [point for point in points.values() if not setup.is_cached(point)]
    watcher.begin("demonstrations", len(points) - len(missing))
    # Before they are scored, so that no two processes make the same
    prepare_points(setup, _shared(setup.settings, missing), jobs)
    watcher.begin("learning", 0)
    with score_points(setup, missing, jobs) as scored:
        for point, score in scored:
            watcher.episode()
            came = "nothing learnt yet" if np.isnan(score) else f"score {score:.3g}"
            where = f"{point.name}, repetition {point.repetition + 1}, {point.count} target samples"
            watcher.finished(f"{where}: {came}")
    return {one: setup.score(point) for one, point in points.items()}
