"""Running episodes, in this process or spread over several, and catching what fails."""

import errno
import math
import os
import pickle
import sys
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from itertools import takewhile
from typing import Any, cast

from joblib import Parallel, delayed
from threadpoolctl import threadpool_limits

from proxytune.domain import DomainFamily, Episode
from proxytune.errors import EpisodeError, RunError
from proxytune.study.store import Outcome

WATCH_S = 0.5
OF_THE_MACHINE = (errno.ENOSPC, errno.EDQUOT, errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EIO)


@contextmanager
def running(
    family: DomainFamily, episodes: Sequence[Episode], jobs: int, over: Callable[[], bool] = lambda: False
) -> Iterator[Iterator[Outcome]]:
    """Run episodes and give each outcome as soon as it is there, in no particular order.

    Which process runs an episode, and after which, does not change its outcome. With several jobs, joblib's backend is
    the caller's choice (processes of this machine by default). Leaving the context drops the episodes not yet done.

    Args:
        family: The domain family.
        episodes: What to run, in the order in which to begin.
        jobs: How many processes; with one, everything runs in this process.
        over: Once this is true no further episode begins; those under way are still finished.

    Raises:
        RunError: If the machine fails rather than an episode: a process dies, memory or disk run out.
    """
    begun = takewhile(lambda _: not over(), episodes)
    outcomes = _spread(family, begun, jobs) if min(jobs, len(episodes)) > 1 else _here(family, begun)
    try:
        yield _told(outcomes)
    finally:
        with warnings.catch_warnings():
            # joblib warns of episodes it has finished in vain; whoever leaves early knows.
            warnings.simplefilter("ignore", UserWarning)
            outcomes.close()


def _here(family: DomainFamily, episodes: Iterable[Episode]) -> Generator[Outcome, None, None]:
    for episode in episodes:
        yield run_episode(family, episode)


def _spread(family: DomainFamily, episodes: Iterable[Episode], jobs: int) -> Generator[Outcome, None, None]:
    recipe = _Recipe(pickle.dumps(family), tuple(sys.path), os.getpid())
    # One more than there are processes waits its turn: enough to keep them busy, few to be run in vain.
    parallel = Parallel(n_jobs=jobs, batch_size=1, pre_dispatch=jobs + 1, return_as="generator_unordered")
    outcomes = parallel(delayed(_run_pickled)(recipe, episode) for episode in episodes)
    return cast("Generator[Outcome, None, None]", outcomes)


@dataclass(frozen=True)
class _Recipe:
    """A family pickled once, where its modules are found, and whose it is: a process unpickles it once."""

    pickled: bytes
    folders: tuple[str, ...]
    owner: int


def _run_pickled(recipe: _Recipe, episode: Episode) -> Outcome:
    if os.getppid() == recipe.owner:
        _end_with(recipe.owner)
    return run_episode(_unpickled(recipe), episode)


@lru_cache
def _end_with(parent: int) -> None:
    """End this process soon after its parent: after a `kill -9` it would wait for work for minutes."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(WATCH_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


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
