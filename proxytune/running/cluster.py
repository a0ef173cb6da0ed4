"""Doing pieces of work on the machines of a Dask cluster, where every worker has the same code."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from joblib import parallel_config

from proxytune.errors import ExtensionError, InputError, RunError
from proxytune.running.sending import check_code, made_by
from proxytune.running.workers import Elsewhere, elsewhere

CONNECT_S, JOINED_S = 10.0, 30.0
"""So long it is waited for a connection, and for the first worker [s]."""


@contextmanager
def on_cluster(address: str) -> Iterator[None]:
    """Have all pieces of work done by a cluster's workers meanwhile, as many at once as there are workers.

    Workers may leave and join: what a lost one was doing is done by another, and new ones have work from the next
    trial, point or step on.

    Args:
        address: Of the cluster's scheduler, as in tcp://127.0.0.1:8786.

    Raises:
        ExtensionError: If `distributed` is not installed.
        InputError: If nothing answers there, or a worker has other code, other packages or several threads.
        RunError: If no worker joins.
    """
    client, killed = _connect(address)
    with client:
        _check(client, address)
        place = Elsewhere(lambda: max(1, len(client.nthreads())), killed, made_by())
        with elsewhere(place), parallel_config(backend="dask", client=client):
            yield


def _connect(address: str) -> tuple[Any, tuple[type[BaseException], ...]]:
    """A client, and what it raises of a piece that has ended several workers."""
    try:
        from distributed import Client, KilledWorker
    except ModuleNotFoundError:
        line = '--backend dask needs distributed; install it: pip install "proxytune[dask]"'
        raise ExtensionError(line) from None
    try:
        connect: Any = Client
        return connect(address, timeout=CONNECT_S, set_as_default=False), (KilledWorker,)
    except (OSError, ValueError) as problem:
        line = f"--address {address}: no scheduler answers ({type(problem).__name__})"
        raise InputError(f"{line}; start one with `dask scheduler`, and give the address that it prints") from None


def _check(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=JOINED_S)
    except TimeoutError:
        line = f"--address {address}: no worker has joined within {JOINED_S:.0f} s"
        raise RunError(f"{line}; start one: dask worker {address} --nthreads 1") from None
    for worker, threads in client.nthreads().items():
        if threads != 1:
            line = f"worker {worker} has {threads} threads, and a simulator is for one in a process"
            raise InputError(f"{line}; start it with --nthreads 1, and --nworkers for more cores")
    client.run(check_code, made_by())
