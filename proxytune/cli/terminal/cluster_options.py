"""The options that say where episodes run, alike for every command that runs many."""

import argparse
from collections.abc import Callable
from contextlib import nullcontext
from functools import wraps
from typing import TypeVar

from proxytune.errors import InputError
from proxytune.running import on_cluster

PROCESSES, DASK = "processes", "dask"
Result = TypeVar("Result")


def configure_cluster(parser: argparse.ArgumentParser) -> None:
    """Add where episodes run."""
    parser.add_argument(
        "--backend",
        choices=(PROCESSES, DASK),
        default=PROCESSES,
        help="where episodes run: processes of this machine, or the workers of a Dask cluster [processes]",
    )
    parser.add_argument("--address", metavar="URL", help="of the cluster's scheduler, as in tcp://127.0.0.1:8786")


def on_its_cluster(run: Callable[[argparse.Namespace], Result]) -> Callable[[argparse.Namespace], Result]:
    """Run a command where its options say."""

    @wraps(run)
    def placed(arguments: argparse.Namespace) -> Result:
        if arguments.backend == DASK and not arguments.address:
            raise InputError("--backend dask: give --address too, that of the scheduler, as in tcp://127.0.0.1:8786")
        if arguments.address and arguments.backend != DASK:
            raise InputError(f"--address {arguments.address}: is for --backend dask; give that too")
        with on_cluster(arguments.address) if arguments.address else nullcontext():
            return run(arguments)

    return placed
