"""Which topic is taken, poses out of transforms, and the drives that a bag becomes, of whatever storage."""

import sqlite3

import bags
import numpy as np
import pytest
from moving_frames import TIMES, circle, moving, read
from scipy.spatial.transform import Rotation

from proxytune.errors import LogError
from proxytune.importing import Wanted
from proxytune.importing.bag import Topic
from proxytune.importing.topics import channels_of, choose, notes_of, read_bag

KINDS = {
    "Twist": "geometry_msgs/msg/Twist",
    "TwistStamped": "geometry_msgs/msg/TwistStamped",
    "Wheels": "wheel_msgs/msg/WheelsCmdStamped",
    "Array": "std_msgs/msg/Float32MultiArray",
    "Joints": "sensor_msgs/msg/JointState",
    "Pose": "geometry_msgs/msg/PoseStamped",
    "Covariance": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "Odometry": "nav_msgs/msg/Odometry",
    "TF": "tf2_msgs/msg/TFMessage",
    "Image": "sensor_msgs/msg/Image",
    "Compressed": "sensor_msgs/msg/CompressedImage",
    "Scan": "sensor_msgs/msg/LaserScan",
}
DRIVE = (("/cmd_vel", "Twist", 100), ("/odom", "Odometry", 500))


def topics(*rows):
    return tuple(Topic(name, KINDS[kind], count) for name, kind, count in rows)


def chosen(*rows, **wanted):
    return choose(topics(*rows), Wanted(**wanted), "run.bag")


@pytest.mark.parametrize(
    ("rows", "name"),
    [
        ([("/nav/twist", "Twist", 900), ("/robot/cmd_vel", "TwistStamped", 10)], "/robot/cmd_vel"),
        ([("/cmd_vel_smoothed", "Twist", 900), ("/cmd_vel", "Twist", 10)], "/cmd_vel"),
        ([("/measured_twist", "Twist", 900), ("/base_command", "Twist", 10)], "/base_command"),
        ([("/a", "Twist", 10), ("/b", "TwistStamped", 20)], "/b"),
        ([("/cmd_vel", "Twist", 0), ("/b", "Twist", 20)], "/b"),
        ([("/wheels_a", "Wheels", 900), ("/b", "Twist", 20)], "/b"),
    ],
)
def test_commands_go_by_name_then_type_then_number(rows, name):
    assert chosen(*rows, ("/odom", "Odometry", 5)).commands.name == name


@pytest.mark.parametrize(
    ("rows", "name"),
    [
        ([("/odom", "Odometry", 900), ("/pose", "Pose", 10)], "/pose"),
        ([("/odom", "Odometry", 900), ("/amcl_pose", "Covariance", 10)], "/amcl_pose"),
        ([("/tf", "TF", 900), ("/odom", "Odometry", 10)], "/odom"),
        ([("/pose", "Pose", 900), ("/ground_truth/odom", "Odometry", 10)], "/ground_truth/odom"),
        ([("/goal_pose", "Pose", 900), ("/odom", "Odometry", 10)], "/odom"),
        ([("/tf_static", "TF", 900), ("/tf", "TF", 10)], "/tf"),
    ],
)
def test_poses_go_by_name_then_type_and_a_goal_is_no_pose(rows, name):
    assert chosen(*rows, ("/cmd_vel", "Twist", 5)).poses.name == name


def test_a_depth_picture_joints_and_topics_of_other_kinds_are_not_taken():
    rows = (*DRIVE, ("/depth/image", "Image", 900), ("/b", "Compressed", 50), ("/c", "Image", 10))
    assert chosen(*rows).pictures.name == "/c"
    assert chosen(*rows[:3]).pictures is None
    assert chosen(*rows, frames="none").pictures is None
    rows = (*DRIVE, ("/wheels", "Array", 5))
    assert chosen(*rows, kind="duty").commands.name == "/wheels"
    rows = (("/joint_states", "Joints", 5), DRIVE[1])
    assert chosen(*rows, commands="/joint_states").kind == "wheel_speed"
    with pytest.raises(LogError, match="no topic is plainly commands; name one of /joint_states by --commands, or"):
        chosen(*rows)


def test_measured_wheels_are_a_topic_that_is_named_and_the_listing_says_how():
    rows = (*DRIVE, ("/joint_states", "Joints", 5))
    assert chosen(*rows).wheels is None
    roles = {channel.name: channel.role for channel in channels_of(topics(*rows), chosen(*rows))}
    assert roles["/joint_states"] == "left out: taken only where it is named (--commands or --wheel-speeds)"
    choice = chosen(*rows, wheels="joint_states")
    assert choice.wheels.name == "/joint_states"
    assert "Wheel speeds are 5 messages of /joint_states (JointState)." in notes_of(topics(*rows), choice)
    with pytest.raises(LogError, match="topic /odom cannot be wheel speeds: nav_msgs/msg/Odometry is none of JointSt"):
        chosen(*rows, wheels="/odom")


@pytest.mark.parametrize("name", ["/c", "c"])
def test_a_topic_that_is_named_is_taken(name):
    rows = (*DRIVE, ("/c", "Twist", 1), ("/p", "Pose", 1))
    assert chosen(*rows, commands=name).commands.name == "/c"
    assert chosen(*rows, poses="/odom").poses.name == "/odom"


@pytest.mark.parametrize("wanted", [{"commands": "none"}, {"kind": "none"}])
def test_a_log_may_go_without_commands(wanted):
    choice = chosen(DRIVE[1], **wanted)
    assert (choice.commands, choice.kind) == (None, "none")


@pytest.mark.parametrize(
    ("kind", "wanted", "expected"),
    [("Twist", "", "twist"), ("Wheels", "", "duty"), ("Array", "duty", "duty"), ("Array", "twist", "twist")],
)
def test_the_kind_of_commands_is_what_their_type_says_else_what_is_wanted(kind, wanted, expected):
    assert chosen(("/c", kind, 1), DRIVE[1], kind=wanted).kind == expected


@pytest.mark.parametrize(
    ("rows", "wanted", "words"),
    [
        ([DRIVE[1]], {}, "run.bag: no topic has commands, which are messages of type Twist.* --commands none"),
        ([DRIVE[0]], {}, "run.bag: no topic has poses, which are messages of type PoseStamped"),
        ([DRIVE[0], ("/goal", "Pose", 1)], {}, "no topic is plainly poses; name one of /goal by --poses"),
        (DRIVE, {"commands": "/cmd_val"}, "no topic '/cmd_val'; did you mean '/cmd_vel'?"),
        (DRIVE, {"poses": "/cmd_vel"}, "/cmd_vel cannot be poses: geometry_msgs/msg/Twist is none of PoseStamped"),
        (DRIVE, {"poses": "map>base_link"}, "no topic has poses, which are messages of type TFMessage"),
        ([*DRIVE, ("/c", "Twist", 0)], {"commands": "/c"}, "/c cannot be commands: it has no messages"),
        ([("/w", "Array", 9), DRIVE[1]], {}, "/w does not say what its two numbers are; add --kind duty"),
        (DRIVE, {"commands": "/cmd_vel", "kind": "duty"}, "holds commands of kind twist, not duty; leave --kind out"),
        (DRIVE, {"kind": "dutty"}, "unknown kind of commands 'dutty'; did you mean 'duty'?"),
    ],
)
def test_what_cannot_be_taken_is_refused_with_a_remedy(rows, wanted, words):
    with pytest.raises(LogError, match=words.replace("?", r"\?")):
        chosen(*rows, **wanted)


def test_every_topic_has_a_role_and_those_without_a_definition_or_lacking_in_a_bag_are_not_taken():
    rows = topics(*DRIVE, ("/c", "Twist", 9), ("/scan", "Scan", 9), ("/joints", "Joints", 9), ("/e", "Pose", 0))
    choice = choose(rows, Wanted(), "run.bag")
    assert [channel.role for channel in channels_of(rows, choice)] == [
        "commands",
        "poses",
        "left out: could be commands as well (--commands)",
        "left out: neither commands, poses nor pictures",
        "left out: taken only where it is named (--commands or --wheel-speeds)",
        "left out: it has no messages",
    ]
    assert notes_of(rows, choice) == (
        "Commands are 100 messages of /cmd_vel (Twist); /c could be as well (--commands).",
        "Poses are 500 messages of /odom (Odometry).",
    )
    rows = (*topics(*DRIVE), Topic("/mocap", KINDS["Pose"], 9, known=False))
    choice = choose(rows, Wanted(), "run.bag")
    assert choice.poses.name == "/odom"
    assert "does not define" in channels_of(rows, choice)[2].role
    rows = (*topics(*DRIVE), Topic("/mocap", KINDS["Pose"], 9, lacking=1))
    choice = choose(rows, Wanted(), "runs")
    assert choice.poses.name == "/odom"
    assert channels_of(rows, choice)[2].role == "left out: bags without messages of it: 1"


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_single_transform_is_the_pose(tmp_path, storage):
    source = read(tmp_path, moving("odom", "base_link", circle()), storage=storage)
    assert source.drives[0].poses.places[:, :2] == pytest.approx(circle()[:, :2])
    assert source.drives[0].poses.times == pytest.approx(TIMES, abs=1e-6)
    assert "Poses of base_link in odom are composed of odom>base_link." in source.notes


def test_static_transforms_on_both_sides_are_composed(tmp_path):
    """The world is turned by a quarter and shifted; the base stands 0.1 m behind the tracked point."""
    world = moving("map", "/odom", [(10.0, 0.0, np.pi / 2)], TIMES[:1], "/tf_static")
    base = moving("tracked", "base_link", [(-0.1, 0.0, 0.0)], TIMES[:1], "/tf_static")
    poses = read(tmp_path, world, base, moving("odom", "tracked", circle())).drives[0].poses
    x, y, heading = circle().T
    x, y = x - 0.1 * np.cos(heading), y - 0.1 * np.sin(heading)
    assert poses.places[:, 0] == pytest.approx(10.0 - y)
    assert poses.places[:, 1] == pytest.approx(x)
    assert np.unwrap(poses.headings) == pytest.approx(heading + np.pi / 2)


def test_a_slower_transform_is_interpolated_within_what_it_covers(tmp_path):
    slow = TIMES[[5, 20, 40]] + 0.03
    drifting = [(0.1 * (time - TIMES[0]), 0.0, 0.0) for time in slow]
    source = read(tmp_path, moving("map", "odom", drifting, slow), moving("odom", "base_link", circle()))
    poses = source.drives[0].poses
    assert poses.times == pytest.approx(TIMES[6:41], abs=1e-6)
    left_out = "map>odom, odom>base_link; 15 outside of what all of them cover are left out."
    assert any(note.endswith(left_out) for note in source.notes)
    assert poses.places[:, 0] == pytest.approx(circle()[6:41, 0] + 0.1 * (TIMES[6:41] - TIMES[0]), abs=1e-6)


def test_a_turning_transform_is_interpolated_by_the_shortest_turn_and_a_tilted_frame_has_a_tilt(tmp_path):
    slow = TIMES[[0, -1]]
    turning = [(0.0, 0.0, np.pi - 0.1), (0.0, 0.0, -np.pi + 0.1)]
    ahead = moving("odom", "base_link", circle() * [1, 1, 0])
    poses = read(tmp_path, moving("map", "odom", turning, slow), ahead).drives[0].poses
    turned = np.pi - 0.1 + 0.2 * (TIMES - TIMES[0]) / (TIMES[-1] - TIMES[0])
    assert np.unwrap(poses.headings) == pytest.approx(turned, abs=1e-5)
    tilted = Rotation.from_euler("x", 0.3).as_quat()
    mount = moving("base_link", "mast", [(0.0, 0.0, 1.0, *tilted)], TIMES[:1], "/tf_static")
    wanted = Wanted(commands="none", poses="odom>mast")
    poses = read(tmp_path / "again", mount, moving("odom", "base_link", circle()), wanted=wanted).drives[0].poses
    assert poses.tilts == pytest.approx(np.full(50, 0.3))
    assert poses.places[:, 2] == pytest.approx(np.ones(50))
    assert np.unwrap(poses.headings) == pytest.approx(circle()[:, 2])


def test_transforms_at_no_common_time_are_told_and_a_bad_one_elsewhere_does_no_harm(tmp_path):
    late = moving("map", "odom", circle()[:9], TIMES[:9] + 100)
    with pytest.raises(LogError, match="the transforms of map>base_link share no time"):
        read(tmp_path, late, moving("odom", "base_link", circle()))
    wheel = moving("base_link", "wheel", [(np.nan, 0.0, 0.0)] * 3, TIMES[:3])
    poses = read(tmp_path / "again", wheel, moving("odom", "base_link", circle())).drives[0].poses
    assert poses.places[:, :2] == pytest.approx(circle()[:, :2])


@pytest.mark.parametrize(
    ("row", "words"), [((np.nan, 0.0, 0.0), "number 3 is not finite"), ((0.0,) * 7, "orientation 3 is the quaternion")]
)
def test_a_bad_transform_is_told_by_name_and_number(tmp_path, row, words):
    rows = [*circle()[:2], row]
    with pytest.raises(LogError, match=f"transform odom>base_link: {words}"):
        read(tmp_path, moving("odom", "base_link", rows, TIMES[:3]))


ISSUED = 1.7e9 + np.arange(20) * 0.1
STAMPED = 1.7e9 + np.arange(100) * 0.02
TWISTS = np.random.default_rng(1).normal(size=(20, 2))
POSES = np.random.default_rng(2).normal(size=(100, 3))
BOTH = ((ISSUED, TWISTS), (STAMPED, POSES))


@pytest.mark.parametrize("storage", bags.STORAGES)
def test_a_drive_has_commands_as_received_and_poses_as_stamped(tmp_path, storage):
    clocks = {"command_delay_s": 0.03, "pose_clock_s": -0.2, "pose_delay_s": np.linspace(0.0, 0.01, 100)}
    pictures = (ISSUED[:2], np.zeros((2, 4, 5, 3), dtype=np.uint8))
    source = read_bag(bags.write_bag(tmp_path / "run.bag", storage, *BOTH, pictures, **clocks), Wanted())
    (drive,) = source.drives
    assert drive.name == ("run" if storage == "ros1" else "run.bag")
    assert drive.commands.kind == "twist"
    assert np.array_equal(drive.commands.values, TWISTS)
    assert drive.commands.times == pytest.approx(ISSUED + 0.03, abs=1e-6)
    assert drive.poses.times == pytest.approx(STAMPED - 0.2, abs=1e-6)
    assert drive.poses.headings == pytest.approx(POSES[:, 2])
    assert [picture.shape for picture in drive.pictures.read()] == [(4, 5, 3)] * 2
    assert "/cmd_vel has no header: its times are when the bag received each message." in source.notes
    assert any("/pose were received 0.205 s after their stamps" in note for note in source.notes)
    assert [channel.role for channel in source.channels] == ["pictures", "commands", "poses"]


def test_the_bags_times_are_taken_where_asked(tmp_path):
    bag = bags.write_bag(tmp_path / "run", "mcap", *BOTH, pose_clock_s=-0.2, pose_delay_s=0.01)
    (one,) = read_bag(bag, Wanted(stamps="receive")).drives
    assert one.poses.times == pytest.approx(STAMPED + 0.01, abs=1e-6)


def test_bags_of_a_folder_are_drives_and_notes_say_of_which(tmp_path):
    bags.write_bag(tmp_path / "b.bag", "ros1", *BOTH)
    bags.write_bag(tmp_path / "a", "mcap", *BOTH, pose_clock_s=0.3)
    source = read_bag(tmp_path, Wanted())
    assert [drive.name for drive in source.drives] == ["a", "b"]
    assert source.form == "2 bags: ROS 1 bag, ROS 2 bag (mcap)"
    assert [channel.count for channel in source.channels] == [40, 200]
    assert [note[:8] for note in source.notes if "clocks differ" in note] == ["a: Messa"]


def test_bags_of_a_folder_share_their_topics(tmp_path):
    """The second bag has no /mocap, so both are read from /pose."""
    both = list(bags.pose_messages(*BOTH[1])) + list(bags.pose_messages(STAMPED, -POSES, topic="/mocap"))
    bags.write_messages(tmp_path / "one.bag", "ros1", [*both, *bags.twist_messages(*BOTH[0])])
    bags.write_bag(tmp_path / "two.bag", "ros1", *BOTH)
    for drive in read_bag(tmp_path, Wanted()).drives:
        assert np.array_equal(drive.poses.places[:, 0], POSES[:, 0])
    header = "/cmd_vel has no header: its times are when the bag received each message."
    assert [note for note in read_bag(tmp_path, Wanted()).notes if "header" in note] == [f"all 2 drives: {header}"]


def test_transforms_of_the_first_bag_are_those_of_all(tmp_path):
    for name, child in (("one.bag", "base_link"), ("two.bag", "robot")):
        bags.write_messages(tmp_path / name, "ros1", bags.transform_messages("map", child, POSES, STAMPED))
    with pytest.raises(LogError, match="two.bag: /tf: no transforms lead from 'map' to 'base_link'"):
        read_bag(tmp_path, Wanted(commands="none"))


@pytest.mark.parametrize("storage", bags.STORAGES)
def test_a_bag_without_messages_is_told(tmp_path, storage):
    bag = bags.write_messages(tmp_path / "run.bag", storage, [("/cmd_vel", bags.TWIST, 0.0, None)])
    with pytest.raises(LogError, match="run.bag: holds no messages; record it again, or leave it out"):
        read_bag(bag, Wanted())


def test_a_bag_without_definitions_is_read_by_those_of_humble(tmp_path):
    wheels = ("/wheels", "wheel_msgs/msg/WheelsCmdStamped", ISSUED[0], {"vel_left": 1.0})
    messages = [*bags.pose_messages(*BOTH[1]), *bags.twist_messages(*BOTH[0]), wheels]
    bag = bags.write_messages(tmp_path / "run", "sqlite3", messages)
    with sqlite3.connect(bag / "run.db3") as table:
        table.execute("UPDATE schema SET schema_version = 3")
    source = read_bag(bag, Wanted())
    assert np.array_equal(source.drives[0].commands.values, TWISTS)
    assert "run does not define its types of message: those of ROS 2 Humble were taken." in source.notes
    assert "does not define wheel_msgs/msg/WheelsCmdStamped" in source.channels[2].role


def test_messages_that_only_the_metadata_know_are_missing(tmp_path):
    bag = bags.write_bag(tmp_path / "run", "sqlite3", *BOTH)
    with sqlite3.connect(bag / "run.db3") as table:
        table.execute("DELETE FROM messages WHERE topic_id = (SELECT id FROM topics WHERE name = '/pose')")
    with pytest.raises(LogError, match="run: /pose: no messages; take another topic, or leave the bag out"):
        read_bag(bag, Wanted())


def test_several_publishers_of_a_topic_are_one_topic(tmp_path):
    """ROS 1 keeps a connection for each publisher."""
    store, path = bags.typestore("ros1"), tmp_path / "run.bag"
    messages = [*bags.pose_messages(*BOTH[1]), *bags.twist_messages(*BOTH[0])]
    with bags.rosbag1.Writer(path) as writer:
        for publisher in ("one", "two"):
            half = messages[publisher == "two" :: 2]
            kinds, how = {topic: kind for topic, kind, _, _ in half}, {"typestore": store, "callerid": publisher}
            to = {topic: writer.add_connection(topic, kind, **how) for topic, kind in kinds.items()}
            for topic, kind, time, fields in half:
                raw = store.serialize_ros1(bags.make(store, kind, fields), kind)
                writer.write(to[topic], bags.nanoseconds(time), raw)
    (drive,) = read_bag(path, Wanted()).drives
    assert np.array_equal(drive.commands.values, TWISTS)
    assert np.array_equal(drive.poses.places[:, 0], POSES[:, 0])
