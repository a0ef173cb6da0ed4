"""Under which name code keeps episodes: what changes it, what does not, and that studies of earlier code go on."""

import shutil
import tomllib
from dataclasses import replace

import pytest
from toy_families import PENDULUM

from proxytune import lineage
from proxytune.driving import LaneFollowing, shipped_map
from proxytune.environments.family import gymnasium_family
from proxytune.learning import learner_identity
from proxytune.learning.cloning import BehaviourCloning
from proxytune.learning.ridge import RandomFeatures
from proxytune.search import ENGINE_NAMES, code_of, engine_code, engine_of
from proxytune.search.engine import AfterDesign
from proxytune.settings import Section

MODULES = {
    "driving": ["effects/model.py", "driving/episode.py", "driving/lane.py"],
    "environments": ["effects/model.py", "environments/family.py"],
}
ONE_OF_EACH = [(family, module) for family, modules in MODULES.items() for module in modules]


def driving_family(folder):
    return LaneFollowing("duckiebot", "planar", "ground_plane", shipped_map("small_loop"), 2.0, 0.01, 2.0, (), folder)


def pendulum(folder):
    pytest.importorskip("gymnasium")
    return gymnasium_family(Section(folder / "study.toml", "domain.", tomllib.loads(PENDULUM)), model=None)


FAMILIES = {"driving": driving_family, "environments": pendulum}
NAMES = {"driving": "e2b6bdcec33bd3df", "environments": "ef20f19774fc9119"}
"""What their identities have been since they were first kept, with the versions that the test states."""


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A copy of our code, to be edited, whose digests are not remembered."""
    for room in {room for rooms in lineage.ROOMS.values() for room in rooms}:
        shutil.copytree(lineage.PACKAGE / room, tmp_path / "package" / room)
    (tmp_path / "study").mkdir()
    monkeypatch.setattr(lineage, "PACKAGE", tmp_path / "package")
    monkeypatch.setattr(lineage, "code_meaning", lineage.code_meaning.__wrapped__)
    return tmp_path / "package"


@pytest.mark.parametrize("family", lineage.ROOMS)
def test_code_that_means_something_else_is_decided_upon(family):
    hint = f"all episodes proven the same? then append it to '{family}' in proxytune/lineage.toml, else see lineage.py"
    code = lineage.code_meaning(family)
    assert code in lineage.SAME_CODE[family], f"code of {family} means {code}; {hint}"


@pytest.mark.parametrize("name", ENGINE_NAMES)
def test_code_that_proposes_is_decided_upon(name):
    code = code_of(AfterDesign.__module__, engine_of(name).make.__module__)
    entry = f"engine {name}"
    assert code in lineage.SAME_CODE[entry], f"append {code} to SAME_CODE['{entry}'] if all proposals are the same"
    assert engine_code(name) == lineage.SAME_CODE[entry][0]


@pytest.mark.parametrize("learner", [BehaviourCloning, RandomFeatures])
def test_code_that_learns_is_decided_upon(learner, monkeypatch):
    codes, entry = [], f"learner {learner.__module__}"
    monkeypatch.setattr("proxytune.learning.lessons.named", lambda _, code: codes.append(code) or code)
    learner_identity(learner())
    assert codes[0] in lineage.SAME_CODE[entry], f"append {codes[0]} to SAME_CODE['{entry}'] if it learns the same"


@pytest.mark.parametrize(("family", "module"), ONE_OF_EACH)
def test_a_changed_comment_in_our_code_leaves_the_identity_and_a_changed_line_not(package, family, module, tmp_path):
    kin, path = FAMILIES[family](tmp_path / "study"), package / module
    before = kin.identity
    path.write_text(f"# a comment\n{path.read_text()}")
    assert kin.identity == before
    path.write_text(f"{path.read_text()}\nMORE = 1\n")
    assert kin.identity != before


@pytest.mark.parametrize("family", FAMILIES)
def test_a_family_keeps_the_name_it_had_since_no_class_of_its_settings_was_renamed(family, tmp_path, monkeypatch):
    monkeypatch.setattr("proxytune.driving.family.versions_of", lambda names: dict.fromkeys(names, "1.0"))
    kin = FAMILIES[family](tmp_path)
    if family == "environments":
        kin = replace(kin, spaces=replace(kin.spaces, packages=(("numpy", "1.0"),)))
    assert kin.identity == NAMES[family]


@pytest.mark.parametrize("family", FAMILIES)
def test_code_that_is_proven_to_play_the_same_episodes_keeps_their_identity(package, family, tmp_path, monkeypatch):
    kin = FAMILIES[family](tmp_path / "study")
    before = kin.identity
    (package / "effects" / "more.py").write_text("MORE = 1\n")
    assert kin.identity != before
    monkeypatch.setitem(lineage.SAME_CODE, family, (*lineage.SAME_CODE[family], lineage.code_meaning(family)))
    assert kin.identity == before


def test_code_of_one_family_is_no_part_of_another_s(package):
    before = lineage.code_name("driving")
    path = package / "environments" / "family.py"
    path.write_text(f"{path.read_text()}\nMORE = 1\n")
    assert lineage.code_name("driving") == before != lineage.code_name("environments")
