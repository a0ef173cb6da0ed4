"""A user's own URDF, SDF or MuJoCo model, patched, with the filter before it, moves as the model that was found."""

import re
import shlex
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from export_truth import driven_by, instance
from one_line import complaint_of
from own_models import FILES, MJCF, SDF, URDF
from ros_stubs import Ackermann, Stamped, Twist, load_node

from proxytune import CommandFilter, export
from proxytune.cli.main import main
from proxytune.driving import drivetrain, link_pose, parse_urdf, read_robot, robot_home, rotation
from proxytune.driving.plants import PlanarPlant
from proxytune.effects import FilterContext, Model, effects_from, model_text
from proxytune.identity import modules_beside
from proxytune.report.export.instance import IN_WHEELS
from proxytune.report.export.into import patch
from proxytune.report.export.urdf import angles_of
from proxytune.report.export.xml_patch import XmlPatch

HZ = 60.0
PAGE = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "exporting.md"
TWISTS = np.repeat([[0.3, 0.0], [0.25, 1.2], [0.4, -0.6], [-0.15, 0.8]], 90, axis=0)
FOUND = {
    "trim": 0.08,
    "wheel_gain.left": 0.93,
    "yaw_scrub": 0.2,
    "dead_band.width": 0.08,
    "turn_slip": 0.12,
    "delay": 0.2,
    "delay_jitter": 0.05,
    "saturation.limit": 0.7,
    "camera_pitch": 25.0,
    "field_of_view": 80.0,
}
BODY = """<robot name="mine">
  <mujoco><compiler discardvisual="true" fusestatic="false"/></mujoco>
  <link name="base_footprint">
    <inertial><mass value="0.001"/><inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="base_link">
    <inertial><origin xyz="-0.02 0 0.07"/><mass value="0.9"/>
      <inertia ixx="1e-3" iyy="2e-3" izz="2.7e-3" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision name="skid"><origin xyz="-0.07 0 0.01"/><geometry><sphere radius="0.01"/></geometry></collision></link>
  <joint name="foot" type="fixed"><parent link="base_footprint"/><child link="base_link"/></joint>
  <link name="wheel_a">
    <inertial><mass value="0.05"/><inertia ixx="2e-5" iyy="2e-5" izz="2e-5" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><sphere radius="0.0318"/></geometry></collision></link>
  <link name="wheel_b">
    <inertial><mass value="0.05"/><inertia ixx="2e-5" iyy="2e-5" izz="2e-5" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><sphere radius="0.0318"/></geometry></collision></link>
  <joint name="my_left_joint" type="continuous">
    <parent link="base_link"/><child link="wheel_a"/><origin xyz="0 0.08 0.0318"/><axis xyz="0 1 0"/></joint>
  <joint name="my_right_joint" type="continuous">
    <parent link="base_link"/><child link="wheel_b"/><origin xyz="0 -0.08 0.0318"/><axis xyz="0 1 0"/></joint>
</robot>
"""


@pytest.fixture
def model(write_file):
    return write_file(model_text(Model("duckiebot", None, FOUND, {})), "model.toml")


@pytest.fixture
def patched(model, tmp_path):
    """Writes a model of one's own, and patches it with what was found."""

    def patch(name, text, **more):
        (tmp_path / name).write_text(text)
        return export(model, tmp_path / "out" / name, into=tmp_path / name, **more)

    return patch


def extended(**more):
    """Poses of the model that was found, at each tick."""
    found = instance(**{name.replace(".", "__"): value for name, value in FOUND.items()})
    figures = found.robot.figures
    train = drivetrain(found.robot, effects_from({**found.theta, **more}, figures))
    turn = TWISTS[:, 1] * figures["effective_baseline"] / 2.0
    duties = np.stack((TWISTS[:, 0] - turn, TWISTS[:, 0] + turn), axis=1) / figures["full_speed"]
    twists, _ = train.apply(duties, train.begin(FilterContext(HZ, np.zeros(2), figures)))
    return PlanarPlant(np.zeros(3), 1.0 / HZ).move(twists)[0]


def nominal(twists):
    return PlanarPlant(np.zeros(3), 1.0 / HZ).move(np.array(twists))[0]


def test_the_filter_moves_the_nominal_simulator_and_only_wheels_and_camera_of_a_car_are_patched(model):
    bent = CommandFilter(model, rate_hz=HZ)
    assert nominal([bent.step(one) for one in TWISTS]) == pytest.approx(extended(), abs=1e-9)
    bent = CommandFilter(model, rate_hz=HZ, has=IN_WHEELS)
    asked = np.array([bent.step(one) for one in TWISTS])
    rims = np.stack((asked[:, 0] - 0.08 * asked[:, 2], asked[:, 0] + 0.08 * asked[:, 2]), axis=1)
    rims *= (0.93 * 0.92, 1.08)
    moved = np.stack((rims.mean(axis=1), asked[:, 1], (rims[:, 1] - rims[:, 0]) / 0.2), axis=1)
    assert nominal(moved) == pytest.approx(extended(), abs=1e-9)
    body = read_robot("car").body()
    found = instance(CAR, wheel_gain=0.9, steering_offset=0.1)
    assert "--wheels LEFT,RIGHT of axle_left, steer_left" in complaint_of(patch, found, body, Path("mine.urdf"))
    patched = patch(found, body, Path("mine.urdf"), ("axle_left", "axle_right"))
    assert {"wheel_gain", "yaw_scrub"} & patched.has == {"wheel_gain"}
    assert patched.text.count('radius="0.045"') == 4
    assert patched.text.count('radius="0.05"') == 4


def driven(mujoco, text, commands):
    """Poses of a robot in MuJoCo whose wheels follow the speeds that velocities ask of nominal wheels."""
    simulated = on_a_floor(mujoco, text) if "<robot" in text else mujoco.MjModel.from_xml_string(text)
    forward, _, yaw = np.transpose(commands)
    wheels = np.stack((forward - 0.08 * yaw, forward + 0.08 * yaw), axis=1) / 0.0318
    return driven_by(mujoco, simulated, wheels)


def on_a_floor(mujoco, urdf):
    """A URDF as MuJoCo reads it, set free on a floor, with motors at its wheels: what a user of it adds."""
    spec = mujoco.MjSpec.from_string(urdf)
    spec.option.timestep = 0.0005
    spec.body("base_footprint").add_freejoint()
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[9, 9, 0.1])
    for geom in (one for body in spec.bodies for one in body.geoms if one.name == "skid"):
        geom.condim, geom.priority = 1, 1
    for joint in ("my_left_joint", "my_right_joint"):
        spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT).set_to_velocity(kv=0.05)
    return spec.compile()


@pytest.mark.parametrize(("name", "text"), [("mine.xml", MJCF), ("mine.urdf", BODY)])
def test_a_users_own_model_patched_and_filtered_drives_in_mujoco_as_the_twin_does(model, patched, name, text):
    """The error against the twin is at most 1.5 % of the way, and a twentieth of that of the file as it was."""
    mujoco = pytest.importorskip("mujoco")
    report = patched(name, text)
    bent = CommandFilter(model, rate_hz=HZ, has=report.facts["has"])
    twin = extended()
    way = np.linalg.norm(np.diff(twin[:, :2], axis=0), axis=1).sum()

    def error(poses):
        return np.linalg.norm(poses[:, :2] - twin[:, :2], axis=1).max()

    plain = np.insert(TWISTS, 1, 0.0, axis=1)
    after = error(driven(mujoco, report.output.read_text(), [bent.step(one) for one in TWISTS]))
    before = error(driven(mujoco, text, plain))
    only_filter = CommandFilter(model, rate_hz=HZ)
    filtered = error(driven(mujoco, text, [only_filter.step(one) for one in TWISTS]))
    assert max(after, filtered) < 0.015 * way
    assert before > 20.0 * max(after, filtered)


@pytest.mark.parametrize("name", FILES)
def test_only_wheels_and_camera_of_a_file_change_and_the_diff_shows_them(patched, tmp_path, name):
    report = patched(name, FILES[name])
    before, after = (text.splitlines() for text in (FILES[name], report.output.read_text()))
    changed = [new for old, new in zip(before, after, strict=True) if old != new]
    assert 3 <= len(changed) <= 6
    assert all(f"+{line}" in report.facts["diff"].splitlines() for line in changed)
    assert set(IN_WHEELS) <= set(report.facts["has"])
    left = {line.name: line.place for line in report.lines}
    assert left["dead_band.width"] == left["delay_jitter"] == "the filter"
    assert left["trim"] == "in the file"
    assert (tmp_path / name).read_text() == FILES[name]


def test_a_patched_urdf_or_sdf_has_wheels_and_camera_where_they_were_found(patched):
    root = parse_urdf(patched("mine.urdf", URDF).output)
    left, right, camera = (link_pose(root, name) for name in ("wheel_l", "wheel_r", "camera_link"))
    assert left[1, 3] - right[1, 3] == pytest.approx(0.16 * 0.2 / 0.16)
    radii = [float(one.get("radius")) for one in root.iter("cylinder")]
    assert radii == pytest.approx([0.03 * 0.93 * 0.92, 0.03 * 1.08])
    assert [left[2, 3], right[2, 3]] == pytest.approx(radii)  # both touch the floor
    assert camera[:3, 3] == pytest.approx((0.02 + 0.066, 0.0, 0.108))
    assert np.degrees(np.arcsin(-camera[2, 0])) == pytest.approx(25.0)
    assert root.find("gazebo/plugin/wheel_separation").text == "0.16"
    root = ET.fromstring(patched("mine.sdf", SDF).output.read_text())
    places = [[float(v) for v in root.find(f".//link[@name='{name}']/pose").text.split()] for name in ("lw", "rw")]
    assert places[0][1] - places[1][1] == pytest.approx(0.2)
    radii = [float(one.text) for one in root.iter("radius")]
    assert [place[2] + 0.05 for place in places] == pytest.approx(radii)
    eye = [float(value) for value in root.find(".//sensor/pose").text.split()]
    assert eye == pytest.approx([0.086, 0.0, 0.058, 0.0, np.radians(25.0), 0.0], abs=1e-6)
    vertical = 2.0 * np.arctan(0.75 * np.tan(float(root.find(".//horizontal_fov").text) / 2.0))
    assert np.degrees(vertical) == pytest.approx(80.0)


def test_an_element_without_a_last_tag_gets_its_text_inside_and_a_camera_may_look_straight_down(tmp_path):
    (tmp_path / "a.sdf").write_text('<sdf><pose/><sensor name="eye" /></sdf>')
    xml = XmlPatch(tmp_path / "a.sdf")
    xml.set_text(xml.root.find("pose"), "1 2")
    xml.add(xml.root.find("sensor"), "<pose>3</pose>")
    assert xml.text() == '<sdf><pose>1 2</pose><sensor name="eye"><pose>3</pose></sensor></sdf>'
    for pitch in (-np.pi / 2.0, 0.4, np.pi / 2.0):
        turned = rotation(0.0, 0.3, 1.1) @ rotation(0.0, -0.3, 0.0) @ rotation(0.2, pitch, 0.7)
        np.testing.assert_allclose(rotation(*angles_of(turned)), turned, atol=1e-7)


@pytest.mark.parametrize(
    ("name", "before", "after", "said"),
    [
        ("mine.urdf.xacro", "", "", "run `xacro mine.urdf.xacro > mine.urdf`, patch mine.urdf"),
        ("mine.urdf", "left_wheel_joint", "port", "cannot be told; name their joints: --wheels LEFT,RIGHT of port"),
        ("mine.urdf", "<robot", "<robots", "is not XML"),
        ("mine.urdf", "robot", "rover", "begins with <rover>"),
        ("mine.urdf", 'xyz="0.02 0.08 0"', 'xyz="0.02 x 0"', "not sound"),
        ("mine.urdf", 'xyz="0.02 0.08 0"', 'xyz="0.02 1e999 0"', "not sound"),
        ("mine.sdf", "0.02 -0.08 -0.02 -1.5708", "0.02 -0.08 -0.02\n", "not sound"),
        ("mine.urdf", 'xyz="0.02 0.08 0"', 'xyz="0.02 -0.18 0"', "is not to the left of"),
        ("mine.sdf", 'relative_to="chassis"', 'relative_to="nowhere"', "not sound"),
        ("mine.xml", 'size="0.0318"', "", "states its own size"),
    ],
)
def test_a_file_that_cannot_be_patched_is_one_line_and_nothing_is_written(patched, tmp_path, name, before, after, said):
    assert said in complaint_of(patched, name, FILES.get(name, URDF).replace(before, after))
    assert not (tmp_path / "out").exists()


def test_wheels_may_be_named_and_those_called_l_and_r_are_found(patched):
    patched("mine.urdf", URDF.replace("left_wheel_joint", "port"), wheels=("port", "right_wheel_joint"))

    def renamed(text):
        return text.replace("left_wheel_joint", "wheel_l").replace("right_wheel_joint", "wheel_r")

    short, mine = (patched("mine.urdf", text).output.read_text() for text in (renamed(URDF), URDF))
    assert short == renamed(mine)


def test_what_would_overwrite_or_misread_the_users_own_is_refused(model, tmp_path):
    (tmp_path / "found").mkdir()
    (tmp_path / "found" / "model.toml").write_text(model.read_text())
    (tmp_path / "mine.urdf").write_text(URDF)
    told = complaint_of(export, tmp_path / "found", tmp_path / "out.urdf", into=tmp_path / "mine.urdf")
    assert re.search("is no study's folder; give what was diagnosed, .*found/model.toml", told)
    told = complaint_of(export, model, tmp_path / "mine.urdf", into=tmp_path / "mine.urdf")
    assert "mine.urdf: is read by this command, and would be lost" in told
    assert "model.toml: is read by this command" in complaint_of(lambda: export(model, model, to="ros"))
    assert "--to urf: no such format; did you mean 'urdf'?" in complaint_of(lambda: export(model, "o", to="urf"))
    for to in ("urdf", "optuna"):
        assert "--has: is for --to filter; leave" in complaint_of(export, model, tmp_path / "o", to=to, has=("trim",))
        assert "--wheels: is for --into FILE" in complaint_of(export, model, tmp_path / "o", to=to, wheels="ab")
    assert "--has: is for --to filter" in complaint_of(export, model, tmp_path / "o", into=model, has="trim")
    told = complaint_of(lambda: CommandFilter(model, rate_hz=HZ, has="trimm"))
    told_too = complaint_of(lambda: CommandFilter({"trim": "0.1"}, rate_hz=HZ, figures={}))
    assert told_too == "θ: trim must be a number, got '0.1'"
    assert told == "has=trimm: no such effect; did you mean 'trim'?"
    assert "two finite numbers" in complaint_of(CommandFilter(model, rate_hz=HZ).step, (np.nan, 0.0))


def test_the_files_of_the_robot_are_kept_and_an_earlier_export_beside_them_is_replaced(
    tmp_path, monkeypatch, write_file
):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(robot_home("duckiebot"), tmp_path / "duckiebot")
    model = write_file(model_text(Model("duckiebot", None, FOUND, {})), "model.toml")
    for kept in (tmp_path / "duckiebot" / "robot.toml", read_robot("duckiebot", tmp_path).body()):
        told = complaint_of(export, model, kept, to="urdf")
        assert f"{kept.name}: is read by this command, and would be lost" in told
    for _ in range(2):
        assert "<robot" in export(model, tmp_path / "duckiebot" / "found.urdf", to="urdf").output.read_text()


def test_a_filter_in_a_studys_folder_is_none_of_its_modules(model, tmp_path, write_file):
    before = modules_beside(tmp_path)
    export(model, tmp_path / "bend.py", to="filter")
    car = write_file(model_text(Model("car", None, {"delay": 0.05}, {})), "car.toml")
    export(car, tmp_path / "bend_car.py", to="filter")
    assert modules_beside(tmp_path) == before


@pytest.mark.parametrize("stamped", [False, True])
def test_the_ros_node_tells_what_the_python_class_answers_and_stops_after_silence(
    model, tmp_path, monkeypatch, stamped
):
    path = export(model, tmp_path / "bend.py", to="filter", has=("trim",)).output
    module = load_node(path, monkeypatch, stamped=stamped)
    node, bent = module.CommandVelocityFilter(), CommandFilter(model, rate_hz=HZ, has="trim")
    said = Stamped() if stamped else Twist()
    twist = said.twist if stamped else said
    twist.linear.x, twist.angular.z = 0.3, 0.5
    node.heard(said)
    for _ in range(300):
        node.tick()
    (answers,) = node.told.values()
    told = [one.twist if stamped else one for one in answers]
    expected = [bent.step((0.3, 0.5)) for _ in range(30)]
    assert [(one.linear.x, one.linear.y, one.angular.z) for one in told[:30]] == pytest.approx(np.array(expected))
    assert abs(told[-1].linear.x) < 1e-6
    assert "dead_band.width 0.08 duty: the filter" in path.read_text()


CAR = read_robot("car")
FOUND_OF_CAR = {"dead_band": 0.08, "delay": 0.12, "steering_offset": 0.05, "steering_lag": 0.2, "wheel_gain": 0.9}
DRIVES = np.repeat([[0.5, 0.3], [0.9, -0.2], [0.0, 0.1], [0.7, 0.4]], 60, axis=0)


@pytest.mark.parametrize("command", ["ackermann", "speed_steering", "twist"])
def test_the_filter_moves_a_nominal_car_as_the_one_that_was_found(write_file, command):
    path = write_file(model_text(Model("car", None, FOUND_OF_CAR, {}), (), CAR.catalogue), "model.toml")
    full, lock, wheelbase = 3.0, np.radians(24.0), 0.33
    train = drivetrain(CAR, effects_from({**CAR.theta, **FOUND_OF_CAR}, CAR.figures, CAR.catalogue))
    twists, _ = train.apply(DRIVES / (full, lock), train.begin(FilterContext(HZ, np.zeros(2), CAR.figures)))
    asked = DRIVES / (full, lock) if command == "ackermann" else DRIVES
    if command == "twist":
        asked = np.stack((DRIVES[:, 0], DRIVES[:, 0] * np.tan(DRIVES[:, 1]) / wheelbase), axis=1)
        asked, twists = asked[:120], twists[:120]  # at rest a twist tells no angle
    bent = CommandFilter(path, rate_hz=HZ, command=command, has=("wheel_gain",))
    told = np.array([bent.step(one) for one in asked])
    if command == "ackermann":
        told = told * (full, lock)
    if command != "twist":
        told = np.stack((told[:, 0], 0.0 * told[:, 0], told[:, 0] * np.tan(told[:, 1]) / wheelbase), axis=1)
    assert 0.9 * told == pytest.approx(twists, abs=1e-9)  # the simulator's own wheels are smaller


def test_the_node_of_a_car_hears_and_tells_ackermann_drives(tmp_path, write_file, monkeypatch):
    model = write_file(model_text(Model("dart", None, {"steering_offset": 0.1}, {}), (), CAR.catalogue), "model.toml")
    path = export(model, tmp_path / "bend.py", to="filter").output
    node, said = load_node(path, monkeypatch).AckermannFilter(), Ackermann()
    said.drive.speed, said.drive.steering_angle = 1.0, 0.1
    node.heard(said)
    for _ in range(60):
        node.tick()
    (told,) = node.told.values()
    assert told[9].drive.speed == pytest.approx(1.0)
    assert told[9].drive.steering_angle == pytest.approx(0.1 + 0.1 * np.radians(25.0))
    assert told[-1].drive.speed == pytest.approx(0.0)
    said.drive.speed = -1.0  # a car without reverse stays
    node.heard(said)
    node.tick()
    assert told[-1].drive.speed == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"command": "speed"}, "must be 'twist' or 'duty'"),
        ({"rate_hz": 0.0}, "must be a positive number"),
        ({"has": ("trimm",)}, "did you mean 'trim'"),
    ],
)
def test_a_wrong_argument_of_the_filter_is_one_line(model, arguments, said):
    assert said in complaint_of(CommandFilter, model, **{"rate_hz": HZ, **arguments})


def test_the_python_of_the_page_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(PAGE.read_text(encoding="utf-8").split("```python")[1].split("```")[0], {})


def test_the_command_shows_the_diff_and_how_to_make_the_filter_to_be_pasted_as_it_is(
    model, tmp_path, capsys, refused, monkeypatch
):
    model = model.rename(tmp_path / "the model.toml")
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "60")
    (tmp_path / "mine.urdf").write_text(URDF)
    given = ["export", str(model), "--into", str(tmp_path / "mine.urdf"), "--output", str(tmp_path / "found.urdf")]
    assert main([*given, "--effects", "trim, dead_band"]) == 0
    told = capsys.readouterr().out
    assert """+  <link name="wheel_l"><collision><geometry><cylinder radius="0.02566""" in told
    then = next(line for line in told.splitlines() if "the filter for the rest: " in line)
    words = shlex.split(then.partition("rest: ")[2])
    told = "--effects", "trim, dead_band", "--to", "filter", "--has", "trim,wheel_gain,yaw_scrub", "--output"
    assert words == ["proxytune", "export", str(model), *told, "cmd_vel_filter.py"]
    assert "give either --to FORMAT" in refused(*given, "--to", "urdf")
