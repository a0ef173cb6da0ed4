"""A robot's figures are sourced, enough to drive a log, and the same in robot.toml and URDF."""

import shutil
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from one_line import complaint_of

from proxytune.driving import CAMERA, UNITS, lane_following, read_robot, robot as module, robot_names
from proxytune.driving.bullet import BulletPlant
from proxytune.driving.plants import PlanarPlant, drivetrain
from proxytune.driving.robot import REQUIRED, robot_from_geometry
from proxytune.effects import FilterContext, Stage, effects_from, theta_names
from proxytune.errors import ExtensionError, SettingsError
from proxytune.files import shipped
from proxytune.settings import Section, read_settings

ROBOT = read_robot("duckiebot")
BODY = ET.parse(ROBOT.urdf).getroot()


def stated(name):
    return read_settings(shipped("robots") / name / "robot.toml").values


def twists(robot, duties, **theta):
    train = drivetrain(robot, effects_from({**robot.theta, **theta}, robot.figures))
    return train.apply(duties, train.begin(FilterContext(60.0, np.zeros(2), robot.figures)))[0]


def copy_duckiebot(folder, before, after):
    """The duckiebot's folder within another, with one piece of its robot.toml replaced."""
    source, home = shipped("robots") / "duckiebot", folder / "duckiebot"
    home.mkdir()
    (home / "duckiebot.urdf").write_bytes((source / "duckiebot.urdf").read_bytes())
    text = (source / "robot.toml").read_text(encoding="utf-8")
    assert before in text
    (home / "robot.toml").write_text(text.replace(before, after, 1), encoding="utf-8")
    return home


@pytest.mark.parametrize("name", robot_names())
def test_every_figure_has_a_unit_and_a_source_and_is_not_negative(name):
    figures, required = stated(name)["figures"], REQUIRED[read_robot(name).drive]
    assert set(required) <= set(figures) <= set(UNITS)
    for figure, cell in figures.items():
        assert cell["unit"] == UNITS[figure]
        assert len(cell["source"]) > 10
        assert cell["value"] >= 0
    assert all(figures[figure]["value"] > 0 for figure in required if figure != "motor_time_constant")


@pytest.mark.parametrize("name", robot_names())
def test_a_robot_is_called_as_its_folder_and_described_in_a_line(name):
    robot = read_robot(name)
    assert robot.name == name
    assert robot.description.strip()
    assert "\n" not in robot.description


@pytest.mark.parametrize("name", robot_names())
def test_every_effect_but_the_cameras_has_a_neutral_value_for_every_robot(name):
    robot = read_robot(name)
    figures, effects = robot.figures, robot.catalogue.shipped.values()
    seen = [e for e in effects if e.stage is not Stage.CAMERA or set(CAMERA) <= set(figures)]
    assert len(seen) >= len(effects) - 9
    values = [parameter.neutral_value(figures) for effect in seen for parameter in effect.parameters]
    assert np.isfinite(values).all()


@pytest.mark.parametrize("name", robot_names())
def test_neutral_drivetrain_effects_leave_every_robot_as_it_is(name):
    robot = read_robot(name)
    held = np.tile((0.3, 0.5), (240, 1))
    plain = drivetrain(robot, ())
    stages = (Stage.COMMAND, Stage.ACTUATION, Stage.MOTION)
    kinds = [e for e in robot.catalogue.shipped.values() if e.stage in stages and e.name != "motor_lag"]
    parameters = {n: p for e in kinds for n, p in zip(theta_names(e), e.parameters, strict=True)}
    theta = {name: parameter.neutral_value(robot.figures) for name, parameter in parameters.items()}
    neutral = drivetrain(robot, effects_from(theta, robot.figures, robot.catalogue))
    setting = FilterContext(60.0, np.zeros(2), robot.figures)
    one, other = (train.apply(held, train.begin(setting))[0] for train in (neutral, plain))
    np.testing.assert_allclose(one, other, atol=1e-9)


DIFFERENTIAL = [name for name in robot_names() if read_robot(name).drive == "differential"]


@pytest.mark.parametrize("name", DIFFERENTIAL)
def test_every_robot_drives_straight_at_full_speed_and_turns_by_its_baseline_on_the_planar_plant(name):
    robot = read_robot(name)
    with PlanarPlant(np.array((0.2, -0.1, 0.4)), 1 / 60) as plant:
        straight, _ = plant.move(twists(robot, np.tile((1.0, 1.0), (300, 1))))
        turning, _ = plant.move(twists(robot, np.tile((0.0, 1.0), (300, 1))))
    assert np.hypot(*(straight[-1] - straight[-61])[:2]) == pytest.approx(robot.figures["full_speed"], rel=1e-3)
    rate = robot.figures["full_speed"] / robot.figures["effective_baseline"]
    assert turning[-1, 2] - turning[-61, 2] == pytest.approx(rate, rel=1e-3)


@pytest.mark.parametrize("name", [name for name in robot_names() if "urdf" not in stated(name)])
def test_a_robot_without_body_is_refused_on_bullet_in_one_line(name):
    told = complaint_of(BulletPlant, read_robot(name), np.zeros(3), 1 / 60)
    assert told == f"robot '{name}' has no body: its robot.toml names no urdf; use plant = \"planar\""


@pytest.mark.parametrize("plant", ["bullet", "planar"])
@pytest.mark.parametrize("name", [name for name in robot_names() if "camera_rows" not in stated(name)["figures"]])
def test_a_study_on_a_robot_without_camera_is_refused_before_it_starts(tmp_path, name, plant):
    section = Section(tmp_path / "study.toml", "domain.", {"robot": name, "plant": plant})
    told = complaint_of(lambda: lane_following(section, model=None))
    assert told.startswith(f"{tmp_path / 'study.toml'}: domain.robot: robot '{name}' has no camera: ")
    assert "camera_rate" in told


def test_a_robot_with_camera_but_without_body_may_be_studied_on_the_planar_plant_only(tmp_path, monkeypatch):
    folder = copy_duckiebot(tmp_path, 'urdf = "duckiebot.urdf"\n', "")
    monkeypatch.setattr(module, "shipped", lambda kind: tmp_path)
    bodiless = read_robot.__wrapped__(folder.name)
    monkeypatch.setattr("proxytune.driving.family.read_robot", lambda name, folder: bodiless)
    path = tmp_path / "study.toml"
    assert lane_following(Section(path, "domain.", {"plant": "planar"}), model=None).plant == "planar"
    with pytest.raises(SettingsError, match='domain.robot: robot .duckiebot. has no body: .* use plant = "planar"'):
        lane_following(Section(path, "domain.", {"plant": "bullet"}), model=None)


GEOMETRY = {"wheel_radius": 0.05, "effective_baseline": 0.3, "full_speed": 1.5}


def test_a_robot_is_made_of_what_its_log_says():
    robot = robot_from_geometry("tractor", GEOMETRY, 25.0)
    assert robot.name == "tractor"
    assert dict(robot.figures) == {**GEOMETRY, "motor_time_constant": 0.0, "control_rate": 25.0}
    assert not robot.theta
    np.testing.assert_allclose(twists(robot, np.array([[0.5, 1.0]])), [[1.125, 0.0, 2.5]])
    with pytest.raises(SettingsError, match="robot 'tractor' has no body"):
        robot.body()
    with pytest.raises(SettingsError, match="robot 'tractor' has no camera"):
        robot.camera_figures()


@pytest.mark.parametrize("figure", GEOMETRY)
def test_a_log_that_leaves_out_a_figure_of_its_robot_is_told_which(figure):
    known = {name: value for name, value in GEOMETRY.items() if name != figure}
    with pytest.raises(SettingsError, match=f"robot 'tractor' is unknown and its log states no {figure}; add "):
        robot_from_geometry("tractor", known, 25.0)


def test_links_have_inertia_and_nominal_effects_agree_with_the_figures():
    assert all(link.find("inertial/inertia") is not None for link in BODY.iter("link"))
    lag = next(effect for effect in effects_from(ROBOT.theta, ROBOT.figures) if effect.name == "motor_lag")
    assert lag.time_constant == ROBOT.figures["motor_time_constant"]
    assert ROBOT.theta["camera_pitch"] == ROBOT.figures["camera_pitch"]


def test_the_robots_of_the_package_are_listed_and_one_by_an_unknown_or_another_name_is_refused(tmp_path):
    with pytest.raises(SettingsError, match="robot 'duckybot' is unknown .*; did you mean 'duckiebot'"):
        read_robot("duckybot")
    shutil.copytree(shipped("robots") / "husky", tmp_path / "wolf")
    with pytest.raises(SettingsError, match="name: unknown value 'husky'; known are: wolf"):
        read_robot("wolf", tmp_path)
    assert robot_names() == ("car", "dart", "duckiebot", "husky", "irobot_create")


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ('unit = "kg"', 'unit = "g"', "figures.mass.unit: unknown value 'g'"),
        ("mass = {", "masss = {", "figures.masss: unknown key; did you mean 'mass'?"),
        ("full_speed = {", "# full_speed = {", "figures.full_speed: is missing; add"),
        ('unit = "kg", source = "DB18 with battery, weighed"', 'unit = "kg"', "figures.mass.source: is missing"),
        ("value = 0.0318", "value = 0", "figures.wheel_radius.value: must be between 1e-06"),
        ('urdf = "duckiebot.urdf"', 'urdf = "gone.urdf"', "urdf: no such file: gone.urdf"),
        ('urdf = "duckiebot.urdf"', f'urdf = "{"a" * 300}"', "urdf: no file can have so long a name"),
        ("value = 1.05", "value = nan", "figures.mass.value: must be finite"),
    ],
)
def test_a_mistake_in_robot_toml_is_one_line(tmp_path, monkeypatch, before, after, says):
    copy_duckiebot(tmp_path, before, after)
    monkeypatch.setattr(module, "shipped", lambda kind: tmp_path)
    assert says in complaint_of(read_robot.__wrapped__, "duckiebot")


def test_a_robot_is_examined_only_with_its_wheels_distance_and_a_body_of_its_figures(tmp_path, monkeypatch):
    robot = read_robot("duckiebot")
    assert robot.wheel_distance() == robot.figures["wheel_distance"]
    figures = {name: value for name, value in robot.figures.items() if name != "wheel_distance"}
    with pytest.raises(SettingsError, match="states no wheel_distance; add it"):
        replace(robot, figures=figures).wheel_distance()
    folder = copy_duckiebot(tmp_path, "wheel_torque = {", "# wheel_torque = {")
    monkeypatch.setattr(module, "shipped", lambda kind: tmp_path)
    with pytest.raises(SettingsError, match=r"has no body: its robot.toml states no wheel_torque; use plant"):
        read_robot.__wrapped__(folder.name).body()


def test_a_robot_beside_the_study_comes_before_a_shipped_one(tmp_path):
    for name in ("my_robot", "duckiebot"):
        home = tmp_path / name
        shutil.copytree(shipped("robots") / "duckiebot", home)
        text = (home / "robot.toml").read_text(encoding="utf-8").replace('name = "duckiebot"', f'name = "{name}"')
        (home / "robot.toml").write_text(text.replace("value = 0.0318", "value = 0.04"), encoding="utf-8")
        section = Section(tmp_path / "study.toml", "domain.", {"robot": name, "plant": "planar", "seconds": 1.0})
        family = lane_following(section, model=None)
        assert family.instance({}).robot.figures["wheel_radius"] == 0.04
        assert family.instance({}).robot.urdf == home / "duckiebot.urdf"
    assert read_robot("duckiebot").figures["wheel_radius"] == 0.0318
    assert robot_names(tmp_path) == ("car", "dart", "duckiebot", "husky", "irobot_create", "my_robot")


def test_a_plugin_s_robot_is_read_from_the_folder_that_it_names(tmp_path, monkeypatch):
    info = tmp_path / "wolves-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: wolves\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[proxytune]\nrobot.wolf = wolves_of:HOME\nrobot.fox = wolves_of:FOX\n")
    (tmp_path / "wolves_of.py").write_text("from pathlib import Path\nHOME = Path(__file__).parent / 'wolf'\nFOX = 3\n")
    shutil.copytree(shipped("robots") / "husky", tmp_path / "wolf")
    toml = tmp_path / "wolf" / "robot.toml"
    toml.write_text(toml.read_text(encoding="utf-8").replace('name = "husky"', 'name = "wolf"'), encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert read_robot("wolf").figures == read_robot("husky").figures
    with pytest.raises(ExtensionError, match="robot 'fox': its plug-in must be the path of its folder, got int"):
        read_robot("fox")
