"""Under which name episodes are kept: what changes it, what does not, and that studies of earlier code go on.

A mounted camera is the robot's nominal one but for the figures that camera effects set.
"""

import shutil
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from proxytune.driving import (
    LaneFollowing,
    family as identity,
    lineage,
    mounted_camera,
    read_robot,
    robot_from_geometry,
    robot_home,
    shipped_map,
)
from proxytune.effects import effects_from
from proxytune.errors import SettingsError
from proxytune.files import shipped

OF_THEN = {
    ("planar", ""): "9e04143f2c12f033",
    ("planar", "x = 1\n"): "5fc0d658a4944099",
}
"""What commit 54760ad said, by plant and the text of the user's module."""


def family(folder, plant="planar", camera="ground_plane"):
    return LaneFollowing(
        "duckiebot", plant, camera, shipped_map("small_loop"), 2.0, 0.01, 2.0, (("trim.trim", 0.1),), folder
    )


@pytest.fixture
def fresh():
    """Forget what is cached of code and robots, before and after."""
    kept = (identity.code_meaning, identity.robot_meaning)
    for cached in kept:
        cached.cache_clear()
    yield
    for cached in kept:
        cached.cache_clear()


def test_code_that_means_something_else_is_decided_upon():
    hint = "all episodes proven the same? then append it to SAME_CODE in driving/lineage.py, else see there"
    assert identity.code_meaning() in lineage.SAME_CODE, f"code means {identity.code_meaning()}; {hint}"


@pytest.mark.parametrize(("plant", "module"), OF_THEN)
def test_an_earlier_identity_is_what_the_code_of_then_said(tmp_path, plant, module):
    if module:
        (tmp_path / "mine.py").write_text(module)
    assert family(tmp_path, plant).earlier_identities == (OF_THEN[plant, module],)


def test_earlier_episodes_count_only_while_code_and_robot_mean_what_they_did(tmp_path, monkeypatch, fresh):
    shutil.copytree(shipped("robots") / "duckiebot", tmp_path / "duckiebot")
    described = tmp_path / "duckiebot" / "robot.toml"
    text = described.read_text()
    described.write_text(f"# a comment\n{text}")
    assert len(family(tmp_path).earlier_identities) == 1
    identity.robot_meaning.cache_clear()
    described.write_text(text.replace("0.0318", "0.0319", 1))
    assert family(tmp_path).earlier_identities == ()
    identity.robot_meaning.cache_clear()
    described.write_text(text)
    monkeypatch.setattr(lineage, "SAME_CODE", ("other code",))
    assert family(tmp_path).earlier_identities == ()


def test_every_robot_that_travels_has_an_earlier_identity(tmp_path):
    assert {path.parent.name for path in shipped("robots").glob("*/robot.toml")} >= set(lineage.OF_54760AD)
    code = identity.code_meaning()
    digests = [lineage.digest_of_54760ad(r, identity.robot_meaning(robot_home(r)), code) for r in lineage.OF_54760AD]
    assert None not in digests
    assert lineage.digest_of_54760ad("another robot", "", identity.code_meaning()) is None


@pytest.fixture
def package(tmp_path, monkeypatch, fresh):
    """A copy of our code, to be edited."""
    for room in ("effects", "driving"):
        shutil.copytree(identity.PACKAGE / room, tmp_path / "package" / room)
    monkeypatch.setattr(identity, "PACKAGE", tmp_path / "package")
    monkeypatch.setattr(lineage, "__file__", str(tmp_path / "package" / "driving" / "lineage.py"))
    return tmp_path / "package"


@pytest.mark.parametrize("module", ["effects/chain.py", "driving/task.py", "driving/road/lane.py"])
def test_a_changed_comment_in_our_code_leaves_the_identity_and_a_changed_line_does_not(package, module, tmp_path):
    before, path = family(tmp_path / "study").identity, package / module
    path.write_text(f"# a comment\n{path.read_text()}")
    identity.code_meaning.cache_clear()
    assert family(tmp_path / "study").identity == before
    path.write_text(f"{path.read_text()}\nMORE = 1\n")
    identity.code_meaning.cache_clear()
    assert family(tmp_path / "study").identity != before


def test_what_is_said_of_earlier_code_is_no_part_of_the_code(package):
    before = identity.code_meaning()
    (package / "driving" / "lineage.py").write_text("SAME_CODE = ()\n")
    identity.code_meaning.cache_clear()
    assert identity.code_meaning() == before


def test_code_that_is_proven_to_drive_the_same_episodes_keeps_their_identity(package, tmp_path, monkeypatch):
    before = family(tmp_path / "study").identity
    (package / "effects" / "more.py").write_text("MORE = 1\n")
    identity.code_meaning.cache_clear()
    assert family(tmp_path / "study").identity != before
    monkeypatch.setattr(lineage, "SAME_CODE", (*lineage.SAME_CODE, identity.code_meaning()))
    assert family(tmp_path / "study").identity == before


def test_a_user_s_modules_count_by_their_meaning_in_packages_too(tmp_path):
    (tmp_path / "pack").mkdir()
    path = tmp_path / "pack" / "mine.py"
    path.write_text("x = 1\n")
    before = family(tmp_path).identity
    path.write_text('"""Mine."""\n\nx = 1  # one\n')
    assert family(tmp_path).identity == before
    path.write_text("x = 2\n")
    assert family(tmp_path).identity != before


@pytest.mark.parametrize(
    ("plant", "camera", "packages"),
    [
        ("planar", "ground_plane", {"numpy"}),
        ("planar", "renderer", {"numpy", "pybullet"}),
        ("bullet", "ground_plane", {"numpy", "pybullet"}),
    ],
)
def test_the_versions_of_what_simulates_count(tmp_path, monkeypatch, plant, camera, packages):
    domain = family(tmp_path, plant, camera)
    assert set(domain.versions) == packages
    before, installed = domain.identity, dict(domain.versions)
    for package in ("numpy", "pybullet"):
        other = {**installed, package: "0.0"}
        monkeypatch.setattr("proxytune.driving.family.versions_of", lambda names, o=other: {n: o[n] for n in names})
        assert (domain.identity != before) == (package in packages)


def test_an_identity_does_not_depend_on_where_the_study_lies(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        Path(tmp_path / name / "mine.py").write_text("x = 1\n")
    assert family(tmp_path / "a").identity == family(tmp_path / "b").identity


ROBOT = read_robot("duckiebot")
NOMINAL = ROBOT.camera_figures()


def mounted(theta):
    return mounted_camera(ROBOT, effects_from(theta, ROBOT.figures))


def test_without_effects_the_camera_is_nominal():
    assert mounted({}) == NOMINAL


@given(st.floats(0.0, 45.0), st.floats(-10.0, 10.0), st.floats(-0.4, 0.2))
def test_each_camera_effect_sets_its_figure_alone(pitch, roll, k1):
    camera = mounted({"camera_pitch": pitch, "camera_roll": roll, "lens_distortion": k1})
    changed = {name for name in vars(camera) if getattr(camera, name) != getattr(NOMINAL, name)}
    assert (camera.pitch_deg, camera.roll_deg, camera.k1) == (pitch, roll, k1)
    assert changed <= {"pitch_deg", "roll_deg", "k1"}


def test_effects_on_motion_and_on_pictures_leave_it_alone():
    assert mounted({"trim": 0.1, "blur": 0.05, "camera_latency": 0.1}) == NOMINAL


def test_a_robot_without_a_camera_is_refused():
    geometry = {"wheel_radius": 0.03, "effective_baseline": 0.16, "full_speed": 0.6}
    with pytest.raises(SettingsError, match="camera"):
        mounted_camera(robot_from_geometry("cart", geometry, 20.0), ())


def test_figures_that_no_camera_can_have_are_refused():
    with pytest.raises(SettingsError, match="height_m must be above 0 m"):
        mounted_camera(ROBOT, [_Sunk()])


class _Sunk:
    """A user's own effect that puts the lens beneath the floor."""

    name, stage = "sunk", next(iter(effects_from({"camera_pitch": 1.0}, ROBOT.figures))).stage

    def begin(self, setting):
        """Nothing to remember."""

    def apply(self, signal, memory):
        return signal * 0.0 - 1.0, None
