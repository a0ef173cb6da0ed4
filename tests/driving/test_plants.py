"""What a URDF says of its wheels, and that the bullet plant does not drive one that says otherwise than robot.toml."""

import math
import os
import shutil
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest
from one_line import complaint_of

from proxytune.driving import lane_following, parse_urdf, read_body, read_robot, robot_names
from proxytune.driving.plants import check_body
from proxytune.errors import SettingsError
from proxytune.files import shipped
from proxytune.settings import Section

ROBOT = read_robot("duckiebot")
TEXT = ROBOT.urdf.read_text(encoding="utf-8")


def body_of(text):
    return read_body(ET.fromstring(text), Path("robot.urdf"))


def test_the_duckiebots_wheels_mass_and_camera_are_read():
    body = body_of(TEXT)
    assert (body.left.joint, body.right.joint) == ("axle_left", "axle_right")
    assert (body.left.radius_m, body.wheel_distance) == pytest.approx((0.0318, 0.1))
    assert body.left.effort == 0.08
    assert body.mass_kg == pytest.approx(ROBOT.figures["mass"])
    assert body.camera[:3, 3] == pytest.approx((0.066, 0.0, 0.108))
    assert math.degrees(math.asin(-body.camera[2, 0])) == pytest.approx(ROBOT.figures["camera_pitch"], abs=1e-4)


def test_wheels_are_read_turned_fixed_and_by_their_names_where_there_are_more():
    turned = TEXT.replace('xyz="0 0.05 0.0318"', 'xyz="0 0.05 0.0318" rpy="-1.5707963 0 0"')
    turned = turned.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 0 1"/>', 1)
    assert body_of(turned).left.axis == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)
    third = '<link name="w"/><joint name="rear" type="continuous"><parent link="chassis"/><child link="w"/>'
    third += '<axis xyz="0 1 0"/></joint></robot>'
    assert body_of(TEXT.replace("</robot>", third)).left.joint == "axle_left"
    unnamed = TEXT.replace("axle_", "wheel_joint_").replace("</robot>", third)
    with pytest.raises(SettingsError, match="found wheel_joint_left, wheel_joint_right, rear; call the two driven"):
        body_of(unnamed)


BAD = {
    "no file": (None, "cannot be read"),
    "no XML": ("robot", "is not XML"),
    "no URDF": ("<sdf/>", "is no URDF: it needs <robot> with links; got <sdf>"),
}


@pytest.mark.parametrize(("text", "expected"), BAD.values(), ids=BAD)
def test_what_is_no_urdf_is_refused_in_a_line(tmp_path, text, expected):
    path = tmp_path / "robot.urdf"
    if text is not None:
        path.write_text(text)
    assert expected in complaint_of(parse_urdf, path)


def test_a_robot_with_words_for_numbers_or_without_its_mesh_is_refused(tmp_path):
    with pytest.raises(SettingsError, match="is no sound URDF .*'wide'"):
        body_of(TEXT.replace("0 0.05 0.0318", "0 wide 0.0318"))
    path = tmp_path / "robot.urdf"
    mesh = '<collision><geometry><mesh filename="m.stl"/></geometry></collision>'
    path.write_text(TEXT.replace("</link>", f"{mesh}</link>", 1))
    with pytest.raises(SettingsError, match=r"names m.stl, which is not there; add it beside the URDF"):
        check_body(replace(ROBOT, urdf=path))


CHANGES = {
    "another radius": ("0.0318", "0.04", r"has the wheel_radius 0.04 m, robot.toml says 0.0318 m; correct the one"),
    "another distance": ("0 0.05 0.0318", "0 0.06 0.0318", "has the wheel_distance 0.11 m, robot.toml says 0.1 m"),
    "another name": ("axle_left", "left_wheel_joint", "found left_wheel_joint, axle_right|must be called axle_left"),
    "an axle to the right": ('<axis xyz="0 1 0"/>', '<axis xyz="0 -1 0"/>', "its axis must point to the left"),
}


@pytest.mark.parametrize(("before", "after", "expected"), CHANGES.values(), ids=CHANGES)
def test_a_urdf_that_disagrees_with_robot_toml_is_refused(write_file, before, after, expected):
    path = write_file(TEXT.replace(before, after), "robot.urdf")
    with pytest.raises(SettingsError, match=expected):
        check_body(replace(ROBOT, urdf=path))


@pytest.mark.parametrize("named", ["pipe.stl", "package://robots/pipe.stl", "shape.obj"])
def test_what_a_urdf_names_must_be_a_file(tmp_path, named):
    path, pipe = tmp_path / "robot.urdf", tmp_path / ("shape.mtl" if named == "shape.obj" else "pipe.stl")
    (tmp_path / "robots").mkdir()
    os.mkfifo(pipe)
    os.mkfifo(tmp_path / "robots" / "pipe.stl")
    (tmp_path / "shape.obj").write_text("mtllib shape.mtl\nv 0 0 0\n")
    mesh = f'<visual><geometry><mesh filename="{named}"/></geometry></visual>'
    path.write_text(TEXT.replace("</link>", f"{mesh}</link>", 1))
    with pytest.raises(SettingsError, match=r"robot.urdf: names .*which is a folder, a device or a pipe"):
        check_body(replace(ROBOT, urdf=path))


def test_a_study_of_such_a_robot_is_refused_before_the_first_episode(tmp_path):
    shutil.copytree(shipped("robots") / "duckiebot", tmp_path / "mine")
    described = tmp_path / "mine" / "robot.toml"
    text = described.read_text().replace('"duckiebot"', '"mine"')
    described.write_text(text.replace("value = 0.0318", "value = 0.05"))
    section = Section(tmp_path / "study.toml", "domain.", {"robot": "mine"})
    with pytest.raises(SettingsError, match=r"domain.robot: duckiebot.urdf: has the wheel_radius"):
        lane_following(section, model=None)
    planar = Section(tmp_path / "study.toml", "domain.", {"robot": "mine", "plant": "planar"})
    assert lane_following(planar, model=None).plant == "planar"


def test_a_robot_beside_the_studys_folder_is_its_robot_too(tmp_path):
    shutil.copytree(shipped("robots") / "husky", tmp_path / "mine")
    described = tmp_path / "mine" / "robot.toml"
    described.write_text(described.read_text().replace('"husky"', '"mine"'))
    (tmp_path / "study").mkdir()
    assert "mine" in robot_names(tmp_path / "study")
    assert read_robot("mine", tmp_path / "study").figures["wheel_radius"] == 0.165
