"""Messages become rows of numbers, whatever type they have, and a bad one is told by its number."""

import bags
import numpy as np
import pytest

from proxytune.errors import LogError
from proxytune.importing.ros.bag import open_bag
from proxytune.importing.ros.messages import read_commands, read_poses

TIMES = 1.7e9 + np.arange(5) * 0.1
TWIST = {"linear": bags.xyz((0.3, 0, 0)), "angular": bags.xyz((0, 0, -0.7))}
POSE = bags.pose((1.0, 2.0, 0.5))
TURN = bags.pose((1.0, 2.0, 3.0, 0.0, np.sin(0.1), 0.0, np.cos(0.1)))


def written(tmp_path, kind, fields, storage="mcap"):
    """A bag of five messages of one type; fields(number) are a message's."""
    stamped = [("/topic", kind, time, fields(number)) for number, time in enumerate(TIMES)]
    return open_bag(bags.write_messages(tmp_path / "run.bag", storage, stamped))


def with_header(**fields):
    return lambda number: {"header": bags.header(TIMES[number] - 0.01), **fields}


COMMANDS = {
    "geometry_msgs/msg/Twist": (lambda number: TWIST, (0.3, -0.7), 0.0),
    "geometry_msgs/msg/TwistStamped": (with_header(twist=TWIST), (0.3, -0.7), 0.01),
    "wheel_msgs/msg/WheelsCmdStamped": (with_header(vel_left=0.25, vel_right=-0.5), (0.25, -0.5), 0.01),
    "std_msgs/msg/Float32MultiArray": (lambda number: {"data": [0.25, 0.5]}, (0.25, 0.5), 0.0),
    "std_msgs/msg/Float64MultiArray": (lambda number: {"data": [0.2, 0.4]}, (0.2, 0.4), 0.0),
    "sensor_msgs/msg/JointState": (
        with_header(name=["wheel_right", "lidar", "wheel_left"], velocity=[2.0, 9.0, 1.0]),
        (1.0, 2.0),
        0.01,
    ),
}
POSES = {
    "geometry_msgs/msg/PoseStamped": with_header(pose=POSE),
    "geometry_msgs/msg/PoseWithCovarianceStamped": with_header(pose={"pose": POSE}),
    "nav_msgs/msg/Odometry": with_header(pose={"pose": POSE}, child_frame_id="base_link"),
    "geometry_msgs/msg/TransformStamped": with_header(
        transform={"translation": POSE["position"], "rotation": POSE["orientation"]}, child_frame_id="robot"
    ),
}


@pytest.mark.parametrize("storage", ["ros1", "mcap"])
@pytest.mark.parametrize("kind", COMMANDS)
def test_every_type_of_command_is_two_numbers_and_its_time(tmp_path, kind, storage):
    fields, row, early = COMMANDS[kind]
    with written(tmp_path, kind, fields, storage) as bag:
        commands, _ = read_commands(bag, "/topic", "twist", "header")
    assert commands.values == pytest.approx(np.tile(row, (5, 1)))
    assert commands.times == pytest.approx(TIMES - early, abs=1e-6)


@pytest.mark.parametrize("storage", ["ros1", "mcap"])
@pytest.mark.parametrize("kind", POSES)
def test_every_type_of_pose_is_a_place_and_a_heading(tmp_path, kind, storage):
    with written(tmp_path, kind, POSES[kind], storage) as bag:
        poses, _ = read_poses(bag, "/topic", "header")
    assert poses.places == pytest.approx(np.tile((1.0, 2.0, 0.0), (5, 1)))
    assert poses.headings == pytest.approx(np.full(5, 0.5))
    assert poses.times == pytest.approx(TIMES - 0.01, abs=1e-6)


def test_a_tilt_stays_known(tmp_path):
    with written(tmp_path, bags.POSE, with_header(pose=TURN)) as bag:
        assert read_poses(bag, "/topic", "header")[0].tilts == pytest.approx(np.full(5, 0.2))


def test_an_array_of_other_than_two_numbers_is_refused_by_number(tmp_path):
    with (
        written(tmp_path, "std_msgs/msg/Float32MultiArray", lambda number: {"data": [0.0] * (2 + number // 3)}) as bag,
        pytest.raises(LogError, match=r"run.bag: /topic, message 4: has 3 elements, .* --commands"),
    ):
        read_commands(bag, "/topic", "duty", "header")


@pytest.mark.parametrize("names", [["left", "front_left", "right"], ["a", "b", "c"]])
def test_joints_that_are_not_one_left_and_one_right_are_refused(tmp_path, names):
    with (
        written(tmp_path, "sensor_msgs/msg/JointState", with_header(name=names, velocity=[1.0, 1.0, 1.0])) as bag,
        pytest.raises(LogError, match=f"message 1: .* has joints {', '.join(names)}"),
    ):
        read_commands(bag, "/topic", "wheel_speed", "header")


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_command_that_is_not_finite_is_told_by_message(tmp_path, bad):
    def fields(number):
        return {"linear": bags.xyz((bad if number == 2 else 0.0, 0.0, 0.0)), "angular": bags.xyz((0, 0, 0))}

    with (
        written(tmp_path, bags.TWIST, fields) as bag,
        pytest.raises(LogError, match="run.bag: /topic, message 3: holds a number that is not finite"),
    ):
        read_commands(bag, "/topic", "twist", "header")


def test_a_pose_that_is_not_finite_is_kept_for_the_checks_to_leave_out(tmp_path):
    def fields(number):
        return with_header(pose=bags.pose((np.nan if number == 2 else 0.0, 0.0, 0.0)))(number)

    with written(tmp_path, bags.POSE, fields) as bag:
        poses, _ = read_poses(bag, "/topic", "header")
    assert np.flatnonzero(np.isnan(poses.places[:, 0])).tolist() == [2]


def test_an_orientation_of_zeros_is_no_heading(tmp_path):
    with (
        written(tmp_path, bags.POSE, with_header(pose={"position": bags.xyz((0, 0, 0))})) as bag,
        pytest.raises(LogError, match="/topic: orientation 1 is the quaternion"),
    ):
        read_poses(bag, "/topic", "header")


def test_poses_of_two_frames_on_one_topic_are_refused(tmp_path):
    def fields(number):
        return {"header": bags.header(TIMES[number], "odom" if number else "/map"), "pose": POSE}

    with (
        written(tmp_path, bags.POSE, fields) as bag,
        pytest.raises(LogError, match="/topic: mixes poses of map and odom"),
    ):
        read_poses(bag, "/topic", "header")
