"""Doing many independent pieces of work, in this process or spread over several."""

import os
import pickle
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeVar, cast

from joblib import Parallel, delayed

from proxytune.errors import RunError
from proxytune.extensions import describe, place_of
from proxytune.extensions.beside import folders, open_folders

WATCH_S = 0.5
Piece = TypeVar("Piece")
Result = TypeVar("Result")


@contextmanager
def working(
    work: Callable[[Piece], Result], pieces: Sequence[Piece], jobs: int, skip: Callable[[Piece], bool] = lambda _: False
) -> Iterator[Iterator[Result]]:
    """Do pieces of work and give each result as soon as it is there, in no particular order.

    Which process does a piece, and after which, must not change its result. With several jobs, joblib's backend is
    the caller's choice (processes of this machine by default). Leaving the context drops the pieces not yet done.

    Args:
        work: Does one piece; picklable.
        pieces: What to do, in the order in which to begin.
        jobs: How many processes; with one, everything is done in this process.
        skip: Whether a piece need not be done any more, asked when it is about to begin; those under way are finished.

    Raises:
        RunError: If a process dies.
    """
    begun = (piece for piece in pieces if not skip(piece))
    results = _spread(work, begun, jobs) if min(jobs, len(pieces)) > 1 else _here(work, begun)
    try:
        yield _name_dead_processes(results)
    finally:
        with warnings.catch_warnings():
            # joblib warns of pieces it has finished in vain; whoever leaves early knows.
            warnings.simplefilter("ignore", UserWarning)
            results.close()


def _here(work: Callable[[Piece], Result], pieces: Iterable[Piece]) -> Generator[Result, None, None]:
    for piece in pieces:
        yield work(piece)


def _spread(work: Callable[[Piece], Result], pieces: Iterable[Piece], jobs: int) -> Generator[Result, None, None]:
    recipe = _Recipe(_pickled(work), tuple(sys.path), folders(), os.getpid())
    # One more than there are processes waits its turn: enough to keep them busy, few to be run in vain.
    parallel = Parallel(n_jobs=jobs, batch_size=1, pre_dispatch=jobs + 1, return_as="generator_unordered")
    return cast("Generator[Result, None, None]", parallel(delayed(_do_pickled)(recipe, piece) for piece in pieces))


def _pickled(work: Callable[[Piece], Result]) -> bytes:
    try:
        return pickle.dumps(work)
    except Exception as problem:
        remedy = "make it of classes and functions that a module has by name, without open files, or set jobs = 1"
        line = f"what is to be run cannot be sent to other processes ({describe(problem)}){place_of(problem)}"
        raise RunError(f"{line}; {remedy}") from problem


@dataclass(frozen=True)
class _Recipe:
    """Work pickled once, where its modules are found, and whose it is: a process unpickles it once."""

    pickled: bytes
    path: tuple[str, ...]
    own: tuple[str, ...]
    owner: int


def _do_pickled(recipe: _Recipe, piece: Any) -> Any:
    if os.getppid() == recipe.owner:
        _end_with(recipe.owner)
    return _unpickled(recipe)(piece)


@lru_cache
def _end_with(parent: int) -> None:
    """End this process with its parent, and not before.

    After a `kill -9` it would wait for work for minutes. Ctrl-C reaches every process of a terminal; the parent answers
    it, and ends this one.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(WATCH_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@lru_cache(maxsize=1)
def _unpickled(recipe: _Recipe) -> Callable[[Any], Any]:
    sys.path.extend(folder for folder in recipe.path if folder not in sys.path)
    open_folders(recipe.own)
    try:
        return cast("Callable[[Any], Any]", pickle.loads(recipe.pickled))
    except Exception as problem:
        line = f"another process cannot load what is to be run: {describe(problem)}{place_of(problem)}"
        raise RunError(f"{line}; what it needs must be there when its modules are imported, or set jobs = 1") from None


def _name_dead_processes(results: Iterator[Result]) -> Iterator[Result]:
    try:
        yield from results
    except BrokenExecutor:
        raise RunError(
            "a process that ran episodes was killed (out of memory?); run again to continue, perhaps with jobs = 1"
        ) from None
