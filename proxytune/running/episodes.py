"""Running episodes, and catching what fails."""

import errno
import functools
import math
import sys
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

from threadpoolctl import ThreadpoolController

from proxytune.domain import DomainFamily, Episode, Outcome
from proxytune.errors import EpisodeError, RunError
from proxytune.extensions import describe, place_of
from proxytune.running.workers import working

OF_THE_MACHINE = (errno.ENOSPC, errno.EDQUOT, errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EIO)


def running(
    family: DomainFamily,
    episodes: Sequence[Episode],
    jobs: int,
    skip: Callable[[Episode], bool] = lambda _: False,
    needed: Collection[str] = (),
) -> AbstractContextManager[Iterator[Outcome]]:
    """Run episodes and give each outcome as soon as it is there, in no particular order; see `working`.

    Raises:
        RunError: If the machine fails rather than an episode: a process dies, memory or disk run out.
    """
    return working(functools.partial(run_episode, family, needed=tuple(needed)), episodes, jobs, skip)


def run_episode(family: DomainFamily, episode: Episode, needed: Collection[str] = ()) -> Outcome:
    """Run one episode on one thread; what the agent or the domain does wrong is its outcome.

    Args:
        family: Where it runs.
        episode: Which one.
        needed: The metrics without which it has failed; others may be missing. All, where none is named.

    Raises:
        RunError: If memory or disk run out: that is not the episode's doing.
    """
    start = time.perf_counter()
    metrics: Mapping[str, float] | None = None
    failure = ""
    try:
        with _libraries(len(sys.modules)).limit(limits=1):
            metrics = _checked(family, episode, family.run(episode), needed)
    except EpisodeError as problem:
        failure = f"{problem}{place_of(problem.__cause__)}"
    except Exception as problem:
        if isinstance(problem, MemoryError) or getattr(problem, "errno", None) in OF_THE_MACHINE:
            raise RunError(f"the machine failed ({type(problem).__name__}: {problem}); run again to continue") from None
        failure = f"the domain family raised {describe(problem)}{place_of(problem)}"
    return Outcome(episode, metrics, failure, time.perf_counter() - start)


@functools.lru_cache(maxsize=1)
def _libraries(modules: int) -> ThreadpoolController:
    """The libraries that have threads of their own; looking for them takes longer than a short episode.

    Args:
        modules: How many modules are loaded: with another, there may be another library.
    """
    return ThreadpoolController()


def _checked(family: DomainFamily, episode: Episode, result: Any, needed: Collection[str]) -> dict[str, float]:
    """The result as plain numbers, one per metric of the family; what is not needed may be missing."""
    if not hasattr(result, "keys"):
        raise EpisodeError(f"run of the domain family must give metrics by name, got {type(result).__name__}")
    metrics = {}
    for name in family.metrics:
        value = _number(result[name]) if name in result else math.nan
        if math.isfinite(value):
            metrics[name] = value
        elif name in (needed or family.metrics):
            raise EpisodeError(f"agent '{episode.agent}': the domain family gave no finite '{name}'")
    return metrics


def _number(value: Any) -> float:
    """A value as a number; NaN if it is none."""
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan
