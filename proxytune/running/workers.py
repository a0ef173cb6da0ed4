"""Doing many independent pieces of work, in this process or spread over several."""

import functools
import os
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import closing, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from multiprocessing import TimeoutError as ParallelTimeoutError
from typing import Any, Generic, TypeVar, cast

from joblib import Parallel, delayed
from joblib.parallel import BACKENDS, get_active_backend

from proxytune.errors import RunError
from proxytune.running.apart import Apart, Lost
from proxytune.running.sending import NotSendableError, Recipe, do_sent, end_with, recipe_of

START_S = 30.0
"""So long may processes take to start beyond a piece's own time-out [s]."""
Piece = TypeVar("Piece")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Rescue(Generic[Piece, Result]):
    """What becomes of pieces that end their process, or do not end themselves.

    A process that dies is not known to have died of its piece: that is done once more in a process apart, and lost if
    that dies too.

    Attributes:
        lost: The result of a piece that has no other, from how it ended.
        timeout_s: How long a piece may take [s]; then all are done in other processes.
        suspect: Whether a piece is done in a process apart at once, because the like of it has ended one before.
        begins: Told of each piece that begins in this very process, which it may end.
        apart: Whether no piece is done in this process, as one may end it.
    """

    lost: Callable[[Piece, Lost], Result]
    timeout_s: float | None = None
    suspect: Callable[[Piece], bool] = lambda _: False
    begins: Callable[[Piece], None] = lambda _: None
    apart: bool = False


@dataclass(frozen=True)
class Elsewhere:
    """Where pieces are done instead of in processes of this machine.

    Attributes:
        cores: How many are done at once there, asked whenever there are pieces to do.
        killed: What is raised of a piece that has ended several processes there.
        made_by: The code that must be there, by names and versions.
    """

    cores: Callable[[], int]
    killed: tuple[type[BaseException], ...]
    made_by: Mapping[str, str]


_elsewhere: ContextVar[Elsewhere | None] = ContextVar("elsewhere", default=None)


@contextmanager
def elsewhere(place: Elsewhere) -> Iterator[None]:
    """Have all pieces done there meanwhile, by joblib's backend of the moment."""
    before = _elsewhere.set(place)
    try:
        yield
    finally:
        _elsewhere.reset(before)


@contextmanager
def working(
    work: Callable[[Piece], Result],
    pieces: Sequence[Piece],
    jobs: int,
    skip: Callable[[Piece], bool] = lambda _: False,
    rescue: Rescue[Piece, Result] | None = None,
) -> Iterator[Iterator[Result]]:
    """Do pieces of work and give each result as soon as it is there, in no particular order.

    Which process does a piece, and after which, must not change its result. With several jobs, joblib's backend is
    the caller's choice (processes of this machine by default). Leaving the context drops the pieces not yet done.

    Args:
        work: Does one piece; picklable.
        pieces: What to do, in the order in which to begin.
        jobs: How many processes; with one, and no time-out, everything is done in this process.
        skip: Whether a piece need not be done any more, asked when it is about to begin; those under way are finished.
        rescue: What becomes of pieces that end their process; nothing else can be done without them.

    Raises:
        RunError: If a process dies and there is no rescue.
    """
    begun = (piece for piece in pieces if not skip(piece))
    results = _results(work, begun, min(jobs, len(pieces)), rescue or Rescue(_no_rescue))
    try:
        yield results
    finally:
        with warnings.catch_warnings():
            # joblib warns of pieces it has finished in vain; whoever leaves early knows.
            warnings.simplefilter("ignore", UserWarning)
            results.close()


def _no_rescue(piece: Any, lost: Lost) -> Any:
    raise RunError(
        f"a process was killed twice by the same piece of work ({lost.how}; out of memory?); run again to continue, "
        "perhaps with jobs = 1"
    )


def _results(
    work: Callable[[Piece], Result], pieces: Iterable[Piece], jobs: int, rescue: Rescue[Piece, Result]
) -> Generator[Result, None, None]:
    if jobs > 1 or _elsewhere.get():
        return _spread(work, pieces, jobs, rescue)
    apart = rescue.apart or rescue.timeout_s is not None
    return _apart(work, pieces, rescue) if apart else _here(work, pieces, rescue)


def _here(
    work: Callable[[Piece], Result], pieces: Iterable[Piece], rescue: Rescue[Piece, Result]
) -> Generator[Result, None, None]:
    with Apart(work) as apart:
        for piece in pieces:
            if rescue.suspect(piece):
                # What cannot go to another process can only be done here.
                with suppress(NotSendableError):
                    yield apart.do(piece, functools.partial(rescue.lost, piece))
                    continue
            rescue.begins(piece)
            yield work(piece)


def _apart(
    work: Callable[[Piece], Result], pieces: Iterable[Piece], rescue: Rescue[Piece, Result]
) -> Generator[Result, None, None]:
    with Apart(work, rescue.timeout_s) as apart:
        for piece in pieces:
            yield apart.do(piece, functools.partial(rescue.lost, piece))


def _spread(
    work: Callable[[Piece], Result], pieces: Iterable[Piece], jobs: int, rescue: Rescue[Piece, Result]
) -> Generator[Result, None, None]:
    """Do them in several processes; where one dies or hangs, what was under way is done apart, then the rest."""
    place, left, begun = _elsewhere.get(), enumerate(pieces), _Begun(rescue.suspect)
    recipe = recipe_of(work, place.made_by if place else None)
    ended: tuple[type[BaseException], ...] = (BrokenExecutor, ParallelTimeoutError, *(place.killed if place else ()))
    broken = True
    while broken:
        try:
            jobs = place.cores() if place else jobs
            with closing(_in_processes(recipe, begun.of(left), jobs, rescue.timeout_s)) as results:
                for number, result in results:
                    del begun.pieces[number]
                    yield result
            broken = False
        except ended:
            broken = True
        yield from _apart(work, list(begun.pieces.values()), rescue)
        begun.pieces.clear()


class _Begun:
    """Pieces that have begun in other processes, or are to be done apart; each until its result is there."""

    def __init__(self, suspect: Callable[[Any], bool]) -> None:
        self.pieces: dict[int, Any] = {}
        self._suspect = suspect

    def of(self, numbered: Iterator[tuple[int, Any]]) -> Iterator[tuple[int, Any]]:
        """Numbered pieces as they begin, without those that are to be done apart."""
        for number, piece in numbered:
            self.pieces[number] = piece
            if not self._suspect(piece):
                yield number, piece


def _in_processes(
    recipe: Recipe, numbered: Iterable[tuple[int, Any]], jobs: int, timeout_s: float | None
) -> Generator[tuple[int, Any], None, None]:
    # One more than there are processes waits its turn: enough to keep them busy, few to be run in vain.
    parallel = Parallel(
        n_jobs=jobs,
        batch_size=1,
        pre_dispatch=jobs + 1,
        return_as="generator_unordered",
        timeout=timeout_s and timeout_s + START_S,
        **_of_processes(),
    )
    tasks = (delayed(_do_numbered)(recipe, number, piece) for number, piece in numbered)
    return cast("Generator[tuple[int, Any], None, None]", parallel(tasks))


def _do_numbered(recipe: Recipe, number: int, piece: Any) -> tuple[int, Any]:
    return number, do_sent(recipe, piece)


def _of_processes() -> dict[str, Any]:
    """What joblib's own processes begin with; those of another backend are not ours to end."""
    backend, _ = get_active_backend()
    return {"initializer": end_with, "initargs": (os.getpid(),)} if isinstance(backend, BACKENDS["loky"]) else {}
