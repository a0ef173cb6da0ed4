"""A log: a robot's drives, commands and measured poses."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from proxytune.arrays import Floats, Whole
from proxytune.errors import LogError

COMMANDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "duty": ("left", "right"),
        "twist": ("v", "omega"),
        "wheel_speed": ("wheel_command_left", "wheel_command_right"),
        "ackermann": ("throttle", "steering"),
        "speed_steering": ("speed", "steering_angle"),
        "none": (),
    }
)
"""The columns of each kind of command: duties in [−1, 1], a speed [m/s] and yaw rate [rad/s], wheel speeds [rad/s];
of a car throttle and steering in [−1, 1], left positive, or speed [m/s] and wheel angle [rad]."""
CAR_COMMANDS = ("ackermann", "speed_steering")
"""Kinds of command that are a car's."""
ENABLED = "enabled"
"""The column that says whether the motors are on (1) or cut by a switch (0)."""
POSE = ("x", "y", "heading")
WHEELS = ("wheel_left", "wheel_right")


def check_kind(command: str, robot: str, drive: str, where: str) -> None:
    """Refuse commands of another kind than a robot takes that drives as this; a twist is for any."""
    if command not in ("twist", "none") and (command in CAR_COMMANDS) != (drive == "ackermann"):
        car = drive == "ackermann"
        drives, kinds = ("steers", CAR_COMMANDS) if car else ("drives by two wheels", ("duty", "wheel_speed"))
        raise LogError(
            f"{where}: commands of kind '{command}' are not for robot '{robot}', which {drives} "
            f'(drive = "{drive}" in its robot.toml); give {", ".join(kinds)} or twist, or name another robot'
        )


class Measured(NamedTuple):
    """Poses at times of their own (N,) [s] as they were measured: x [m], y [m], heading [rad, unwrapped] (N, 3).

    Each is moved to a sample of the regular grid (N,), the nearest free one.
    """

    times: Floats
    poses: Floats
    rows: Whole


@dataclass(frozen=True)
class LogEpisode:
    """One drive: poses on a regular grid of times, commands on the same or at times of their own."""

    name: str  # what the column `episode` says
    times: Floats  # times of the samples (rows,) [s], 1 / rate_hz apart
    # what was commanded (rows, 2), in the units of the log's command kind, held until the next row; or (M, 2)
    # where commands have times of their own; where the motors were cut, what drives is 0
    commands: Floats
    poses: Floats  # measured poses (rows, 3): x [m], y [m], heading [rad, unwrapped]; NaN where there is none
    wheels: Floats | None  # measured wheel speeds (rows, 2), left and right [rad/s], or None
    # when each command was issued (M,) [s], held until the next; None where they go with the samples
    issued: Floats | None = None
    # poses as they were measured, where they have times of their own: `poses` has each moved to the nearest free
    # sample along the motion round it, by a sample at most; none where they lie on the grid
    measured: Measured | None = None

    @property
    def measured_poses(self) -> tuple[Floats, Floats]:
        """Times (N,) [s] and poses (N, 3) of the drive as they were measured, those left out that have no place."""
        times, poses = (self.times, self.poses) if self.measured is None else self.measured[:2]
        known = np.isfinite(poses[:, 0])
        return times[known], poses[known]

    @property
    def held(self) -> Floats:
        """The command in force at each sample (rows, 2); none before the first is zero."""
        if self.issued is None:
            return self.commands
        newest = np.searchsorted(self.issued, self.times + 1e-9, side="right")
        return np.concatenate((np.zeros_like(self.commands[:1]), self.commands))[newest]


@dataclass(frozen=True)
class Frames:
    """The pictures that a log's camera took, N of them."""

    paths: tuple[Path, ...]  # the files (N,)
    drives: Whole  # number of the drive that each belongs to (N,)
    times: Floats  # middle of each exposure on the poses' clock (N,) [s]
    road: str  # the map that they show: a name of the package's, or the path of a map file
    position_m: float | None = None  # standard deviation of the tracker's places [m]; None where it is not known
    heading_deg: float | None = None  # standard deviation of its headings [deg]; None where it is not known
    rectified: bool = False  # whether the lens' distortion has been taken out
    # how long a rolling shutter takes from the first row to the last [s], where that is known; 0 for a global
    # shutter; None where it is not known
    readout_s: float | None = None
    fixed_exposure: bool = False  # whether every picture was exposed alike


@dataclass(frozen=True)
class Log:
    """A robot's drives.

    Attributes:
        name: What the log is called.
        robot: Name of the robot.
        command: Kind of the commands, one of COMMANDS; "none" for still frames, whose commands are (rows, 0).
        rate_hz: Samples per second; 0 for still frames that state none, whose times are as in the file. Where poses
            have times of their own, those of the grid that they are moved to.
        geometry: Figures that log.toml states itself: wheel_radius, effective_baseline [m], full_speed [m/s].
        episodes: The drives.
        frames: What its camera saw, or None.
        clock_offset_s: How much later its poses are stamped than its commands [s], as log.toml declares; None where
            it says nothing. Commands have been moved to the poses' clock.
        fit_clock_offset: Whether log.toml asks for the offset to be fitted, the robot's delay being what it declares.
    """

    name: str
    robot: str
    command: str
    rate_hz: float
    geometry: dict[str, float]
    episodes: tuple[LogEpisode, ...]
    frames: Frames | None = None
    clock_offset_s: float | None = None
    fit_clock_offset: bool = False

    @property
    def poses_hz(self) -> float:
        """Measured poses a second: the rate of the samples, or what is usual where poses have times of their own."""
        between = [np.diff(episode.measured.times) for episode in self.episodes if episode.measured is not None]
        usual = np.concatenate(between) if between else np.empty(0)
        return 1.0 / float(np.median(usual)) if len(usual) else self.rate_hz
