"""docs/how-to/extending.md works as it stands: its files are written, its commands run, a folder for each section."""

import re
import shlex
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from planted import look_for_few

from proxytune.cli.main import main
from proxytune.driving import lane_following
from proxytune.extensions import load
from proxytune.extensions.door import GROUP
from proxytune.settings import Section, read_settings
from proxytune.study import open_study

PAGE = (Path(__file__).resolve().parent.parent / "docs" / "how-to" / "extending.md").read_text(encoding="utf-8")
INTRODUCTION, *CHAPTERS = re.split(r"^## ", PAGE, flags=re.MULTILINE)
SECTIONS = {chapter.partition("\n")[0]: chapter for chapter in CHAPTERS}
COMMAND = "python -m proxytune "


class Block(NamedTuple):
    """A file of the page, or the lines of one that are changed or added."""

    path: str
    change: str
    text: str


def blocks(text):
    found = re.findall(
        r"^```(?:python|toml)\n# (\S+?)(?:, (changed|added))?\n(.*?)^```", text, re.DOTALL | re.MULTILINE
    )
    return [Block(*one) for one in found]


def put(block, folder):
    """Write a file; of one that is changed, replace the lines of the same keys, or add the lines at its end."""
    path = folder / block.path
    path.parent.mkdir(exist_ok=True)
    before = path.read_text(encoding="utf-8") if block.change else ""
    path.write_text(changed(before, block.text) if block.change == "changed" else before + block.text, encoding="utf-8")


def changed(text, lines):
    for line in lines.splitlines():
        key = line.split(" = ")[0]
        text, count = re.subn(rf"^{key} = .*$", line, text, flags=re.MULTILINE)
        assert count == 1, f"the page changes {key}, which is there {count} times"
    return text


@pytest.fixture
def follow(tmp_path, monkeypatch, answered):
    """Writes the files of the introduction and of a section, runs its commands, and gives what each printed."""

    def followed(section):
        for block in (*blocks(INTRODUCTION), *blocks(SECTIONS[section])):
            put(block, tmp_path)
        monkeypatch.chdir(tmp_path)
        commands = re.findall(rf"^{COMMAND}(.*)$", SECTIONS[section], flags=re.MULTILINE)
        return {line: answered(*shlex.split(line)) for line in commands}

    return followed


def test_the_study_of_the_introduction_reads(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for block in blocks(INTRODUCTION):
        put(block, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"study.toml", "truth.toml"}
    assert main(["measure", ".", "--model", "truth.toml", "--output", "target.csv"]) == 0
    assert open_study(tmp_path).settings.agents == ("steady", "braitenberg", "daredevil")


@pytest.mark.slow
def test_diagnose_finds_the_effect_and_predict_and_a_study_read_what_it_wrote(follow, tmp_path, monkeypatch, answered):
    look_for_few(monkeypatch)
    found = follow("An effect")["diagnose log --effects weak_reverse:WeakReverse --output found"]
    (effect,) = found["effects"]
    value, (low, high) = effect["parameters"]["loss"]["value"], effect["parameters"]["loss"]["interval"]
    assert effect["name"] == "weak_reverse:WeakReverse"
    assert value == pytest.approx(0.3, abs=0.02)
    assert low < value < high
    assert any(name.endswith("effect_curve.png") for name in found["files"])
    answered("predict", "found/model.toml", "log", "--output", "poses.csv")
    domain = Section(tmp_path / "study.toml", "domain.", {"plant": "planar"})
    family = lane_following(domain, model=tmp_path / "found" / "model.toml")
    assert dict(family.effects)["weak_reverse:WeakReverse"] == pytest.approx(value)


@pytest.mark.slow
def test_the_agent_drives_in_a_study(follow, tmp_path):
    assert len(follow("An agent")["study ."]["trials"]) == 4
    assert "grey:Grey,0," in (tmp_path / "target.csv").read_text()


@pytest.mark.slow
def test_the_robot_is_listed_and_drives_on_the_map(follow, tmp_path):
    answers = follow("A robot and a map")
    assert "my_robot" in [row["name"] for row in answers["list robots"]["robots"]]
    assert len(answers["study ."]["trials"]) == 4
    family = lane_following(read_settings(tmp_path / "study.toml").section("domain"), model=None)
    assert (family.robot, family.map.size, family.starts) == ("my_robot", (2.4, 1.755), 2)


@pytest.mark.slow
def test_the_measure_is_the_objective_of_a_study(follow, tmp_path):
    assert len(follow("A measure, also as the objective")["study ."]["trials"]) == 4
    assert open_study(tmp_path).objective.label == "Worst"


@pytest.mark.slow
def test_the_engine_runs_in_a_study(follow, tmp_path):
    assert len(follow("A search engine")["study ."]["trials"]) == 4
    assert open_study(tmp_path).engine.label == "Halton sequence"


@pytest.mark.slow
def test_the_learner_is_taught(follow):
    taught = follow("A learner")["teach ."]
    assert list(taught["proxies"]) == ["nominal"]
    assert np.isfinite(taught["proxies"]["nominal"]["zero_shot"])


@pytest.mark.slow
def test_the_other_simulator_is_tuned(follow):
    answered = follow("Another simulator")["study swing"]
    assert len(answered["trials"]) == 10
    assert set(answered["best"]["theta"]) == {"mass", "damping"}


@pytest.fixture
def everything(tmp_path, monkeypatch):
    """A folder with every module of the page, on the path; they are forgotten afterwards."""
    modules = [block for text in SECTIONS.values() for block in blocks(text) if block.path.endswith(".py")]
    for block in modules:
        put(block, tmp_path)
    for folder in (tmp_path, tmp_path / "swing"):
        monkeypatch.syspath_prepend(str(folder))
    yield tmp_path
    for block in modules:
        sys.modules.pop(Path(block.path).stem, None)


@pytest.mark.slow
def test_what_the_page_makes_keeps_the_promises_that_its_tests_check(everything):
    tests = {name: test for name, test in load("test_mine:__dict__", kind="test").items() if name.startswith("test_")}
    assert len(tests) == 5
    for test in tests.values():
        test()


def test_the_entry_points_of_the_page_are_listed_as_plug_ins(everything, answered):
    (block,) = blocks(SECTIONS["Plug-ins"])
    points = tomllib.loads(block.text)["project"]["entry-points"][GROUP]
    info = everything / "mine-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    lines = [f"{name} = {value}" for name, value in points.items() if not name.startswith("robot")]
    (info / "entry_points.txt").write_text(f"[{GROUP}]\n" + "\n".join(lines) + "\n")
    for kind, name in {"effect": "weak_reverse", "agent": "grey", "engine": "halton", "measure": "worst"}.items():
        rows = answered("list", f"{kind}s")[f"{kind}s"]
        assert name in [row.get(kind, row.get("key" if kind == "measure" else "name")) for row in rows]
    agents, learners, families = (
        {row["name"]: row for row in answered("list", kind)[kind]} for kind in ("agents", "learners", "families")
    )
    assert agents["grey"]["how_it_drives"] == "Turns away from the brighter half of what it sees."
    assert learners["nearest"]["how_it_learns"].startswith("Does what the expert did at the most similar picture")
    assert families["swinging"]["what_it_simulates"].startswith("Called with the study's [domain] table")
    assert {"proxytune.driving.family:lane_following", "swinging"} < set(families)


def test_one_s_own_is_told_by_list_as_module_and_attribute(everything, monkeypatch, answered, capsys, refused):
    monkeypatch.chdir(everything)
    assert answered("list", "effects", "weak_reverse:WeakReverse")["effects"][0]["high"] == 0.9
    assert main(["list", "effects", "weak_reverse:WeakReverse"]) == 0
    assert capsys.readouterr().out.startswith("weak_reverse:WeakReverse: The robot is slower backwards than forwards.")
    named = {"agents": "grey:Grey", "engines": "my_engine:HALTON", "learners": "nearest:Nearest"}
    for kind, name in named.items():
        assert [row["name"] for row in answered("list", kind, name)[kind]] == [name]
    (row,) = answered("list", "measures", "my_measures:WORST")["measures"]
    assert (row["key"], row["name"]) == ("my_measures:WORST", "Worst")
    assert "effect 'weak_reverse:Weak': weak_reverse has no 'Weak'" in refused("list", "effects", "weak_reverse:Weak")
    assert "list robots: no 'grey:Grey'" in refused("list", "robots", "grey:Grey")
