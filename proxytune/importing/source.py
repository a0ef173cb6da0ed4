"""The contract of importers: what a user asks for (Wanted), what every importer returns (Source), and further Facts.

A source has drives with commands, poses, wheel speeds and pictures, each at times of their own.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Floats
from proxytune.errors import InputError
from proxytune.settings import GEOMETRY


@dataclass(frozen=True)
class Commands:
    """Commands (M, 2) as they were issued at times (M,) [s], as stamped; `proxytune.logs.COMMANDS` has their kinds.

    A third column is `enabled`, where the source has it.
    """

    kind: str
    times: Floats
    values: Floats
    in_rows: bool = False  # whether they stand in the rows of poses, and have no times of their own


@dataclass(frozen=True)
class Poses:
    """Poses as they were measured at times (N,) [s], as stamped: places x, y, z (N, 3) [m], and headings (N,) [rad].

    Tilts are of its upward axis from the world's (N,) [rad]; 0 where the source has headings alone.
    """

    times: Floats
    places: Floats
    headings: Floats
    tilts: Floats

    def only(self, chosen: NDArray[Any]) -> "Poses":
        """Some of the poses, by number or by mask."""
        return Poses(self.times[chosen], self.places[chosen], self.headings[chosen], self.tilts[chosen])


@dataclass(frozen=True)
class Wheels:
    """Speeds of the left and the right wheel (W, 2) [rad/s] as they were measured at times (W,) [s], in order."""

    times: Floats
    speeds: Floats

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """The speeds of the left and the right wheel at other times (N,), NaN before the first and after the last."""
        left, right = (np.interp(times, self.times, own, np.nan, np.nan) for own in self.speeds.T)
        return left, right


@dataclass(frozen=True)
class Pictures:
    """Pictures of the robot's camera, taken at K times [s]; `read` makes them, (rows, columns, 3), one by one."""

    times: Floats
    read: Callable[[], Iterator[NDArray[np.uint8]]]


@dataclass(frozen=True)
class Drive:
    """One drive of a source, as the log calls it: what was recorded, None where it was not."""

    name: str
    commands: Commands | None
    poses: Poses
    pictures: Pictures | None = None
    wheels: Wheels | None = None


@dataclass(frozen=True)
class Channel:
    """A topic, column or array of a source: its type, how many messages or rows, and its role, or why it has none."""

    name: str
    kind: str
    count: int
    role: str


@dataclass(frozen=True)
class Survey:
    """A drive in numbers."""

    name: str  # what the log calls it
    seconds: float  # from its first pose to its last [s]
    poses: int  # how many were measured
    poses_hz: float  # at the usual interval between them
    lost: float  # share of the poses that dropped out, gaps apart
    gaps: int  # times without a pose of more than half a second
    longest_gap_s: float  # the longest of them [s]
    jitter_s: float  # standard deviation of the intervals between poses, drop-outs apart [s]
    commands: int  # how many were issued
    frames: int  # how many pictures were taken
    lag_s: float | None  # how long after its command it turns [s]; below 0: before it; none where that cannot be told


@dataclass(frozen=True)
class Source:
    """The findings of an importer."""

    form: str  # what the source is, as in "ROS 2 bag (mcap)"
    drives: tuple[Drive, ...]
    channels: tuple[Channel, ...]  # all that it holds, and what each was taken for
    notes: tuple[str, ...]  # what was decided on the way, a sentence each
    surveys: tuple[Survey, ...] = ()  # the drives in numbers, once their stamps have been checked


@dataclass(frozen=True)
class Wanted:
    """Choices of what to take from a source; whatever is left empty is chosen by what there is."""

    commands: str = ""  # topic of the commands; "none" for a log without them
    poses: str = ""  # topic of the poses, or parent and child of a transform as "map>base_link"
    frames: str = ""  # topic of the pictures; "none" to leave them out
    wheels: str = ""  # topic of joints with measured wheel speeds, of a bag; taken only if named
    stamps: str = "header"  # whose times count: "header" (when it was measured) or "receive" (when it was written down)
    # of a table or of arrays: our name to theirs, with the unit where it is not ours, as in {"time":
    # "stamp_ns:ns", "x": "pos_x_mm:mm", "heading": "yaw_deg:deg", "v": "cmd_lin"}
    columns: Mapping[str, str] = field(default_factory=dict)
    kind: str = ""  # kind of the commands, one of `proxytune.logs.COMMANDS`, where the source does not say
    vesc: Path | None = None  # the vesc.yaml of a car whose bag has what its VESC was sent

    @property
    def without_commands(self) -> bool:
        """True if the log is to have no commands."""
        return "none" in (self.commands, self.kind)


@dataclass(frozen=True)
class Facts:
    """Statements that only the user can make of a source."""

    robot: str = ""  # name of the robot; empty: the log's own name
    # its wheel_radius_m, baseline_m and full_speed_m_s, where there is no folder of it
    figures: Mapping[str, float] = field(default_factory=dict)
    road: str = ""  # the map that pictures show: a name, or the path of a map file
    clock_offset: str = ""  # seconds that poses are stamped later than commands, "fit", or empty

    @property
    def offset_s(self) -> float:
        """Seconds that poses are known to be stamped later than commands."""
        return 0.0 if self.clock_offset in ("", "fit") else float(self.clock_offset)


def told_once(said: Sequence[tuple[str, str]], count: int, what: str) -> list[tuple[str, str]]:
    """Names and what is said of them: every note once, with the names that it is of, or "all 8 drives"."""
    names: dict[str, list[str]] = {}
    for name, note in said:
        names.setdefault(note, []).append(name)
    return [(f"all {count} {what}" if len(own) == count > 1 else ", ".join(own), note) for note, own in names.items()]


def finite(text: str) -> float | None:
    """The finite number that a text states, if it does."""
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def read_geometry(given: list[str]) -> dict[str, float]:
    """Measures of a robot from texts such as baseline_m=0.16; any other is an InputError."""
    geometry = {}
    for text in given:
        key, _, value = text.partition("=")
        if key.strip() not in GEOMETRY:
            raise InputError(f"--figure {text}: write one of {', '.join(GEOMETRY)}, as in baseline_m=0.16")
        number = finite(value)
        if number is None or number <= 0.0:
            raise InputError(f"--figure {text}: '{value}' is no length or speed; write it as in {key}=0.16")
        geometry[key.strip()] = number
    return geometry
