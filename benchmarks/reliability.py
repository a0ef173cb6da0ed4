"""What a study survives: `python benchmarks/reliability.py kills|digits|bits|cuts [COUNT]`.

`kills`: so many studies of each engine, with one job and with two, each ended by `kill -9` at four random moments and
then finished; their trials and episodes are compared with those of a study that was never stopped.

`digits`, `bits`, `cuts`: so many times the study.db of a finished study is damaged in one place (a digit of a stored
value is changed, a bit flipped, the end cut off) and read again. Each damage is told in one line, or changes nothing
that is read, or goes unnoticed.
"""

import argparse
import itertools
import os
import random
import re
import signal
import sqlite3
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "fakes"))

import conftest
import launched
import processes

from proxytune.errors import ProxytuneError
from proxytune.search import ENGINE_NAMES
from proxytune.storage import Store
from proxytune.study import Study, open_study, result_of, stored_run

KILLS = 4
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


def main() -> None:
    """Do one of them, and print a line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("what", choices=("kills", *DAMAGES))
    parser.add_argument("count", type=int, nargs="?", default=3)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as home:
        if asked.what == "kills":
            print(survive_kills(asked.count, Path(home)))
        else:
            print(survive_damage(DAMAGES[asked.what], asked.count, Path(home)))


if __name__ == "__main__":
    main()
