"""A diagnosis that is killed goes on with what it knew, to the same answer; what does not fit is made again."""

import json
import os
import pickle
from dataclasses import replace

import hidden_cases as hidden
import numpy as np
import pytest
from planted import CALM, TRUTH, look_for_few, planted_log

from proxytune.diagnosis import RULES, diagnose_log, forget_stages, robot_of
from proxytune.diagnosis.answer import Estimate
from proxytune.diagnosis.stages import FOLDER, Stages, _digest_of, facts_of
from proxytune.errors import RunError
from proxytune.report import diagnosis_document


class Killed(BaseException):
    """As a signal that nothing can catch."""


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
        stages = Stages(tmp_path, "facts")
        stages.know(thing=thing)
        assert stages.keep("one", lambda: (thing, 1))[0] is thing
    (path,) = tmp_path.rglob("*.pickle")
    assert path.stat().st_size < 200


def test_other_facts_and_spoilt_files_are_made_again(tmp_path):
    assert Stages(tmp_path, "facts").keep("one", lambda: 1) == 1
    (path,) = tmp_path.rglob("*.pickle")
    path.write_bytes(path.read_bytes()[:-2])
    assert Stages(tmp_path, "facts").keep("one", lambda: 2) == 2
    assert Stages(tmp_path, "others").keep("one", lambda: 3) == 3
    assert [folder.name for folder in (tmp_path / FOLDER).iterdir()] == ["others"]
    forget_stages(tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_digit_that_a_disk_has_changed_is_no_result(tmp_path):
    Stages(tmp_path, "facts").keep("one", lambda: np.linspace(0.0, 1.0, 3))
    (path,) = tmp_path.rglob("*.pickle")
    content = path.read_bytes()
    path.write_bytes(content.replace(np.float64(0.5).tobytes(), np.float64(0.25).tobytes()))
    assert path.read_bytes() != content
    assert Stages(tmp_path, "facts").keep("one", lambda: "made again") == "made again"


class Harmful:
    def __reduce__(self):
        return os.mkdir, ("harm",)


def test_a_strangers_file_runs_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Stages(tmp_path, "facts").keep("one", lambda: 1)
    (path,) = tmp_path.rglob("*.pickle")
    content = pickle.dumps(Harmful())
    path.write_bytes(_digest_of(content) + b"\n" + content)
    assert Stages(tmp_path, "facts").keep("one", lambda: 2) == 2
    assert not (tmp_path / "harm").exists()


@pytest.mark.slow
def test_facts_are_the_log_the_robot_and_the_options():
    log = planted_log(TRUTH, episodes=2, seconds=3.0)
    robot = robot_of(log)
    plain = facts_of(log, None, robot, 1, RULES)
    assert plain == facts_of(planted_log(TRUTH, episodes=2, seconds=3.0), None, robot_of(log), 1, RULES)
    moved = replace(log.episodes[0], poses=log.episodes[0].poses + 1e-12)
    others = [
        facts_of(replace(log, episodes=(moved, *log.episodes[1:])), None, robot, 1, RULES),
        facts_of(log, log, robot, 1, RULES),
        facts_of(log, None, replace(robot, figures={**robot.figures, "full_speed": 0.61}), 1, RULES),
        facts_of(log, None, robot, 2, RULES),
        facts_of(log, None, robot, 1, replace(RULES, p_value=0.02)),
    ]
    assert len({plain, *others}) == 6


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


@pytest.mark.slow
@pytest.mark.parametrize("curved", [False, True])
def test_a_diagnosis_that_is_killed_after_each_stage_comes_to_the_same_answer(tmp_path, monkeypatch, curved):
    if curved:
        log = hidden.make_log(hidden.OUTSIDE[0], episodes=6, seconds=12.0)
    else:
        log = planted_log({**TRUTH, "yaw_scrub": 0.12}, episodes=6, seconds=12.0, noise=CALM)
    robot, stages = robot_of(log), []
    look_for_few(monkeypatch)
    undisturbed = diagnosis_document(diagnose_log(log, robot))
    interrupted(monkeypatch, stages)
    found = None
    for _ in range(20):
        try:
            found = diagnose_log(log, robot, folder=tmp_path)
            break
        except Killed:
            continue
    assert len(stages) == len(set(stages)) >= 9, "each stage is made once"
    assert json.dumps(diagnosis_document(found)) == json.dumps(undisturbed)
