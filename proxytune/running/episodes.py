"""Running episodes, and catching what fails."""

import errno
import functools
import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

from threadpoolctl import ThreadpoolController

from proxytune.domain import DomainFamily, Episode, Outcome
from proxytune.errors import EpisodeError, RunError
from proxytune.running.workers import working

OF_THE_MACHINE = (errno.ENOSPC, errno.EDQUOT, errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EIO)


def running(
    family: DomainFamily, episodes: Sequence[Episode], jobs: int, skip: Callable[[Episode], bool] = lambda _: False
) -> AbstractContextManager[Iterator[Outcome]]:
    """Run episodes and give each outcome as soon as it is there, in no particular order; see `working`.

    Raises:
        RunError: If the machine fails rather than an episode: a process dies, memory or disk run out.
    """
    return working(functools.partial(run_episode, family), episodes, jobs, skip)


def run_episode(family: DomainFamily, episode: Episode) -> Outcome:
    """Run one episode on one thread; what the agent or the domain does wrong is its outcome.

    Raises:
        RunError: If memory or disk run out: that is not the episode's doing.
    """
    start = time.perf_counter()
    metrics: Mapping[str, float] | None = None
    failure = ""
    try:
        with _libraries(len(sys.modules)).limit(limits=1):
            metrics = _checked(family, episode, family.run(episode))
    except EpisodeError as problem:
        failure = str(problem)
    except Exception as problem:
        if isinstance(problem, MemoryError) or getattr(problem, "errno", None) in OF_THE_MACHINE:
            raise RunError(f"the machine failed ({type(problem).__name__}: {problem}); run again to continue") from None
        failure = f"the domain family raised {type(problem).__name__}: {' '.join(str(problem).split())}"
    return Outcome(episode, metrics, failure, time.perf_counter() - start)


@functools.lru_cache(maxsize=1)
def _libraries(modules: int) -> ThreadpoolController:
    """The libraries that have threads of their own; looking for them takes longer than a short episode.

    Args:
        modules: How many modules are loaded: with another, there may be another library.
    """
    return ThreadpoolController()


def _checked(family: DomainFamily, episode: Episode, result: Any) -> dict[str, float]:
    """The result as plain numbers, one per metric of the family."""
    metrics = {}
    for name in family.metrics:
        value = float(result[name]) if name in result else math.nan
        if not math.isfinite(value):
            raise EpisodeError(f"agent '{episode.agent}': the domain family gave no finite '{name}'")
        metrics[name] = value
    return metrics
