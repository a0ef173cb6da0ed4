"""Messages of commands and poses as rows of numbers."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from proxytune.errors import LogError
from proxytune.importing.orientation import headings_and_tilts
from proxytune.importing.ros.bag import Bag
from proxytune.importing.ros.stamps import Stamps, Whole, choose_times
from proxytune.importing.source import Commands, Floats, Poses

Row = tuple[float, ...]


def collect(bag: Bag, topic: str, row_of: Callable[[Any], Row], *, finite: bool = True) -> tuple[Stamps, Floats]:
    """The stamps of a topic's messages, and a row of numbers of each (N, columns).

    Args:
        bag: An open bag.
        topic: Name of the topic.
        row_of: Makes a row of a message; a LogError of its own is completed by topic and number.
        finite: Whether all numbers must be finite.

    Raises:
        LogError: If a message cannot be read, makes no row, or holds a number that is not finite where it must.
    """
    headers, receives, rows = [], [], []
    for number, (receive_ns, message) in enumerate(bag.messages(topic), start=1):
        rows.append(_row(message, row_of, f"{bag.path}: {topic}, message {number}", finite=finite))
        receives.append(receive_ns)
        headers.append(header_ns(message))
    if not rows:
        raise LogError(f"{bag.path}: {topic}: no messages; take another topic, or leave the bag out")
    stamped = None if headers[0] is None else whole(headers)
    return Stamps(stamped, whole(receives)), np.array(rows, dtype=np.float64)


def read_commands(bag: Bag, topic: str, kind: str, stamps: str) -> tuple[Commands, tuple[str, ...]]:
    """The commands of a topic, and what there is to say of their times."""
    both, values = collect(bag, topic, command_of)
    times, notes = choose_times(both, stamps, topic)
    return Commands(kind, times, values), notes


def read_poses(bag: Bag, topic: str, stamps: str) -> tuple[Poses, tuple[str, ...]]:
    """The poses of a topic, and what there is to say of their times.

    Raises:
        LogError: If the topic mixes the poses of several frames, or an orientation is no rotation.
    """
    frames: dict[str, None] = {}

    def row_of(message: Any) -> Row:
        frames[frame_of(message)] = None
        return pose_of(message)

    both, rows = collect(bag, topic, row_of, finite=False)
    where = f"{bag.path}: {topic}"
    if len(frames) > 1:
        raise LogError(f"{where}: mixes poses of {' and '.join(sorted(frames))}; record each on a topic of its own")
    times, notes = choose_times(both, stamps, topic)
    return Poses(times, rows[:, :3], *headings_and_tilts(rows[:, 3:], where)), notes


def header_ns(message: Any) -> int | None:
    """The stamp in a message's header [ns], or None where the type has none."""
    header = getattr(message, "header", None)
    return None if header is None else int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


def whole(values: list[Any]) -> Whole:
    """Whole numbers as an array."""
    return np.array(values, dtype=np.int64)


def frame_of(message: Any) -> str:
    """Which frame a pose is of, and in which, as in "map>base_link"."""
    return f"{message.header.frame_id.lstrip('/')}>{getattr(message, 'child_frame_id', '').lstrip('/')}".rstrip(">")


def pose_of(message: Any) -> Row:
    """x, y, z and the quaternion x, y, z, w of a pose or a transform, with or without covariance."""
    if hasattr(message, "transform"):
        place, turn = message.transform.translation, message.transform.rotation
    else:
        pose = message.pose.pose if hasattr(message.pose, "pose") else message.pose
        place, turn = pose.position, pose.orientation
    return (place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w)


def command_of(message: Any) -> Row:
    """The two columns of a command: forward speed and yaw rate, or left and right.

    Raises:
        LogError: If an array has not two elements, or joints are not one left and one right.
    """
    return COMMANDS[message.__msgtype__.rpartition("/")[2]](message)


def _twist(message: Any) -> Row:
    twist = getattr(message, "twist", message)
    return (twist.linear.x, twist.angular.z)


def _wheels(message: Any) -> Row:
    return (message.vel_left, message.vel_right)


def _array(message: Any) -> Row:
    if len(message.data) != 2:
        raise LogError(f"has {len(message.data)} elements, not a left and a right one; name another by --commands")
    return (float(message.data[0]), float(message.data[1]))


def _joints(message: Any) -> Row:
    pairs = dict(zip(message.name, message.velocity, strict=False))
    sides = [[speed for name, speed in pairs.items() if side in name.lower()] for side in ("left", "right")]
    if [len(side) for side in sides] != [1, 1]:
        names = ", ".join(message.name) or "none"
        raise LogError(f"needs the velocities of one left and one right joint, but has joints {names}")
    return (float(sides[0][0]), float(sides[1][0]))


COMMANDS: Mapping[str, Callable[[Any], Row]] = {
    "Twist": _twist,
    "TwistStamped": _twist,
    "WheelsCmdStamped": _wheels,
    "Float32MultiArray": _array,
    "Float64MultiArray": _array,
    "JointState": _joints,
}


def _row(message: Any, row_of: Callable[[Any], Row], where: str, *, finite: bool) -> Row:
    try:
        row = row_of(message)
    except LogError as problem:
        raise LogError(f"{where}: {problem}") from None
    if finite and not all(map(math.isfinite, row)):
        values = ", ".join(f"{value:g}" for value in row)
        raise LogError(f"{where}: holds a number that is not finite ({values}); leave such messages out of the bag")
    return row
