"""A study on a cluster of this machine whose workers and scheduler are killed, stopped, late or of other code.

Each pattern says what happens, in order: `worker NAME` starts a worker (`nanny`: with one; `same`: at one address;
`threads`, `other`: of two threads, of other code), `run` the command on the cluster and `alone` on this machine,
`joined N` waits for so many workers, a number for so many episodes in study.db, `said TEXT` for a line of the command;
the rest are signals. Whatever happened, the study comes to the trials and episodes of an undisturbed run, to the digit.
"""

import functools
import multiprocessing
import os
import signal
import socket
import sys
import time
from contextlib import suppress
from itertools import chain
from pathlib import Path

import clustered
import pytest
from processes import PYTHONPATH, episodes, finished_episodes, trials

from proxytune.cli.main import main

pytest.importorskip("distributed")
CONTEXT = multiprocessing.get_context("forkserver")
CONTEXT.set_forkserver_preload(clustered.PRELOAD)

OWN_FAMILY = """
from deadly import Deadly, deadly
from helper import same


class Mine(Deadly):
    def run(self, episode):
        return same(super().run(episode))


def family(domain, *, model):
    return Mine(**vars(deadly(domain, model=model)))
"""
SIGNALS = {"kill": signal.SIGKILL, "term": signal.SIGTERM, "stop": signal.SIGSTOP, "go": signal.SIGCONT}
SIGNALS["interrupt"] = signal.SIGINT
GONE = "no worker is there"
LIMITS = {"limit": "episode_timeout_s", "budget": "budget"}
PATTERNS = {
    "workers are killed, end in order, and are there again at the same address": "same a, run, 8, worker b, joined 2, "
    "kill a, 20, same a, joined 2, term b, 32, worker c, joined 2, kill a",
    "both are killed before the first episode; late ones have two threads and other code": "worker a, worker b, "
    f"joined 2, run, said page:, kill a, kill b, said {GONE}, threads c, said has 2 threads, other d, "
    "said it is not used, worker e",
    "its nanny starts a killed worker again": "nanny a, run, 10, kill child a, 25, kill child a",
    "the scheduler stops, ends in order and is killed": "worker a, worker b, run, 8, stop scheduler, "
    "said does not answer, go scheduler, said it goes on, 20, term scheduler, scheduler, worker c, 32, kill scheduler, "
    "scheduler, worker d",
    "both stop for a while, then for good": "worker a, worker b, joined 2, run, 8, stop a, stop b, said not heard of, "
    "go a, go b, 24, stop a, stop b, worker c",
    "the command stops for longer than its limit, then a worker whose nanny ends it": "limit 2, nanny a, worker b, "
    "joined 2, run, 8, stop command, seconds 6, go command, 20, stop child a",
    "the command is killed with its workers, interrupted without any, then without a scheduler": "worker a, run, 8, "
    f"kill command, kill a, worker b, run, 20, kill b, said {GONE}, interrupt command, worker c, run, 32, "
    "kill scheduler, said does not answer, interrupt command, alone",
    "an episode ends its workers, another hangs": "limit 1, budget 2, fault agent2:1:leaves, fault agent4:0:hangs, "
    "nanny a, nanny b, joined 2, run",
}


class Loopback:
    """A cluster of this machine, with a study to run on it."""

    def __init__(self, folder):
        self.folder, self.processes, self.told = folder, {}, []
        with socket.socket() as one, socket.socket() as other:
            one.bind(("127.0.0.1", 0))
            other.bind(("127.0.0.1", 0))
            self.port, self.same = one.getsockname()[1], other.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.log = folder.parent / "command.log"
        self.log.touch()

    def start(self, name, kind, *words, output=os.devnull):
        words = tuple(map(str, words))
        self.processes[name] = CONTEXT.Process(target=clustered.begin, args=(kind, words, str(output)))
        self.processes[name].start()

    def scheduler(self):
        self.start("scheduler", "scheduler", "--host", "127.0.0.1", "--port", self.port, "--no-dashboard")

    def worker(self, name, *words, kind="worker", threads=1):
        how = ("--nthreads", threads, "--no-dashboard", "--local-directory", self.folder.parent / "scratch")
        self.start(name, kind, self.address, *how, *words)

    def run(self, *words):
        words = words or ("--backend", "dask", "--address", self.address)
        self.start("command", "command", self.folder, "--json", *words, output=self.log)

    def joined(self, count):
        from distributed import Client

        with Client(self.address, timeout=30, set_as_default=False) as client:
            client.wait_for_workers(count, timeout=60)

    def child_of(self, name):
        """The worker's process, which its nanny started."""
        tasks = Path(f"/proc/{self.processes[name].pid}/task")
        for _ in range(600):
            for child in chain.from_iterable(task.read_text().split() for task in tasks.glob("*/children")):
                if b"multiprocessing.spawn" in Path(f"/proc/{child}/cmdline").read_bytes():
                    return int(child)
            time.sleep(0.05)
        raise AssertionError(f"{name} has no child")

    def signal(self, what, name):
        if name.startswith("child "):
            os.kill(self.child_of(name.removeprefix("child ")), SIGNALS[what])
        elif what == "interrupt":
            os.kill(self.processes[name].pid, SIGNALS[what])
        else:
            os.killpg(self.processes[name].pid, SIGNALS[what])
        if what in ("kill", "term", "interrupt") and not name.startswith("child "):
            self.processes.pop(name).join(60)

    def until(self, happened, what):
        for _ in range(1200):
            if happened():
                return
            assert self.processes["command"].exitcode is None, f"it has ended, before {what}: {self.log.read_text()}"
            time.sleep(0.05)
        raise AssertionError(f"never {what}: {self.log.read_text()}")

    def do(self, step):
        verb, _, rest = step.partition(" ")
        if verb.isdecimal():
            self.until(lambda: finished_episodes(self.folder) >= int(verb), f"{verb} episodes")
        elif verb == "said":
            self.until(lambda: rest in self.log.read_text(), f"said {rest}")
        elif verb in SIGNALS:
            self.signal(verb, rest)
        elif verb in ("scheduler", "run"):
            getattr(self, verb)()
        else:
            {
                "worker": lambda: self.worker(rest, "--no-nanny"),
                "nanny": lambda: self.worker(rest),
                "same": lambda: self.worker(rest, "--no-nanny", "--worker-port", self.same),
                "threads": lambda: self.worker(rest, "--no-nanny", threads=2),
                "other": lambda: self.worker(rest, "--no-nanny", kind="other"),
                "joined": lambda: self.joined(int(rest)),
                "seconds": lambda: time.sleep(float(rest)),
                "alone": lambda: self.run("--jobs", "1"),
            }[verb]()

    def end(self):
        for process in self.processes.values():
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.join()


SMALL = {"budget": "4", "initial": "3"}


def own_study(make_study, called, sleep, told):
    faults = [rest for word, rest in told if word == "fault"]
    domain = {"sleep": sleep, "faults": str(faults).replace("'", '"')}
    limits = {LIMITS[word]: rest for word, rest in told if word in LIMITS}
    folder = make_study(called, family='"mine:family"', domain=domain, **{**SMALL, **limits})
    (folder / "mine.py").write_text(OWN_FAMILY)
    (folder / "helper.py").write_text("def same(scores):\n    return scores\n")
    return folder


@pytest.fixture(scope="module")
def undisturbed(make_studies):
    """The trials and episodes of a study on this machine alone, run once for each of its kinds."""

    def run(told):
        folder = own_study(make_studies, f"alone{len(told)}", "0.0", told)
        assert main(["study", str(folder), "--json"]) == 0
        return trials(folder), episodes(folder)

    return functools.cache(run)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="a worker's process is looked up in /proc")
@pytest.mark.parametrize("pattern", PATTERNS)
def test_whatever_becomes_of_a_cluster_a_study_comes_to_the_same(make_study, undisturbed, monkeypatch, pattern):
    monkeypatch.setenv("PYTHONPATH", PYTHONPATH)  # for the process that is forked
    steps = PATTERNS[pattern].split(", ")
    pairs = [(word, rest) for word, _, rest in (step.partition(" ") for step in steps)]
    told = tuple(pair for pair in pairs if pair[0] in ("fault", *LIMITS))
    alone = undisturbed(told)
    there = own_study(make_study, "there", "0.05", told)
    cluster = Loopback(there)
    try:
        cluster.scheduler()
        for step in steps[len(told) :]:
            cluster.do(step)
        cluster.processes["command"].join(240)
        status = cluster.processes["command"].exitcode
    finally:
        cluster.end()
    said = cluster.log.read_text()
    assert status == 0, said
    assert "Traceback" not in said
    assert (trials(there), episodes(there)) == alone
