"""No file, whatever is in it, makes a reader fail otherwise than by one line that a person can act on.

    python -m pytest tests/fuzzing -m slow --fuzz 100000

spoils each kind of file so often; every spoilt file depends on its kind and number alone.
"""

import json
import shutil
import sqlite3
import sys
import warnings
import zlib
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

sys.path.append(str(Path(__file__).parent))

import foreign_robot
import numpy as np
import pytest
from mutation import mutated
from runs import read_runs
from tiny_loop import write_diagnosis

from proxytune.domain import make_episode
from proxytune.driving import read_map, read_robot
from proxytune.effects import read_model
from proxytune.errors import ProxytuneError
from proxytune.files import shipped
from proxytune.importing import Wanted, read_source
from proxytune.learning import Cache
from proxytune.logs import read_log
from proxytune.loop.comparison import compare_errors, lacking, level_text, next_step
from proxytune.loop.diagnosing import read_diagnosis
from proxytune.loop.episodes import pictures_file, read_pictures
from proxytune.loop.opening import Kept
from proxytune.scores import read_scores
from proxytune.storage import Store
from proxytune.study import open_study, read_lessons, read_study_settings, result_of, stored_run

MODEL = """\
format = 1
robot = "duckiebot"
plant = "planar"
[geometry]
wheel_radius_m = 0.0318
[effects.trim]
trim = { value = 0.06, interval = [0.05, 0.07] }
[effects.delay]
delay = 0.19
[effects.dead_band]
width = 0.15
"""
SCORES = "agent,episode,distance,time\nA,1,1.5,10\nA,2,2.5,20\nB,1,3,30\nB,2,1e-3,7\n"
KEY = {"objective": "made up", "engine": "gp", "seed": 1, "budget": 5, "initial": 3, "code": "1a2b"}
MAP = "small_loop.toml"
ONE_DRIVE = 12.0
"""Seconds: short, so that many can be read."""


class Reader(NamedTuple):
    """How to come by good files in a folder, which of them to spoil, what reads them, and whether that complains."""

    make: Callable[[Path, Path], object]
    spoil: tuple[str, ...]
    read: Callable[[Path], object]
    complains: bool = True


def write(name: str, content: str) -> Callable[[Path, Path], object]:
    return lambda home, finished: (home / name).write_text(content)


def copy(source: Path) -> Callable[[Path, Path], object]:
    return lambda home, finished: shutil.copytree(source, home, dirs_exist_ok=True)


def copy_finished(home: Path, finished: Path) -> None:
    shutil.copytree(finished, home, dirs_exist_ok=True)


def copy_robot(home: Path, finished: Path) -> None:
    shutil.copytree(shipped("robots") / "duckiebot", home / "own")
    text = (home / "own" / "robot.toml").read_text()
    (home / "own" / "robot.toml").write_text(text.replace('name = "duckiebot"', 'name = "own"'))


def read_own_robot(home: Path) -> object:
    return read_robot.__wrapped__("own", home)  # read_robot reads each robot once


def read_both(home: Path) -> object:
    return read_scores(home / "scores.csv", ["distance", "time"])


def write_a_log(home: Path, finished: Path) -> None:
    foreign_robot.write_own_times(home, [foreign_robot.drive(1, seconds=ONE_DRIVE)])


def write_tables(form: str) -> Callable[[Path, Path], object]:
    def make(home: Path, finished: Path) -> None:
        foreign_robot.write_form(home.parent / f"{home.name}_made", form, [foreign_robot.drive(1, seconds=ONE_DRIVE)])
        shutil.copytree(home.parent / f"{home.name}_made" / form, home, dirs_exist_ok=True)

    return make


def write_arrays(home: Path, finished: Path) -> None:
    Cache(home).get("lesson", {"one": 1}, lambda: {"samples": np.arange(12.0).reshape(3, 4), "name": np.array("x")})
    next(home.glob("lesson-*.npz")).rename(home / "lesson.npz")


def read_arrays(home: Path) -> object:
    cache = Cache(home / "cache")
    path = cache.path("lesson", {"one": 1})
    path.parent.mkdir(exist_ok=True)
    shutil.copy(home / "lesson.npz", path)
    return cache.get("lesson", {"one": 1}, dict)


def read_study(home: Path) -> object:
    study = open_study(home)
    with Store.read(home) as store:
        return result_of(stored_run(study, store))


def write_note(home: Path, finished: Path) -> None:
    copy_finished(home, finished)
    with Store.open(home) as store:
        store.begin_episode("one", make_episode({"delay": 0.1, "trim": -0.2}, agent="agent1", start=2, seed=11))
    (home / "theta").write_text('{"delay": 0.1, "trim": -0.2}')


def read_note(home: Path) -> object:
    with closing(sqlite3.connect(home / "study.db")) as plain, plain:
        plain.execute("UPDATE under_way SET theta = CAST(? AS TEXT)", ((home / "theta").read_bytes(),))
    with Store.open(home) as store:
        return store.under_way("one")


def write_lessons(home: Path, finished: Path) -> None:
    estimate = {"value": 3.0, "low": 1.0, "high": 5.0}
    lesson = {"theta": {"trim": 0.1}, "zero_shot": 2.5, "failure": "", "needed": estimate, "plv": None, "more": None}
    copy_finished(home, finished)
    (home / "families").mkdir()
    (home / "families" / "lessons.json").write_text(json.dumps({"one": lesson, "two": lesson}))


def read_the_lessons(home: Path) -> object:
    lessons = read_lessons(read_study_settings(home))
    return json.dumps({name: asdict(lesson) for name, lesson in lessons.items()}, allow_nan=False)


def write_pictures(home: Path, finished: Path) -> None:
    path = pictures_file(home)
    path.parent.mkdir()
    path.with_name("before.png").write_bytes(b"a picture")
    texts = [{"file": "before.png", "title": "steady beside the target", "caption": "They part at 2 s."}]
    path.write_text(json.dumps(texts, indent=2))


def write_a_diagnosis(home: Path, finished: Path) -> None:
    write_diagnosis(home)


def read_a_diagnosis(home: Path) -> object:
    """As a loop reads it and prints it."""
    found = read_diagnosis(home)
    rows = [level_text(row.before, row.unit) for row in compare_errors(found)]
    return json.dumps([lacking(found), next_step(found, "", "model.toml", {}), rows, found], allow_nan=False)


def write_runs(home: Path, finished: Path) -> None:
    judgement = {"code": "1a2b", "score": 3.0, "theta": {"trim": 0.1}}
    run = {"key": KEY, "visited": [[0.1, 0.2]], "seconds": 0.1, "judgement": judgement}
    (home / "runs.jsonl").write_text("".join(json.dumps({**run, "key": {**KEY, "seed": n}}) + "\n" for n in range(5)))


READERS = {
    "study.toml": Reader(copy_finished, ("study.toml",), lambda home: open_study(home)),
    "target.csv": Reader(copy_finished, ("target.csv",), lambda home: open_study(home)),
    "study.db": Reader(copy_finished, ("study.db",), read_study),
    "model.toml": Reader(write("model.toml", MODEL), ("model.toml",), lambda home: read_model(home / "model.toml")),
    "robot.toml": Reader(copy_robot, ("own/robot.toml", "own/duckiebot.urdf"), read_own_robot),
    "map": Reader(copy(shipped("robots") / "maps"), (MAP,), lambda home: read_map(home / MAP)),
    "log": Reader(write_a_log, ("log.toml", "samples.csv", "commands.csv"), read_log),
    "scores": Reader(write("scores.csv", SCORES), ("scores.csv",), read_both),
    "table": Reader(write_tables("csv"), ("run0.csv",), lambda home: read_source(home / "run0.csv", Wanted())),
    "arrays": Reader(write_arrays, ("lesson.npz",), read_arrays),
    "lessons.json": Reader(write_lessons, ("families/lessons.json",), read_the_lessons),
    "pictures.json": Reader(write_pictures, ("righted/pictures.json",), read_pictures),
    "diagnosis.json": Reader(write_a_diagnosis, ("diagnosis.json",), read_a_diagnosis),
    "under way": Reader(write_note, ("theta",), read_note),
    "runs": Reader(write_runs, ("runs.jsonl",), lambda home: read_runs(home / "runs.jsonl"), False),
    "loop.json": Reader(
        write("loop.json", '{"format": 1, "steps": {"study": "0123456789abcdef", "log": "0123"}}'), ("loop.json",), Kept
    ),
}


def outcome(read: Callable[[Path], object], home: Path) -> Any:
    """What came of reading: nothing, or the complaint; a warning counts as a failure."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            read(home)
        except ProxytuneError as problem:
            return str(problem)
    return None


@pytest.fixture
def inputs(request):
    """How many files of each kind are spoilt."""
    return request.config.getoption("fuzz")


def check_spoilt(name: str, reader: Reader, home: Path, count: int) -> None:
    """Spoil so many files, one at a time: each is read, or told of in one line."""
    good = {file: (home / file).read_bytes() for file in reader.spoil}
    complaints = 0
    for number in range(count):
        random = np.random.default_rng((zlib.crc32(name.encode()), number))
        file = reader.spoil[int(random.integers(len(reader.spoil)))]
        content = mutated(good[file], random)
        (home / file).write_bytes(content)
        try:
            complaint = outcome(reader.read, home)
        except Exception as problem:
            pytest.fail(f"{file}, number {number}: {type(problem).__name__}: {problem}\n{content[:3000]!r}")
        assert complaint is None or "\n" not in complaint, f"{file}, number {number}: {complaint!r}"
        complaints += complaint is not None
        (home / file).write_bytes(good[file])
    assert not reader.complains or complaints >= 0.1 * count - 1, "hardly any change was noticed"


@pytest.mark.slow
@pytest.mark.parametrize("name", READERS)
def test_a_spoilt_file_is_read_or_told_of_in_one_line(name, inputs, tmp_path, finished_once):
    reader, home = READERS[name], tmp_path / "spoilt"
    home.mkdir()
    reader.make(home, finished_once)
    assert outcome(reader.read, home) is None
    check_spoilt(name, reader, home, inputs)
