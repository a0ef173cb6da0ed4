"""Doing pieces of work on the machines of a Dask cluster, where every worker has the same code."""

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from platform import python_version
from typing import Any

from joblib import parallel_config

from proxytune.errors import ExtensionError, InputError, RunError
from proxytune.running.workers import elsewhere
from proxytune.versions import version_changes, versions_of

PACKAGES = ("numpy", "scipy", "scikit-learn", "pybullet", "joblib", "distributed")
CONNECT_S = 10.0
JOINED_S = 30.0
"""So long it is waited for a connection, and for the first worker [s]."""


@contextmanager
def on_cluster(address: str) -> Iterator[None]:
    """Have all pieces of work done by a cluster's workers meanwhile, as many at once as those have cores.

    Args:
        address: Of the cluster's scheduler, as in tcp://127.0.0.1:8786.

    Raises:
        ExtensionError: If `distributed` is not installed.
        InputError: If nothing answers there, or a worker has other code, other packages or several threads.
        RunError: If no worker joins.
    """
    client = _connect(address)
    with client:
        _check(client)
        with elsewhere(partial(_cores, client)), parallel_config(backend="dask", client=client):
            yield


def made_by() -> dict[str, str]:
    """What results depend on besides their settings: proxytune's own code, Python and packages."""
    return {"proxytune": _digest(), "Python": python_version(), **versions_of(PACKAGES)}


def _connect(address: str) -> Any:
    try:
        from distributed import Client
    except ModuleNotFoundError:
        line = '--backend dask needs distributed; install it: pip install "proxytune[dask]"'
        raise ExtensionError(line) from None
    try:
        return Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as problem:
        line = f"--address {address}: no scheduler answers ({type(problem).__name__})"
        raise InputError(f"{line}; start one with `dask scheduler`, and give the address that it prints") from None


def _check(client: Any) -> None:
    try:
        client.wait_for_workers(1, timeout=JOINED_S)
    except TimeoutError:
        line = f"no worker has joined {client.scheduler.address} within {JOINED_S:.0f} s"
        raise RunError(f"{line}; start one: dask worker {client.scheduler.address} --nthreads 1") from None
    threads = client.nthreads()
    several = [worker for worker, count in threads.items() if count != 1]
    if several:
        line = f"worker {several[0]} has {threads[several[0]]} threads, and PyBullet is for one in a process"
        raise InputError(f"{line}; start it with --nthreads 1 and as many --nworkers as it has cores")
    for worker, theirs in client.run(made_by).items():
        check_code(theirs, worker)


def check_code(theirs: Mapping[str, str], worker: str) -> None:
    """Refuse a worker whose results may differ.

    Raises:
        InputError: If it has another version of anything.
    """
    changes = version_changes(made_by(), theirs)
    if changes:
        raise InputError(f"worker {worker} has {', '.join(changes)}; install the same there as here")


def _cores(client: Any) -> int:
    """How many pieces the workers of this moment can do at once."""
    return max(1, len(client.nthreads()))


@cache
def _digest() -> str:
    home = Path(__file__).resolve().parent.parent
    paths = sorted(home.rglob("*.py"))
    own = {path.relative_to(home).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}
    own = {name: digest for name, digest in own.items() if not name.startswith(("robots/", "studies/"))}
    return hashlib.sha256(repr(own).encode()).hexdigest()[:12]
