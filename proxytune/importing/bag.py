"""Bags on disk: their topics, and the messages of commands and poses as rows of numbers with times.

Times are those in the messages' headers or, where these hold none or the user asks for it, when the bag received them.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from proxytune.arrays import Floats, Whole
from proxytune.errors import LogError, ProxytuneError, to_install
from proxytune.importing.bag_chunks import check_bag_size, check_messages_size
from proxytune.importing.checks import headings_and_tilts
from proxytune.importing.source import Commands, Poses, Wheels
from proxytune.settings import nearest

ROS1 = ".bag"
ROS2 = (".db3", ".mcap")
METADATA = "metadata.yaml"
REPAIR = {"ROS 1 bag": "rosbag reindex", "ROS 2 bag (mcap)": "mcap recover", "ROS 2 bag (sqlite3)": "ros2 bag reindex"}


@dataclass(frozen=True)
class Topic:
    """A topic of a bag, or of several bags together, so many of which are `lacking` messages of it.

    Messages can be read where their type, as geometry_msgs/msg/Twist, is `known`.
    """

    name: str
    kind: str
    count: int
    known: bool = True
    lacking: int = 0


@dataclass(frozen=True)
class Bag:
    """A bag that is open: the file, or the folder of a ROS 2 bag, and the library's reader of it."""

    path: Path
    reader: Any

    @property
    def topics(self) -> tuple[Topic, ...]:
        """Its topics by name."""
        with complaints(self.path, "does not say what it holds"):
            known, listed = self.reader.typestore.fielddefs, self.reader.topics.items()
            kinds = {str(name): (str(topic.msgtype or "several types"), int(topic.msgcount)) for name, topic in listed}
            return tuple(Topic(name, kind, count, kind in known) for name, (kind, count) in sorted(kinds.items()))

    @property
    def defines_types(self) -> bool:
        """True if the bag says what its messages look like."""
        with complaints(self.path, "does not say what its messages are"):
            return any(connection.msgdef.format.name != "NONE" for connection in self.reader.connections)

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """The messages of a topic in the order received: when each was received [ns], and what it holds."""
        connections = [connection for connection in self.reader.connections if connection.topic == topic]
        incoming = self.reader.messages(connections=connections) if connections else iter(())
        for number in itertools.count(1):
            with complaints(self.path, f"{topic}, message {number}: cannot be read"):
                received = next(incoming, None)
                if received is None:
                    return
                connection, receive_ns, raw = received
                message = self.reader.deserialize(raw, connection.msgtype)
            yield receive_ns, message


@contextmanager
def open_bag(path: Path) -> Iterator[Bag]:
    """Open a bag while it is read."""
    check_bag_size(path)
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ModuleNotFoundError:
        raise LogError(f"{path}: reading bags needs rosbags; {to_install('ros')}") from None
    with complaints(path, "cannot be read as a bag"):
        # The library would take a ROS 2 folder named run.bag for a file of ROS 1.
        inside = path.suffix == ROS1 and path.is_dir()
        paths = sorted(file for file in path.glob("*") if file.suffix in ROS2) if inside else [path]
        reader = AnyReader(paths, default_typestore=get_typestore(Stores.ROS2_HUMBLE))
        reader.open()
    try:
        with complaints(path, "cannot be read as a bag"):
            check_messages_size(path, reader)
        yield Bag(path, reader)
    finally:
        reader.close()


def form_of(path: Path) -> str:
    """Name of a bag's form, as in "ROS 2 bag (mcap)"."""
    if path.suffix == ROS1 and path.is_file():
        return "ROS 1 bag"
    files = [path] if path.is_file() else path.glob("*")
    return "ROS 2 bag (mcap)" if any(".mcap" in file.suffixes for file in files) else "ROS 2 bag (sqlite3)"


@contextmanager
def complaints(path: Path, what: str) -> Iterator[None]:
    """Turn whatever comes of a damaged bag into one line.

    That is nearly anything: the library's own errors, KeyError, struct.error, AssertionError, MemoryError; and of a
    message whose type says text where a number should be, TypeError.
    """
    try:
        yield
    except ProxytuneError:
        raise
    except Exception as problem:
        text = "".join(letter if letter.isprintable() else " " for letter in str(problem))
        reason = " ".join(text.split())[:200].rstrip(".") or type(problem).__name__
        remedy = f"copy it again, or repair it with {REPAIR[form_of(path)]}"
        raise LogError(f"{path}: {what} ({reason}); {remedy}") from None


def bags_in(path: Path) -> dict[str, Path]:
    """The bags that a path is or holds, by the names of their drives; none where it is of another form."""
    if _is_one(path):
        return {_name_of(path): path}
    bags: dict[str, Path] = {}
    for item in sorted(path.glob("*")):
        found = [item] if _is_one(item) else [file for file in sorted(item.glob("*")) if _is_one(file)]
        for bag in found:
            name = _name_of(bag) if bag == item else item.name if len(found) == 1 else f"{item.name}_{_name_of(bag)}"
            names = itertools.chain((name, f"{name}{bag.suffix}"), (f"{name}_{n}" for n in itertools.count(2)))
            bags[next(free for free in names if free not in bags)] = bag
    return bags


def _is_one(path: Path) -> bool:
    return (path / METADATA).is_file() if path.is_dir() else path.is_file() and path.suffix in (ROS1, *ROS2)


def _name_of(bag: Path) -> str:
    return bag.resolve().name if bag.is_dir() else bag.stem


UNSET_NS = 10**8 * 10**9
"""Stamps before 1973 are no date: a driver left them at zero, or counted from its own start."""
APART_S = 0.05
"""Clocks whose stamps differ by more in the median are worth a note."""
DRIFT_S = 0.02
"""Clocks that run apart by more are worth a note."""


@dataclass(frozen=True)
class Stamps:
    """When messages (N,) were made, as their headers say, None if there are none, and when the bag got them [ns]."""

    header: Whole | None
    receive: Whole


def seconds(stamps_ns: Whole) -> Floats:
    """Stamps in seconds, exact to half a microsecond: whole seconds and the rest are converted apart."""
    return stamps_ns // 10**9 + (stamps_ns % 10**9) * 1e-9


def choose_times(stamps: Stamps, wanted: str, where: str) -> tuple[Floats, tuple[str, ...]]:
    """Times of a topic's messages (N,) [s], "header" or "receive" as wanted, and what there is to say of them."""
    if wanted not in ("header", "receive"):
        raise LogError(f"{where}: unknown stamps '{wanted}'; {nearest(wanted, ('header', 'receive'))}")
    received = seconds(stamps.receive)
    if wanted == "receive":
        return received, (f"Times of {where} are when the bag received each message, as asked.",)
    if stamps.header is None:
        return received, (f"{where} has no header: its times are when the bag received each message.",)
    unset = stamps.header < UNSET_NS
    if unset.all() and (stamps.receive >= UNSET_NS).all():
        reason = f"Headers of {where} hold no date"
        return received, (f"{reason}: its times are when the bag received each message.",)
    if unset.any() and not unset.all():
        number = int(np.argmax(unset)) + 1
        raise LogError(f"{where}: the header of message {number} has no time stamp; take --stamps receive")
    header = seconds(stamps.header)
    return header, _clock_notes(header, received, where)


def _clock_notes(header: Floats, received: Floats, where: str) -> tuple[str, ...]:
    """Tell how far the headers' clock and the bag's are apart, and how much that changes over the drive."""
    late = received - header
    tenth = max(1, len(late) // 10)
    apart, drift = float(np.median(late)), float(np.median(late[:tenth]) - np.median(late[-tenth:]))
    notes = []
    if apart > APART_S:
        reason = "messages took that long, or the clocks differ"
        notes.append(f"Messages of {where} were received {apart:.3f} s after their stamps, in the median: {reason}.")
    if apart < -APART_S:
        early = f"Messages of {where} were received {-apart:.3f} s before their stamps, in the median"
        notes.append(f"{early}: the clocks differ; --stamps receive takes the bag's times.")
    if abs(drift) > DRIFT_S:
        by = f"{1e3 * drift:+.0f} ms"
        notes.append(f"The clock of the headers of {where} drifts by {by} against the bag's over the drive.")
    return tuple(notes)


Row = tuple[float, ...]
SIDES = ("left", "right")


def collect(bag: Bag, topic: str, row_of: Callable[[Any], Row], *, finite: bool = True) -> tuple[Stamps, Floats]:
    """The stamps of a topic's messages, and a row of numbers of each (N, columns).

    A LogError of `row_of` is completed by topic and number. Numbers must be finite where `finite` says so.
    """
    headers, receives, rows = [], [], []
    for number, (receive_ns, message) in enumerate(bag.messages(topic), start=1):
        where = f"{bag.path}: {topic}, message {number}"
        try:
            with complaints(bag.path, f"{topic}, message {number}: is not what its type says"):
                row, header = tuple(map(float, row_of(message))), header_ns(message)
        except LogError as problem:
            text = str(problem)
            raise LogError(text if text.startswith(f"{where}: ") else f"{where}: {text}") from None
        if finite and not all(map(math.isfinite, row)):
            values = ", ".join(f"{value:g}" for value in row)
            raise LogError(f"{where}: holds a number that is not finite ({values}); leave such messages out of the bag")
        rows.append(row)
        receives.append(receive_ns)
        headers.append(header)
    if not rows:
        raise LogError(f"{bag.path}: {topic}: no messages; take another topic, or leave the bag out")
    with complaints(bag.path, f"{topic}: has stamps that are no times"):
        stamped = None if headers[0] is None else np.array(headers, dtype=np.int64)
        return Stamps(stamped, np.array(receives, dtype=np.int64)), np.array(rows, dtype=np.float64)


def read_commands(bag: Bag, topic: str, kind: str, stamps: str) -> tuple[Commands, tuple[str, ...]]:
    """The commands of a topic, and what there is to say of their times."""
    both, values = collect(bag, topic, lambda said: COMMAND_TYPES[said.__msgtype__.rpartition("/")[2]][1](said))
    times, notes = choose_times(both, stamps, topic)
    return Commands(kind, times, values), notes


def read_poses(bag: Bag, topic: str, stamps: str) -> tuple[Poses, tuple[str, ...]]:
    """The poses of a topic, and what there is to say of their times."""
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


def read_wheels(bag: Bag, topic: str, stamps: str) -> tuple[Wheels, tuple[str, ...]]:
    """The measured wheel speeds of a topic of joints, and what there is to say of their times.

    A side with several wheels turns as fast as they do on average. Messages of other joints are passed over. Angles are
    differentiated where no velocity is measured, or every one is 0.
    """
    names: dict[str, None] = {}

    def row_of(message: Any) -> Row:
        names.update(dict.fromkeys(message.name))
        sides = [[place for place, name in enumerate(message.name) if side in name.lower()] for side in SIDES]
        wheels = [[place for place in side if "wheel" in message.name[place].lower()] for side in sides]
        sides = wheels if all(wheels) else sides
        velocity, position = (dict(enumerate(map(float, values))) for values in (message.velocity, message.position))
        means = [sum(velocity.get(place, math.nan) for place in side) / max(1, len(side)) for side in sides]
        angles = [position.get(place, math.nan) for side in sides for place in side[:1]]
        return (*means, *angles) if all(sides) else (math.nan,) * 4

    both, rows = collect(bag, topic, row_of, finite=False)
    times, notes = choose_times(both, stamps, topic)
    differentiated = not np.nan_to_num(rows[:, :2]).any() and bool(np.nan_to_num(rows[:, 2:]).any())
    values = rows[:, 2:] if differentiated else rows[:, :2]
    known = np.isfinite(values).all(axis=1)
    times, first = np.unique(times[known], return_index=True)
    values = values[known][first]
    if len(times) < 2:
        needed = "needs two messages or more with velocities or angles of a left and a right wheel"
        raise LogError(f"{bag.path}: {topic}: {needed}, but has joints {', '.join(names) or 'none'}")
    if differentiated:
        values = np.gradient(np.unwrap(values, axis=0), times, axis=0)
        notes = (*notes, f"{topic} measures no velocities: they are how fast its angles change.")
    return Wheels(times, values), notes


def header_ns(message: Any) -> int | None:
    """The stamp in a message's header [ns], or None where the type has none."""
    header = getattr(message, "header", None)
    return None if header is None else int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


def frame_of(message: Any) -> str:
    """The frame in which a pose is, and the one whose it is, as in "map>base_link"."""
    return f"{message.header.frame_id.lstrip('/')}>{getattr(message, 'child_frame_id', '').lstrip('/')}".rstrip(">")


def pose_of(message: Any) -> Row:
    """x, y, z and the quaternion x, y, z, w of a pose or a transform, with or without covariance."""
    if hasattr(message, "transform"):
        place, turn = message.transform.translation, message.transform.rotation
    else:
        pose = message.pose.pose if hasattr(message.pose, "pose") else message.pose
        place, turn = pose.position, pose.orientation
    return (place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w)


def _twist(message: Any) -> Row:
    twist = getattr(message, "twist", message)
    return (twist.linear.x, twist.angular.z)


def _array(message: Any) -> Row:
    if len(message.data) != 2:
        raise LogError(f"has {len(message.data)} elements, not a left and a right one; name another by --commands")
    return (float(message.data[0]), float(message.data[1]))


def _joints(message: Any) -> Row:
    pairs = dict(zip(message.name, message.velocity, strict=False))
    sides = [[speed for name, speed in pairs.items() if side in name.lower()] for side in SIDES]
    if [len(side) for side in sides] != [1, 1]:
        names = ", ".join(message.name) or "none"
        raise LogError(f"needs the velocities of one left and one right joint, but has joints {names}")
    return (float(sides[0][0]), float(sides[1][0]))


def _ackermann(message: Any) -> Row:
    drive = getattr(message, "drive", message)
    return (drive.speed, drive.steering_angle)


COMMAND_TYPES: Mapping[str, tuple[str, Callable[[Any], Row]]] = {
    "Twist": ("twist", _twist),
    "TwistStamped": ("twist", _twist),
    "AckermannDriveStamped": ("speed_steering", _ackermann),
    "AckermannDrive": ("speed_steering", _ackermann),
    "WheelsCmdStamped": ("duty", lambda message: (message.vel_left, message.vel_right)),
    "Float32MultiArray": ("", _array),
    "Float64MultiArray": ("", _array),
    "JointState": ("wheel_speed", _joints),
}
"""The kind of command that a type of message says, and its two columns; two numbers in an array do not say theirs."""
