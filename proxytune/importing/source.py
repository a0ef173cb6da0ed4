"""What every importer makes of a source: drives with commands, poses and pictures, each at times of their own."""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Commands:
    """Commands as they were issued, M of them.

    Attributes:
        kind: One of `proxytune.logs.COMMANDS`, which says what the two columns are.
        times: When each was issued (M,) [s], as stamped.
        values: What was commanded (M, 2).
    """

    kind: str
    times: Floats
    values: Floats


@dataclass(frozen=True)
class Poses:
    """Poses as they were measured, N of them.

    Attributes:
        times: When each was measured (N,) [s], as stamped.
        places: Where the robot was (N, 3): x, y, z [m].
        headings: How it was turned about the upward axis (N,) [rad].
        tilts: Angle between its upward axis and the world's (N,) [rad]; 0 where the source has headings alone.
    """

    times: Floats
    places: Floats
    headings: Floats
    tilts: Floats

    def only(self, chosen: NDArray[Any]) -> "Poses":
        """Some of the poses, by number or by mask."""
        return Poses(self.times[chosen], self.places[chosen], self.headings[chosen], self.tilts[chosen])


@dataclass(frozen=True)
class Pictures:
    """Pictures of the robot's camera, K of them, read one after the other.

    Attributes:
        times: When each was taken (K,) [s], as stamped.
        read: Makes them, (rows, columns, 3) of red, green and blue.
    """

    times: Floats
    read: Callable[[], Iterator[NDArray[np.uint8]]]


@dataclass(frozen=True)
class Drive:
    """One drive of a source.

    Attributes:
        name: What the log calls the episode.
        commands: What was commanded, or None.
        poses: What was measured.
        pictures: What the camera saw, or None.
    """

    name: str
    commands: Commands | None
    poses: Poses
    pictures: Pictures | None = None


@dataclass(frozen=True)
class Channel:
    """Something that a source holds: a topic, a column or an array.

    Attributes:
        name: What the source calls it.
        kind: Its type, as in geometry_msgs/msg/Twist.
        count: How many messages or rows it has.
        role: What it is taken for, as in "commands", or why it is left out.
    """

    name: str
    kind: str
    count: int
    role: str


@dataclass(frozen=True)
class Survey:
    """A drive in numbers.

    Attributes:
        name: What the log calls it.
        seconds: From its first pose to its last [s].
        poses: How many were measured.
        poses_hz: At the usual interval between them.
        lost: Share of the poses that dropped out, gaps apart.
        gaps: Times without a pose of more than half a second.
        longest_gap_s: The longest of them [s].
        jitter_s: Standard deviation of the intervals between poses, drop-outs apart [s].
        commands: How many were issued.
        frames: How many pictures were taken.
        lag_s: How long after its command it turns [s]; below 0: before it. None where that cannot be told.
    """

    name: str
    seconds: float
    poses: int
    poses_hz: float
    lost: float
    gaps: int
    longest_gap_s: float
    jitter_s: float
    commands: int
    frames: int
    lag_s: float | None

    @property
    def facts(self) -> dict[str, Any]:
        """What a JSON document says of it."""
        return asdict(self)


@dataclass(frozen=True)
class Source:
    """What an importer found.

    Attributes:
        form: What the source is, as in "ROS 2 bag (mcap)".
        drives: Its drives.
        channels: All that it holds, and what each was taken for.
        notes: What was decided on the way, a sentence each.
        surveys: The drives in numbers, once their stamps have been checked.
    """

    form: str
    drives: tuple[Drive, ...]
    channels: tuple[Channel, ...]
    notes: tuple[str, ...]
    surveys: tuple[Survey, ...] = ()

    @property
    def facts(self) -> dict[str, Any]:
        """What a JSON document says of it."""
        channels = [{"name": c.name, "type": c.kind, "count": c.count, "role": c.role} for c in self.channels]
        return {"form": self.form, "channels": channels, "notes": list(self.notes)}
