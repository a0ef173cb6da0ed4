"""From a URDF of others to a robot that drives."""

import numpy as np
import pytest

from proxytune.driving import BulletPlant, parse_urdf, read_body, read_robot
from proxytune.driving.plants import check_body
from proxytune.errors import InputError
from proxytune.skeletons import robot_from_urdf, robot_skeleton

OTHERS = """<robot name="turtle">
  <link name="base_footprint"/>
  <link name="base_link">
    <inertial><origin xyz="-0.02 0 0.03"/><mass value="0.8"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial>
    <visual><geometry><mesh filename="package://turtle/base.stl"/></geometry></visual>
    <collision><origin xyz="-0.03 0 0.07"/><geometry><box size="0.14 0.1 0.1"/></geometry></collision>
  </link>
  <joint name="base_joint" type="fixed">
    <parent link="base_footprint"/><child link="base_link"/><origin xyz="0 0 0.01"/>
  </joint>
  {wheels}
  <link name="caster"><inertial><mass value="0.01"/>
      <inertia ixx="1e-6" ixy="0" ixz="0" iyy="1e-6" iyz="0" izz="1e-6"/></inertial>
    <collision><geometry><sphere radius="0.01"/></geometry></collision></link>
  <joint name="caster_joint" type="fixed">
    <parent link="base_link"/><child link="caster"/><origin xyz="-0.08 0 0"/></joint>
  <link name="camera_link"/>
  <joint name="camera_joint" type="fixed">
    <parent link="base_link"/><child link="camera_link"/><origin xyz="0.07 0 0.1" rpy="0 0.5236 0"/></joint>
</robot>
"""
WHEEL = """<link name="wheel_{side}"><inertial><mass value="0.05"/>
      <inertia ixx="2e-5" ixy="0" ixz="0" iyy="3e-5" iyz="0" izz="2e-5"/></inertial>
    <collision><geometry>{shape}</geometry></collision></link>
  <joint name="wheel_{side}_joint" type="continuous">
    <parent link="base_link"/><child link="wheel_{side}"/>
    <origin xyz="0.01 {left} 0.023" rpy="-1.5707963 0 0"/><axis xyz="0 0 {up}"/></joint>"""


def urdf(folder, shape='<cylinder radius="0.033" length="0.018"/>', up=1):
    wheels = (WHEEL.format(side=s, left=y, shape=shape, up=up) for s, y in (("left", 0.08), ("right", -0.08)))
    path = folder / "turtle.urdf"
    path.write_text(OTHERS.format(wheels="".join(wheels)))
    return path


def write(folder, skeleton):
    (folder / "rover").mkdir()
    for name, text in skeleton.files.items():
        (folder / "rover" / name).write_text(text, encoding="utf-8")
    return read_robot("rover", folder)


@pytest.mark.parametrize("up", [1, -1])
def test_wheels_mass_and_camera_are_read_and_the_bullet_plant_drives_it_ahead(tmp_path, up):
    robot = write(tmp_path, robot_from_urdf("rover", urdf(tmp_path, up=up), {"full_speed": 0.4}))
    check_body(robot)
    wanted = {"wheel_radius": 0.033, "wheel_distance": 0.16, "mass": 0.91, "full_speed": 0.4, "camera_pitch": 30.0}
    assert {name: robot.figures[name] for name in wanted} == pytest.approx(wanted, rel=1e-4)
    assert (robot.figures["camera_forward"], robot.figures["camera_height"]) == pytest.approx((0.06, 0.11))
    with BulletPlant(robot, (0.0, 0.0, 0.0), 1.0 / 60.0) as plant:
        poses, crashed = plant.move(np.tile((0.2, 0.0, 0.0), (120, 1)))
    assert not crashed
    assert poses[-1, 0] == pytest.approx(0.4, abs=0.02)


def test_what_was_read_is_said_and_what_a_urdf_cannot_know_is_to_be_edited(tmp_path):
    lines = robot_from_urdf("rover", urdf(tmp_path), {"full_speed": 0.4}).files["robot.toml"].splitlines()
    figures = {line.split(" = ")[0]: line for line in lines if " = { value" in line}
    assert "read from turtle.urdf" in figures["wheel_radius"]
    assert "given to" in figures["full_speed"]
    assert not [n for n in ("wheel_radius", "wheel_distance", "mass", "camera_height") if "EDIT" in figures[n]]
    assert "# EDIT" in figures["motor_time_constant"]
    notes = robot_from_urdf("rover", urdf(tmp_path), {}).notes
    assert notes[0].startswith("read from turtle.urdf: wheel_radius 0.033, wheel_distance 0.16, mass 0.91")
    for said in ("wheel_left_joint is now called axle_left", "moved by 0.01 0 -0.01 m", "1 meshes of its looks"):
        assert any(said in note for note in notes), said


def test_the_origin_is_the_middle_of_the_axle_on_the_floor(tmp_path):
    robot = write(tmp_path, robot_from_urdf("rover", urdf(tmp_path), {}))
    assert read_body(parse_urdf(robot.urdf), robot.urdf).left.centre == pytest.approx((0.0, 0.08, 0.033))


def test_wheels_that_are_meshes_need_their_radius_and_two_no_car_and_a_link_may_have_a_quote(tmp_path):
    path = urdf(tmp_path, shape='<mesh filename="wheel.stl"/>')
    with pytest.raises(InputError, match="its wheels are meshes; state their radius: --figures wheel_radius=METRES"):
        robot_from_urdf("rover", path, {})
    described = robot_from_urdf("rover", path, {"wheel_radius": 0.04}).files["robot.toml"]
    assert "wheel_radius = { value = 0.04," in described
    with pytest.raises(InputError, match="a car needs two joints that steer, found none; call them steer_left and"):
        robot_from_urdf("mine", urdf(tmp_path), {}, "ackermann")
    path = urdf(tmp_path)
    path.write_text(path.read_text().replace('"wheel_left"', '"wheel\'s left"'))
    assert read_body(parse_urdf(path), path).left.radius_m == 0.033
    assert "wheel's left" in robot_from_urdf("rover", path, {}).files["rover.urdf"]


def test_what_is_stated_goes_before_the_urdf_save_for_the_wheels(tmp_path):
    stated = {"mass": 2.5, "camera_pitch": 10.0, "wheel_radius": 0.05, "wheel_distance": 0.3}
    skeleton = robot_from_urdf("rover", urdf(tmp_path), stated)
    robot = write(tmp_path, skeleton)
    wanted = {"mass": 2.5, "camera_pitch": 10.0, "wheel_radius": 0.033, "wheel_distance": 0.16, "camera_height": 0.11}
    assert {name: robot.figures[name] for name in wanted} == pytest.approx(wanted)
    sources = {line.split(" = ")[0]: line for line in skeleton.files["robot.toml"].splitlines() if " = { value" in line}
    assert "given to" in sources["mass"]
    assert "read from turtle.urdf" in sources["wheel_radius"]
    assert "mass" not in skeleton.notes[0]


@pytest.mark.parametrize("number", ["-0.02 0 0.03", "-0.03 0 0.07", "0 0 0.01"])
@pytest.mark.parametrize("wrong", ["a b c", "1 2"])
def test_a_number_that_is_none_is_one_line(tmp_path, number, wrong):
    path = urdf(tmp_path)
    text = path.read_text()
    assert f'xyz="{number}"' in text
    path.write_text(text.replace(f'xyz="{number}"', f'xyz="{wrong}"'))
    with pytest.raises(InputError, match="turtle.urdf: is no sound URDF .*; correct it"):
        robot_from_urdf("rover", path, {})


def test_the_joints_of_a_car_are_found_and_named_and_its_wheelbase_is_read(tmp_path):
    text = robot_skeleton("other", {"wheelbase": 0.31, "wheel_distance": 0.2}, "ackermann").files["other.urdf"]
    for name, other in {"axle": "rear_wheel_joint", "steer": "hinge", "hub": "front_wheel_joint"}.items():
        text = text.replace(f'joint name="{name}_', f'joint name="{other}_')
    (tmp_path / "other.urdf").write_text(text, encoding="utf-8")
    skeleton = robot_from_urdf("rover", tmp_path / "other.urdf", {}, "ackermann")
    robot = write(tmp_path, skeleton)
    check_body(robot)
    assert robot.figures["wheelbase"] == pytest.approx(0.31)
    assert "joint hinge_left is now called steer_left" in skeleton.notes
