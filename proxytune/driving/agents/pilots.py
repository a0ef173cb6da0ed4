"""Agents that see the lane, each its own way, and steer for its centre."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from proxytune.driving.agents.agent import Command, Picture
from proxytune.driving.agents.perception import (
    Eye,
    Lane,
    Pixels,
    fit_lane,
    open_eye,
    white_pixels,
    yellow_pixels,
)
from proxytune.driving.robot import Robot

HALF_LANE_M = 0.128
"""From a lane's centre to the middle of the marking on either side of it [m]."""

_NONE: Pixels = np.empty(0, dtype=np.intp)


class Sight(NamedTuple):
    """What a pilot remembers: the eye, the robot's figures that turn a twist into duties, and the last lane seen."""

    eye: Eye
    full_speed: float
    baseline: float
    lane: Lane


def _begin(robot: Robot, reach_m: float) -> Sight:
    return Sight(
        open_eye(robot, reach_m=reach_m),
        robot.figures["full_speed"],
        robot.figures["effective_baseline"],
        Lane(0.0, 0.0, 0),
    )


def duties(speed: float, yaw_rate: float, *, full_speed: float, baseline: float) -> Command:
    """Duties for a forward speed [m/s] and a yaw rate [rad/s]; where a wheel saturates, turning goes first."""
    turn = min(max(float(yaw_rate * baseline / 2.0), -full_speed), full_speed)
    room = full_speed - abs(turn)
    ahead = min(max(float(speed), -room), room)
    return np.array((ahead - turn, ahead + turn)) / full_speed


@dataclass(frozen=True)
class LanePilot:
    """Segments the markings by colour, projects them on the floor and steers by offset and direction (PD).

    Attributes:
        speed: Forward speed [m/s].
        offset_gain: Yaw rate for the lane's offset [rad/s per m].
        slope_gain: Yaw rate for the lane's direction [rad/s].
        markings: Which markings it goes by.
        reach_m: How far ahead it looks [m].
        contrast: How yellow a pixel must be (of 255).
        brightness: How white a pixel must be (of 255).
    """

    speed: float
    offset_gain: float
    slope_gain: float
    markings: Literal["both", "yellow", "white"] = "both"
    reach_m: float = 0.5
    contrast: float = 60.0
    brightness: float = 150.0

    def begin(self, robot: Robot) -> Sight:
        """Nothing seen yet."""
        return _begin(robot, self.reach_m)

    def act(self, picture: Picture, memory: Sight) -> tuple[Command, Sight]:
        """Steer for the lane; where none is seen, as the last time."""
        eye = memory.eye
        yellow = _NONE if self.markings == "white" else yellow_pixels(picture, eye, contrast=self.contrast)
        white = _NONE if self.markings == "yellow" else white_pixels(picture, eye, brightness=self.brightness)
        lane = fit_lane(eye, yellow=yellow, white=white, half_lane_m=HALF_LANE_M) or memory.lane
        yaw_rate = self.offset_gain * lane.offset + self.slope_gain * lane.slope
        command = duties(self.speed, yaw_rate, full_speed=memory.full_speed, baseline=memory.baseline)
        return command, Sight(eye, memory.full_speed, memory.baseline, lane)


@dataclass(frozen=True)
class PursuitPilot:
    """Pure pursuit of a point on the lane's centre as the markings show it.

    Attributes:
        speed: Forward speed on the straight [m/s].
        look_ahead_m: Distance of the point pursued [m].
        caution: Share of the speed given up per unit of curvature times look-ahead.
    """

    speed: float
    look_ahead_m: float
    caution: float = 0.0

    def begin(self, robot: Robot) -> Sight:
        """Nothing seen yet."""
        return _begin(robot, 1.6 * self.look_ahead_m)

    def act(self, picture: Picture, memory: Sight) -> tuple[Command, Sight]:
        """Drive the arc through the point pursued."""
        eye = memory.eye
        yellow, white = yellow_pixels(picture, eye), white_pixels(picture, eye)
        lane = fit_lane(eye, yellow=yellow, white=white, half_lane_m=HALF_LANE_M) or memory.lane
        left = lane.offset + lane.slope * self.look_ahead_m
        curvature = 2.0 * left / (self.look_ahead_m**2 + left**2)
        speed = self.speed / (1.0 + self.caution * abs(curvature) * self.look_ahead_m)
        command = duties(speed, speed * curvature, full_speed=memory.full_speed, baseline=memory.baseline)
        return command, Sight(eye, memory.full_speed, memory.baseline, lane)
