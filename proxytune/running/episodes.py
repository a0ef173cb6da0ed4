"""Running episodes: what fails is an outcome, what the machine lacks is not, and what takes long is told of."""

import errno
import functools
import math
import random
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from threadpoolctl import ThreadpoolController

from proxytune.domain import DomainFamily, Episode, Outcome
from proxytune.errors import EpisodeError, RunError
from proxytune.extensions import describe, is_users, one_line, place_of
from proxytune.running.workers import Rescue, WorkerExit, working

ENDED, ENDLESS = "it ended its process", "it took longer than"
"""How failures begin of episodes that end their process, and of those that do not end themselves."""
LONG_S = 60.0
"""An episode that has been under way for so long is told of [s]: nothing else shows that an agent hangs."""
MONITOR = "stall monitor"
OF_THE_MACHINE = (errno.ENOSPC, errno.EDQUOT, errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EIO)


@dataclass(frozen=True)
class Watch:
    """How episodes are watched that may end their process or never end.

    Attributes:
        timeout_s: How long an episode may take [s]; one that takes longer has failed. None for as long as it takes.
        suspect: Whether an episode is run in a process of its own at once, as an earlier process ended during its like.
        begins: Told of each episode that begins in this very process, which it may end.
        waits: Told again and again, where nothing limits it, which episode has been under way longest, if that is long,
            and for how long [s]; from another thread.
    """

    timeout_s: float | None = None
    suspect: Callable[[Episode], bool] = lambda _: False
    begins: Callable[[Episode], None] = lambda _: None
    waits: Callable[[str, float], None] = lambda what, seconds: None


UNWATCHED = Watch()


@contextmanager
def running(
    family: DomainFamily,
    episodes: Sequence[Episode],
    jobs: int,
    skip: Callable[[Episode], bool] = lambda _: False,
    needed: Collection[str] = (),
    watch: Watch = UNWATCHED,
) -> Iterator[Iterator[Outcome]]:
    """Run episodes and give each outcome as soon as it is there, in no particular order; see `working`.

    An episode that ends two processes, the second one its own, has failed, and so has one that takes too long.

    Raises:
        RunError: If the machine fails rather than an episode: memory, disk or descriptors run out.
    """
    work = functools.partial(run_episode, family, needed=tuple(needed))
    rescue = Rescue(functools.partial(_lost, watch), watch.timeout_s, watch.suspect, watch.begins)
    waits = watch.waits if watch.timeout_s is None else UNWATCHED.waits
    with (
        StallMonitor(waits) as monitor,
        working(work, episodes, jobs, monitor.begins_unless(skip), rescue) as outcomes,
    ):
        yield monitor.until_there(outcomes)


def _lost(watch: Watch, episode: Episode, end: WorkerExit) -> Outcome:
    """The outcome of an episode that has ended its process, or was ended.

    Raises:
        RunError: If the process was killed from outside, as a machine without memory does.
    """
    where = f"agent '{episode.agent}' from start {episode.start}"
    if end.killed:
        raise RunError(
            f"{where}: its process was killed twice ({end.how}; out of memory?); run again to continue, with more "
            "memory or without that agent"
        )
    failure = f"{ENDED} twice ({end.how})" if end.how else f"{ENDLESS} {watch.timeout_s:g} s"
    return Outcome(episode, None, failure, end.seconds)


def run_episode(family: DomainFamily, episode: Episode, needed: Collection[str] = ()) -> Outcome:
    """Run one episode on one thread; what the agent or the domain does wrong is its outcome.

    What it draws from `random` and `numpy.random`, which belong to the whole process, follows from the episode's seed.

    Args:
        family: Where it runs.
        episode: Which one.
        needed: The metrics without which it has failed; others may be missing. All, where none is named.

    Raises:
        RunError: If memory, disk or descriptors run out: that is not the episode's doing.
    """
    start = time.perf_counter()
    metrics: Mapping[str, float] | None = None
    failure = ""
    try:
        with _libraries(len(sys.modules)).limit(limits=1), _seeded(episode.seed):
            metrics = _checked(family, episode, family.run(episode), needed)
    except BaseException as problem:
        if is_users(problem):
            raise
        who = f"agent '{episode.agent}' from start {episode.start}"
        check_machine(who, problem, "with more room or without that agent")
        failure = one_line(_failure(problem))
    return Outcome(episode, metrics, failure, time.perf_counter() - start)


def check_machine(whose: str, problem: BaseException | None, remedy: str) -> None:
    """Refuse to call something failed of what memory, disk or descriptors lacked, whoever caught that first.

    Args:
        whose: What was under way, as the complaint begins.
        problem: What was raised.
        remedy: How to run again, as the complaint ends.

    Raises:
        RunError: With what the machine lacked.
    """
    while problem is not None:
        if isinstance(problem, MemoryError) or getattr(problem, "errno", None) in OF_THE_MACHINE:
            where = place_of(problem)
            raise RunError(
                f"{whose}: the machine failed ({describe(problem)}){where}; run again to continue, {remedy}"
            ) from None
        problem = problem.__cause__ or problem.__context__


def _failure(problem: BaseException) -> str:
    """Why an episode failed."""
    if isinstance(problem, EpisodeError):
        return f"{problem}{place_of(problem.__cause__)}"
    # What is no Exception, as of sys.exit, goes through every family, so it may be the agent's.
    whose = "the domain family" if isinstance(problem, Exception) else "the agent or the domain family"
    return f"{whose} raised {describe(problem)}{place_of(problem)}"


@contextmanager
def _seeded(seed: int) -> Iterator[None]:
    """Let the generators of the whole process draw from a seed, and go on afterwards as if they had not."""
    plain, array = random.getstate(), np.random.get_state()
    random.seed(seed)
    np.random.seed(seed % 2**32)
    try:
        yield
    finally:
        random.setstate(plain)
        np.random.set_state(array)


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


class StallMonitor:
    """Says again and again which episode has been under way longest, if that is long; use as a context.

    What tells is called from a thread of its own.
    """

    def __init__(self, tell: Callable[[str, float], None]) -> None:
        self._tell, self._begun, self._ended = tell, dict[Episode, float](), threading.Event()
        self._thread = threading.Thread(target=self._watch, name=MONITOR, daemon=True)

    def __enter__(self) -> "StallMonitor":
        self._thread.start()
        return self

    def __exit__(self, *problem: object) -> None:
        self._ended.set()
        self._thread.join()

    def begins_unless(self, skip: Callable[[Episode], bool]) -> Callable[[Episode], bool]:
        """Whether an episode is skipped, asked when it is about to begin: if not, it is under way from then on."""

        def asked(episode: Episode) -> bool:
            skipped = skip(episode)
            if not skipped:
                self._begun[episode] = time.monotonic()
            return skipped

        return asked

    def until_there(self, outcomes: Iterable[Outcome]) -> Iterator[Outcome]:
        """The outcomes, whose episodes are under way no more."""
        for outcome in outcomes:
            self._begun.pop(outcome.episode, None)
            yield outcome

    def _watch(self) -> None:
        while not self._ended.wait(LONG_S / 10.0):
            for episode, since in sorted(self._begun.items(), key=lambda begun: begun[1])[:1]:
                seconds = time.monotonic() - since
                if seconds >= LONG_S:
                    self._tell(f"agent '{episode.agent}' from start {episode.start}", seconds)
