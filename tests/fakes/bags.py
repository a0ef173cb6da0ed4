"""Synthetic bags: the same drive as a ROS 1 file, or a ROS 2 folder of sqlite3 or mcap."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

rosbag1 = pytest.importorskip("rosbags.rosbag1")
rosbag2 = pytest.importorskip("rosbags.rosbag2")
typesys = pytest.importorskip("rosbags.typesys")

STORAGES = ("ros1", "sqlite3", "mcap")
TRANSFORMS = "geometry_msgs/TransformStamped[] transforms"
WHEELS = "std_msgs/Header header\nfloat32 vel_left\nfloat32 vel_right"

POSE = "geometry_msgs/msg/PoseStamped"
TWIST = "geometry_msgs/msg/Twist"


@cache
def typestore(storage):
    """The types of messages, with two that a distribution may lack."""
    store = typesys.get_typestore(getattr(typesys.Stores, "ROS1_NOETIC" if storage == "ros1" else "ROS2_HUMBLE"))
    for kind, text in (("tf2_msgs/msg/TFMessage", TRANSFORMS), ("wheel_msgs/msg/WheelsCmdStamped", WHEELS)):
        if kind not in store.fielddefs:
            store.register(typesys.get_types_from_msg(text, kind))
    return store


def make(store, kind, fields):
    """A message of a type out of a table of its fields; what is left out is zero."""
    values = {}
    for name, (node, what) in store.fielddefs[kind][1]:
        values[name] = _value(store, node, what, fields.get(name))
    unknown = set(fields) - set(values) - {"seq"}
    assert not unknown, f"{kind} has no {unknown}"
    return store.types[kind](**values)


def _value(store, node, what, given):
    if node.name == "NAME":
        return make(store, what, given or {})
    if node.name == "BASE":
        return given if given is not None else ("" if what[0] == "string" else 0)
    (inner, kind), length = what
    if inner.name == "NAME":
        return [make(store, kind, each) for each in given or ()]
    if kind[0] == "string":
        return list(given or ())
    return np.asarray(np.zeros(length) if given is None else given, dtype=kind[0])


def header(stamp_s, frame="map"):
    """The table of a header."""
    ns = nanoseconds(stamp_s)
    return {"stamp": {"sec": ns // 10**9, "nanosec": ns % 10**9}, "frame_id": frame}


def nanoseconds(stamp_s):
    return int(stamp_s) * 10**9 + round((stamp_s % 1.0) * 1e9)


def quaternion(heading):
    """The table of a turn about the upward axis."""
    return {"x": 0.0, "y": 0.0, "z": float(np.sin(heading / 2)), "w": float(np.cos(heading / 2))}


def pose(row):
    """The table of a pose: x, y, heading, or x, y, z and a quaternion."""
    if len(row) == 3:
        return {"position": xyz((row[0], row[1], 0.0)), "orientation": quaternion(row[2])}
    return {"position": xyz(row[:3]), "orientation": dict(zip(("x", "y", "z", "w"), map(float, row[3:]), strict=True))}


def xyz(row):
    return dict(zip(("x", "y", "z"), map(float, row), strict=True))


def transform(stamp_s, parent, child, row):
    """The table of a TransformStamped."""
    it = pose(row)
    both = {"translation": it["position"], "rotation": it["orientation"]}
    return {"header": header(stamp_s, parent), "child_frame_id": child, "transform": both}


def write_messages(path, storage, messages):
    """Write a bag of (topic, type, received [s], fields); ROS 1 as a file, ROS 2 as a folder."""
    path = Path(path)
    store = typestore(storage)
    connections = {}
    with _writer(path, storage) as writer:
        for topic, kind, received_s, fields in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            if fields is None:
                continue  # A topic without messages
            message = make(store, kind, fields)
            raw = store.serialize_ros1(message, kind) if storage == "ros1" else store.serialize_cdr(message, kind)
            writer.write(connections[topic], nanoseconds(received_s), raw)
    return path


def _writer(path, storage):
    if storage == "ros1":
        return rosbag1.Writer(path)
    return rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin[storage.upper()])


def twist_messages(times, twists, topic="/cmd_vel", delay_s=0.0):
    """Twists (M, 2) of speed and yaw rate, received some time after they were issued (a number, or one for each)."""
    for time, delay, (v, omega) in zip(times, np.broadcast_to(delay_s, len(times)), twists, strict=True):
        yield topic, TWIST, time + delay, {"linear": xyz((v, 0, 0)), "angular": xyz((0, 0, omega))}


def pose_messages(times, poses, topic="/pose", clock_s=0.0, delay_s=0.0, kind=POSE, frame="map"):
    """Poses (N, 3) or (N, 7), stamped by a clock that is ahead and received some time after."""
    clocks, delays = (np.broadcast_to(value, len(times)) for value in (clock_s, delay_s))
    for time, ahead, delay, row in zip(times, clocks, delays, poses, strict=True):
        body = pose(row) if kind == POSE else {"pose": pose(row)}
        yield topic, kind, time + delay, {"header": header(time + ahead, frame), "pose": body}


def transform_messages(parent, child, rows, times, topic="/tf"):
    """Transforms (N, 3) or (N, 7) of a child in its parent, a message each, received as stamped."""
    for time, row in zip(times, rows, strict=True):
        yield topic, "tf2_msgs/msg/TFMessage", time, {"transforms": [transform(time, parent, child, row)]}


def picture_messages(times, pictures, topic="/camera/image_raw", encoding="rgb8", pad=0, delay_s=0.0):
    """Pictures (K, rows, columns, channels), each row padded with some bytes."""
    for time, picture in zip(times, pictures, strict=True):
        rows = np.pad(picture.reshape(len(picture), -1), ((0, 0), (0, pad)))
        size = {"height": len(picture), "width": picture.shape[1], "step": rows.shape[1], "encoding": encoding}
        fields = {"header": header(time, "camera"), "is_bigendian": 0, "data": rows.ravel(), **size}
        yield topic, "sensor_msgs/msg/Image", time + delay_s, fields


def write_bag(path, storage, commands, poses, pictures=None, **clocks):
    """Write a drive as a bag.

    Args:
        path: The file (ROS 1) or folder (ROS 2) to make.
        storage: One of STORAGES.
        commands: Times (M,) [s] and twists (M, 2): speed [m/s], yaw rate [rad/s]; or None.
        poses: Times (N,) [s] and poses (N, 3): x, y, heading; or (N, 7): place and quaternion x, y, z, w.
        pictures: Times (K,) and pictures (K, rows, columns, 3) of red, green and blue, or None.
        clocks: command_delay_s, pose_clock_s and pose_delay_s, numbers or one for each message: how much later than
            its time a message is received, and by how much the clock that stamps poses is ahead.
    """
    messages = list(
        pose_messages(*poses, clock_s=clocks.get("pose_clock_s", 0.0), delay_s=clocks.get("pose_delay_s", 0.0))
    )
    if commands is not None:
        messages += twist_messages(*commands, delay_s=clocks.get("command_delay_s", 0.0))
    if pictures is not None:
        messages += picture_messages(*pictures)
    return write_messages(path, storage, sorted(messages, key=lambda message: message[2]))
