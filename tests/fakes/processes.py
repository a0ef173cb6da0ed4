"""The command line as real processes: started, watched until something is in study.db, and stopped by a signal."""

import os
import re
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

FAKES = Path(__file__).resolve().parent
ROOT = FAKES.parents[1]
PYTHONPATH = os.pathsep.join([str(ROOT), str(FAKES), *filter(None, [os.environ.get("PYTHONPATH")])])
ENVIRONMENT = {**os.environ, "PYTHONPATH": PYTHONPATH, "OMP_NUM_THREADS": "1"}


def heeding_ctrl_c():
    """To be called in the child: a process started in the background would ignore SIGINT, and so would its children."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def start(*words, **how):
    """`python -m proxytune` with these words, in a session of its own."""
    command = [sys.executable, "-m", "proxytune", *map(str, words)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, **how}
    return subprocess.Popen(command, env=ENVIRONMENT, start_new_session=True, **{"preexec_fn": heeding_ctrl_c, **pipes})


def besides_progress(told):
    """What a command says on standard error, without its lines of progress and where the page is."""
    lines = told.splitlines(keepends=True)
    return "".join(line for line in lines if not re.match(r"compare: at most|proxytune study: page: |\d+ s: ", line))


def but_for(document, keys):
    """A document without what stands under these keys, wherever they are."""
    if isinstance(document, list):
        return [but_for(one, keys) for one in document]
    if isinstance(document, dict):
        return {key: but_for(value, keys) for key, value in document.items() if key not in keys}
    return document


def finished_episodes(folder):
    """How many episodes are in study.db."""
    try:
        with closing(sqlite3.connect(f"file:{folder}/study.db?mode=ro", uri=True)) as plain:
            return plain.execute("SELECT count(*) FROM episodes").fetchone()[0]
    except sqlite3.Error:
        return 0


def wait_for(folder, process, episodes):
    """Return as soon as so many are, or the process has ended."""
    while finished_episodes(folder) < episodes and process.poll() is None:
        time.sleep(0.005)


def trials(folder):
    """Every trial with its scores."""
    with closing(sqlite3.connect(folder / "study.db")) as plain:
        query = (
            "SELECT number, theta, state, score, measures, failed_episodes"
            " FROM trials JOIN instances ON instances.id = instance ORDER BY number"
        )
        return plain.execute(query).fetchall()


def episodes(folder):
    """Every episode with its scores, in an order of their own."""
    with closing(sqlite3.connect(folder / "study.db")) as plain:
        query = "SELECT theta, agent, start, seed, metrics FROM episodes JOIN instances ON instances.id = instance"
        return sorted(plain.execute(query).fetchall())
