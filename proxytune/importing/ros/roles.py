"""What a log needs of a bag, and how topics for it are told apart."""

from collections.abc import Mapping
from dataclasses import dataclass

from proxytune.importing.ros.bag import Topic

KINDS: Mapping[str, str] = {
    "Twist": "twist",
    "TwistStamped": "twist",
    "WheelsCmdStamped": "duty",
    "Float32MultiArray": "",
    "Float64MultiArray": "",
    "JointState": "wheel_speed",
}
"""The kind of command that a type of message says; two numbers in an array do not say theirs."""

TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")


@dataclass(frozen=True)
class Role:
    """Something that a log needs of a bag, and how its topic is found.

    Attributes:
        name: What the topic is taken for.
        option: The option that names the topic.
        ranks: Types of message that can be it, without their package; the lowest rank goes first.
        first: Parts of names that go first, the foremost first.
        never: Parts of names that are something else, whatever their type.
        asked: Types that are taken only where the topic is named.
    """

    name: str
    option: str
    ranks: Mapping[str, int]
    first: tuple[str, ...] = ()
    never: tuple[str, ...] = ()
    asked: tuple[str, ...] = ()

    def can_be(self, topic: Topic) -> bool:
        """Whether a topic has messages that can be read as this."""
        return topic.count > 0 and topic.known and not topic.lacking and short(topic.kind) in self.ranks

    def is_offered(self, topic: Topic) -> bool:
        """Whether a topic may be taken without being named."""
        named_otherwise = any(part in topic.name.lower() for part in self.never)
        return self.can_be(topic) and not named_otherwise and short(topic.kind) not in self.asked

    def order(self, topic: Topic) -> tuple[bool, int, int, int, str]:
        """The lowest goes first: by name, by type, by number of messages."""
        name = topic.name.lower()
        differs = name.rpartition("/")[2] not in self.first
        by_name = next((place for place, part in enumerate(self.first) if part in name), len(self.first))
        return differs, by_name, self.ranks[short(topic.kind)], -topic.count, topic.name

    def why_not(self, topic: Topic) -> str:
        """Why a topic is not taken."""
        if not topic.count:
            return "it has no messages"
        if topic.lacking:
            return f"bags without messages of it: {topic.lacking}"
        if not topic.known:
            return f"the bag does not define {topic.kind}; record it by a newer ROS or as mcap, which does"
        if self.can_be(topic):
            return f"taken only where it is named ({self.option})"
        return f"{topic.kind} is none of {', '.join(self.ranks)}"


COMMAND_ROLE = Role(
    "commands",
    "--commands",
    {name: place for place, name in enumerate(KINDS)} | {"TwistStamped": 0, "Float64MultiArray": 3},
    first=("cmd_vel", "cmd", "command"),
    asked=("JointState",),
)
POSE_ROLE = Role(
    "poses",
    "--poses",
    {
        "PoseStamped": 0,
        "TransformStamped": 0,
        "PoseWithCovarianceStamped": 1,
        "Odometry": 2,
        "TFMessage": 3,
        "tfMessage": 3,
    },
    first=("mocap", "vicon", "vrpn", "optitrack", "qualisys", "ground_truth"),
    never=("goal", "target", "setpoint", "initialpose", "cmd", "command", "tf_static"),
)
PICTURE_ROLE = Role("pictures", "--pictures", {"Image": 0, "CompressedImage": 1}, never=("depth", "mask", "debug"))


def short(kind: str) -> str:
    """A type without its package: Twist of geometry_msgs/msg/Twist."""
    return kind.rpartition("/")[2]
