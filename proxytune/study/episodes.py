"""Running episodes, in this process or spread over several, and catching what fails."""

import errno
import math
import pickle
import sys
import time
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, cast

from joblib import Parallel, delayed
from threadpoolctl import threadpool_limits

from proxytune.domain import DomainFamily, Episode
from proxytune.errors import EpisodeError, RunError
from proxytune.study.store import Outcome

OF_THE_MACHINE = (errno.ENOSPC, errno.EDQUOT, errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EIO)


@contextmanager
def running(family: DomainFamily, episodes: Sequence[Episode], jobs: int) -> Iterator[Iterator[Outcome]]:
    """Run episodes and give each outcome as soon as it is there, in no particular order.

    Which process runs an episode, and after which, does not change its outcome. With several jobs, joblib's backend is
    the caller's choice (processes of this machine by default). Leaving the context drops the episodes not yet done.

    Args:
        family: The domain family.
        episodes: What to run, in the order in which to begin.
        jobs: How many processes; with one, everything runs in this process.

    Raises:
        RunError: If the machine fails rather than an episode: a process dies, memory or disk run out.
    """
    outcomes = _here(family, episodes) if jobs == 1 else _spread(family, episodes, jobs)
    try:
        yield _told(outcomes)
    finally:
        outcomes.close()


def _here(family: DomainFamily, episodes: Sequence[Episode]) -> Generator[Outcome, None, None]:
    for episode in episodes:
        yield run_episode(family, episode)


def _spread(family: DomainFamily, episodes: Sequence[Episode], jobs: int) -> Generator[Outcome, None, None]:
    recipe = _Recipe(pickle.dumps(family), tuple(sys.path))
    parallel = Parallel(n_jobs=min(jobs, max(1, len(episodes))), batch_size=1, return_as="generator_unordered")
    outcomes = parallel(delayed(_run_pickled)(recipe, episode) for episode in episodes)
    return cast("Generator[Outcome, None, None]", outcomes)


@dataclass(frozen=True)
class _Recipe:
    """A family pickled once, and where its modules are found: a process that has it unpickles it once."""

    pickled: bytes
    folders: tuple[str, ...]


def _run_pickled(recipe: _Recipe, episode: Episode) -> Outcome:
    return run_episode(_unpickled(recipe), episode)


@lru_cache(maxsize=1)
def _unpickled(recipe: _Recipe) -> DomainFamily:
    sys.path.extend(folder for folder in recipe.folders if folder not in sys.path)
    return cast("DomainFamily", pickle.loads(recipe.pickled))


def run_episode(family: DomainFamily, episode: Episode) -> Outcome:
    """Run one episode on one thread; what the agent or the domain does wrong is its outcome.

    Raises:
        RunError: If memory or disk run out: that is not the episode's doing.
    """
    start = time.perf_counter()
    metrics: Mapping[str, float] | None = None
    failure = ""
    try:
        with threadpool_limits(limits=1):
            metrics = _checked(family, episode, family.run(episode))
    except EpisodeError as problem:
        failure = str(problem)
    except Exception as problem:
        if isinstance(problem, MemoryError) or getattr(problem, "errno", None) in OF_THE_MACHINE:
            raise RunError(f"the machine failed ({type(problem).__name__}: {problem}); run again to go on") from None
        failure = f"the domain family raised {type(problem).__name__}: {' '.join(str(problem).split())}"
    return Outcome(episode, metrics, failure, time.perf_counter() - start)


def _checked(family: DomainFamily, episode: Episode, result: Any) -> dict[str, float]:
    """The result as plain numbers, one per metric of the family."""
    metrics = {}
    for name in family.metrics:
        value = float(result[name]) if name in result else math.nan
        if not math.isfinite(value):
            raise EpisodeError(f"agent '{episode.agent}': the domain family gave no finite '{name}'")
        metrics[name] = value
    return metrics


def _told(outcomes: Iterator[Outcome]) -> Iterator[Outcome]:
    try:
        yield from outcomes
    except BrokenExecutor:
        raise RunError(
            "a process that ran episodes was killed (out of memory?); run again to go on, perhaps with jobs = 1"
        ) from None
