"""A diagnosis that is killed goes on with what it knew, to the same answer; what does not fit is made again."""

import contextlib
import json
import os
import pickle
import shutil
from collections.abc import Mapping
from dataclasses import is_dataclass, replace
from pathlib import Path

import hidden_cases as hidden
import numpy as np
import pytest
from pictured import ROBOT, ROLLED, lane_poses, write_still_frames
from PIL import Image
from planted import CALM, TRUTH, look_for_few, planted_log
from stopping import Killed
from threadpoolctl import threadpool_info, threadpool_limits

from proxytune.diagnosis import RULES, diagnose_log, forget_stages, robot_of
from proxytune.diagnosis.answer import Estimate
from proxytune.diagnosis.stages import FOLDER, Stages, _digest_of, facts_of
from proxytune.driving import Markings, Robot
from proxytune.errors import RunError
from proxytune.files import shipped
from proxytune.logs import Frames, read_log
from proxytune.report import diagnosis_document


def test_nothing_is_removed_behind_a_link_in_the_place_of_the_stages(tmp_path):
    (tmp_path / "mine" / "kept").mkdir(parents=True)
    (tmp_path / "found").mkdir()
    (tmp_path / "found" / FOLDER).symlink_to(tmp_path / "mine")
    with pytest.raises(RunError, match="is a symbolic link; remove it, or give another folder"):
        Stages(tmp_path / "found", "facts")
    forget_stages(tmp_path / "found")
    assert (tmp_path / "mine" / "kept").is_dir()


def test_a_stage_is_made_once_and_read_as_it_was(tmp_path):
    kept = Stages(tmp_path, "facts").keep("one", lambda: (np.linspace(0.0, 1.0, 3), Estimate(0.1, (0.0, 0.2), "m")))
    read = Stages(tmp_path, "facts").keep("one", lambda: pytest.fail("made twice"))
    np.testing.assert_array_equal(kept[0], read[0])
    assert read[1] == kept[1]


def test_things_that_are_known_are_not_copied(tmp_path):
    thing = {"large": np.zeros(1000)}
    for _ in range(2):
        assert Stages(tmp_path, "facts", thing=thing).keep("one", lambda: (thing, 1))[0] is thing
    (path,) = tmp_path.rglob("*.pickle")
    assert path.stat().st_size < 200


def test_what_was_spoilt_or_is_of_other_facts_is_made_again_and_what_was_changed_is_no_result(tmp_path, monkeypatch):
    said = []
    assert Stages(tmp_path, "facts", said.append).keep("one", lambda: 1) == 1
    assert Stages(tmp_path, "others", said.append).keep("one", lambda: 2) == 2
    assert Stages(tmp_path, "facts", said.append).keep("one", lambda: 3) == 1
    assert said == []
    path = tmp_path / FOLDER / "facts" / "one.pickle"
    path.write_bytes(path.read_bytes()[:-2])
    assert Stages(tmp_path, "facts", said.append).keep("one", lambda: 4) == 4
    assert said == [f"{path}: is damaged; it is made again"]
    forget_stages(tmp_path)
    assert not list(tmp_path.iterdir())
    Stages(tmp_path, "facts").keep("one", lambda: np.linspace(0.0, 1.0, 3))
    (path,) = tmp_path.rglob("*.pickle")
    content = path.read_bytes()
    path.write_bytes(content.replace(np.float64(0.5).tobytes(), np.float64(0.25).tobytes()))
    assert path.read_bytes() != content
    assert Stages(tmp_path, "facts").keep("one", lambda: "made again") == "made again"
    monkeypatch.chdir(tmp_path)
    Stages(tmp_path, "facts").keep("one", lambda: 1)
    content = pickle.dumps(Harmful())
    path.write_bytes(_digest_of(content) + b"\n" + content)
    assert Stages(tmp_path, "facts").keep("one", lambda: 2) == 2
    assert not (tmp_path / "harm").exists()


class Harmful:
    def __reduce__(self):
        return os.mkdir, ("harm",)


@pytest.mark.slow
def test_facts_are_the_log_the_robot_and_the_options(tmp_path):
    log = planted_log(TRUTH, episodes=2, seconds=3.0)
    robot = robot_of(log)
    plain = facts_of(robot, log, None, 1, RULES)
    assert plain == facts_of(robot_of(log), planted_log(TRUTH, episodes=2, seconds=3.0), None, 1, RULES)
    moved = replace(log.episodes[0], poses=log.episodes[0].poses + 1e-12)
    (tmp_path / "other.urdf").write_text("<robot/>")
    others = [
        facts_of(robot, replace(log, episodes=(moved, *log.episodes[1:])), None, 1, RULES),
        facts_of(robot, log, log, 1, RULES),
        facts_of(replace(robot, figures={**robot.figures, "full_speed": 0.61}), log, None, 1, RULES),
        facts_of(replace(robot, urdf=tmp_path / "other.urdf"), log, None, 1, RULES),
        facts_of(robot, log, None, 2, RULES),
        facts_of(robot, log, None, 1, replace(RULES, p_value=0.02)),
    ]
    assert len({plain, *others}) == 7


def interrupted(monkeypatch, whole):
    """Have every stage that is made anew be the last thing that its process does."""
    keep = Stages.keep

    def once(self, stage, make):
        made = []
        result = keep(self, stage, lambda: made.append(stage) or make())
        if made:
            whole.append(stage)
            raise Killed
        return result

    monkeypatch.setattr(Stages, "keep", once)


def made_one_by_one(monkeypatch, diagnose):
    """The stages that are made and the answer, of a diagnosis that is killed after each stage and begun again."""
    stages = []
    interrupted(monkeypatch, stages)
    for _ in range(20):
        with contextlib.suppress(Killed):
            return stages, diagnose()
    return stages, None


@pytest.mark.slow
@pytest.mark.parametrize(
    "make_log",
    [
        lambda: hidden.make_log(hidden.OUTSIDE[0], episodes=6, seconds=12.0),
        lambda: planted_log({**TRUTH, "yaw_scrub": 0.12}, episodes=6, seconds=12.0, noise=CALM),
        lambda: planted_log({**TRUTH, "motor_lag.time_constant": 1.6}, episodes=6, seconds=12.0, noise=CALM),
    ],
    ids=["curves", "a name", "a value beyond the usual range"],
)
def test_a_diagnosis_that_is_killed_after_each_stage_comes_to_the_same_answer(tmp_path, monkeypatch, make_log):
    log = make_log()
    robot = robot_of(log)
    look_for_few(monkeypatch)
    undisturbed = diagnosis_document(diagnose_log(log, robot))
    stages, found = made_one_by_one(monkeypatch, lambda: diagnose_log(log, robot, folder=tmp_path))
    assert len(stages) == len(set(stages)) >= 9, "each stage is made once"
    assert json.dumps(diagnosis_document(found)) == json.dumps(undisturbed)


OF_CAMERA = ["everything", "match", "named", "weighed", "look", "concluded"]


def still_frames(folder):
    """The folder of a log of few and small frames by a camera that is rolled."""
    return write_still_frames(folder, ROLLED, lane_poses(20), columns=64)


def assert_same_to_the_bit(one, other):
    """Compare all that a diagnosis holds but its robot."""
    if isinstance(one, np.ndarray):
        assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
    elif isinstance(one, Mapping):
        assert_same_to_the_bit(list(one.items()), list(other.items()))
    elif isinstance(one, tuple | list):
        assert len(one) == len(other)
        for mine, yours in zip(one, other, strict=True):
            assert_same_to_the_bit(mine, yours)
    elif is_dataclass(one) and not isinstance(one, Robot):
        assert_same_to_the_bit(list(vars(one).items()), list(vars(other).items()))
    elif not isinstance(one, Robot | Markings):
        assert repr(one) == repr(other)


@pytest.mark.slow
def test_of_a_camera_killed_after_each_stage_the_answer_is_the_same_to_the_bit(tmp_path, monkeypatch):
    log = read_log(still_frames(tmp_path / "log"))
    # Fits then have a scatter of their own.
    log = replace(log, frames=replace(log.frames, position_m=None))
    undisturbed = diagnose_log(log, ROBOT)
    stages, found = made_one_by_one(monkeypatch, lambda: diagnose_log(log, ROBOT, folder=tmp_path / "found"))
    assert stages == OF_CAMERA, "each stage is made once"
    assert json.dumps(diagnosis_document(found)) == json.dumps(diagnosis_document(undisturbed))
    assert_same_to_the_bit(found.camera, undisturbed.camera)


def as_it_was(log, patch):
    return log


def elsewhere(log, patch):
    """What is imported lies in another folder each time."""
    home = log.frames.paths[0].parents[1]
    return read_log(home.rename(home.with_name("moved")))


def another_pixel(log, patch):
    with Image.open(log.frames.paths[7]) as picture:
        changed = np.array(picture)
    changed[30, 30] += 1
    Image.fromarray(changed).save(log.frames.paths[7])
    return log


def another_map(log, patch):
    path = Path(log.frames.road)
    path.write_text(path.read_text().replace("white_width = 0.048", "white_width = 0.049"))
    return log


def other_poses(log, patch):
    log.episodes[0].poses[3, 0] += 1e-12
    return log


def other_statement(log, patch):
    return replace(log, frames=replace(log.frames, rectified=True))


def other_code(log, patch):
    patch.setattr("proxytune.diagnosis.stages.meaning_of", lambda *_: "other")
    return log


@pytest.mark.parametrize(
    ("change", "options", "next_made"),
    [
        (as_it_was, {}, OF_CAMERA[1]),
        (elsewhere, {}, OF_CAMERA[1]),
        (another_pixel, {}, OF_CAMERA[0]),
        (another_map, {}, OF_CAMERA[0]),
        (other_poses, {}, OF_CAMERA[0]),
        (other_statement, {}, OF_CAMERA[0]),
        (other_code, {}, OF_CAMERA[0]),
        (as_it_was, {"seed": 2}, OF_CAMERA[0]),
        (as_it_was, {"declared": ["camera_pitch", "camera_roll"]}, OF_CAMERA[0]),
    ],
)
def test_a_stage_of_another_log_other_options_or_code_is_made_again(tmp_path, monkeypatch, change, options, next_made):
    folder, stages = still_frames(tmp_path / "log"), []
    shutil.copy(shipped("robots") / "maps" / "small_loop.toml", folder / "own.toml")
    (folder / "log.toml").write_text((folder / "log.toml").read_text().replace('"small_loop"', '"own.toml"'))
    log = read_log(folder)
    interrupted(monkeypatch, stages)
    with pytest.raises(Killed):
        diagnose_log(log, ROBOT, folder=tmp_path / "found")
    with pytest.raises(Killed):
        diagnose_log(change(log, monkeypatch), ROBOT, folder=tmp_path / "found", **options)
    assert stages == [OF_CAMERA[0], next_made]


def test_stages_of_motion_are_the_same_wherever_the_pictures_of_a_log_lie(tmp_path, monkeypatch):
    folders = set()

    def only_look(self, stage, make):
        folders.add(self._folder)
        raise Killed

    monkeypatch.setattr(Stages, "keep", only_look)
    log, taken = planted_log(TRUTH), (np.zeros(1, dtype=int), np.zeros(1), "small_loop")
    for home in ("first", "again"):
        with pytest.raises(Killed):
            diagnose_log(replace(log, frames=Frames((tmp_path / home,), *taken)), robot_of(log), folder=tmp_path)
    assert len(folders) == 1


def test_a_diagnosis_runs_on_one_thread_of_motion_as_of_a_camera(tmp_path, monkeypatch):
    def count(self, stage, make):
        threads.update(pool["num_threads"] for pool in threadpool_info())
        raise Killed

    monkeypatch.setattr(Stages, "keep", count)
    for log in (planted_log(TRUTH), read_log(still_frames(tmp_path / "log"))):
        threads = set()
        with threadpool_limits(limits=2), pytest.raises(Killed):
            diagnose_log(log, ROBOT)
        assert threads == {1}


def test_a_damaged_stage_of_a_camera_is_told_in_one_line_and_made_again(tmp_path, monkeypatch):
    log, stages, said = read_log(still_frames(tmp_path / "log")), [], []
    interrupted(monkeypatch, stages)
    with pytest.raises(Killed):
        diagnose_log(log, ROBOT, folder=tmp_path / "found")
    (path,) = (tmp_path / "found").rglob("*.pickle")
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(Killed):
        diagnose_log(log, ROBOT, folder=tmp_path / "found", report=said.append)
    assert stages == OF_CAMERA[:1] * 2
    assert said == ["reading frames", "fitting the camera", f"{path}: is damaged; it is made again"]


def test_a_robot_that_is_given_in_place_of_the_one_the_log_names_is_a_caution(monkeypatch):
    monkeypatch.setattr("proxytune.diagnosis.log_diagnosis.diagnose", lambda *_, **__: None)
    log = planted_log(TRUTH, episodes=1, seconds=5.0)
    told = "log.toml names the robot 'duckiebot', and 'irobot_create', which was given, counts"
    for named, given, cautions in (
        ("duckiebot", "irobot_create", [told]),
        ("duckiebot", "duckiebot", []),
        ("nobodys", "duckiebot", []),
    ):
        own = replace(log, robot=named)
        found = [line for line in diagnose_log(own, robot_of(own, given)).cautions if "names the robot" in line]
        assert found == cautions
