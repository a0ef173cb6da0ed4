"""Transforms of a bag: which frames move against which, and the chain between two."""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from proxytune.errors import LogError
from proxytune.importing.ros.bag import Bag
from proxytune.importing.ros.messages import frame_of, header_ns, pose_of, whole
from proxytune.importing.ros.stamps import Stamps
from proxytune.importing.source import Floats

WORLDS = ("map", "world", "odom")
ROBOTS = ("base_link", "base_footprint")

Row = tuple[int, int, tuple[float, ...]]
"""When a transform was stamped and received [ns], and its place and quaternion."""


@dataclass(frozen=True)
class Transform:
    """How a frame stands in its parent, over time.

    Attributes:
        name: Parent and child, as in "odom>base_link".
        stamps: When it was stamped and received, N times.
        values: Place and quaternion x, y, z, w (N, 7).
    """

    name: str
    stamps: Stamps
    values: Floats

    @property
    def moves(self) -> bool:
        """Whether it ever changes."""
        return bool((self.values != self.values[0]).any())


def read_transforms(bag: Bag, topics: tuple[str, ...]) -> dict[str, Transform]:
    """The transforms of a bag, by parent and child.

    Args:
        bag: An open bag.
        topics: Topics of transforms; of those named tf_static the last message holds for all times.

    Raises:
        LogError: If a message cannot be read.
    """
    rows: dict[str, list[Row]] = defaultdict(list)
    for topic in topics:
        for receive_ns, message in bag.messages(topic):
            for each in message.transforms:
                if topic.endswith("tf_static"):
                    rows[frame_of(each)].clear()
                rows[frame_of(each)].append((header_ns(each) or 0, receive_ns, pose_of(each)))
    return {name: _transform(name, some) for name, some in rows.items()}


def choose_transform(transforms: dict[str, Transform], where: str) -> str:
    """Parent and child of the robot's pose: a map, world or odom frame and a base, or all that moves.

    Raises:
        LogError: If none is plainly the robot's pose.
    """
    for parent in WORLDS:
        for child in ROBOTS:
            for name in _pairs(transforms, parent, child):
                return name
    moving = [name for name, transform in transforms.items() if transform.moves]
    if len(moving) == 1:
        return moving[0]
    raise LogError(f"{where}: no transform is plainly the robot's pose; {_remedy(transforms)}")


def chain_of(transforms: dict[str, Transform], name: str, where: str) -> list[Transform]:
    """The transforms that lead from a parent down to a child, as in "map>base_link".

    Raises:
        LogError: If there is no way, or nothing on it moves.
    """
    parent, _, child = name.partition(">")
    chain = _chain(transforms, parent, child)
    if not chain:
        raise LogError(f"{where}: no transforms lead from '{parent}' to '{child}'; {_remedy(transforms)}")
    if not any(transform.moves for transform in chain):
        raise LogError(f"{where}: {name} never moves; {_remedy(transforms)}")
    return chain


def _transform(name: str, rows: list[Row]) -> Transform:
    header, receive = (whole([row[column] for row in rows]) for column in (0, 1))
    return Transform(name, Stamps(header, receive), np.array([values for _, _, values in rows], dtype=np.float64))


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
