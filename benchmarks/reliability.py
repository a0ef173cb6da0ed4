"""What is survived: `python benchmarks/reliability.py kills|commands|digits|bits|cuts [COUNT] [COMMAND ...]`.

`kills`: so many studies of each engine, with one job and with two, each ended by `kill -9` at four random moments and
then finished; their trials and episodes are compared with those of a study that was never stopped.

`commands`: each command is ended by so many `kill -9` at random moments, alone or with its processes, at most four in a
row, and then run again to its end. Every file must then be what two undisturbed runs agree upon, and no draft be left.
"Went on" counts the last runs that found something finished by the killed ones; no stage of a diagnosis that one of
them has kept may be made again. Commands may be chosen by the names of their table's first column.

`digits`, `bits`, `cuts`: so many times the study.db of a finished study is damaged in one place (a digit of a stored
value is changed, a bit flipped, the end cut off) and read again. Each damage is told in one line, or changes nothing
that is read, or goes unnoticed.
"""

import argparse
import itertools
import os
import random
import re
import shutil
import signal
import sqlite3
import sys
import tempfile
import time
import zlib
from collections import Counter
from collections.abc import Callable, Collection
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "fakes"))

import conftest
import foreign_robot
import launched
import pictured
import processes
import several
import taught
import tiny_loop

from proxytune.cli.main import main
from proxytune.errors import ProxytuneError
from proxytune.files import DRAFT, shipped
from proxytune.search import ENGINE_NAMES
from proxytune.storage import Store
from proxytune.study import Study, open_study, result_of, stored_run

KILLS = 4
TIMES = re.compile(rb"\d{4}-\d\d-\d\d \d\d:\d\d|\d+(\.\d+)? m?s\b")
"""When a page was written, and how long it took."""
STAGES = ".stages"
TABLES = ("facts", "trials", "episodes", "instances")


def survive_kills(count: int, home: Path) -> str:
    """Kill studies of every engine, and compare what they come to."""
    cases = list(itertools.product([engine for engine in ENGINE_NAMES if engine != "tpe"], "12", range(count)))
    equal, kills = 0, 0
    with launched.launching() as launcher:
        for engine, jobs, number in cases:
            own = home / f"{engine}_{jobs}_{number}"
            own.mkdir()
            make_study, keys = conftest.study_maker(own), {"engine": f'"{engine}"', "initial": "3"}
            whole = launched.never_stopped(make_study, **keys)
            folder = make_study("stopped", domain={"sleep": "0.01"}, jobs=jobs, **keys)
            moments = np.random.default_rng((int(jobs), number)).integers(1, len(whole[1]), KILLS)
            kills += sum(killed(launcher, folder, int(moment)) for moment in sorted(moments))
            status, printed = launched.Launched(launcher, folder).end()
            assert status == 0, printed
            equal += (processes.trials(folder), processes.episodes(folder)) == whole
    return f"{kills} kills: {equal} of {len(cases)} studies came to the same trials and episodes"


SMALL = {"agents": '["agent0", "agent1", "agent2"]', "domain": {"sleep": "0.01"}}
COMMANDS = {
    "study": "study fresh",
    "study, two jobs": "study fresh2",
    "study of families": "study several",
    "study by PLV": "study teachable",
    "study of a bank": "study bank",
    "sweep": "sweep fresh --parameter trim --points 5",
    "teach": "teach taught",
    "score": "score --proxy proxy.csv --target target.csv --metric distance:max --output scored --table scored.csv",
    "plot": "plot done",
    "repair": "repair spoilt",
    "export": "export done --to optuna --output trials.sqlite3",
    "export, skopt": "export done --to skopt --output trials.pkl",
    "export of a model": "export tiny/twin.toml --to filter --output filter.py",
    "export into a file": "export tiny/twin.toml --into own.urdf --output patched.urdf",
    "new": "new study begun",
    "new robot": "new robot rover",
    "import": "import table.csv imported --robot nobodys" + "".join(
        f" --figure {key}={value}" for key, value in foreign_robot.FIGURES.items()
    ),
    "record": "record tiny --model tiny/twin.toml --output recorded --seconds 5 --frames 4",
    "record of a table": "record tiny --model tiny/twin.toml --output recorded --commands drive.csv",
    "measure": "measure tiny --model tiny/twin.toml --output measured.csv",
    "drive": "drive tiny --agent steady --output drive.png",
    "drive, moving": "drive tiny --agent steady --output drive.gif",
    "predict": "predict tiny/twin.toml log --horizon 2 --output poses.csv",
    "predict of pictures": "predict tiny/twin.toml pictured --frames --output drawn",
    "diagnose": "diagnose driven --output found",
    "diagnose of a camera": "diagnose stills --output found",
    "loop": "loop tiny --log driven",
    "list": "list effects",
    "completion": "completion bash",
}  # fmt: skip


def prepare(home: Path) -> None:
    """Write what the commands need."""
    make = conftest.study_maker(home)
    make("fresh", **SMALL)
    make("fresh2", jobs="2", **SMALL)
    make("bank", target=None, preflight=None, **SMALL)
    (home / "bank" / "target.csv").unlink()
    several.make_several(make, called="several", **SMALL)
    lessons = {**SMALL, "grid": [0, 20, 40], "starts": "1", "metrics": '["distance:max"]'}
    taught.make_taught(make, called="taught", **lessons)
    more = {
        "parameters": {"trim": "[-0.2, 0.2]"},
        "objective": '"plv"',
        "more": "examinations = 10\nbudget = 3\n[teaching.width]\ntrim = [0.0, 0.3]",
    }
    taught.make_taught(make, called="teachable", **lessons, **more)
    launched.never_stopped(make)
    for name in ("done", "spoilt"):
        shutil.copytree(home / "whole", home / name)
    change_digit(home / "spoilt" / "study.db", random.Random(1))
    for name, more in (("proxy", 0.1), ("target", 0.0)):
        rows = [f"{a},{e},{a * e + more * a * a}\n" for a in range(1, 7) for e in range(20)]
        (home / f"{name}.csv").write_text("agent,episode,distance\n" + "".join(rows))
    tiny_loop.write_tiny(home / "tiny")
    drives = [foreign_robot.drive(1, seconds=45.0)]
    shutil.copy(foreign_robot.write_form(home / "made", "csv", drives) / "run0.csv", home / "table.csv")
    for log, seconds, frames in (("driven", 11, 0), ("pictured", 5, 4)):
        words = f"record {home}/tiny --model {home}/tiny/twin.toml --output {home}/{log} --repeats 1"
        main([*words.split(), "--seconds", str(seconds), "--frames", str(frames)])
    rolled = {"camera_pitch": 19.15, "camera_roll": 4.0}
    pictured.write_still_frames(home / "stills", rolled, pictured.lane_poses(30), columns=96)
    (home / "log").mkdir()
    foreign_robot.write_own_times(home / "log", drives)
    rows = [f"0,{0.05 * tick:.2f},{0.2 + 0.1 * (tick // 20 % 3)},{0.3}\n" for tick in range(200)]
    (home / "drive.csv").write_text("episode,time,left,right\n" + "".join(rows))
    shutil.copy(shipped("robots") / "duckiebot" / "duckiebot.urdf", home / "own.urdf")


def survive_in_every_command(count: int, home: Path, chosen: Collection[str] = COMMANDS) -> str:
    """Kill every command, run it again, and compare what it leaves; a line of a table each."""
    start, work = home / "start", home / "work"
    start.mkdir()
    prepare(start)
    os.environ["TMPDIR"] = str(home)
    work.mkdir()
    os.chdir(work)
    lines = ["| command | kills | before its end | runs | went on | came to the same |", "|---|---|---|---|---|---|"]
    with launched.launching() as launcher:
        for name in chosen:
            words = COMMANDS[name]
            whole, seconds = [], 0.0
            for _ in range(2):
                renew(work, start)
                begun = time.monotonic()
                status, printed = launched.Launched(launcher, work, words.split()).end()
                assert status == 0, printed
                seconds = time.monotonic() - begun
                whole.append(left_in(work))
            rng, sent, kills, runs, gone_on, equal = random.Random(zlib.crc32(name.encode())), 0, 0, 0, 0, 0
            begun_with = {*left_in(start)}
            while sent < count:
                renew(work, start)
                again: list[str] = []
                for _ in range(min(KILLS, count - sent)):
                    before = stages_in(work)
                    process = launched.Launched(launcher, work, words.split())
                    time.sleep(rng.uniform(0.0, seconds))
                    with suppress(ProcessLookupError):
                        (os.kill if rng.random() < 0.4 else os.killpg)(process.pid, signal.SIGKILL)
                    sent, kills = sent + 1, kills + (process.end()[0] == -signal.SIGKILL)
                    after_it = stages_in(work)
                    # All are gone once the findings are written.
                    again += [stage for stage in before if after_it and after_it.get(stage) != before[stage]]
                found = {path for path in {*left_in(work)} - begun_with if not path.endswith(DRAFT)}
                gone_on += bool(found) or any(left_in(work)[path] != left_in(start)[path] for path in begun_with)
                status, printed = launched.Launched(launcher, work, words.split()).end()
                after = left_in(work)
                agreed = {path: content for path, content in whole[0].items() if whole[1][path] == content}
                odd = again + [path for path in agreed if after.get(path) != agreed[path]]
                odd += sorted({*after} - {*whole[0]})
                runs, equal = runs + 1, equal + (status == 0 and not odd)
                if status or odd:
                    print(f"{name}: status {status}, {odd}: {printed[-200:]}", file=sys.stderr, flush=True)
            lines.append(f"| {name} | {sent} | {kills} | {runs} | {gone_on} | {equal} |")
            print(lines[-1], file=sys.stderr, flush=True)
    return "\n".join(lines)


def renew(work: Path, start: Path) -> None:
    """Put everything back as it was before the command."""
    for path in work.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    shutil.copytree(start, work, dirs_exist_ok=True)


def stages_in(work: Path) -> dict[str, int]:
    """The stages of a diagnosis that are kept, and when each was written."""
    return {str(path): path.stat().st_mtime_ns for path in work.rglob(f"{STAGES}/*/*.pickle")}


def left_in(folder: Path) -> dict[str, Any]:
    """Every file and what is in it; of a study.db its trials and episodes."""
    found: dict[str, Any] = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.name == "study.db":
            found[name] = processes.trials(path.parent), processes.episodes(path.parent)
        elif path.is_file() and not path.name.startswith("study.db-"):
            found[name] = TIMES.sub(b"", path.read_bytes()) if path.suffix == ".html" else path.read_bytes()
    return found


def killed(launcher: Any, folder: Path, episodes: int) -> bool:
    """Run a study until it has so many episodes; whether it was still running then, and is killed."""
    process = launched.Launched(launcher, folder)
    processes.wait_for(folder, process, episodes)
    if not process.poll():
        os.kill(process.pid, signal.SIGKILL)
    return bool(process.end()[0] == -signal.SIGKILL)


def change_digit(path: Path, rng: random.Random) -> None:
    """Change a digit of a value in some row."""
    with closing(sqlite3.connect(path)) as plain, plain:
        changed = 0
        while not changed:
            table = rng.choice(TABLES)
            columns = [row[1] for row in plain.execute(f"PRAGMA table_info({table})")]
            row = rng.choice(plain.execute(f"SELECT * FROM {table}").fetchall())
            place = rng.choice([place for place, value in enumerate(row) if re.search(r"\d", str(value))])
            this = " AND ".join(f"{column} IS ?" for column in columns)
            query = f"UPDATE OR IGNORE {table} SET {columns[place]} = ? WHERE {this}"
            changed = plain.execute(query, (with_other_digit(row[place], rng), *row)).rowcount


def with_other_digit(value: Any, rng: random.Random) -> Any:
    """The value with one of its digits changed."""
    text = str(value)
    place = rng.choice([found.start() for found in re.finditer(r"\d", text)])
    digit = rng.choice([other for other in "0123456789" if other != text[place]])
    return type(value)(text[:place] + digit + text[place + 1 :])


def flip_bit(path: Path, rng: random.Random) -> None:
    """Flip a bit anywhere in the file."""
    content = bytearray(path.read_bytes())
    content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    path.write_bytes(content)


def cut_off(path: Path, rng: random.Random) -> None:
    """Leave the end of the file out."""
    content = path.read_bytes()
    path.write_bytes(content[: rng.randrange(1, len(content))])


def contents(folder: Path, study: Study) -> Any:
    """All that a command reads of a study.db, its scores worked out anew."""
    with Store.read(folder) as store:
        known = stored_run(study, store)
        result_of(known)
        outcomes = [dict(store.outcomes(known.study.identity, trial.theta)) for trial in store.trials()]
        return store.facts(), store.trials(), store.sweeps(), outcomes, store.seconds()


def survive_damage(damage: Callable[[Path, random.Random], None], count: int, home: Path) -> str:
    """Damage a finished study's study.db so often, and count what its reader says."""
    make_study, said = conftest.study_maker(home), Counter[str]()
    launched.never_stopped(make_study)
    folder, study = home / "whole", open_study(home / "whole")
    path, rng = folder / "study.db", random.Random(0)
    content, whole = path.read_bytes(), contents(folder, study)
    for _ in range(count):
        damage(path, rng)
        try:
            said["changed nothing that is read" if contents(folder, study) == whole else "unnoticed"] += 1
        except ProxytuneError as problem:
            said["told in several lines" if "\n" in str(problem) else "told in one line"] += 1
        except Exception as problem:
            said[f"{type(problem).__name__} escaped"] += 1
        path.write_bytes(content)
    return f"{count} times: " + ", ".join(f"{number} {what}" for what, number in said.most_common())


DAMAGES = {"digits": change_digit, "bits": flip_bit, "cuts": cut_off}


def run() -> None:
    """Do one of them, and print a line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("what", choices=("kills", "commands", *DAMAGES))
    parser.add_argument("count", type=int, nargs="?", default=3)
    parser.add_argument("names", nargs="*", choices=[[], *COMMANDS], metavar="COMMAND")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as home:
        if asked.what == "commands":
            print(survive_in_every_command(asked.count, Path(home), asked.names or COMMANDS))
        elif asked.what == "kills":
            print(survive_kills(asked.count, Path(home)))
        else:
            print(survive_damage(DAMAGES[asked.what], asked.count, Path(home)))


if __name__ == "__main__":
    run()
