"""A study on a cluster of this machine whose workers and scheduler are killed, stopped, late or of other code.

Each pattern says what happens, in order: `worker NAME` starts a worker (`nanny`: with one; `same`: at one address;
`threads`, `other`: of two threads, of other code), `run` the command on the cluster and `alone` on this machine,
`joined N` waits for so many workers, a number for so many episodes in study.db, `said TEXT` for a line of the command;
the rest are signals. Whatever happened, the study comes to the trials and episodes of an undisturbed run, to the digit.
"""

import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from itertools import chain
from pathlib import Path

import pytest
from processes import ENVIRONMENT, episodes, finished_episodes, heeding_ctrl_c, trials

from proxytune.cli.main import main

pytest.importorskip("distributed")

OWN_FAMILY = """
from deadly import Deadly, deadly
from helper import same


class Mine(Deadly):
    def run(self, episode):
        return same(super().run(episode))


def family(domain, *, model):
    return Mine(**vars(deadly(domain, model=model)))
"""
HELPER = "def same(scores):\n    return scores\n"
COMMAND = """
import sys
import proxytune.running.cluster as cluster
cluster.SILENT_S, cluster.START_S, cluster.PATIENCE_S = 4.0, 3.0, 1.0
from proxytune.cli.main import main
sys.exit(main(sys.argv[1:]))
"""
SCHEDULER = "from distributed.cli.dask_scheduler import main; main()"
WORKER = "from distributed.cli.dask_worker import main; main()"
OTHER_WORKER = "import proxytune.running.sending as sending; sending.PACKAGES = ('numpy',); " + WORKER
SIGNALS = {
    "kill": signal.SIGKILL,
    "term": signal.SIGTERM,
    "stop": signal.SIGSTOP,
    "go": signal.SIGCONT,
    "interrupt": signal.SIGINT,
}
GONE = "no worker is there"
PATTERNS = {
    "nothing happens": "worker a, worker b, run",
    "one worker, then a second, then only that": "worker a, run, 10, worker b, joined 2, 30, kill a",
    "one of two ends in order": "worker a, worker b, joined 2, run, 20, term a",
    "both are killed before the first episode": "worker a, worker b, joined 2, run, "
    f"said page:, kill a, kill b, said {GONE}, worker c",
    "each is killed in turn": "worker a, run, 10, worker b, joined 2, kill a, 30, worker c, joined 2, kill b, 50, "
    "worker d, joined 2, kill c",
    "its nanny starts a killed worker again": "nanny a, run, 20, kill child a, 60, kill child a",
    "killed and there again at the same address": "same a, run, 20, kill a, same a, 60, kill a, same a",
    "the scheduler ends in order and comes back": "worker a, run, 20, term scheduler, scheduler, worker b",
    "the scheduler is killed twice": "worker a, run, 20, kill scheduler, scheduler, worker b, 50, kill scheduler, "
    "said does not answer, scheduler, worker c",
    "the scheduler stops for a while": "worker a, worker b, run, 20, stop scheduler, said does not answer, "
    "go scheduler",
    "one of two stops answering": "worker a, worker b, joined 2, run, 20, stop a",
    "both stop for a while": "worker a, worker b, joined 2, run, 20, stop a, stop b, said not heard of, go a, go b",
    "the only one stops, another comes": "worker a, run, 20, stop a, said not heard of, worker b",
    "one with a limit stops, and its nanny ends it": "limit 2, nanny a, worker b, joined 2, run, 20, stop child a",
    "the command stops for longer than its limit": "limit 2, worker a, run, 20, stop command, seconds 8, go command",
    "a late worker has two threads": "worker a, run, 10, threads b, said has 2 threads",
    "a late worker of other code is alone": "worker a, run, 10, kill a, other b, said it is not used, "
    f"said {GONE}, worker c",
    "the command is killed with the workers and begun again": "worker a, run, 20, kill command, kill a, worker b, run",
    "ctrl-c while none is there, then on this machine": f"worker a, run, 20, kill a, said {GONE}, interrupt command, "
    "alone",
    "ctrl-c while there is no scheduler, then on this machine": "worker a, run, 20, kill scheduler, "
    "said does not answer, interrupt command, alone",
    "an episode ends its workers": "fault agent2:1:leaves, nanny a, nanny b, joined 2, run",
    "an episode hangs": "limit 1, fault agent2:1:hangs, nanny a, nanny b, joined 2, run",
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

    def start(self, name, code, *words, output=subprocess.DEVNULL):
        command = [sys.executable, "-c", code, *map(str, words)]
        scratch = {"DASK_TEMPORARY_DIRECTORY": str(self.folder.parent / "scratch")}
        how = {"stdout": subprocess.DEVNULL, "stderr": output, "start_new_session": True, "preexec_fn": heeding_ctrl_c}
        self.processes[name] = subprocess.Popen(command, env={**ENVIRONMENT, **scratch}, **how)

    def scheduler(self):
        self.start("scheduler", SCHEDULER, "--host", "127.0.0.1", "--port", self.port, "--no-dashboard")

    def worker(self, name, *words, code=WORKER, threads=1):
        self.start(name, code, self.address, "--nthreads", threads, "--no-dashboard", *words)

    def run(self, *words):
        words = words or ("--backend", "dask", "--address", self.address)
        with self.log.open("a") as log:
            self.start("command", COMMAND, "study", self.folder, "--json", *words, output=log)

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
            self.processes.pop(name).wait(60)

    def until(self, happened, what):
        for _ in range(1200):
            if happened():
                return
            assert self.processes["command"].poll() is None, f"it has ended, before {what}: {self.log.read_text()}"
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
                "other": lambda: self.worker(rest, "--no-nanny", code=OTHER_WORKER),
                "joined": lambda: self.joined(int(rest)),
                "seconds": lambda: time.sleep(float(rest)),
                "alone": lambda: self.run("--jobs", "1"),
            }[verb]()

    def end(self):
        for process in self.processes.values():
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def own_study(make_study, called, sleep, faults=(), **changes):
    domain = {"sleep": sleep, "faults": str(list(faults)).replace("'", '"')}
    folder = make_study(called, family='"mine:family"', domain=domain, **changes)
    (folder / "mine.py").write_text(OWN_FAMILY)
    (folder / "helper.py").write_text(HELPER)
    return folder


@pytest.fixture(scope="module")
def undisturbed(make_studies):
    """The trials and episodes of a study on this machine alone, run once for each of its kinds."""
    known = {}

    def run(faults, limit):
        if (faults, limit) not in known:
            changes = {"episode_timeout_s": limit} if limit else {}
            called, jobs = f"alone{len(known)}", "2" if faults else "1"
            folder = own_study(make_studies, called, "0.0", faults, jobs=jobs, **changes)
            assert main(["study", str(folder), "--json"]) == 0
            known[faults, limit] = trials(folder), episodes(folder)
        return known[faults, limit]

    return run


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="a worker's process is looked up in /proc")
@pytest.mark.parametrize("pattern", PATTERNS)
def test_whatever_becomes_of_a_cluster_a_study_comes_to_the_same(make_study, undisturbed, capsys, pattern):
    steps = PATTERNS[pattern].split(", ")
    told = {word: rest for word, _, rest in (step.partition(" ") for step in steps) if word in ("limit", "fault")}
    changes = {"episode_timeout_s": told["limit"]} if "limit" in told else {}
    faults = (told["fault"],) if "fault" in told else ()
    alone = undisturbed(faults, told.get("limit"))
    there = own_study(make_study, "there", "0.1", faults, **changes)
    cluster = Loopback(there)
    try:
        cluster.scheduler()
        for step in steps:
            if step.partition(" ")[0] not in told:
                cluster.do(step)
        status = cluster.processes["command"].wait(240)
    finally:
        cluster.end()
    said = cluster.log.read_text()
    assert status == 0, said
    assert "Traceback" not in said
    assert (trials(there), episodes(there)) == alone
