"""Bags on disk: which they are, what topics they hold, and their messages one after the other."""

import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from proxytune.errors import LogError

ROS1 = ".bag"
ROS2 = (".db3", ".mcap")
METADATA = "metadata.yaml"

REPAIR = {"ROS 1 bag": "rosbag reindex", "ROS 2 bag (mcap)": "mcap recover", "ROS 2 bag (sqlite3)": "ros2 bag reindex"}


@dataclass(frozen=True)
class Topic:
    """A topic of a bag, or of several bags together.

    Attributes:
        name: Its name, as in /cmd_vel.
        kind: Type of its messages, as in geometry_msgs/msg/Twist.
        count: How many messages it has.
        known: Whether the type is defined, so that messages can be read.
        lacking: How many of the bags have no messages of it.
    """

    name: str
    kind: str
    count: int
    known: bool = True
    lacking: int = 0


@dataclass(frozen=True)
class Bag:
    """A bag that is open.

    Attributes:
        path: The file, or the folder of a ROS 2 bag.
        reader: The library's reader of it.
    """

    path: Path
    reader: Any

    @property
    def topics(self) -> tuple[Topic, ...]:
        """Its topics by name."""
        known = self.reader.typestore.fielddefs
        kinds = {name: (topic.msgtype or "several types", topic.msgcount) for name, topic in self.reader.topics.items()}
        return tuple(Topic(name, kind, count, kind in known) for name, (kind, count) in sorted(kinds.items()))

    @property
    def defines_types(self) -> bool:
        """Whether the bag says what its messages look like."""
        return any(connection.msgdef.format.name != "NONE" for connection in self.reader.connections)

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """The messages of a topic in the order received: when each was received [ns], and what it holds.

        Raises:
            LogError: If the bag breaks off, or a message is not what its type says.
        """
        connections = [connection for connection in self.reader.connections if connection.topic == topic]
        numbers = count(1)
        incoming = self.reader.messages(connections=connections) if connections else iter(())
        while True:
            with _complaints(self.path, f"{topic}, message {next(numbers)}: cannot be read"):
                received = next(incoming, None)
                if received is None:
                    return
                connection, receive_ns, raw = received
                message = self.reader.deserialize(raw, connection.msgtype)
            yield receive_ns, message


def is_bag(path: Path) -> bool:
    """Whether a path is a ROS bag, or a folder of several."""
    return bool(_bags_in(path))


def bags_in(path: Path) -> dict[str, Path]:
    """The bags that a path holds, by the names of their drives.

    Raises:
        LogError: If there is none.
    """
    if not path.exists():
        raise LogError(f"{path}: no such file; check the path")
    bags = _bags_in(path)
    if not bags:
        raise LogError(f"{path}: holds no bag; give a .bag, .db3 or .mcap file, or a folder of bags")
    return bags


@contextmanager
def open_bag(path: Path) -> Iterator[Bag]:
    """Open a bag while it is read.

    Raises:
        LogError: If the library is not installed, or the bag is cut short or is none.
    """
    reader = _open_reader(path)
    try:
        yield Bag(path, reader)
    finally:
        reader.close()


def form_of(path: Path) -> str:
    """What a bag is, as in "ROS 2 bag (mcap)"."""
    if path.suffix == ROS1 and path.is_file():
        return "ROS 1 bag"
    files = [path] if path.is_file() else path.glob("*")
    return "ROS 2 bag (mcap)" if any(".mcap" in file.suffixes for file in files) else "ROS 2 bag (sqlite3)"


def _open_reader(path: Path) -> Any:
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ModuleNotFoundError:
        raise LogError(f'{path}: reading bags needs rosbags; pip install "proxytune[ros]"') from None
    with _complaints(path, "cannot be read as a bag"):
        reader = AnyReader(_paths(path), default_typestore=get_typestore(Stores.ROS2_HUMBLE))
        reader.open()
    return reader


def _paths(path: Path) -> list[Path]:
    """What the library opens: it would take a ROS 2 folder named run.bag for a file of ROS 1."""
    inside = path.suffix == ROS1 and path.is_dir()
    return sorted(file for file in path.glob("*") if file.suffix in ROS2) if inside else [path]


@contextmanager
def _complaints(path: Path, what: str) -> Iterator[None]:
    """Turn whatever the library raises into one line.

    Damaged bags make it raise nearly anything: its own errors, KeyError, struct.error, AssertionError, MemoryError.
    """
    try:
        yield
    except Exception as problem:
        text = "".join(letter if letter.isprintable() else " " for letter in str(problem))
        reason = " ".join(text.split())[:200].rstrip(".") or type(problem).__name__
        remedy = f"copy it again, or repair it with {REPAIR[form_of(path)]}"
        raise LogError(f"{path}: {what} ({reason}); {remedy}") from None


def _bags_in(path: Path) -> dict[str, Path]:
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
