"""A Dask cluster gives the results of one machine, to the bit, whoever leaves or joins."""

import os
import signal
import socket
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest
from convoy import Convoy

from proxytune.cli.main import main
from proxytune.domain import make_episode
from proxytune.errors import InputError
from proxytune.running import Watch, on_cluster, run_episode, running, working
from proxytune.running.cluster import Cluster
from proxytune.running.sending import check_code, made_by

distributed = pytest.importorskip("distributed")

OWN_FAMILY = """
from helper import shift
from wobbly import wobbly


def family(domain, *, model):
    return shift(wobbly(domain, model=model))
"""


@pytest.fixture(scope="module")
def cluster():
    """A scheduler with two workers, which are processes of their own."""
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as running:
        yield running


def doubled(piece):
    return 2 * piece


def ends_its_worker_once(flag, piece):
    if piece == 3 and not flag.exists():
        flag.touch()
        os._exit(1)
    return 2 * piece


@dataclass
class StopsItsWorkerOnce:
    """A result that is a number where it arrives, and stops the process that first hands it over."""

    number: int
    flag: Path

    def __reduce__(self):
        if not self.flag.exists():
            self.flag.write_text(str(os.getpid()))
            os.kill(os.getpid(), signal.SIGSTOP)
        return int, (self.number,)


def doubled_and_stopped(flag, piece):
    time.sleep(0.1 - time.time() % 0.1)  # Pieces of both workers end together, and are fetched together
    return StopsItsWorkerOnce(2 * piece, flag) if piece == 3 else 2 * piece


def test_other_code_on_a_worker_is_refused_by_name():
    check_code(made_by())
    with pytest.raises(InputError, match=r"has NumPy [\d.]+ \(was 1\.0\); install the same there as here"):
        check_code({**made_by(), "numpy": "1.0"})


def test_a_worker_that_does_not_start_again_holds_up_no_command_that_ends():
    started, before = threading.Event(), set(threading.enumerate())
    cluster = object.__new__(Cluster)
    cluster._client = SimpleNamespace(restart_workers=lambda *workers, **how: started.wait(30.0))
    cluster._restart(SimpleNamespace(address="tcp://h:1"))
    (waiting,) = set(threading.enumerate()) - before
    started.set()
    assert waiting.daemon


def test_where_nothing_answers_the_user_is_told_in_one_line(make_study, capsys, monkeypatch):
    monkeypatch.setattr("proxytune.running.cluster.CONNECT_S", 0.5)
    assert main(["study", str(make_study()), "--backend", "dask", "--address", "tcp://127.0.0.1:9"]) == 2
    assert "--address tcp://127.0.0.1:9: no scheduler answers" in capsys.readouterr().err.strip().splitlines()[-1]


@pytest.mark.parametrize("greeting", [b"", b"SSH-2.0-OpenSSH_9.2\r\n"])
def test_what_listens_and_is_no_scheduler_is_told_in_one_line(make_study, capsys, monkeypatch, greeting):
    monkeypatch.setattr("proxytune.running.cluster.CONNECT_S", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        if greeting:  # else it is silent
            threading.Thread(target=lambda: server.accept()[0].sendall(greeting), daemon=True).start()
        assert main(["study", str(make_study()), "--backend", "dask", "--address", address]) == 2
    assert f"--address {address}: no scheduler answers" in capsys.readouterr().err.strip().splitlines()[-1]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [(["--backend", "dask"], "--backend dask: give --address"), (["--address", "tcp://h:1"], "is for --backend dask")],
)
def test_backend_and_address_go_together(make_study, capsys, words, complaint):
    assert main(["study", str(make_study()), *words]) == 2
    assert complaint in capsys.readouterr().err


@pytest.mark.slow
def test_each_worker_is_sent_a_fleet(cluster):
    """However many jobs there are here."""
    episodes = [make_episode({}, agent=f"agent{number}", start=0, seed=number) for number in range(6)]
    known = {(one.agent, one.start): 0.1 for one in episodes}
    here = {one: run_episode(Convoy(), one).metrics for one in episodes}
    with on_cluster(cluster.scheduler_address), running(Convoy(), episodes, jobs=1, watch=Watch(known=known)) as fleets:
        sent = list(fleets)
    assert [len(fleet) for fleet in sent] == [3, 3]
    assert {one.episode: one.metrics for fleet in sent for one in fleet} == here


@pytest.mark.slow
def test_workers_do_all_pieces_and_one_that_dies_is_made_up_for(cluster, tmp_path):
    with on_cluster(cluster.scheduler_address):
        with working(doubled, range(20), jobs=1) as results:
            assert sorted(results) == [2 * piece for piece in range(20)]
        with working(partial(ends_its_worker_once, tmp_path / "flag"), range(20), jobs=1) as results:
            assert sorted(results) == [2 * piece for piece in range(20)]
    assert (tmp_path / "flag").exists()


@pytest.mark.slow
def test_nobody_waits_for_a_worker_that_stops_before_it_hands_over_what_it_has_done(cluster, tmp_path, monkeypatch):
    monkeypatch.setattr("proxytune.running.cluster.SILENT_S", 4.0)
    flag = tmp_path / "flag"

    def results():
        work = partial(doubled_and_stopped, flag)
        with on_cluster(cluster.scheduler_address), working(work, range(20), jobs=1) as came:
            return list(came)

    with ThreadPoolExecutor(1) as thread:
        try:
            came = thread.submit(results).result(timeout=150.0)
        finally:
            os.kill(int(flag.read_text()), signal.SIGCONT)
    assert sorted(came) == [2 * piece for piece in range(20)]


@pytest.mark.slow
def test_a_worker_of_several_threads_is_refused():
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=None) as several,
        pytest.raises(InputError, match="has 2 threads.*start it with --nthreads 1"),
        on_cluster(several.scheduler_address),
    ):
        pass


@pytest.mark.slow
def test_a_study_with_its_own_modules_gives_the_same_trials_while_a_worker_joins(cluster, make_study, answered):
    answers = []
    for name, words in (("here", ()), ("there", ("--backend", "dask", "--address", cluster.scheduler_address))):
        folder = make_study(name, family='"mine:family"')
        (folder / "mine.py").write_text(OWN_FAMILY)
        (folder / "helper.py").write_text("def shift(family):\n    return family\n")
        cluster.scale(3 if words else 2)
        answers.append(answered("study", folder, *words))
    here, there = answers
    assert here["best"] == there["best"]
    for key in ("number", "theta", "score"):
        assert [trial.get(key) for trial in here["trials"]] == [trial.get(key) for trial in there["trials"]]
