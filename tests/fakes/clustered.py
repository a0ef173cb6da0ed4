"""The processes of a cluster of this machine: forked from one that has loaded what they need."""

import os
import signal
import sys

PRELOAD = ["loaded", "distributed.cli.dask_scheduler", "distributed.cli.dask_worker"]


def begin(kind: str, words: tuple[str, ...], output: str) -> None:
    """Be one of them, in a session of its own: a scheduler, a worker, an "other" of other code, or the command."""
    from distributed.cli import dask_scheduler, dask_worker

    from proxytune.cli.main import main
    from proxytune.running import cluster, sending

    os.setsid()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    descriptor = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    for stream in (1, 2):
        os.dup2(descriptor, stream)
    sys.argv = [kind, *words]
    if kind == "other":
        sending.PACKAGES = ("numpy",)
    if kind == "command":
        cluster.SILENT_S, cluster.START_S, cluster.PATIENCE_S = 4.0, 3.0, 1.0
        sys.exit(main(["study", *words]))
    (dask_scheduler if kind == "scheduler" else dask_worker).main()
