"""Poses out of transforms: which frames are moved against which, composed along the chain between two."""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from proxytune.errors import LogError
from proxytune.importing.orientation import headings_and_tilts
from proxytune.importing.ros.bag import Bag
from proxytune.importing.ros.messages import frame_of, header_ns, pose_of, whole
from proxytune.importing.ros.stamps import Stamps, choose_times
from proxytune.importing.source import Floats, Poses

WORLDS = ("map", "world", "odom")
ROBOTS = ("base_link", "base_footprint")

Row = tuple[int, int, tuple[float, ...]]
"""When a transform was stamped and received [ns], and its place and quaternion."""


@dataclass(frozen=True)
class Transform:
    """How a frame stands in its parent, over time.

    Attributes:
        name: Parent and child, as in "odom>base_link".
        times: When (N,) [s]; a single one where it never changes.
        places: Where (N, 3) [m].
        quaternions: How it is turned (N, 4): x, y, z, w.
        notes: What there is to say of its times.
    """

    name: str
    times: Floats
    places: Floats
    quaternions: Floats
    notes: tuple[str, ...]

    @property
    def moves(self) -> bool:
        """Whether it changes."""
        return len(self.times) > 1


def read_transforms(bag: Bag, topics: tuple[str, ...], stamps: str) -> dict[str, Transform]:
    """The transforms of a bag, by parent and child.

    Args:
        bag: An open bag.
        topics: Topics of transforms; those named tf_static hold for all times.
        stamps: Whose times count.

    Raises:
        LogError: If a transform holds no rotation or no finite number.
    """
    rows: dict[str, list[Row]] = defaultdict(list)
    for topic in topics:
        for receive_ns, message in bag.messages(topic):
            for each in message.transforms:
                if topic.endswith("tf_static"):
                    rows[frame_of(each)].clear()
                rows[frame_of(each)].append((header_ns(each) or 0, receive_ns, pose_of(each)))
    return {name: _transform(name, some, stamps, f"{bag.path}: transform {name}") for name, some in rows.items()}


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


def read_chain(transforms: dict[str, Transform], name: str, where: str) -> tuple[Poses, tuple[str, ...]]:
    """Poses of a child in a parent, at the times of the transform between them that comes most often.

    Other moving transforms are interpolated to these times; poses outside of what they cover are left out.

    Raises:
        LogError: If no chain of transforms leads from the one to the other, or nothing in it moves.
    """
    parent, _, child = name.partition(">")
    chain = _chain(transforms, parent, child)
    if not chain:
        raise LogError(f"{where}: no transforms lead from '{parent}' to '{child}'; {_remedy(transforms)}")
    moving = [transform for transform in chain if transform.moves]
    if not moving:
        raise LogError(f"{where}: {name} never moves; {_remedy(transforms)}")
    times = max(moving, key=lambda transform: len(transform.times)).times
    times = times[_covered(times, moving)]
    if not len(times):
        raise LogError(f"{where}: the transforms between '{parent}' and '{child}' share no time; name another pair")
    place, turn = np.zeros((1, 3)), Rotation.identity(1)
    for transform in chain:
        step, rotation = _at(transform, times)
        place, turn = place + turn.apply(step), turn * rotation
    names = ", ".join(transform.name for transform in chain)
    notes = (f"Poses are {name}, of the transforms {names}.", *(note for each in moving for note in each.notes))
    return Poses(times, place, *headings_and_tilts(turn.as_quat(), f"{where}: {name}")), notes


def _transform(name: str, rows: list[Row], stamps: str, where: str) -> Transform:
    """One transform from its rows; a single one where it never changes."""
    table = np.array([values for _, _, values in rows], dtype=np.float64)
    finite = np.isfinite(table).all(axis=1)
    if not finite.all():
        raise LogError(f"{where}: number {int(np.argmin(finite)) + 1} is not finite; name another pair by --poses")
    headings_and_tilts(table[:, 3:], where)
    if (table == table[0]).all():
        return Transform(name, np.zeros(1), table[:1, :3], table[:1, 3:], ())
    header, receive = (whole([row[column] for row in rows]) for column in (0, 1))
    times, notes = choose_times(Stamps(header, receive), stamps, name)
    return Transform(name, times, table[:, :3], table[:, 3:], notes)


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


def _covered(times: Floats, transforms: list[Transform]) -> NDArray[np.bool_]:
    """Which times all transforms cover."""
    first = max(transform.times.min() for transform in transforms)
    last = min(transform.times.max() for transform in transforms)
    covered: NDArray[np.bool_] = (times >= first) & (times <= last)
    return covered


def _at(transform: Transform, times: Floats) -> tuple[Floats, Rotation]:
    """Places and rotations at some times: straight between two places, by the shortest turn between two rotations."""
    if not transform.moves or np.array_equal(transform.times, times):
        return transform.places, Rotation.from_quat(transform.quaternions)
    stamps, order = np.unique(transform.times, return_index=True)
    places = np.stack([np.interp(times, stamps, column) for column in transform.places[order].T], axis=1)
    rotations = Rotation.from_quat(transform.quaternions[order])
    return places, Slerp(stamps, rotations)(times) if len(stamps) > 1 else rotations


def _remedy(transforms: dict[str, Transform]) -> str:
    known = ", ".join(f"{name}{'' if transform.moves else ' (static)'}" for name, transform in transforms.items())
    return f"name a parent and a child by --poses 'parent>child'; the bag has {known}"
