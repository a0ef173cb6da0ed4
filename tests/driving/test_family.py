"""Under which name episodes of driving are kept, and that the mounted camera is the robot's but for its effects."""

import shutil
from pathlib import Path

import pytest

from proxytune.driving import LaneFollowing, mounted_camera, read_robot, robot_from_geometry, shipped_map
from proxytune.driving.family import robot_meaning
from proxytune.effects import effects_from
from proxytune.errors import SettingsError
from proxytune.files import shipped


def family(folder, plant="planar", camera="ground_plane"):
    road, effects = shipped_map("small_loop"), (("trim.trim", 0.1),)
    return LaneFollowing("duckiebot", plant, camera, road, 2.0, 0.01, 2.0, effects, folder)


def test_a_robot_counts_by_what_its_files_mean(tmp_path):
    shutil.copytree(shipped("robots") / "duckiebot", tmp_path / "duckiebot")
    described = tmp_path / "duckiebot" / "robot.toml"
    before, text = family(tmp_path).identity, described.read_text()
    described.write_text(f"# a comment\n{text}")
    robot_meaning.cache_clear()
    assert family(tmp_path).identity == before
    described.write_text(text.replace("0.0318", "0.0319", 1))
    robot_meaning.cache_clear()
    assert family(tmp_path).identity != before


def test_a_user_s_modules_count_by_their_meaning_in_packages_too_wherever_the_study_lies(tmp_path):
    (tmp_path / "pack").mkdir()
    path = tmp_path / "pack" / "mine.py"
    path.write_text("x = 1\n")
    before = family(tmp_path).identity
    path.write_text('"""Mine."""\n\nx = 1  # one\n')
    assert family(tmp_path).identity == before
    path.write_text("x = 2\n")
    assert family(tmp_path).identity != before
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        Path(tmp_path / name / "mine.py").write_text("x = 1\n")
    assert family(tmp_path / "a").identity == family(tmp_path / "b").identity


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


ROBOT = read_robot("duckiebot")
NOMINAL = ROBOT.camera_figures()


def mounted(theta):
    return mounted_camera(ROBOT, effects_from(theta, ROBOT.figures))


def test_a_camera_is_nominal_without_effects_and_refused_where_there_is_none_or_none_can_be():
    assert mounted({}) == NOMINAL
    assert mounted({"trim": 0.1, "blur": 0.05, "camera_latency": 0.1}) == NOMINAL
    geometry = {"wheel_radius": 0.03, "effective_baseline": 0.16, "full_speed": 0.6}
    with pytest.raises(SettingsError, match="camera"):
        mounted_camera(robot_from_geometry("cart", geometry, 20.0), ())
    with pytest.raises(SettingsError, match="height_m must be above 0 m"):
        mounted_camera(ROBOT, [_Sunk()])


class _Sunk:
    """A user's own effect that puts the lens beneath the floor."""

    name, stage = "sunk", next(iter(effects_from({"camera_pitch": 1.0}, ROBOT.figures))).stage

    def begin(self, setting):
        """Nothing to remember."""

    def apply(self, signal, memory):
        return signal * 0.0 - 1.0, None
