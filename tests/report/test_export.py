"""Exported files drive, look and say as was found."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from export_truth import ROBOT, driven_by, instance

from proxytune.api.exporting import WRITERS
from proxytune.driving import AXLES, drivetrain, orientation, parse_urdf, read_body, read_robot
from proxytune.driving.plants import PlanarPlant
from proxytune.effects import CAR_CATALOGUE, CATALOGUE, FilterContext, effects_from, theta_names
from proxytune.errors import SettingsError
from proxytune.report import FORMATS, export_lines, mjcf_text, ros_text, urdf_text
from proxytune.report.export.instance import PLACES, Instance, place_of

DUTIES = np.repeat([[0.5, 0.5], [0.3, 0.6], [0.9, 0.9], [-0.2, 0.3]], 60, axis=0)
FOUND = {
    "as it is": {},
    "pulls to one side": {"trim": 0.1, "wheel_gain__left": 0.9},
    "late and lazy": {"delay": 0.3, "motor_lag__time_constant": 0.4, "motor_lag__imbalance": 0.3},
    "weak, and turns easily": {"saturation__limit": 0.5, "saturation__imbalance": 0.2, "yaw_scrub": 0.12},
}


CAR = read_robot("car")
HELD = np.repeat([[0.3, 0.0], [0.3, 0.8], [0.25, -0.6], [0.5, 0.1]], 60, axis=0)
FOUND_OF_CARS = {
    "as it is": {},
    "steers to one side": {"steering_offset": 0.1, "steering_gain": 0.8, "wheel_gain": 0.9},
    "late and lazy": {"delay": 0.3, "motor_lag": 0.3, "steering_lag": 0.3},
    "weak, with stops": {"saturation": 0.3, "steering_saturation": 0.5},
}


@pytest.mark.parametrize(
    ("robot", "theta", "commands", "share", "turned"),
    [
        *(pytest.param(ROBOT, theta, DUTIES, 0.015, 0.03, id=case) for case, theta in FOUND.items()),
        *(
            pytest.param(CAR, theta, HELD, 0.03, np.inf, id=f"car {case}", marks=pytest.mark.slow)
            for case, theta in FOUND_OF_CARS.items()
        ),
    ],
)
def test_mujoco_drives_the_exported_model_as_the_planar_plant_the_instance(robot, theta, commands, share, turned):
    mujoco = pytest.importorskip("mujoco")
    found = instance(robot, **theta)
    train = drivetrain(robot, effects_from(found.theta, robot.figures, robot.catalogue))
    twists, _ = train.apply(commands, train.begin(FilterContext(60.0, np.zeros(2), robot.figures)))
    expected = PlanarPlant(np.zeros(3), 1.0 / 60.0).move(twists)[0]
    poses = driven_by(mujoco, mujoco.MjModel.from_xml_string(mjcf_text(found)), commands)
    driven = np.linalg.norm(np.diff(expected[:, :2], axis=0), axis=1).sum()
    assert np.linalg.norm(poses[:, :2] - expected[:, :2], axis=1).max() < share * driven
    assert abs(np.arctan2(*(f(poses[-1, 2] - expected[-1, 2]) for f in (np.sin, np.cos)))) < turned


@pytest.mark.parametrize("form", FORMATS)
def test_what_a_car_has_a_place_for_changes_its_file_and_the_rest_is_named(form):
    for effect, kind in CAR_CATALOGUE.items():
        own, wheels = (PLACES[drive].get(effect) for drive in ("ackermann", "differential"))
        if effect in CATALOGUE and own == wheels:
            continue  # as on two wheels
        name, one = theta_names(kind)[0], kind.parameters[0]
        texts = []
        for share in (0.4, 0.7):
            found = Instance(CAR, {**CAR.theta, name: one.low + share * (one.high - one.low)}, {}, "a test")
            texts.append(without_comments(WRITERS[form](found)))
        assert (texts[0] != texts[1]) == bool(place_of(effect, form, "ackermann")), name


def test_mujocos_camera_stands_and_looks_as_was_found():
    mujoco = pytest.importorskip("mujoco")
    found = instance(camera_pitch=30.0, camera_yaw=5.0, camera_roll=-3.0, camera_height=0.12, field_of_view=80.0)
    model = mujoco.MjModel.from_xml_string(mjcf_text(found))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    axes = data.cam_xmat[0].reshape(3, 3)
    assert np.column_stack((-axes[:, 2], -axes[:, 0], axes[:, 1])) == pytest.approx(orientation(found.camera), abs=1e-6)
    assert data.cam_xpos[0] == pytest.approx((0.066, 0.0, 0.12))
    assert model.cam_fovy[0] == pytest.approx(80.0)


def test_exported_wheels_turn_and_pull_as_was_found_those_of_a_car_are_askew_and_of_a_robot_as_it_is_its_own():
    found = instance(trim=0.1, wheel_gain__left=0.9, yaw_scrub=0.2)
    body = read_body(ET.fromstring(urdf_text(found)), Path("exported.urdf"))
    assert (body.left.joint, body.right.joint) == AXLES
    assert (body.left.radius_m, body.right.radius_m) == pytest.approx((0.0318 * 0.9 * 0.9, 0.0318 * 1.1))
    assert [wheel.centre[2] for wheel in (body.left, body.right)] == pytest.approx(
        [body.left.radius_m, body.right.radius_m]
    )
    assert body.wheel_distance == pytest.approx(0.2)
    found = instance(CAR, wheel_gain=0.9, steering_offset=0.1)
    root = ET.fromstring(urdf_text(found))
    body = read_body(root, Path("exported.urdf"))
    assert (body.left.radius_m, body.right.radius_m) == pytest.approx((0.045, 0.045))
    askew = [joint.find("origin").get("rpy") for joint in root.iter("joint") if "steer" in joint.get("name")]
    assert [float(turned.split()[2]) for turned in askew] == pytest.approx([np.radians(2.4)] * 2)
    before = read_body(parse_urdf(ROBOT.urdf), ROBOT.urdf)
    assert WRITERS["urdf"](instance()).count(f'radius="{before.left.radius_m:g}"') == 4


def test_pybullet_loads_the_exported_urdf_and_finds_camera_and_tracked_point_where_they_are(write_file):
    pybullet = pytest.importorskip("pybullet", reason="PyBullet is not installed")
    found = instance(camera_pitch=30.0, camera_yaw=5.0, marker_offset__forward=0.05, heading_offset=30.0)
    path = write_file(urdf_text(found), "found.urdf")
    world = pybullet.connect(pybullet.DIRECT)
    try:
        body = pybullet.loadURDF(str(path), useFixedBase=True, physicsClientId=world)
        base, _ = pybullet.getBasePositionAndOrientation(body, physicsClientId=world)
        offset = np.array(pybullet.getDynamicsInfo(body, -1, physicsClientId=world)[3])
        links = {
            pybullet.getJointInfo(body, number, physicsClientId=world)[12].decode(): pybullet.getLinkState(
                body, number, physicsClientId=world
            )[4:6]
            for number in range(pybullet.getNumJoints(body, physicsClientId=world))
        }
    finally:
        pybullet.disconnect(world)
    root = np.array(base) - offset
    place, turn = links["camera"]
    matrix = np.array(pybullet.getMatrixFromQuaternion(turn)).reshape(3, 3)
    assert np.array(place) - root == pytest.approx((0.066, 0.0, 0.108), abs=1e-6)
    assert matrix == pytest.approx(orientation(found.camera), abs=1e-6)
    place, turn = links["tracked_point"]
    assert np.array(place) - root == pytest.approx((0.05, 0.0, 0.0), abs=1e-6)
    assert pybullet.getEulerFromQuaternion(turn)[2] == pytest.approx(np.pi / 6.0)


def test_ros_parameters_are_those_that_make_the_robot_go_as_told():
    yaml = pytest.importorskip("yaml")
    found = instance(trim=0.1, yaw_scrub=0.2, saturation__limit=0.5, slew_rate=0.5, lens_distortion=-0.2)
    nodes = yaml.safe_load(ros_text(found))
    assert all(set(node) == {"ros__parameters"} for node in nodes.values())
    wheels, camera = (nodes[name]["ros__parameters"] for name in ("diff_drive_controller", "camera"))
    assert wheels["wheel_separation"] * wheels["wheel_separation_multiplier"] == pytest.approx(0.2)
    assert (wheels["left_wheel_radius_multiplier"], wheels["right_wheel_radius_multiplier"]) == (0.9, 1.1)
    assert wheels["linear.x.max_velocity"] == pytest.approx(0.6 * 0.5 * 0.9)
    # A duty rises at the same rate whatever it is cut off at.
    assert wheels["linear.x.max_acceleration"] == pytest.approx(0.6 * 0.9 / 0.5)
    assert wheels["angular.z.max_acceleration"] == pytest.approx(2.0 / 0.2 * 0.6 * 0.9 / 0.5)
    assert camera["camera_info.d"] == [-0.2, 0.0, 0.0, 0.0, 0.0]
    assert nodes["camera_transform"]["ros__parameters"]["translation.z"] == pytest.approx(0.108)


def test_ros_intrinsics_for_more_pixels_are_those_that_the_file_says_to_make_of_them():
    yaml, found, s = pytest.importorskip("yaml"), instance(lens_centre__right=0.05), 4
    sizes = ("camera_columns", "camera_rows")
    larger = ROBOT.figures | {name: s * ROBOT.figures[name] for name in sizes}
    texts = [ros_text(one) for one in (found, replace(found, robot=replace(ROBOT, figures=larger)))]
    assert "focal lengths s times as large, and a centre c at (c + 0.5) * s - 0.5." in texts[0]
    k, wanted = (yaml.safe_load(text)["camera"]["ros__parameters"]["camera_info.k"] for text in texts)
    made = [s * k[0], 0.0, (k[2] + 0.5) * s - 0.5, 0.0, s * k[4], (k[5] + 0.5) * s - 0.5, 0.0, 0.0, 1.0]
    assert made == pytest.approx(wanted, abs=1e-5)


def with_urdf(folder, *changes):
    """The Duckiebot with changes of its URDF."""
    text = ROBOT.urdf.read_text()
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    (folder / "changed.urdf").write_text(text)
    return replace(ROBOT, urdf=folder / "changed.urdf")


def test_names_with_quotes_and_numbers_that_are_none_are_told_or_taken(tmp_path):
    robot = with_urdf(tmp_path, ('"wheel_left"', '"wheel\'s"'))
    root = ET.fromstring(urdf_text(instance(robot, wheel_gain__left=0.9)))
    assert read_body(root, Path("exported.urdf")).left.radius_m == pytest.approx(0.0318 * 0.9)
    joint = (
        '<joint name="spot" type="fixed"><parent link="p"/><child link="tracked_point"/><origin xyz="a b c"/></joint>'
    )
    robot = with_urdf(tmp_path, ("</robot>", f"{joint}</robot>"))
    with pytest.raises(SettingsError, match="changed.urdf: is no sound URDF .*; correct it"):
        urdf_text(instance(robot, marker_offset__forward=0.05))


@pytest.mark.parametrize("form", [urdf_text, mjcf_text])
def test_names_with_signs_of_xml_give_a_file_that_can_be_read(form):
    root = ET.fromstring(form(replace(instance(replace(ROBOT, name='R&D "<b>"')), source="a----b -")))
    assert root.tag in ("robot", "mujoco")
    assert form is urdf_text or root.get("model") == 'R&D "<b>"'


PAGE = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "exporting.md"
NEEDED = {
    "floor_slope.push": {"floor_slope.x": 0.1},
    **{f"{effect}.imbalance": {} for effect in ("dead_band", "stiction", "saturation", "motor_lag", "backlash")},
    "saturation.imbalance": {"saturation.limit": 0.7},
}


def without_comments(text):
    return re.sub(r"<!--.*?-->|#.*", "", text, flags=re.DOTALL if "<!--" in text else 0)


def parameters():
    for effect in CATALOGUE.values():
        yield from ((effect.name, name, one) for name, one in zip(theta_names(effect), effect.parameters, strict=True))


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize(("effect", "name", "parameter"), list(parameters()), ids=lambda value: str(value)[:30])
def test_a_value_changes_the_file_where_it_has_a_place_and_nowhere_else(form, effect, name, parameter):
    beside = NEEDED.get(name, {})
    values = [parameter.low + share * (parameter.high - parameter.low) for share in (0.4, 0.7)]
    texts = [
        without_comments(
            WRITERS[form](instance(**{key.replace(".", "__"): one for key, one in {**beside, name: value}.items()}))
        )
        for value in values
    ]
    assert (texts[0] != texts[1]) == bool(place_of(effect, form))


def test_values_without_a_place_are_not_told_where_neutral():
    names = [line.name for line in export_lines(instance(dead_band__width=0.0, turn_slip=0.0), "urdf")]
    assert not {"dead_band.width", "turn_slip"} & set(names)
    assert [place_of(name, form) for name in ("learnt", "weak_reverse:WeakReverse") for form in FORMATS] == [""] * 6
    assert set(PLACES["differential"]) <= set(CATALOGUE)
    assert set(PLACES["ackermann"]) <= set(CAR_CATALOGUE)


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_effect_is_in_the_table_of_the_page(name):
    row = f"| `{name}` | {' | '.join(place_of(name, form) or 'no place' for form in FORMATS)} |"
    assert row in PAGE.read_text(encoding="utf-8").splitlines()
