"""Whatever is in a file, the command that is given it does it or tells why in one line.

What reads a file may take what that which comes after it cannot bear: here both are done, on the same spoilt files.
They are spoilt as those of `test_readers`, and as often.
"""

import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path

sys.path.append(str(Path(__file__).parent))

import bags
import foreign_robot
import numpy as np
import pytest
from missing_effects.cases import Drive, FormatError, write_poses
from missing_effects.score import read_truths, score, table
from own_models import FILES
from PIL import Image
from test_readers import MODEL, ONE_DRIVE, Reader, check_spoilt, copy_robot, inputs, outcome, write_a_log
from tiny_loop import TWIN, write_tiny

from proxytune.api import Wanted, diagnose, export, import_log, predict, record_log
from proxytune.cli.main import main
from proxytune.diagnosis import RULES
from proxytune.diagnosis.answer import Estimate
from proxytune.diagnosis.stages import Stages
from proxytune.domain import make_episode
from proxytune.driving import lane_following, read_robot
from proxytune.errors import InputError
from proxytune.logs import read_log, read_pictures
from proxytune.settings import Section
from proxytune.storage import Store
from proxytune.study import StudyRun, open_study, read_study_settings
from proxytune.study.earlier import earlier_trials, learn
from tests.conftest import study_maker

__all__ = ["inputs"]  # A fixture

TIMES = np.arange(0.0, ONE_DRIVE, 0.05)


def drive_numbers():
    """Poses (N, 3) and twists (N, 2) of a circle."""
    poses = np.stack((np.sin(0.5 * TIMES), 1.0 - np.cos(0.5 * TIMES), 0.5 * TIMES), axis=1)
    return poses, np.stack((np.full(len(TIMES), 0.5), np.full(len(TIMES), 0.5)), axis=1)


def write_bag(storage):
    def make(home, finished):
        poses, twists = drive_numbers()
        pictures = (TIMES[::60], np.zeros((len(TIMES[::60]), 4, 5, 3), dtype=np.uint8))
        bags.write_bag(
            home / ("a.bag" if storage == "ros1" else "a"), storage, (TIMES, twists), (TIMES, poses), pictures
        )

    return make


def import_it(name):
    """As `import SOURCE OUTPUT` does it."""

    def read(home):
        shutil.rmtree(home / "out", ignore_errors=True)
        return import_log(home / name, home / "out").document()

    return read


def write_npz(home, finished):
    poses, twists = drive_numbers()
    columns = {"time": TIMES, "x": poses[:, 0], "y": poses[:, 1], "heading": poses[:, 2]}
    frames = np.zeros((len(TIMES), 3, 4, 3), dtype=np.uint8)
    np.savez_compressed(home / "a.npz", **columns, v=twists[:, 0], omega=twists[:, 1], frames=frames)


def write_pictures(ending):
    def make(home, finished):
        write_a_log(home, finished)
        (home / "frames").mkdir()
        noise = np.random.default_rng(0).integers(0, 256, (12, 16, 3), dtype=np.uint8)
        for number in range(2):
            Image.fromarray(noise).save(home / "frames" / f"{number}.{ending}")
        text = (home / "log.toml").read_text()
        (home / "log.toml").write_text(f'map = "small_loop"\n{text}\n[camera]\nframes = "frames/%d.{ending}"\n')
        times = (home / "samples.csv").read_text().splitlines()[2].split(",")
        (home / "frames.csv").write_text(
            f"frame,episode,time\n0,{times[0]},{float(times[1])}\n1,{times[0]},{float(times[1]) + 1.0}\n"
        )

    return make


def read_frames(home):
    frames = read_log(home).frames
    assert frames is not None
    return read_pictures(frames, range(len(frames.paths)))


def write_model_and_log(home, finished):
    (home / "model.toml").write_text(MODEL + "[effects.camera_pitch]\ncamera_pitch = 20.0\n")
    (home / "log").mkdir()
    foreign_robot.write_own_times(home / "log", [foreign_robot.drive(1, seconds=ONE_DRIVE)])


def predict_it(home):
    return predict(home / "model.toml", home / "log", horizon_s=1.0).document()


def export_it(home):
    return [export(home / "model.toml", home / f"out.{to}", to=to).document() for to in ("urdf", "mjcf", "ros")]


def write_a_long_log(home, finished):
    foreign_robot.write_own_times(home, [foreign_robot.drive(1, seconds=45.0)])


def diagnose_it(home):
    return diagnose(home, declared=["delay"], rules=replace(RULES, most_effects=1)).document()


def drive_it(home):
    read_robot.cache_clear()
    domain = {"robot": "own", "plant": "planar", "seconds": 1.0}
    family = lane_following(Section(home / "study.toml", "domain.", domain), model=None)
    return family.run(make_episode({"trim": 0.01}, agent="steady", start=0, seed=1))


STAGE = {"errors": np.linspace(0.0, 1.0, 7), "trim": Estimate(0.1, (0.0, 0.2), "m"), "effects": ("dead_band",)}


def write_stage(home, finished):
    Stages(home, "facts").keep("one", lambda: STAGE)
    (home / ".stages" / "facts" / "one.pickle").rename(home / "one.pickle")


def read_stage(home):
    """What is spoilt is made again: a diagnosis goes on with what it knew, or begins."""
    (home / ".stages" / "facts").mkdir(parents=True, exist_ok=True)
    shutil.copy(home / "one.pickle", home / ".stages" / "facts")
    read = Stages(home, "facts").keep("one", lambda: STAGE)
    np.testing.assert_array_equal(read["errors"], STAGE["errors"])
    assert {**read, "errors": None} == {**STAGE, "errors": None}


def write_a_table_of_commands(home, finished):
    write_tiny(home / "tiny")
    (home / "twin.toml").write_text(TWIN)
    rows = [f"{drive},{0.05 * row:.2f},{0.1 * drive + 0.2},{0.3}\n" for drive in range(2) for row in range(21)]
    (home / "commands.csv").write_text("episode,time,left,right\n" + "".join(rows))


def record_it(home):
    wanted = Wanted(repeats=1, seconds=5.0, frames=0, seed=1, commands=home / "commands.csv")
    return record_log(read_study_settings(home / "tiny"), home / "twin.toml", home / "log", wanted, lambda line: None)


def write_a_bank(home, finished):
    make = study_maker(home)
    small = {"agents": '["agent0", "agent1", "agent2"]', "engine": None}
    assert main(["study", str(make("bank", target=None, preflight=None, **small)), "--json"]) == 0
    for path in (home / "bank").glob("study.*"):
        path.unlink()
    make("student", learn_from='["../bank/bank.json"]', budget="0", confirm="1", **small)


def learn_from_it(home):
    for path in (home / "student").glob("study.db*"):
        path.unlink()
    study = open_study(home / "student")
    with Store.open(home / "student") as store:
        run = StudyRun(study, store)
        learn(run)
        return earlier_trials(run)


def write_an_entry(home, finished):
    """Two cases of the benchmark of missing effects, and an entry."""
    way = 0.025 * np.arange(101)
    poses = np.stack((way, np.zeros_like(way), np.zeros_like(way)), axis=1)
    one = Drive("a", np.arange(len(way)) * 0.05, np.full((len(way), 2), 0.5), poses)
    texts = {"catalogue.json": {"differential": {"dead_band": "", "stiction": ""}}}
    for case in ("one", "two"):
        texts[f"cases/{case}/robot.json"] = {"drive": "differential"}
        truth = {"kind": "pair", "missing": [["dead_band"]], "floor_m": {"1": 0.01, "2": 0.02, "5": 0.1}}
        texts |= {f"truth/{case}.json": truth, f"entry/{case}.json": {"effects": ["dead_band"], "seconds": 3.0}}
        write_poses(home / "truth" / f"{case}.csv", [one], [poses])
        write_poses(home / "entry" / f"{case}.csv", [one], [1.1 * poses])
    for name, content in texts.items():
        (home / name).parent.mkdir(parents=True, exist_ok=True)
        (home / name).write_text(json.dumps(content, indent=1))


def score_the_entry(home):
    try:
        return table({"entry": score(home / "entry", read_truths(home))})
    except FormatError as problem:
        raise InputError(str(problem)) from None


def write_own_models(home, finished):
    (home / "model.toml").write_text(
        MODEL + "[effects.yaw_scrub]\nbaseline = 0.2\n[effects.camera_pitch]\ncamera_pitch = 25.0\n"
    )
    for name, content in FILES.items():
        (home / name).write_text(content)


def export_into_them(name):
    return lambda home: export(home / "model.toml", home / f"patched{Path(name).suffix}", into=home / name).document()


LOG = ("log/log.toml", "log/samples.csv", "log/commands.csv")
BEHIND = {
    "import ros1": Reader(write_bag("ros1"), ("a.bag",), import_it("a.bag")),
    "import sqlite3": Reader(write_bag("sqlite3"), ("a/a.db3", "a/metadata.yaml"), import_it("a")),
    "import mcap": Reader(write_bag("mcap"), ("a/a.mcap", "a/metadata.yaml"), import_it("a")),
    "import npz": Reader(write_npz, ("a.npz",), import_it("a.npz")),
    "png": Reader(write_pictures("png"), ("frames/0.png", "frames/1.png", "frames.csv"), read_frames),
    "jpg": Reader(write_pictures("jpg"), ("frames/0.jpg", "frames/1.jpg"), read_frames, complains=False),
    "predict": Reader(write_model_and_log, ("model.toml",), predict_it),
    "predict of a log": Reader(write_model_and_log, LOG, predict_it),
    "export": Reader(write_model_and_log, ("model.toml",), export_it),
    "diagnose": Reader(write_a_long_log, ("log.toml", "samples.csv", "commands.csv"), diagnose_it),
    "stages": Reader(write_stage, ("one.pickle",), read_stage, complains=False),
    "record of a table": Reader(write_a_table_of_commands, ("commands.csv",), record_it),
    "bank.json": Reader(write_a_bank, ("bank/bank.json",), learn_from_it),
    "missing_effects": Reader(write_an_entry, ("entry/one.csv", "entry/one.json", "entry/two.json"), score_the_entry),
    **{f"export into {name}": Reader(write_own_models, (name,), export_into_them(name)) for name in FILES},
    "drive": Reader(copy_robot, ("own/robot.toml", "own/duckiebot.urdf"), drive_it),
}
SHARE = {"diagnose": 0.01, "record of a table": 0.1, "drive": 0.2, "import sqlite3": 0.2, "predict of a log": 0.3}
"""What takes longer is done less often."""


@pytest.mark.slow
@pytest.mark.usefixtures("few_effects")
@pytest.mark.parametrize("name", BEHIND)
def test_what_is_done_with_a_spoilt_file_is_done_or_told_in_one_line(name, inputs, tmp_path, finished_once):
    reader, home = BEHIND[name], tmp_path / "spoilt"
    home.mkdir()
    reader.make(home, finished_once)
    assert outcome(reader.read, home) is None
    check_spoilt(name, reader, home, round(inputs * SHARE.get(name, 1.0)))
