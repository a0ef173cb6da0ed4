"""A robot's figures are complete, sourced, and the same in robot.toml and URDF."""

import math
import xml.etree.ElementTree as ET

import pytest

from proxytune.driving import robot as module
from proxytune.driving.robot import UNITS, read_robot, robot_names
from proxytune.errors import SettingsError
from proxytune.settings import read_settings
from proxytune.shipped import shipped

ROBOT = read_robot("duckiebot")
BODY = ET.parse(ROBOT.urdf).getroot()


def origin(joint):
    return [float(v) for v in BODY.find(f"joint[@name='{joint}']/origin").get("xyz").split()]


def test_the_duckiebot_is_listed():
    assert "duckiebot" in robot_names()


def test_every_figure_has_a_source():
    figures = read_settings(shipped("robots") / "duckiebot" / "robot.toml").values["figures"]
    assert set(figures) == set(UNITS)
    assert all(figure["source"] for figure in figures.values())


def test_masses_of_the_body_add_up_to_the_robots():
    masses = [float(mass.get("value")) for mass in BODY.iter("mass")]
    assert sum(masses) == pytest.approx(ROBOT.figures["mass"], abs=1e-9)


def test_wheels_of_the_body_lie_where_the_figures_say():
    left, right = origin("axle_left"), origin("axle_right")
    assert left[1] - right[1] == pytest.approx(ROBOT.figures["wheel_distance"])
    assert left[2] == pytest.approx(ROBOT.figures["wheel_radius"])
    assert left[0] == right[0] == 0.0


def test_the_camera_of_the_body_is_where_the_figures_say():
    x, y, z = origin("camera_mount")
    assert (x, y, z) == (ROBOT.figures["camera_forward"], 0.0, ROBOT.figures["camera_height"])
    pitch = BODY.find("joint[@name='camera_mount']/origin").get("rpy").split()[1]
    assert float(pitch) == pytest.approx(math.radians(ROBOT.figures["camera_pitch"]), abs=1e-6)


def test_wheel_torque_of_the_body_is_the_figures():
    efforts = {float(limit.get("effort")) for limit in BODY.iter("limit")}
    assert efforts == {ROBOT.figures["wheel_torque"]}


def test_every_link_has_inertia():
    assert all(link.find("inertial/inertia") is not None for link in BODY.iter("link"))


def test_nominal_effects_agree_with_the_figures():
    assert ROBOT.theta["motor_lag"] == ROBOT.figures["motor_time_constant"]
    assert ROBOT.theta["camera_pitch"] == ROBOT.figures["camera_pitch"]


def test_an_unknown_robot_is_told_with_the_nearest():
    with pytest.raises(SettingsError, match="robot 'duckybot' is unknown; did you mean 'duckiebot'"):
        read_robot("duckybot")


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ('unit = "kg"', 'unit = "g"', "figures.mass.unit: unknown value 'g'"),
        ("mass = {", "masss = {", "figures.masss: unknown key; did you mean 'mass'?"),
        ('urdf = "duckiebot.urdf"', 'urdf = "gone.urdf"', "urdf: no such file: gone.urdf"),
        ("value = 1.05", "value = nan", "figures.mass.value: must be finite"),
    ],
)
def test_a_mistake_in_robot_toml_is_one_line(tmp_path, monkeypatch, before, after, says):
    source = shipped("robots") / "duckiebot"
    home = tmp_path / "duckiebot"
    home.mkdir()
    (home / "duckiebot.urdf").write_bytes((source / "duckiebot.urdf").read_bytes())
    text = (source / "robot.toml").read_text(encoding="utf-8")
    assert before in text
    (home / "robot.toml").write_text(text.replace(before, after, 1), encoding="utf-8")
    monkeypatch.setattr(module, "shipped", lambda kind: tmp_path)
    with pytest.raises(SettingsError) as caught:
        read_robot.__wrapped__("duckiebot")
    assert says in str(caught.value)
