"""Doing pieces of work on the machines of a Dask cluster, where every worker has the same code.

Pieces are handed out here, one to each worker: so it is known who has what. Whatever is lost, a worker, all of them or
the scheduler, is waited for, and what it had is handed out again; which worker does a piece never changes its result.
"""

import asyncio
import logging
import socket
import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

from proxytune.errors import ExtensionError, InputError, RunError, to_install
from proxytune.running.sending import OtherCodeError, Recipe, check_code, do_sent, made_by
from proxytune.running.workers import LOST, START_S, AwakeClock, Numbered, NumberedResults, elsewhere

CONNECT_S, JOINED_S = 10.0, 30.0
"""So long it is waited for a connection, and for the first worker [s]."""
LONGEST_GREETING = 1 << 20
"""Bytes; a message begins with its length."""
POLL_S, ANSWER_S = 1.0, 5.0
"""So often the scheduler is asked who is there, and so long it may take to answer [s]."""
SILENT_S = 60.0
"""What a worker has that was not heard of for so long is handed to another too [s]: it may have been stopped."""
DEATHS = 3
"""So many workers may a piece lose before it is taken for the reason."""
PATIENCE_S = 5.0
"""So long it is waited without a word [s]; then a line is written, and the next after twice as long."""


def _say(line: str) -> None:
    with suppress(OSError):
        print(f"proxytune: {line}", file=sys.stderr, flush=True)


@contextmanager
def on_cluster(address: str) -> Iterator[None]:
    """Have all pieces of work done by a cluster's workers meanwhile, as many at once as there are workers.

    Workers may leave and join: what a lost one was doing is done by another, and new ones have work at once. Where
    none is left, or the scheduler is lost, it is waited for them. Waiting, and each worker that is not used, is said in
    a line on standard error.

    Args:
        address: Of the cluster's scheduler, as in tcp://127.0.0.1:8786.

    Raises:
        ExtensionError: If `distributed` is not installed.
        InputError: If nothing answers there, or a worker has other code, other packages or several threads.
        RunError: If no worker joins.
    """
    cluster = Cluster(address)
    try:
        cluster.check()
        with elsewhere(cluster):
            yield
    finally:
        cluster.close()


@dataclass
class _Worker:
    """A worker as the scheduler last told of it."""

    address: str  # where it is
    told: float  # when the scheduler last heard of it, by the scheduler's clock
    heard: float  # when that was last seen to change, by ours [s]
    unfit: str  # why it is not used; empty if it is
    running: bool  # whether it takes work


@dataclass
class _Held:
    """A piece that a worker has."""

    number: int
    future: Any
    # fetched as soon as there is one: a worker may stop before it hands it over, and nobody else waits for that
    result: Future[Any]
    since: float  # when it was handed out [s]
    left_behind: bool = False  # whether it has been given up, or handed to another too


class _Pieces:
    """The pieces to do, in their order; those that come back are handed out first."""

    def __init__(self, numbered: Iterator[Numbered]) -> None:
        self._left, self._open, self._back = numbered, dict[int, Any](), deque[int]()
        self._deaths = Counter[int]()

    def more(self) -> bool:
        """Whether any has no result yet; the next one is asked for only if no other is under way."""
        if not self._open:
            self._begin()
        return bool(self._open)

    def _begin(self) -> None:
        for number, piece in self._left:
            self._open[number] = piece
            self._back.append(number)
            return

    def next(self) -> Numbered | None:
        """A piece to hand out; None if there is none."""
        if not self._back:
            self._begin()
        number = self._back.popleft() if self._back else None
        return None if number is None else (number, self._open[number])

    def come_back(self, number: int) -> None:
        """Have a piece handed out again, unless it is or has a result."""
        if number in self._open and number not in self._back:
            self._back.appendleft(number)

    def has_died(self, number: int) -> bool:
        """Whether a piece has ended so many workers, another one now, that it is taken for the reason."""
        self._deaths[number] += 1
        return self._deaths[number] >= DEATHS

    def done(self, number: int) -> bool:
        """Take a piece off; whether it had no result yet."""
        if number in self._back:
            self._back.remove(number)
        return self._open.pop(number, self) is not self


class _Patience:
    """Says seldom for what is waited, and then that it goes on."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say, self._since, self._next_s, self._told = say, time.monotonic(), PATIENCE_S, False

    def wait(self, what: str) -> None:
        """It is waited for something; nothing is said of what is soon over. No word for nothing."""
        now = time.monotonic()
        if not what:
            if self._told:
                self._say("it goes on")
            self._since, self._next_s, self._told = now, PATIENCE_S, False
        elif now - self._since >= self._next_s:
            self._next_s, self._told = 2.0 * self._next_s, True
            self._say(f"{what}; everything finished is kept")


def _wait_for_scheduler(address: str) -> None:
    """Wait until what listens there greets as a scheduler does: Dask's own client waits without end for what is none.

    Raises OSError if nothing does within CONNECT_S, ValueError if the address is none.
    """
    scheme, _, place = address.rpartition("://")
    if scheme not in ("", "tcp"):
        return
    host, _, port = place.rpartition(":")
    until, number = time.monotonic() + CONNECT_S, int(port)
    while True:
        try:
            with socket.create_connection((host.strip("[]"), number), max(0.1, until - time.monotonic())) as line:
                length = line.recv(8, socket.MSG_WAITALL)
        except ConnectionRefusedError:
            if time.monotonic() > until:
                raise
            time.sleep(POLL_S / 10.0)
            continue
        if not 0 < int.from_bytes(length, "little") < LONGEST_GREETING:
            raise ConnectionError("what listens there is no scheduler")
        return


_UNDER_WAY, _AGAIN = object(), object()
Key = tuple[str, str]
"""Which worker: its address and its own folder, as one that is started again may have the address of the one before."""


class Cluster:
    """The workers of a scheduler, as a `Place`."""

    def __init__(self, address: str) -> None:
        self.made_by: Mapping[str, str] = made_by()
        self._address = address
        self._clock, self._woken = AwakeClock(), threading.Event()
        self._workers: dict[Key, _Worker] = {}
        self._asked, self._answers, self._checked = -POLL_S, False, False
        self._client = self._connected()

    def _say(self, line: str) -> None:
        _say(f"--address {self._address}: {line}")

    def _connected(self) -> Any:
        try:
            from distributed import Client, KilledWorker
        except ModuleNotFoundError:
            raise ExtensionError(f"--backend dask needs distributed; {to_install('dask')}") from None
        # What becomes of connections is told here, in one line.
        for name in ("distributed", *logging.root.manager.loggerDict):
            if name.partition(".")[0] in ("distributed", "tornado", "asyncio"):
                logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        self._killed: type[BaseException] = KilledWorker
        try:
            _wait_for_scheduler(self._address)
            connect: Any = Client
            return connect(self._address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError) as problem:
            line = f"--address {self._address}: no scheduler answers ({type(problem).__name__})"
            raise InputError(f"{line}; start one with `dask scheduler`, and give the address that it prints") from None

    def check(self) -> None:
        """Wait for a worker, and refuse a cluster with one that cannot be used."""
        begun = time.monotonic()
        while not self._ask() or not self._workers:
            if time.monotonic() - begun > JOINED_S:
                line = f"--address {self._address}: no worker has joined within {JOINED_S:.0f} s"
                raise RunError(f"{line}; start one: dask worker {self._address} --nthreads 1")
            time.sleep(POLL_S / 10.0)
        for worker in self._workers.values():
            if worker.unfit:
                raise InputError(worker.unfit)
            # One that does not answer now is looked at when it has work.
            with suppress(TimeoutError, CancelledError, self._killed):
                self._submit(worker, check_code, self.made_by).result(timeout=ANSWER_S)
        self._checked = True

    def close(self) -> None:
        """Leave the cluster."""
        with suppress(Exception):
            self._client.close(timeout=ANSWER_S)

    def cores(self) -> int:
        """The number of workers that can be used; one, if there are none at the moment."""
        self._ask()
        return max(1, len(self._usable()))

    def _ask(self) -> bool:
        """Ask the scheduler who is there, if that is some time ago; whether it answered."""
        now = self._clock.seconds()
        if now - self._asked < POLL_S:
            return self._answers
        self._asked, self._answers = now, False
        try:
            if self._client.status in ("closing", "closed"):
                self._client = self._connected()
            scheduler = self._client.scheduler
            told = self._client.sync(scheduler.identity, n_workers=-1, callback_timeout=ANSWER_S)["workers"]
        # A client that is closing has no scheduler, or no loop.
        except (OSError, InputError, AttributeError, RuntimeError):
            return False
        known, self._workers = self._workers, {}
        for address, one in told.items():
            key = (address, one["local_directory"])
            worker = known.get(key) or self._joined(address, one["nthreads"])
            worker.running = one["status"] == "running"
            if one["last_seen"] != worker.told:
                worker.told, worker.heard = one["last_seen"], now
            self._workers[key] = worker
        self._answers = self._client.status == "running"
        return self._answers

    def _joined(self, address: str, threads: int) -> _Worker:
        worker = _Worker(address, 0.0, self._clock.seconds(), "", True)
        if threads != 1:
            line = f"worker {address} has {threads} threads, and a simulator is for one in a process"
            worker.unfit = f"{line}; start it with --nthreads 1, and --nworkers for more cores"
            if self._checked:
                self._say(f"{worker.unfit}; it is not used")
        return worker

    def _silent(self, worker: _Worker) -> bool:
        return self._clock.seconds() - worker.heard > SILENT_S

    def _usable(self) -> dict[Key, _Worker]:
        return {
            key: worker
            for key, worker in self._workers.items()
            if worker.running and not worker.unfit and not self._silent(worker)
        }

    def _submit(self, worker: _Worker, work: Callable[..., Any], *arguments: Any) -> Any:
        key = f"proxytune-{uuid4().hex}"
        return self._client.submit(work, *arguments, key=key, workers=[worker.address], pure=False)

    def _fetched(self, future: Any) -> Future[Any]:
        """What becomes of submitted work, fetched meanwhile."""
        fetching = self._client.gather(future, asynchronous=True)
        result = asyncio.run_coroutine_threadsafe(fetching, self._client.loop.asyncio_loop)
        result.add_done_callback(lambda _: self._woken.set())
        return result

    def results(self, recipe: Recipe, numbered: Iterator[Numbered], timeout_s: float | None) -> NumberedResults:
        """Do numbered pieces; LOST stands for the result of one that ended several workers, or takes too long."""
        pieces, held, patience = _Pieces(numbered), dict[Key, _Held](), _Patience(self._say)
        try:
            while pieces.more():
                answers = self._ask()
                for key in self._usable() if answers else ():
                    if key not in held and (given := pieces.next()):
                        future = self._submit(self._workers[key], do_sent, recipe, given[1])
                        held[key] = _Held(given[0], future, self._fetched(future), self._clock.seconds())
                patience.wait(self._waits_for(answers))
                self._woken.wait(POLL_S)
                self._woken.clear()
                for key, one in list(held.items()):
                    over = one.result.done()
                    came = self._ended(key, one) if over else self._under_way(key, held, pieces, timeout_s)
                    if came is _UNDER_WAY:
                        continue
                    # A worker that was left behind is not free before it has ended what it has.
                    if one.result.done() or not (one.left_behind and key in self._workers):
                        del held[key]
                    if came is not _AGAIN:
                        if pieces.done(one.number):
                            yield one.number, came
                    elif not one.left_behind:
                        pieces.come_back(one.number)
        finally:
            with suppress(Exception):
                self._client.cancel([one.future for one in held.values()], force=True)

    def _under_way(self, key: Key, held: Mapping[Key, _Held], pieces: _Pieces, timeout_s: float | None) -> Any:
        """What becomes of a piece that a worker has not ended, if it still is one."""
        worker, one = self._workers.get(key), held[key]
        if worker is None or one.future.client is not self._client:
            return LOST if worker is None and not one.left_behind and pieces.has_died(one.number) else _AGAIN
        if one.left_behind:
            return _UNDER_WAY
        if timeout_s is not None and self._clock.seconds() - one.since > timeout_s + START_S:
            one.left_behind = True
            self._restart(worker)
            return LOST
        if self._silent(worker):
            one.left_behind = True
            pieces.come_back(one.number)
            # Dask fetches together what ends together: what waits for this one's result is fetched anew.
            for other in held.values():
                if not (other.left_behind or other.result.done()) and other.future.client is self._client:
                    other.result = self._fetched(other.future)
        return _UNDER_WAY

    def _ended(self, key: Key, one: _Held) -> Any:
        """What became of a piece: its result, LOST, or that it is to be handed out again."""
        problem = CancelledError() if one.result.cancelled() else one.result.exception()
        if problem is None:
            return one.result.result()
        if isinstance(problem, OtherCodeError):
            if worker := self._workers.get(key):
                worker.unfit = str(problem)
            self._say(f"{problem}; it is not used")
            return _AGAIN
        if isinstance(problem, self._killed):
            return LOST
        # What a worker has not handed over may be lost with it.
        if one.future.status != "error":
            return _AGAIN
        raise problem

    def _restart(self, worker: _Worker) -> None:
        """Have a worker that hangs started again by its nanny; one that has none is told to end."""

        def restart() -> None:
            with suppress(Exception):
                self._client.restart_workers([worker.address], timeout=JOINED_S, raise_for_error=False)

        threading.Thread(target=restart, daemon=True).start()

    def _waits_for(self, answers: bool) -> str:
        """For what it is waited where nothing goes on, in one phrase."""
        if not answers:
            return "the scheduler does not answer; waiting for it, or another on the same port"
        if self._usable():
            return ""
        why = [worker.address for worker in self._workers.values() if self._silent(worker)]
        silent = f" ({', '.join(why)} not heard of for {SILENT_S:.0f} s)" if why else ""
        return f"no worker is there{silent}; waiting for one: dask worker {self._address} --nthreads 1"
