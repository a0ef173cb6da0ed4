"""The extended study is the study itself, by another proxy, from another folder; a killed diagnosis goes on."""

import shutil
from contextlib import nullcontext

import pytest
from planted import TRUTH, planted_log
from stopping import Killed
from tiny_loop import FOUND, write_diagnosis, write_tiny

from proxytune.diagnosis.stages import Stages
from proxytune.driving import read_map
from proxytune.files import shipped
from proxytune.loop import diagnosing
from proxytune.loop.diagnosing import diagnose_target, write_extension
from proxytune.loop.opening import open_loop
from proxytune.study import load_family, read_study_settings


def extended(tmp_path, *changes):
    study = write_tiny(tmp_path / "tiny", *changes)
    (study / "found.toml").write_text(FOUND)
    settings = read_study_settings(study)
    write_extension(settings, "duckiebot", study / "found.toml", study / "loop" / "extended")
    return settings, read_study_settings(study / "loop" / "extended")


def test_the_extended_study_differs_by_name_proxy_and_effects_diagnosed(tmp_path):
    before, after = extended(tmp_path)
    assert (after.name, after.proxy.resolve()) == ("tiny_extended", (before.folder / "found.toml").resolve())
    assert [path.resolve() for path in after.targets] == [path.resolve() for path in before.targets]
    assert after.truth.resolve() == before.truth.resolve()
    for key in ("metrics", "agents", "starts", "budget", "initial", "seed", "space", "preflight", "family"):
        assert getattr(after, key) == getattr(before, key)
    assert dict(after.domain) == dict(before.domain)
    assert dict(load_family(after, after.proxy).effects)["dead_band.width"] == 0.149

    proxy = ('truth = "twin.toml"', 'truth = "twin.toml"\nproxy = "proxy.toml"')
    effects = ('plant = "planar"\n', 'plant = "planar"\neffects = { delay = { delay = 0.1 } }\n')
    folder = write_tiny(tmp_path / "tiny")
    text = 'format = 1\nrobot = "duckiebot"\n[effects.turn_slip]\nturn_slip = 0.2\n[effects.trim]\ntrim = 0.0\n'
    (folder / "proxy.toml").write_text(text)
    _, after = extended(tmp_path, proxy, effects)
    assert after.domain["effects"] == {"turn_slip": {"turn_slip": 0.2}}


def test_what_a_study_may_read_lies_beside_the_extended_one_and_what_runs_made_does_not(tmp_path):
    folder = write_tiny(tmp_path / "tiny")
    made = ("figures/convergence.png", "study.db", "other/study.toml", "a_log/log.toml")
    for name in (*made, "mine.py", "robby/robot.toml"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("")
    extended(tmp_path)
    there = {path.relative_to(folder / "loop" / "extended").as_posix() for path in (folder / "loop").rglob("*.*")}
    assert there == {"study.toml", "twin.toml", "found.toml", "mine.py", "robby/robot.toml"}


def test_a_robot_a_map_and_a_cheaper_proxy_beside_the_study_are_still_found(tmp_path):
    shutil.copytree(shipped("robots") / "duckiebot", tmp_path / "robby")
    shutil.copy(shipped("robots") / "maps" / "small_loop.toml", tmp_path / "yard.toml")
    (tmp_path / "bank").mkdir()
    path = tmp_path / "robby" / "robot.toml"
    path.write_text(path.read_text().replace('"duckiebot"', '"robby"', 1))
    domain = ('robot = "duckiebot"', 'robot = "robby"\nmap = "../yard.toml"')
    known = ("budget", 'learn_from = ["../bank"]\nlow_fidelity = ["../bank"]\nbudget')
    study = write_tiny(tmp_path / "tiny", domain, known)
    (study / "found.toml").write_text(FOUND.replace("duckiebot", "robby"))
    folder = study / "loop" / "extended"
    write_extension(read_study_settings(study), "robby", study / "found.toml", folder)
    after = read_study_settings(folder)
    assert load_family(after, after.proxy).map == read_map(tmp_path / "yard.toml")
    assert (after.learn_from, after.low_fidelity) == ((), ("../../../bank",))


class Quiet:
    def diagnosis(self, log):
        return nullcontext(lambda line: None)


class Written:
    def __init__(self, found):
        pass

    def write(self, folder):
        write_diagnosis(folder)


def test_a_diagnosis_that_was_killed_goes_on_from_what_its_folder_keeps(tmp_path, monkeypatch):
    made = []

    def diagnose(log, robot, declared, *, seed, report, folder):
        Stages(folder, "facts").keep("one", lambda: made.append("one") or 1)
        if len(made) == 1:
            made.append("killed")
            raise Killed

    monkeypatch.setattr(diagnosing, "diagnose_log", diagnose)
    monkeypatch.setattr(diagnosing, "DiagnosisReport", Written)
    monkeypatch.setattr(diagnosing, "open_log", lambda *_, **__: nullcontext((planted_log(TRUTH, episodes=1), ())))
    loop = open_loop(write_tiny(tmp_path / "tiny"), log=None, twin=None)
    folder = tmp_path / "diagnosed"
    with pytest.raises(Killed):
        diagnose_target(loop, tmp_path, folder, Quiet())
    diagnose_target(loop, tmp_path, folder, Quiet())
    assert made == ["one", "killed"], "the stage is not made again"
    assert {path.name for path in folder.iterdir()} == {"diagnosis.json", "model.toml"}
