"""A bag is known by its files; its messages become rows of numbers, and a damaged one is told in one line."""

import sys

import bags
import numpy as np
import pytest
from hypothesis import given, strategies as st
from one_line import complaint_of

from proxytune.errors import LogError
from proxytune.importing import Wanted, bag as bag_module
from proxytune.importing.bag import (
    Stamps,
    bags_in,
    choose_times,
    open_bag,
    read_commands,
    read_poses,
    read_wheels,
    seconds,
)
from proxytune.importing.topics import read_bag

TIMES = 1.7e9 + np.arange(30) * 0.1
DRIVE = ((TIMES, np.ones((30, 2))), (TIMES, np.ones((30, 3))))


def stored(folder):
    """The file that holds the messages of a ROS 2 folder."""
    (file,) = (*folder.glob("*.db3"), *folder.glob("*.mcap"))
    return file


@pytest.mark.parametrize("storage", bags.STORAGES)
def test_a_bag_is_known_by_its_file_or_folder(tmp_path, storage):
    bag = bags.write_bag(tmp_path / "run.bag", storage, *DRIVE)
    assert len(bags_in(bag if bag.is_file() else stored(bag))) == 1
    assert list(bags_in(tmp_path).values()) == [bag]
    assert bags_in(bag) == {"run" if storage == "ros1" else "run.bag": bag}
    with open_bag(bag) as opened:
        assert len(opened.topics) == 2
    assert bag_module.form_of(bag) == {"ros1": "ROS 1 bag"}.get(storage, f"ROS 2 bag ({storage})")


def test_other_files_and_missing_ones_are_no_bags_and_drives_of_a_folder_are_named_by_theirs(tmp_path):
    (tmp_path / "log.csv").write_text("time,x\n")
    assert not any(map(bags_in, (tmp_path, tmp_path / "log.csv", tmp_path / "missing.bag")))
    for name in ("one", "two"):
        stored(bags.write_bag(tmp_path / name, "mcap", *DRIVE)).parent.joinpath("metadata.yaml").unlink()
    bags.write_bag(tmp_path / "one.bag", "ros1", *DRIVE)
    bags.write_bag(tmp_path / "three", "sqlite3", *DRIVE)
    assert sorted(bags_in(tmp_path)) == ["one", "one.bag", "three", "two"]


@pytest.mark.parametrize("storage", bags.STORAGES)
def test_topics_have_types_and_counts(tmp_path, storage):
    with open_bag(bags.write_bag(tmp_path / "run.bag", storage, *DRIVE)) as bag:
        listed = [(topic.name, topic.kind, topic.count, topic.known) for topic in bag.topics]
    assert listed == [("/cmd_vel", bags.TWIST, 30, True), ("/pose", bags.POSE, 30, True)]


@pytest.mark.parametrize("name", ["run.bag", "run.db3", "run.mcap"])
@pytest.mark.parametrize("content", [b"", b"time,x,y\n" * 99])
def test_a_file_that_is_no_bag_is_told_in_one_line(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(LogError, match=f"{name}: cannot be read as a bag .*; copy it again, or repair it") as caught:
        read_bag(tmp_path / name, Wanted())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "rosbag2_bagfile_information: [", "rosbag2_bagfile_information: {version: 99}"])
def test_broken_metadata_are_told_in_one_line(tmp_path, text):
    bag = bags.write_bag(tmp_path / "run", "sqlite3", *DRIVE)
    (bag / "metadata.yaml").write_text(text)
    with pytest.raises(LogError, match="run: cannot be read as a bag .*ros2 bag reindex") as caught:
        read_bag(bag, Wanted())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("storage", ["ros1", "mcap", pytest.param("sqlite3", marks=pytest.mark.slow)])
def test_a_bag_cut_short_anywhere_is_told_in_one_line(tmp_path, storage):
    bag = bags.write_bag(tmp_path / f"run{'.bag' if storage == 'ros1' else ''}", storage, *DRIVE)
    file = bag if bag.is_file() else stored(bag)
    whole = file.read_bytes()
    for length in np.linspace(0, 0.95 * len(whole), 25).astype(int):
        file.write_bytes(whole[:length])
        with pytest.raises(LogError, match="cannot be read") as caught:
            read_bag(bag, Wanted())
        assert "\n" not in str(caught.value), length


def test_a_message_that_is_not_its_type_is_told_by_number(tmp_path, monkeypatch):
    with open_bag(bags.write_bag(tmp_path / "run", "mcap", *DRIVE)) as bag:
        whole = bag.reader.messages

        def shortened(connections):
            for number, (connection, time, raw) in enumerate(whole(connections=connections)):
                yield connection, time, raw[:-9] if number == 6 else raw

        monkeypatch.setattr(bag.reader, "messages", shortened)
        with pytest.raises(LogError, match=r"run: /pose, message 7: cannot be read \(.*PoseStamped.*\)"):
            list(bag.messages("/pose"))


def test_a_library_that_complains_or_is_not_there_is_one_line_without_control_characters(tmp_path, monkeypatch):
    def open_badly(self):
        raise OSError("first line\n\x1b[31msecond line")

    bag = bags.write_bag(tmp_path / "run.bag", "ros1", *DRIVE)
    monkeypatch.setattr("rosbags.highlevel.AnyReader.open", open_badly)
    with pytest.raises(LogError, match=r"cannot be read as a bag \(first line \[31msecond line\); copy it again"):
        read_bag(bag, Wanted())
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(LogError, match=r'reading bags needs rosbags; pip install "\.\[ros\]"'):
        read_bag(bag, Wanted())


SENT = 1.7e9 + np.arange(5) * 0.1
TWIST = {"linear": bags.xyz((0.3, 0, 0)), "angular": bags.xyz((0, 0, -0.7))}
POSE = bags.pose((1.0, 2.0, 0.5))
TURN = bags.pose((1.0, 2.0, 3.0, 0.0, np.sin(0.1), 0.0, np.cos(0.1)))


def written(tmp_path, kind, fields, storage="mcap"):
    """A bag of five messages of one type; fields(number) are a message's."""
    stamped = [("/topic", kind, time, fields(number)) for number, time in enumerate(SENT)]
    return open_bag(bags.write_messages(tmp_path / "run.bag", storage, stamped))


def with_header(**fields):
    return lambda number: {"header": bags.header(SENT[number] - 0.01), **fields}


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
    assert commands.times == pytest.approx(SENT - early, abs=1e-6)


@pytest.mark.parametrize("storage", ["ros1", "mcap"])
@pytest.mark.parametrize("kind", POSES)
def test_every_type_of_pose_is_a_place_and_a_heading(tmp_path, kind, storage):
    with written(tmp_path, kind, POSES[kind], storage) as bag:
        poses, _ = read_poses(bag, "/topic", "header")
    assert poses.places == pytest.approx(np.tile((1.0, 2.0, 0.0), (5, 1)))
    assert poses.headings == pytest.approx(np.full(5, 0.5))
    assert poses.times == pytest.approx(SENT - 0.01, abs=1e-6)


def test_a_tilt_stays_known_and_a_pose_that_is_not_finite_is_kept_for_the_checks(tmp_path):
    with written(tmp_path, bags.POSE, with_header(pose=TURN)) as bag:
        assert read_poses(bag, "/topic", "header")[0].tilts == pytest.approx(np.full(5, 0.2))

    def fields(number):
        return with_header(pose=bags.pose((np.nan if number == 2 else 0.0, 0.0, 0.0)))(number)

    with written(tmp_path / "again", bags.POSE, fields) as bag:
        poses, _ = read_poses(bag, "/topic", "header")
    assert np.flatnonzero(np.isnan(poses.places[:, 0])).tolist() == [2]


def third(x):
    """Commands of which the third goes at a speed that is none."""
    return lambda number: {"linear": bags.xyz((x if number == 2 else 0, 0, 0)), "angular": bags.xyz((0, 0, 0))}


def joints(*names):
    return with_header(name=names, velocity=[1.0, 1.0, 1.0])


def mixed(number):
    return {"header": bags.header(SENT[number], "odom" if number else "/map"), "pose": POSE}


ARRAY, JOINTS = "std_msgs/msg/Float32MultiArray", "sensor_msgs/msg/JointState"
BAD = {
    "three numbers": (ARRAY, lambda number: {"data": [0.0] * (2 + number // 3)}, "message 4: has 3 elements, "),
    "two on the left": (JOINTS, joints("left", "front_left", "right"), "has joints left, front_left, right"),
    "no wheels": (JOINTS, joints("a", "b", "c"), "has joints a, b, c"),
    "not a number": (bags.TWIST, third(np.nan), "message 3: holds a number that is not finite"),
    "infinite": (bags.TWIST, third(np.inf), "message 3: holds a number that is not finite"),
    "no orientation": (bags.POSE, with_header(pose={"position": bags.xyz((0, 0, 0))}), "orientation 1 is the quater"),
    "two frames": (bags.POSE, mixed, "mixes poses of map and odom"),
}


@pytest.mark.parametrize(("kind", "fields", "said"), BAD.values(), ids=BAD)
def test_a_message_that_cannot_be_used_is_told_by_number(tmp_path, kind, fields, said):
    with written(tmp_path, kind, fields) as bag:
        read = (read_poses, bag, "/topic") if kind == bags.POSE else (read_commands, bag, "/topic", "duty")
        told = complaint_of(*read, "header")
    assert "run.bag: /topic" in told
    assert said in told


FOUR = ("front_left_wheel", "rear_left_wheel", "front_right_wheel", "rear_right_wheel", "left_gripper")


def turning(number):
    """A robot whose left wheels turn at 1 and 2 rad/s, its right ones at 4 and 6, every second message of an arm."""
    if number % 2:
        return with_header(name=["elbow"], position=[1.0], velocity=[9.0])(number)
    return with_header(name=FOUR, velocity=[1.0, 2.0, 4.0, 6.0, 50.0])(number)


def turned(number):
    """Angles of wheels at 1 and −20 rad/s, the right one within a turn, beside velocities that are none."""
    angles = [0.1 * number, np.angle(np.exp(-2j * number))]
    return with_header(name=["wheel_left", "wheel_right"], position=angles, velocity=[0.0, 0.0])(number)


@pytest.mark.parametrize("storage", ["ros1", "mcap"])
def test_wheels_turn_as_joints_say_by_velocity_on_average_or_by_angle_and_other_joints_are_passed_over(
    tmp_path, storage
):
    with written(tmp_path, JOINTS, turning, storage) as bag:
        wheels, notes = read_wheels(bag, "/topic", "header")
    assert wheels.speeds == pytest.approx(np.tile((1.5, 5.0), (3, 1)))
    assert wheels.times == pytest.approx(SENT[::2] - 0.01, abs=1e-6)
    assert notes == ()
    (tmp_path / "again").mkdir()
    with written(tmp_path / "again", JOINTS, turned, storage) as bag:
        wheels, notes = read_wheels(bag, "/topic", "header")
    assert wheels.speeds == pytest.approx(np.tile((1.0, -20.0), (5, 1)), rel=1e-4)
    assert notes == ("/topic measures no velocities: they are how fast its angles change.",)


@pytest.mark.parametrize("fields", [joints("a", "b", "c"), with_header(name=["left", "right"])])
def test_joints_that_measure_no_wheels_are_told_by_their_names(tmp_path, fields):
    with written(tmp_path, JOINTS, fields) as bag:
        told = complaint_of(read_wheels, bag, "/topic", "header")
    assert "run.bag: /topic: needs two messages or more with velocities or angles of a left and a right wheel" in told
    assert "but has joints a, b, c" in told or "but has joints left, right" in told


START_NS = 1_700_000_000 * 10**9
RECEIVE = START_NS + np.arange(100) * 10**7


def both(header_s, receive=RECEIVE):
    return Stamps(receive + np.round(np.asarray(header_s) * 1e9).astype(np.int64), receive)


@given(st.integers(0, 4 * 10**9), st.integers(0, 10**9 - 1))
def test_seconds_keep_the_microsecond(whole, rest):
    assert abs(seconds(np.array([whole * 10**9 + rest]))[0] - whole - rest * 1e-9) < 5e-7


def test_headers_count_unless_the_bags_times_are_asked_for_or_both_count_otherwise():
    stamps = both(-0.01)
    header, notes = choose_times(stamps, "header", "/pose")
    received, said = choose_times(stamps, "receive", "/pose")
    assert received - header == pytest.approx(0.01, abs=1e-6)
    assert notes == ()
    assert "as asked" in said[0]

    header = np.arange(1, 101) * 10**7
    times, notes = choose_times(Stamps(header, header + 10**6), "header", "/pose")
    assert np.array_equal(times, seconds(header))
    assert notes == ()

    header = RECEIVE.copy()
    header[6] = 0
    with pytest.raises(LogError, match="/pose: the header of message 7 has no time stamp; take --stamps receive"):
        choose_times(Stamps(header, RECEIVE), "header", "/pose")

    with pytest.raises(LogError, match="/pose: unknown stamps 'headers'; did you mean 'header'"):
        choose_times(both(0), "headers", "/pose")


@pytest.mark.parametrize("header", [np.zeros(100, dtype=np.int64), np.arange(100) * 10**7], ids=["zero", "1970"])
def test_headers_without_a_date_give_way_to_the_bags_times(header):
    times, notes = choose_times(Stamps(header, RECEIVE), "header", "/pose")
    assert np.array_equal(times, seconds(RECEIVE))
    assert notes == ("Headers of /pose hold no date: its times are when the bag received each message.",)


@pytest.mark.parametrize(
    ("header_s", "words"),
    [
        (-0.06, "0.060 s after their stamps"),
        (0.25, "0.250 s before their stamps, in the median: the clocks differ"),
        *((np.linspace(0, drift, 100), f"drifts by {0.9e3 * drift:+.0f} ms") for drift in (0.04, -0.04)),
    ],
)
def test_clocks_that_differ_or_drift_are_told(header_s, words):
    (note,) = choose_times(both(header_s), "header", "/pose")[1]
    assert words in note
