"""Which topic is taken follows from what is wanted, then from its name, type and number of messages."""

import pytest

from proxytune.errors import LogError
from proxytune.importing.ros.bag import Topic
from proxytune.importing.ros.choice import channels_of, choose, notes_of
from proxytune.importing.wanted import Wanted

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


def test_a_depth_picture_is_no_picture_and_raw_goes_before_compressed():
    rows = (*DRIVE, ("/depth/image", "Image", 900), ("/b", "Compressed", 50), ("/c", "Image", 10))
    assert chosen(*rows).pictures.name == "/c"
    assert chosen(*rows[:3]).pictures is None
    assert chosen(*rows, frames="none").pictures is None


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


def test_a_wanted_kind_leaves_topics_of_other_kinds_out():
    rows = (*DRIVE, ("/wheels", "Array", 5))
    assert chosen(*rows, kind="duty").commands.name == "/wheels"


def test_joints_are_commands_only_where_they_are_named():
    rows = (("/joint_states", "Joints", 5), DRIVE[1])
    assert chosen(*rows, commands="/joint_states").kind == "wheel_speed"
    with pytest.raises(LogError, match="no topic is plainly commands; name one of /joint_states by --commands, or"):
        chosen(*rows)


@pytest.mark.parametrize(
    ("rows", "wanted", "words"),
    [
        ([DRIVE[1]], {}, "run.bag: no topic has commands, which are messages of type Twist.* --commands none"),
        ([DRIVE[0]], {}, "run.bag: no topic has poses, which are messages of type PoseStamped"),
        ([DRIVE[0], ("/goal", "Pose", 1)], {}, "no topic is plainly poses; name one of /goal by --poses"),
        (DRIVE, {"commands": "/cmd_val"}, "no topic '/cmd_val'; did you mean '/cmd_vel'?"),
        (
            DRIVE,
            {"poses": "/cmd_vel"},
            "/cmd_vel cannot be poses: geometry_msgs/msg/Twist is none of PoseStamped",
        ),
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


def test_a_type_without_definition_is_not_taken():
    rows = (*topics(*DRIVE), Topic("/mocap", KINDS["Pose"], 9, known=False))
    choice = choose(rows, Wanted(), "run.bag")
    assert choice.poses.name == "/odom"
    assert "does not define" in channels_of(rows, choice)[2].role


def test_a_topic_that_one_of_several_bags_lacks_is_not_taken():
    rows = (*topics(*DRIVE), Topic("/mocap", KINDS["Pose"], 9, lacking=1))
    choice = choose(rows, Wanted(), "runs")
    assert choice.poses.name == "/odom"
    assert channels_of(rows, choice)[2].role == "left out: bags without messages of it: 1"


def test_every_topic_has_a_role():
    rows = topics(*DRIVE, ("/c", "Twist", 9), ("/scan", "Scan", 9), ("/joints", "Joints", 9), ("/e", "Pose", 0))
    choice = choose(rows, Wanted(), "run.bag")
    assert [channel.role for channel in channels_of(rows, choice)] == [
        "commands",
        "poses",
        "left out: could be commands as well (--commands)",
        "left out: neither commands, poses nor pictures",
        "left out: taken only where it is named (--commands)",
        "left out: it has no messages",
    ]
    assert notes_of(rows, choice) == (
        "Commands are 100 messages of /cmd_vel (Twist); /c could be as well (--commands).",
        "Poses are 500 messages of /odom (Odometry).",
    )
