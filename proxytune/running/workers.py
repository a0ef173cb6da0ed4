"""Many independent pieces of work, in this process or spread over several; those that end their process, or never end.

joblib spreads them, unless there is another `Place` for them. What dies or hangs is done once more by an
IsolatedWorker, which is a process of joblib's own (loky). `pebble` would save the few lines of `do`: its processes run
a user's script again, where loky's do not, and time limits within a piece and the rescue of joblib's workers would stay
here.
"""

import functools
import re
import signal
import threading
import time
import warnings
import zlib
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, wait
from contextlib import closing, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from multiprocessing import TimeoutError as ParallelTimeoutError
from operator import length_hint
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar, cast

from joblib import Parallel, delayed
from joblib.externals.loky import ProcessPoolExecutor
from joblib.parallel import BACKENDS, get_active_backend

from proxytune.errors import RunError
from proxytune.running.sending import (
    NotSendableError,
    Recipe,
    away_from_here,
    do_sent,
    end_with,
    load_sent,
    recipe_of,
    unheard,
)

START_S = 30.0
"""So long may processes take to start beyond a piece's own time-out [s]."""
ASK_S, NAP_S = 0.25, 1.0
"""So often is asked whether a piece is done, and no more than this passes between two questions [s] (`AwakeClock`)."""
OVERRUN = "SIGALRM"
"""How the process of a piece ends that overruns a limit within it."""
Piece = TypeVar("Piece")
Result = TypeVar("Result")


@dataclass(frozen=True)
class WorkerExit:
    """The end of a process before its piece had a result."""

    how: str  # in one phrase, as "SIGSEGV" or "exit status 3"; empty if it was ended because the piece took too long
    seconds: float  # how long the piece took until then

    @property
    def killed(self) -> bool:
        """Whether the process was killed from outside: by the machine, where memory ran out, or by somebody."""
        return self.how == "SIGKILL"


@dataclass(frozen=True)
class Rescue(Generic[Piece, Result]):
    """What becomes of pieces that end their process, or do not end themselves.

    A process that dies is not known to have died of its piece: each part of that is done once more by an isolated
    worker, and lost if that dies too.
    """

    lost: Callable[[Piece, WorkerExit], Result]  # the result of a piece that has no other, from how its process ended
    timeout_s: float | None = None  # how long a piece may take [s]; then all are done in other processes
    # whether a piece is done by an isolated worker at once, because the like of it has ended a process
    suspect: Callable[[Piece], bool] = lambda _: False
    # told of each piece that begins in this very process, which it may end
    begins: Callable[[Piece], None] = lambda _: None
    isolated: bool = False  # whether no piece is done in this process, as one may end it
    parts: Callable[[Piece], Sequence[Piece]] = lambda piece: (piece,)  # by what it is done again, each by itself


LOST: Any = object()
"""Stands for the result of a piece that has none: it took too long, or ended processes."""


Numbered = tuple[int, Any]
"""A piece, or its result, with the piece's number."""
NumberedResults = Generator[Numbered, None, None]


class Place(Protocol):
    """Where pieces are done instead of in processes of this machine."""

    made_by: Mapping[str, str]
    """The code that must be there, by names and versions."""

    def cores(self) -> int:
        """The number of pieces that are done at once there, asked whenever there are pieces to do."""

    def results(self, recipe: Recipe, numbered: Iterator[Numbered], timeout_s: float | None) -> NumberedResults:
        """Do numbered pieces, each asked for when it can begin; LOST stands for the result of one that is given up."""


_elsewhere: ContextVar[Place | None] = ContextVar("elsewhere", default=None)


@contextmanager
def elsewhere(place: Place) -> Iterator[None]:
    """Have all pieces done there meanwhile."""
    before = _elsewhere.set(place)
    try:
        yield
    finally:
        _elsewhere.reset(before)


def places(jobs: int) -> int:
    """The number of pieces that are done at once: by so many processes of this machine, or elsewhere."""
    place = _elsewhere.get()
    return place.cores() if place else jobs


class AwakeClock:
    """Counts the seconds in which this process could run: those of a pause are nobody's work.

    Ctrl-Z, a paused container and some sleeping machines stop whoever waits together with the process it waits for.
    Whoever asks is expected to do so again within a second, or has worked meanwhile.
    """

    def __init__(self) -> None:
        self._seconds, self._asked, self._worked = 0.0, time.monotonic(), time.process_time()
        self._one_at_a_time = threading.Lock()

    def seconds(self) -> float:
        """The seconds until now [s]; whichever thread asks, none is counted twice."""
        with self._one_at_a_time:
            now, worked = time.monotonic(), time.process_time()
            self._seconds += min(now - self._asked, NAP_S + worked - self._worked)
            self._asked, self._worked = now, worked
            return self._seconds


_kept_awake: set[AwakeClock] = set()
_asking: threading.Thread | None = None


@contextmanager
def awake() -> Iterator[AwakeClock]:
    """A clock that is asked often enough meanwhile; read it afterwards."""
    global _asking
    clock = AwakeClock()
    _kept_awake.add(clock)
    # One thread for good: to start and end one takes 5 ms, as long as many an episode. A forked process begins its own
    if _asking is None or not _asking.is_alive():
        _asking = threading.Thread(target=_ask, daemon=True)
        _asking.start()
    try:
        yield clock
    finally:
        _kept_awake.remove(clock)


def _ask() -> None:
    while True:
        time.sleep(ASK_S)
        for clock in tuple(_kept_awake):
            clock.seconds()


@contextmanager
def working(
    work: Callable[[Piece], Result], pieces: Iterable[Piece], jobs: int, rescue: Rescue[Piece, Result] | None = None
) -> Iterator[Iterator[Result]]:
    """Do pieces of work and give each result as soon as it is there, in no particular order.

    Which process does a piece, and after which, must not change its result. With several jobs, joblib's backend is
    the caller's choice (processes of this machine by default); with one, and no time-out, everything is done in this
    process. The next piece is asked for when it is about to begin. Leaving the context drops those not yet done.

    Raises:
        RunError: If a process dies and there is no rescue.
    """
    jobs, rescue = min(jobs, length_hint(pieces, jobs)), rescue or Rescue(_no_rescue)
    if jobs > 1 or _elsewhere.get():
        results = _spread(work, pieces, jobs, rescue)
    elif rescue.isolated or rescue.timeout_s is not None:
        results = _isolated(work, pieces, rescue)
    else:
        results = _here(work, pieces, rescue)
    try:
        yield results
    finally:
        with warnings.catch_warnings():
            # joblib warns of pieces it has finished in vain; whoever leaves early knows.
            warnings.simplefilter("ignore", UserWarning)
            results.close()


def _no_rescue(piece: Any, end: WorkerExit) -> Any:
    told = f"a process was killed twice by the same piece of work ({end.how}; out of memory?)"
    raise RunError(f"{told}; run again to continue, perhaps with jobs = 1")


def _here(
    work: Callable[[Piece], Result], pieces: Iterable[Piece], rescue: Rescue[Piece, Result]
) -> Generator[Result, None, None]:
    with IsolatedWorker(work) as isolated:
        for piece in pieces:
            if rescue.suspect(piece):
                # What cannot go to another process can only be done here.
                with suppress(NotSendableError):
                    yield isolated.do(piece, functools.partial(rescue.lost, piece))
                    continue
            rescue.begins(piece)
            yield work(piece)


def _isolated(
    work: Callable[[Piece], Result], pieces: Iterable[Piece], rescue: Rescue[Piece, Result]
) -> Generator[Result, None, None]:
    with IsolatedWorker(work, rescue.timeout_s) as isolated:
        for piece in pieces:
            parts = rescue.parts(piece)
            whole = isolated.do(piece, lambda _: LOST, tries=1) if len(parts) > 1 else LOST
            if whole is not LOST:
                yield whole
                continue
            for part in parts:
                yield isolated.do(part, functools.partial(rescue.lost, part))


def _spread(
    work: Callable[[Piece], Result], pieces: Iterable[Piece], jobs: int, rescue: Rescue[Piece, Result]
) -> Generator[Result, None, None]:
    """Do them in several processes; where one dies or hangs, what was under way is isolated, then the rest is done."""
    place, left = _elsewhere.get(), enumerate(pieces)
    recipe = recipe_of(work, place.made_by if place else None)
    under_way: dict[int, Piece] = {}

    def begin() -> Iterator[tuple[int, Piece]]:
        for number, piece in left:
            under_way[number] = piece
            if not rescue.suspect(piece):
                yield number, piece

    broken = True
    while broken:
        broken, timeout_s = False, rescue.timeout_s
        done = place.results(recipe, begin(), timeout_s) if place else _in_processes(recipe, begin(), jobs, timeout_s)
        try:
            with closing(done) as results:
                for number, result in results:
                    piece = under_way.pop(number)
                    if result is LOST:
                        yield from _isolated(work, rescue.parts(piece), rescue)
                    else:
                        yield result
        except (BrokenExecutor, ParallelTimeoutError):
            broken = True
        again = [part for piece in under_way.values() for part in rescue.parts(piece)]
        under_way.clear()
        yield from _isolated(work, again, rescue)


def _in_processes(recipe: Recipe, numbered: Iterable[Numbered], jobs: int, timeout_s: float | None) -> NumberedResults:
    # Only joblib's own processes are ours to end with this one.
    local = isinstance(get_active_backend()[0], BACKENDS["loky"])
    with away_from_here() as ours, unheard() as hear:
        # One more than there are processes waits its turn: enough to keep them busy, few to be run in vain.
        parallel = Parallel(
            n_jobs=jobs,
            batch_size=1,
            pre_dispatch=jobs + 1,
            return_as="generator_unordered",
            timeout=timeout_s and timeout_s + START_S,
            **({"initializer": end_with, "initargs": ours} if local else {}),
        )
        tasks = (delayed(_do_numbered)(recipe, number, piece) for number, piece in numbered)
        with closing(cast(NumberedResults, parallel(tasks))) as results:
            hear()
            yield from results


def _do_numbered(recipe: Recipe, number: int, piece: Any) -> Numbered:
    return number, do_sent(recipe, piece)


class IsolatedWorker:
    """One process that does one piece at a time; where a piece ends it, the next piece has a new one.

    Use as a context: leaving it ends the process.
    """

    def __init__(self, work: Callable[[Any], Any], timeout_s: float | None = None) -> None:
        self._work, self._timeout_s = work, timeout_s
        self._recipe: Recipe | None = None
        self._process: Any = None

    def __enter__(self) -> "IsolatedWorker":
        return self

    def __exit__(self, *problem: object) -> None:
        self._end()

    def do(self, piece: Any, lost: Callable[[WorkerExit], Any], tries: int = 2) -> Any:
        """Do a piece, unless the work cannot go to another process; `lost` gives the result if it ends its process.

        Or if it takes too long in so many tries: the machine may have been at fault, or a process have been stopped.
        """
        if self._process is None:
            self._recipe = self._recipe or recipe_of(self._work)
            with away_from_here() as ours:
                self._process = ProcessPoolExecutor(1, initializer=end_with, initargs=ours)
                with unheard():
                    loaded = self._process.submit(load_sent, self._recipe)
                # Loading the work takes none of the pieces' time.
                loaded.exception()
        how, clock, seconds = "", AwakeClock(), 0.0
        try:
            result = self._process.submit(do_sent, self._recipe, piece)
            while self._timeout_s is None or seconds < self._timeout_s:
                wait([result], ASK_S)
                if result.done():
                    return result.result()
                seconds = clock.seconds()
        except BrokenExecutor as problem:
            how, seconds = _exit_told(str(problem)), clock.seconds()
        self._end()
        return self.do(piece, lost, tries - 1) if tries > 1 and not how else lost(WorkerExit(how, seconds))

    def _end(self) -> None:
        if self._process is not None:
            self._process.shutdown(wait=True, kill_workers=True)
        self._process = None


def _exit_told(told: str) -> str:
    """How a process ended, from what loky tells: "The exit codes of the workers are {SIGSEGV(-11)}"."""
    if not (found := re.search(r"\{(\w+)\((-?\d+)\)", told)):
        return "for an unknown reason"
    name, number = found.groups()
    return f"exit status {number}" if name == "EXIT" else name


# Code that is not ours may hang where no Python runs any more: only the end of its process ends that. So a limit within
# a piece ends the process, and a trace says what was under way.


@dataclass(frozen=True)
class Trace:
    """Where a piece says what it does, and what it did when an earlier process ended with it; empty if none did."""

    path: Path
    before: str


_trace: ContextVar[Trace | None] = ContextVar("trace", default=None)


@dataclass(frozen=True)
class TracedTask:
    """Work whose pieces keep what they are doing, for whoever asks after their process has ended."""

    work: Callable[[Any], Any]  # does a piece, in a process that may be ended if a limit is set in it
    folder: Path  # where the traces are; another machine need not have it

    def __call__(self, piece: Any) -> Any:
        """Do a piece."""
        before = _trace.set(Trace(self._path(piece), self.last(piece)))
        try:
            return self.work(piece)
        finally:
            _trace.reset(before)

    def last(self, piece: Any) -> str:
        """What a piece was doing last; empty if nothing is known."""
        with suppress(OSError):
            return self._path(piece).read_text(encoding="utf-8")
        return ""

    def _path(self, piece: Any) -> Path:
        return self.folder / f"{zlib.crc32(repr(piece).encode()):08x}"


@contextmanager
def limited(what: str, timeout_s: float | None) -> Iterator[None]:
    """Keep what is done meanwhile, and end this process if that takes longer than it may [s].

    Outside a traced task there is no limit, nor in a cluster's worker, which is not ours to end: that does its pieces
    in a thread of their own.
    """
    if (trace := _trace.get()) is not None:
        with suppress(OSError):
            trace.path.write_text(what, encoding="utf-8")
    ours = threading.current_thread() is threading.main_thread()
    if trace is None or timeout_s is None or not ours:
        yield
        return
    signal.setitimer(signal.ITIMER_REAL, timeout_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def was_ended_in(what: str) -> bool:
    """Whether an earlier process ended with this piece while it was doing this."""
    trace = _trace.get()
    return trace is not None and trace.before == what
