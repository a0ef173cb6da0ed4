"""The defects D1 to D9 of an attack, by their reproductions: `python benchmarks/defects.py CHECKOUT [CHECKOUT ...]`.

Prints a row of a table each, with what `python -m proxytune` of each checkout does.
"""

import argparse
import json
import os
import resource
import shutil
import signal
import socket
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "fakes"))

import bags
import foreign_robot

GIGABYTE = 1 << 30
SIGN = "import os\nwith open({!r}, 'a') as signed:\n    signed.write(str(os.getpid()) + ' ')\nraise ImportError\n"
LANE = """
format = 1
target = "target.csv"
metrics = ["distance:max"]
agents = ["steady", "daredevil"]
starts = 1
budget = 3
initial = 2
objective = "OBJECTIVE"
confirm = 0
jobs = JOBS
[parameters]
trim = [-0.3, 0.3]
[domain]
robot = "ROBOT"
plant = "PLANT"
map = "small_loop"
seconds = 1
"""
OWN = """
format = 1
family = "mine:family"
target = "target.csv"
metrics = ["distance:max"]
agents = ["agent0", "agent1", "agent2"]
starts = 5
budget = 4
initial = 2
confirm = 0
jobs = 1
preflight = false
MORE
[parameters]
trim = [-0.3, 0.3]
[domain]
"""
FAMILY = """
import os
import time
from helper import same
from wobbly import Wobbly, wobbly

class Mine(Wobbly):
    def run(self, episode):
        FAULT
        time.sleep(SLEEP)
        return same(super().run(episode))

def family(domain, *, model):
    return Mine(**vars(wobbly(domain, model=model)))
"""
HELPER = "def same(scores):\n    return scores\n"
SCHEDULER = "from distributed.cli.dask_scheduler import main; main()"
WORKER = "from distributed.cli.dask_worker import main; main()"


class Done(NamedTuple):
    """The end of a command: exit status (None: it had to be killed), standard output and error, most memory [bytes]."""

    status: int | None
    out: str
    err: str
    peak: int

    def told(self) -> str:
        """Status and last line, or the traceback's."""
        last = (self.err.strip().splitlines() or [""])[-1]
        ended = "hangs" if self.status is None else f"ends with {self.status}"
        return f"{ended}, traceback: {last[:90]}" if "Traceback" in self.err else f"{ended}: {last[:150]}"


class Checkout:
    """A checkout of proxytune and a folder to work in."""

    def __init__(self, code: Path, home: Path) -> None:
        self.code, self.home = code, home
        self.environment = {**os.environ, "PYTHONPATH": f"{code}:{code}/tests/fakes", "OMP_NUM_THREADS": "1"}
        self.environment |= {"MPLBACKEND": "Agg", "XDG_STATE_HOME": str(home / "state"), "TMPDIR": str(home / "tmp")}
        (home / "tmp").mkdir()

    def start(self, *words: object, limits: dict[int, int] | None = None, **how: Any) -> subprocess.Popen[str]:
        """Start a command, its output in files of this folder."""

        def limit() -> None:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            for number, most in (limits or {}).items():
                resource.setrlimit(number, (most, most))

        command = [sys.executable, "-m", "proxytune", *map(str, words)]
        streams = {"stdout": (self.home / "out").open("w"), "stderr": (self.home / "err").open("w"), **how}
        return subprocess.Popen(
            command, cwd=self.home, env=self.environment, start_new_session=True, preexec_fn=limit, text=True, **streams
        )

    def end(self, process: subprocess.Popen[str], seconds: float = 120.0) -> Done:
        """Wait for its end, or kill it after so long."""
        until, peak, ended = time.monotonic() + seconds, 0, 0
        while not ended and time.monotonic() < until:
            ended, status, used = os.wait4(process.pid, os.WNOHANG)
            peak = used.ru_maxrss * 1024
            time.sleep(0.02)
        process.returncode = os.waitstatus_to_exitcode(status) if ended else -9
        if not ended:
            os.killpg(process.pid, signal.SIGKILL)
            peak = os.wait4(process.pid, 0)[2].ru_maxrss * 1024
        text = [(self.home / name).read_text(errors="replace") for name in ("out", "err")]
        return Done(process.returncode if ended else None, *text, peak)

    def wait_for_trials(self) -> None:
        """Wait until a study has driven its first episodes."""
        for _ in range(1200):
            with suppress(sqlite3.Error), closing(sqlite3.connect(self.home / "study" / "study.db")) as stored:
                if stored.execute("SELECT count(*) FROM episodes").fetchone()[0] > 3:
                    return
            time.sleep(0.1)

    def run(self, *words: object, seconds: float = 120.0, **how: Any) -> Done:
        """Run a command to its end."""
        return self.end(self.start(*words, **how), seconds)

    def lane_study(
        self, robot: str = "duckiebot", plant: str = "planar", jobs: int = 2, objective: str = "prpv"
    ) -> Path:
        """A study that names no code."""
        study = self.home / "study"
        study.mkdir()
        text = LANE.replace("ROBOT", robot).replace("PLANT", plant).replace("JOBS", str(jobs))
        (study / "study.toml").write_text(text.replace("OBJECTIVE", objective))
        (study / "target.csv").write_text("agent,episode,distance\nsteady,0,1.0\ndaredevil,0,2.0\n")
        return study

    def own_study(self, fault: str = "", sleep: float = 0.0, more: str = "") -> Path:
        """A study of a family of its own, which the caller trusts."""
        study = self.home / "study"
        study.mkdir()
        self.environment["PROXYTUNE_TRUST"] = "1"
        (study / "study.toml").write_text(OWN.replace("MORE", more))
        (study / "mine.py").write_text(FAMILY.replace("FAULT", fault).replace("SLEEP", str(sleep)))
        (study / "helper.py").write_text(HELPER)
        rows = [f"agent{agent},{start},{1.0 + agent}\n" for agent in range(3) for start in range(5)]
        (study / "target.csv").write_text("agent,episode,distance\n" + "".join(rows))
        return study


def optional_packages(at: Checkout) -> str:
    """D1: files that are called like optional packages, beside a study that names no code."""
    study, signed = at.lane_study(), at.home / "signed"
    for name in ("bottleneck", "numexpr", "pyarrow", "sksparse", "viztracer", "numba", "cython"):
        (study / f"{name}.py").write_text(SIGN.format(str(signed)))
    status = at.run("study", study).status
    ran = len(set(signed.read_text().split())) if signed.exists() else 0
    return f"ends with {status}, their code ran in {ran} processes"


def own_plug_ins(at: Checkout) -> str:
    """D2: a *.dist-info folder in a study."""
    study, signed = at.lane_study(objective="evil"), at.home / "signed"
    (study / "evil-1.0.dist-info").mkdir()
    (study / "evil-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: evil\nVersion: 1.0\n")
    points = "[proxytune]\nengine.evil = evil_mod:make\nmeasure.evil = evil_mod:make\n"
    (study / "evil-1.0.dist-info" / "entry_points.txt").write_text(points)
    (study / "evil_mod.py").write_text(SIGN.format(str(signed)))
    done = at.run("study", study)
    return f"its code {'ran' if signed.exists() else 'did not run'}; {done.told()}"


def one_worker_then_a_second(at: Checkout) -> str:
    """D3: a cluster of one worker that a second joins."""
    study = at.own_study(sleep=1.5)
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{one.getsockname()[1]}"
    with ended() as processes:

        def start(code: str, *words: str) -> None:
            quiet: dict[str, Any] = dict.fromkeys(("stdout", "stderr"), subprocess.DEVNULL) | {
                "start_new_session": True
            }
            command = [sys.executable, "-c", code, *words, "--no-dashboard"]
            processes.append(subprocess.Popen(command, cwd=at.home, env=at.environment, **quiet))

        start(SCHEDULER, "--host", "127.0.0.1", "--port", address.rpartition(":")[2])
        start(WORKER, address, "--nthreads", "1", "--no-nanny")
        time.sleep(8.0)
        command = at.start("study", study, "--backend", "dask", "--address", address)
        time.sleep(10.0)
        start(WORKER, address, "--nthreads", "1", "--no-nanny")
        return at.end(command, 300.0).told()


@contextmanager
def ended() -> Iterator[list[subprocess.Popen[bytes]]]:
    """Processes that are killed in the end."""
    processes: list[subprocess.Popen[bytes]] = []
    try:
        yield processes
    finally:
        for process in processes:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def stopped_process(at: Checkout) -> str:
    """D4: a command with a time limit of 4 s an episode is stopped for 15 s."""
    study = at.own_study(sleep=1.0, more="episode_timeout_s = 4")
    command = at.start("study", study, "--json")
    at.wait_for_trials()
    everything = [command.pid, *descendants(command.pid)]
    for what, pause in ((signal.SIGSTOP, 15.0), (signal.SIGCONT, 0.0)):
        for pid in everything:
            os.kill(pid, what)
        time.sleep(pause)
    done = at.end(command)
    failed = "overran" if "longer than" in done.out + done.err else "no episode failed"
    return f"ends with {done.status}, {failed}"


def descendants(pid: int) -> list[int]:
    """The processes that a process has started, and those that they have."""
    known = subprocess.run(["ps", "-e", "-o", "pid=,ppid="], capture_output=True, text=True, check=True).stdout.split()
    of = dict(zip(map(int, known[::2]), map(int, known[1::2]), strict=True))
    found = [child for child, parent in of.items() if parent == pid]
    return [*found, *(deeper for child in found for deeper in descendants(child))]


def bombs(at: Checkout) -> str:
    """D5: arrays of zeros that are small as long as they are packed, and a picture of one colour."""
    at.home.joinpath("zeros").mkdir()
    np.savez_compressed(at.home / "bomb.npz", **dict.fromkeys(("t", "x", "y", "yaw", "v", "w"), np.zeros(1 << 26)))
    size = (at.home / "bomb.npz").stat().st_size / 1e6
    done = at.run("import", at.home / "bomb.npz", seconds=60.0, limits={resource.RLIMIT_AS: 10 * GIGABYTE})
    return f"{size:.1f} MB packed take {done.peak / 1e6:.0f} MB; {done.told()}"


def process_ends(at: Checkout) -> str:
    """D6: an episode calls os._exit(0), with one job."""
    done = at.run("study", at.own_study("if episode.agent == 'agent1' and episode.start == 3: os._exit(0)"))
    return f"{'some' if done.out.strip() else 'no'} output; {done.told()}"


def pipe_for_a_mesh(at: Checkout) -> str:
    """D7: a URDF that names a pipe."""
    shipped = json.loads(at.run("list", "robots", "--json").out)
    assert shipped
    robots = next(at.code.glob("proxytune/**/robots/duckiebot"), at.code / "robots" / "duckiebot")
    study = at.lane_study(robot="wolf", plant="bullet", jobs=1)
    shutil.copytree(robots, study / "wolf")
    text = (study / "wolf" / "robot.toml").read_text().replace('"duckiebot"', '"wolf"')
    (study / "wolf" / "robot.toml").write_text(text)
    (urdf,) = (study / "wolf").glob("*.urdf")
    urdf.write_text(urdf.read_text().replace("</robot>", MESH + "</robot>"))
    os.mkfifo(study / "wolf" / "m.stl")
    return at.run("study", study, seconds=40.0).told()


MESH = """<link name="more"><visual><geometry><mesh filename="m.stl"/></geometry></visual></link>
<joint name="more" type="fixed"><parent link="base"/><child link="more"/></joint>"""


def terminal_gone(at: Checkout) -> str:
    """D8: standard error is a pipe that nobody reads; then SIGHUP."""
    reader, writer = os.pipe()
    command = at.start("study", at.own_study(sleep=0.05), stderr=writer)
    os.close(writer)
    os.read(reader, 1)
    os.close(reader)
    first = at.end(command)
    shutil.rmtree(at.home / "study")
    command = at.start("study", at.own_study(sleep=0.5))
    at.wait_for_trials()
    os.kill(command.pid, signal.SIGHUP)
    return f"ends with {first.status}; SIGHUP: {at.end(command).told()}"


def camera_without_a_folder(at: Checkout) -> str:
    """D9: `predict` of a robot without a folder, whose model states its camera."""
    (at.home / "k.toml").write_text('format = 1\nrobot = "a"\n[effects.camera_pitch]\ncamera_pitch = 20.0\n')
    (at.home / "log").mkdir()
    (at.home / "log" / "log.toml").write_text(
        'format = 1\nname = "log"\nrobot = "a"\ncommand = "twist"\nrate_hz = 20\n'
        "wheel_radius_m = 0.03\nbaseline_m = 0.16\nfull_speed_m_s = 0.5\n"
    )
    rows = (f"0,{tick / 20},0.4,0.0,{tick / 50},0.0,0.0\n" for tick in range(200))
    (at.home / "log" / "samples.csv").write_text("episode,time,v,omega,x,y,heading\n" + "".join(rows))
    return at.run("predict", "k.toml", "log", "--horizon", "1", "--output", "o.csv").told()


def damaged_bag(at: Checkout) -> str:
    """D9: a ROS 2 bag whose metadata.yaml has a number for a name, and a name for a count."""
    drive = foreign_robot.drive(1, seconds=5.0)
    bag = bags.write_bag(at.home / "bag", "mcap", (drive.issued, drive.twists), (drive.measured, drive.poses))
    path = next(at.home.rglob("metadata.yaml"))
    whole, told = path.read_text(), []
    for old, new in (("/cmd_vel", "7"), ("version: ", "version: x")):
        path.write_text(whole.replace(old, new))
        told.append(at.run("import", path.parent).told())
    assert bag
    return "; ".join(told)


def interrupted_early(at: Checkout) -> str:
    """D9: Ctrl-C and SIGTERM while libraries are imported."""
    study, told = at.own_study(), []
    for what in (signal.SIGINT, signal.SIGTERM):
        command = at.start("study", study)
        time.sleep(0.5)
        os.kill(command.pid, what)
        told.append(f"{what.name} {at.end(command).told()}")
    return "; ".join(told)


def few_descriptors(at: Checkout) -> str:
    """D9: two jobs, 20 open files."""
    return at.run("study", at.own_study(), "--jobs", "2", limits={resource.RLIMIT_NOFILE: 20}).told()


DEFECTS: tuple[Callable[[Checkout], str], ...] = (
    optional_packages, own_plug_ins, one_worker_then_a_second, stopped_process, bombs, process_ends, pipe_for_a_mesh,
    terminal_gone, camera_without_a_folder, damaged_bag, interrupted_early, few_descriptors,
)  # fmt: skip


def run() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("checkouts", nargs="+", type=Path)
    parser.add_argument("--only", default="", help="functions, with commas between")
    asked = parser.parse_args()
    print("| defect |" + " |".join(f" {place.resolve().name}" for place in asked.checkouts) + " |")
    print("|---" * (1 + len(asked.checkouts)) + "|")
    for defect in DEFECTS:
        if asked.only and defect.__name__ not in asked.only.split(","):
            continue
        cells = [(defect.__doc__ or "").rstrip(".")]
        for place in asked.checkouts:
            with tempfile.TemporaryDirectory() as home:
                cells.append(defect(Checkout(place.resolve(), Path(home))).replace(home, "").replace("|", "/"))
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    run()
