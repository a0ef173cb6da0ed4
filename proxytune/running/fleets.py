"""Running a fleet: several episodes at once in one process, each to what it comes to by itself.

What an agent or the domain does wrong is the outcome of an episode; what the machine lacks is not. Whatever a fleet
raises as a whole, its episodes are run one by one, which tells whose doing that was.
"""

import errno
import math
import pickle
import random
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from proxytune.arrays import one_thread
from proxytune.domain import DomainFamily, Episode, Outcome
from proxytune.errors import EpisodeError, RunError
from proxytune.extensions import Heeding, describe, is_users, one_line, place_of
from proxytune.running.workers import AwakeClock, awake

Fleet = tuple[Episode, ...]
RAISED = "the agent or the domain family raised"
"""How failures begin of episodes that raise what is no Exception, as sys.exit does: that ends a whole fleet."""
OF_THE_MACHINE = (errno.ENOSPC, errno.EDQUOT, errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EIO)


def run_fleet(family: DomainFamily, episodes: Sequence[Episode], needed: Collection[str] = ()) -> list[Outcome]:
    """Run episodes, side by side where the family can; each outcome, and what is raised, is as of `run_episode`."""
    together = run_together(family, episodes, needed) if len(episodes) > 1 else None
    return [run_episode(family, one, needed) for one in episodes] if together is None else together


def can_run_together(family: DomainFamily) -> bool:
    """Whether a family runs several episodes at once (`domain.FleetFamily`)."""
    return hasattr(family, "run_many")


def run_together(family: Any, episodes: Sequence[Episode], needed: Collection[str] = ()) -> list[Outcome] | None:
    """Run episodes side by side; each is said to have taken its share of the time.

    Returns:
        Their outcomes in their order. None where the family cannot, where something else than an episode failed, or
        where anything was drawn from the generators of the whole process: these cannot be seeded for each episode.
    """
    if not can_run_together(family):
        return None
    try:
        with Heeding(), awake() as clock, one_thread(), _seeded(episodes[0].seed) as drawn:
            results = list(family.run_many(episodes))
            scored = [_judged(family, *pair, needed) for pair in zip(episodes, results, strict=True)]
            if drawn():
                return None
    except BaseException as problem:
        if is_users(problem):
            raise
        return None
    seconds = clock.seconds() / len(episodes)
    return [Outcome(one, *score, seconds) for one, score in zip(episodes, scored, strict=True)]


def _judged(
    family: DomainFamily, episode: Episode, result: Any, needed: Collection[str]
) -> tuple[Mapping[str, float] | None, str]:
    """What a fleet's result says of an episode: its metrics, or why it failed."""
    try:
        if isinstance(result, EpisodeError):
            raise result
        return _checked(family, episode, result, needed), ""
    except EpisodeError as problem:
        check_machine(f"agent '{episode.agent}'", problem, "with more room")
        return None, one_line(_failure(problem))


def run_episode(family: DomainFamily, episode: Episode, needed: Collection[str] = ()) -> Outcome:
    """Run one episode on one thread; what the agent or the domain does wrong is its outcome.

    What it draws from `random` and `numpy.random`, which belong to the whole process, follows from the episode's seed.
    Metrics that are not needed may be missing; where none is named, all are.

    Raises:
        RunError: If memory, disk or descriptors run out: that is not the episode's doing.
    """
    metrics: Mapping[str, float] | None = None
    failure, clock = "", AwakeClock()
    try:
        with Heeding(), awake() as clock, one_thread(), _seeded(episode.seed):
            metrics = _checked(family, episode, family.run(episode), needed)
    except BaseException as problem:
        if is_users(problem):
            raise
        who = f"agent '{episode.agent}' from start {episode.start}"
        check_machine(who, problem, "with more room or without that agent")
        failure = one_line(_failure(problem))
    return Outcome(episode, metrics, failure, clock.seconds())


def check_machine(whose: str, problem: BaseException | None, remedy: str) -> None:
    """Refuse to call something failed of what memory, disk or descriptors lacked, whoever caught that first.

    The RunError begins with what was under way, and ends with how to run again.
    """
    while problem is not None:
        if isinstance(problem, MemoryError) or getattr(problem, "errno", None) in OF_THE_MACHINE:
            failed = f"the machine failed ({describe(problem)}){place_of(problem)}"
            raise RunError(f"{whose}: {failed}; run again to continue, {remedy}") from None
        problem = problem.__cause__ or problem.__context__


def _failure(problem: BaseException) -> str:
    if isinstance(problem, EpisodeError):
        return f"{problem}{place_of(problem.__cause__)}"
    # What is no Exception, as of sys.exit, goes through every family, so it may be the agent's.
    raised = "the domain family raised" if isinstance(problem, Exception) else RAISED
    return f"{raised} {describe(problem)}{place_of(problem)}"


@contextmanager
def _seeded(seed: int) -> Iterator[Callable[[], bool]]:
    """Let the process's generators draw from a seed, then go on as if they had not; gives what tells if any drew."""
    plain, array = random.getstate(), np.random.get_state()
    random.seed(seed)
    np.random.seed(seed % 2**32)
    begun = _generators()
    try:
        yield lambda: _generators() != begun
    finally:
        random.setstate(plain)
        np.random.set_state(array)


def _generators() -> bytes:
    return pickle.dumps((random.getstate(), np.random.get_state()))


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
