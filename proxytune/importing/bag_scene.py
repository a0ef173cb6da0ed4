"""Scene of a bag: frames that move against each other, the chain between two, and pictures as red, green and blue.

Poses out of a chain of transforms are composed, and interpolated where these come at different times.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from proxytune.arrays import Floats
from proxytune.errors import InputError, LogError
from proxytune.importing.bag import (
    Bag,
    Stamps,
    choose_times,
    collect,
    complaints,
    frame_of,
    header_ns,
    open_bag,
    pose_of,
)
from proxytune.importing.checks import complaint, headings_and_tilts, no_rotation
from proxytune.importing.source import Pictures, Poses
from proxytune.logs import BROKEN
from proxytune.unpacking import open_picture

TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
WORLDS = ("map", "world", "odom")
ROBOTS = ("base_link", "base_footprint")
Row = tuple[int, int, tuple[float, ...]]
"""When a transform was stamped and received [ns], and its place and quaternion."""


@dataclass(frozen=True)
class Transform:
    """A frame in its parent ("odom>base_link"): stamps, and place and quaternion x, y, z, w at each (N, 7)."""

    name: str
    stamps: Stamps
    values: Floats

    @property
    def moves(self) -> bool:
        """True if it ever changes."""
        return bool((self.values != self.values[0]).any())


def read_transforms(bag: Bag) -> dict[str, Transform]:
    """The transforms of a bag, by parent and child; of topics named tf_static the last message holds for all times."""
    rows: dict[str, list[Row]] = defaultdict(list)
    for topic in (topic.name for topic in bag.topics if topic.kind in TRANSFORMS and topic.known):
        for number, (receive_ns, message) in enumerate(bag.messages(topic), start=1):
            with complaints(bag.path, f"{topic}, message {number}: is not what its type says"):
                for each in message.transforms:
                    if topic.endswith("tf_static"):
                        rows[frame_of(each)].clear()
                    rows[frame_of(each)].append((header_ns(each) or 0, receive_ns, tuple(map(float, pose_of(each)))))
    transforms = {}
    for name, some in rows.items():
        header, receive, values = zip(*some, strict=True)
        with complaints(bag.path, f"{name}: has stamps that are no times"):
            stamps = Stamps(*(np.array(one, dtype=np.int64) for one in (header, receive)))
        transforms[name] = Transform(name, stamps, np.array(values, dtype=np.float64))
    return transforms


def choose_transform(transforms: dict[str, Transform], where: str) -> str:
    """Parent and child of the robot's pose: a map, world or odom frame and a base, or all that moves."""
    for parent in WORLDS:
        for child in ROBOTS:
            for name in _pairs(transforms, parent, child):
                return name
    moving = [name for name, transform in transforms.items() if transform.moves]
    if len(moving) == 1:
        return moving[0]
    raise LogError(f"{where}: no transform is plainly the robot's pose; {_remedy(transforms)}")


def read_chain(transforms: dict[str, Transform], name: str, stamps: str, where: str) -> tuple[Poses, tuple[str, ...]]:
    """Poses of a child in a parent ("map>base_link"), at the times of the transform between them that comes most often.

    Other moving transforms are interpolated to these times; poses outside of what they cover are left out.
    """
    parent, _, child = name.partition(">")
    if not (chain := _chain(transforms, parent, child)):
        raise LogError(f"{where}: no transforms lead from '{parent}' to '{child}'; {_remedy(transforms)}")
    if not any(transform.moves for transform in chain):
        raise LogError(f"{where}: {name} never moves; {_remedy(transforms)}")
    for transform in chain:
        finite, about = np.isfinite(transform.values).all(axis=1), f"{where}: transform {transform.name}"
        if not finite.all():
            raise LogError(f"{about}: number {int(np.argmin(finite)) + 1} is not finite; name another by --poses")
        wrong = no_rotation(transform.values[:, 3:])
        if wrong.any():
            raise complaint(transform.values[:, 3:], wrong, about)
    choices = {each.name: choose_times(each.stamps, stamps, each.name) for each in chain if each.moves}
    times = {moving: of_it for moving, (of_it, _) in choices.items()}
    most = max(times.values(), key=len)
    first, last = max(other.min() for other in times.values()), min(other.max() for other in times.values())
    common = most[(most >= first) & (most <= last)]
    if not len(common):
        raise LogError(f"{where}: the transforms of {name} share no time; name another pair by --poses")
    place, turn = np.zeros((len(common), 3)), Rotation.identity(1)
    for transform in chain:
        step, rotation = _at(transform.values, times.get(transform.name), common)
        place, turn = place + turn.apply(step), turn * rotation
    said = (note for _, notes in choices.values() for note in notes)
    poses = Poses(common, place, *headings_and_tilts(turn.as_quat(), f"{where}: {name}"))
    names, left_out = ", ".join(transform.name for transform in chain), len(most) - len(common)
    outside = f"; {left_out} outside of what all of them cover are left out" if left_out else ""
    return poses, (f"Poses of {child} in {parent} are composed of {names}{outside}.", *said)


def _at(values: Floats, times: Floats | None, wanted: Floats) -> tuple[Floats, Rotation]:
    """Places and rotations at wanted times: straight between two places, by the shortest turn between two rotations.

    Without times, a transform stands still.
    """
    if times is None:
        return values[:1, :3], Rotation.from_quat(values[:1, 3:])
    if np.array_equal(times, wanted):
        return values[:, :3], Rotation.from_quat(values[:, 3:])
    stamps, order = np.unique(times, return_index=True)
    places = np.stack([np.interp(wanted, stamps, column) for column in values[order, :3].T], axis=1)
    rotations = Rotation.from_quat(values[order, 3:])
    return places, Slerp(stamps, rotations)(wanted) if len(stamps) > 1 else rotations


def _pairs(transforms: dict[str, Transform], parent: str, child: str) -> list[str]:
    """Pairs of frames with these last names that a chain leads between, as in "map>robot1/base_link"."""
    frames = sorted({frame for name in transforms for frame in name.split(">")})
    parents, children = ([f for f in frames if f.rpartition("/")[2] == last] for last in (parent, child))
    pairs = [(p, c) for p in parents for c in children]
    return [f"{p}>{c}" for p, c in pairs if any(each.moves for each in _chain(transforms, p, c))]


def _chain(transforms: dict[str, Transform], parent: str, child: str) -> list[Transform]:
    """Transforms that lead from a parent down to a child; none where there is no way."""
    ways: list[tuple[str, list[Transform]]] = [(child, [])]
    met = {child}
    for frame, chain in ways:
        for transform in transforms.values():
            above, _, below = transform.name.partition(">")
            if below == frame and above not in met:
                longer = [transform, *chain]
                if above == parent:
                    return longer
                met.add(above)
                ways.append((above, longer))
    return []


def _remedy(transforms: dict[str, Transform]) -> str:
    known = ", ".join(f"{name}{'' if transform.moves else ' (static)'}" for name, transform in transforms.items())
    return f"name a parent and a child by --poses 'parent>child'; the bag has {known}"


Picture = NDArray[np.uint8]
ENCODINGS: Mapping[str, tuple[int, tuple[int, int, int]]] = {
    "rgb8": (3, (0, 1, 2)),
    "bgr8": (3, (2, 1, 0)),
    "rgba8": (4, (0, 1, 2)),
    "bgra8": (4, (2, 1, 0)),
    "mono8": (1, (0, 0, 0)),
}
"""Bytes of a pixel, and which of them are red, green and blue."""
PACKED = ("PNG", "JPEG", "TIFF", "WEBP")
"""As Pillow calls what ROS packs pictures as."""


def read_pictures(bag: Bag, topic: str, stamps: str) -> tuple[Pictures, tuple[str, ...]]:
    """The pictures of a topic, and what there is to say of their times.

    Times are read at once, the pictures when they are asked for, from the bag opened anew.
    """
    both, _ = collect(bag, topic, _check)
    times, notes = choose_times(both, stamps, topic)
    return Pictures(times, partial(iterate, bag.path, topic)), notes


def iterate(path: Path, topic: str) -> Iterator[Picture]:
    """The pictures of a topic, one after the other, (rows, columns, 3) each."""
    with open_bag(path) as bag:
        for number, (_, message) in enumerate(bag.messages(topic), start=1):
            try:
                with complaints(path, "is not what its type says"):
                    picture = picture_of(message)
            except InputError as problem:
                raise LogError(f"{path}: {topic}, message {number}: {problem}") from None
            yield picture


def picture_of(message: Any) -> Picture:
    """Red, green and blue (rows, columns, 3) of an Image or a CompressedImage."""
    if not hasattr(message, "encoding"):
        try:
            packed = BytesIO(np.asarray(message.data, dtype=np.uint8).tobytes())
            with open_picture(packed, "it", PACKED) as image:
                if image.mode.startswith(("I", "F")):
                    raise LogError("has more than 8 bits a pixel; leave pictures out by --pictures none")
                return np.array(image.convert("RGB"))
        except BROKEN:
            text = f"is no picture that can be read (format '{message.format}')"
            raise LogError(f"{text}; record it again, or leave pictures out by --pictures none") from None
    _check(message)
    channels, order = ENCODINGS[message.encoding]
    rows = np.asarray(message.data, dtype=np.uint8)[: message.step * message.height].reshape(message.height, -1)
    pixels = rows[:, : channels * message.width].reshape(message.height, message.width, channels)
    return np.ascontiguousarray(pixels[:, :, order])


def _check(message: Any) -> tuple[float, ...]:
    """Refuse a picture that could not be made later; a compressed one shows only when it is opened."""
    if not hasattr(message, "encoding"):
        return ()
    if message.encoding not in ENCODINGS:
        known = ", ".join(ENCODINGS)
        raise LogError(f"encoding '{message.encoding}' is none of {known}; leave pictures out by --pictures none")
    if not (message.width and message.height):
        raise LogError("has no pixels; record it again, or leave pictures out by --pictures none")
    channels = ENCODINGS[message.encoding][0]
    if message.step < channels * message.width or len(message.data) < message.step * message.height:
        size = f"{message.width} × {message.height} pixels in rows of {message.step} bytes"
        raise LogError(f"{len(message.data)} bytes do not hold {size}; record it again, or take --pictures none")
    return ()
