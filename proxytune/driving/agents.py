"""Agents: controllers that see only the camera's picture and know only the robot's nominal figures.

Some segment the markings by colour, project them on the floor and steer for the lane's centre; some go by the picture
itself. Around any of them others react later, smooth, lean to one side, or slow down where the view is smeared.
`load_agent` finds an agent by name: one of `AGENTS`, a plug-in, or a user's own as `module:attribute`.
"""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.agent import Agent, Command, Picture
from proxytune.driving.optics import CameraFigures, ground_points
from proxytune.driving.robot import Robot
from proxytune.extensions import make

Pixels = NDArray[np.intp]


class Lane(NamedTuple):
    """A straight line through the lane's centre in the robot's frame: left(x) = offset + slope · x.

    Attributes:
        offset: How far to the left of the axle's middle the lane's centre lies [m].
        slope: Tangent of the lane's direction, positive to the left.
        pixels: How many pixels say so.
    """

    offset: float
    slope: float
    pixels: int


@dataclass(frozen=True)
class Eye:
    """The part of the picture that the nominal camera takes for nearby floor.

    Attributes:
        first_row: The rows from here on are looked at.
        ahead: How far ahead of the axle each of their pixels lies [m], NaN beyond `reach`.
        left: How far to the left [m].
        near: Whether it lies within `reach`.
    """

    first_row: int
    ahead: NDArray[np.float64]
    left: NDArray[np.float64]
    near: NDArray[np.bool_]


@functools.lru_cache
def _eye(figures: CameraFigures, reach_m: float) -> Eye:
    ground = ground_points(figures)
    near = ground[..., 0] <= reach_m
    first_row = int(np.argmax(near.any(axis=1)))
    floor = np.where(near[..., None], ground, np.nan)[first_row:].reshape(-1, 2)
    ahead, left = np.ascontiguousarray(floor.T)
    return Eye(first_row, ahead, left, near[first_row:].ravel())


def open_eye(robot: Robot, *, reach_m: float = 0.7) -> Eye:
    """The eye of an agent on this robot, looking no further ahead than `reach_m`."""
    return _eye(robot.camera_figures(), reach_m)


def yellow_pixels(picture: Picture, eye: Eye, *, contrast: float = 60.0) -> Pixels:
    """Pixels of the dashed centre line: red and green brighter than blue by `contrast` (of 255)."""
    looked = picture[eye.first_row :].reshape(-1, 3)
    blue = looked[:, 2].astype(np.int16)
    yellow = np.minimum(looked[:, 0], looked[:, 1]) - blue > contrast
    return (yellow & eye.near).nonzero()[0]


def white_pixels(picture: Picture, eye: Eye, *, brightness: float = 150.0) -> Pixels:
    """Pixels of the solid edge lines: every colour brighter than `brightness` (of 255)."""
    looked = picture[eye.first_row :].reshape(-1, 3)
    darkest = np.minimum(np.minimum(looked[:, 0], looked[:, 1]), looked[:, 2])
    return ((darkest > brightness) & eye.near).nonzero()[0]


def fit_lane(eye: Eye, *, yellow: Pixels, white: Pixels, half_lane_m: float) -> Lane | None:
    """Least squares through the lane's centre: right of the yellow line, left of the white one.

    White pixels to the left of the yellow ones belong to the other lane's edge and are left out.

    Returns:
        The lane, or None where fewer than six pixels are left to fit.
    """
    left_of_robot = eye.left.take(yellow)
    divide = left_of_robot.sum() / yellow.size if yellow.size else half_lane_m
    white = white[eye.left.take(white) < divide]
    count = yellow.size + white.size
    if count < 6:
        return None
    ahead = eye.ahead.take(np.concatenate((yellow, white)))
    left = np.concatenate((left_of_robot - half_lane_m, eye.left.take(white) + half_lane_m))
    mean_ahead, mean_left = float(ahead.sum()) / count, float(left.sum()) / count
    centred = ahead - mean_ahead
    # a ridge keeps a handful of pixels at one distance from spinning the line round
    slope = float((centred * left).sum()) / (float((centred * centred).sum()) + 0.005 * count)
    return Lane(mean_left - slope * mean_ahead, slope, count)


HALF_LANE_M = 0.128
"""From a lane's centre to the middle of the marking on either side of it [m]."""

_NONE: Pixels = np.empty(0, dtype=np.intp)


class PilotMemory(NamedTuple):
    """Memory of a pilot: the eye, the robot's figures that turn a twist into duties, and the last lane seen."""

    eye: Eye
    full_speed: float
    baseline: float
    lane: Lane


def _begin(robot: Robot, reach_m: float) -> PilotMemory:
    return PilotMemory(
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

    def begin(self, robot: Robot) -> PilotMemory:
        """Nothing seen yet."""
        return _begin(robot, self.reach_m)

    def act(self, picture: Picture, memory: PilotMemory) -> tuple[Command, PilotMemory]:
        """Steer for the lane; where none is seen, as the last time."""
        eye = memory.eye
        yellow = _NONE if self.markings == "white" else yellow_pixels(picture, eye, contrast=self.contrast)
        white = _NONE if self.markings == "yellow" else white_pixels(picture, eye, brightness=self.brightness)
        lane = fit_lane(eye, yellow=yellow, white=white, half_lane_m=HALF_LANE_M) or memory.lane
        yaw_rate = self.offset_gain * lane.offset + self.slope_gain * lane.slope
        command = duties(self.speed, yaw_rate, full_speed=memory.full_speed, baseline=memory.baseline)
        return command, PilotMemory(eye, memory.full_speed, memory.baseline, lane)


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

    def begin(self, robot: Robot) -> PilotMemory:
        """Nothing seen yet."""
        return _begin(robot, 1.6 * self.look_ahead_m)

    def act(self, picture: Picture, memory: PilotMemory) -> tuple[Command, PilotMemory]:
        """Drive the arc through the point pursued."""
        eye = memory.eye
        yellow, white = yellow_pixels(picture, eye), white_pixels(picture, eye)
        lane = fit_lane(eye, yellow=yellow, white=white, half_lane_m=HALF_LANE_M) or memory.lane
        left = lane.offset + lane.slope * self.look_ahead_m
        curvature = 2.0 * left / (self.look_ahead_m**2 + left**2)
        speed = self.speed / (1.0 + self.caution * abs(curvature) * self.look_ahead_m)
        command = duties(speed, speed * curvature, full_speed=memory.full_speed, baseline=memory.baseline)
        return command, PilotMemory(eye, memory.full_speed, memory.baseline, lane)


class Wiring(NamedTuple):
    """The weight of every pixel on the turn, and the robot's figures that turn a twist into duties."""

    weights: NDArray[np.float64]
    first_row: int
    full_speed: float
    baseline: float


def _wire(robot: Robot, first_row: float) -> Wiring:
    rows, columns = int(robot.figures["camera_rows"]), int(robot.figures["camera_columns"])
    top = int(first_row * rows)
    side = np.linspace(-1.0, 1.0, columns)
    weights = np.repeat(side[None, :], rows - top, axis=0)
    return Wiring(weights, top, robot.figures["full_speed"], robot.figures["effective_baseline"])


@dataclass(frozen=True)
class Braitenberg:
    """Two eyes, crossed wires: yellow on the right pushes right, white on the left pushes left.

    Like Duckietown's Braitenberg exercise: what it sees drives the wheels and nothing is remembered.

    Attributes:
        speed: Forward speed [m/s].
        push: Yaw rate for a marking that fills its half of the picture's lower part [rad/s].
        first_row: Where the lower part begins, as a share of the picture's height.
    """

    speed: float
    push: float
    first_row: float = 0.45

    def begin(self, robot: Robot) -> Wiring:
        """Wires for this robot's camera."""
        return _wire(robot, self.first_row)

    def act(self, picture: Picture, memory: Wiring) -> tuple[Command, Wiring]:
        """Steer away from yellow on the right and from white on the left, towards the room between them."""
        red, green, blue = np.moveaxis(picture[memory.first_row :].astype(np.int16), -1, 0)
        yellow = np.minimum(red, green) - blue > 60
        white = np.minimum(np.minimum(red, green), blue) > 150
        right_half = memory.weights > -0.35
        left_half = memory.weights < 0.35
        away_from_yellow = (yellow & right_half).mean()
        away_from_white = (white & ~left_half).mean()
        yaw_rate = self.push * (away_from_white - away_from_yellow)
        return duties(self.speed, yaw_rate, full_speed=memory.full_speed, baseline=memory.baseline), memory


@dataclass(frozen=True)
class EdgePilot:
    """Balances sharp edges: steers for the gap between the contours left and right of the picture's middle.

    It sees brightness steps, not colours, so a smeared picture leaves it little to go by.

    Attributes:
        speed: Forward speed [m/s].
        gain: Yaw rate when all contours are on one side [rad/s].
        step: Smallest brightness step between neighbouring pixels that counts (of 255).
        first_row: Where in the picture it begins to look, as a share of the height.
    """

    speed: float
    gain: float
    step: float = 60.0
    first_row: float = 0.55

    def begin(self, robot: Robot) -> Wiring:
        """Wires for this robot's camera."""
        return _wire(robot, self.first_row)

    def act(self, picture: Picture, memory: Wiring) -> tuple[Command, Wiring]:
        """Turn from the side with more edges, and the nearer to the middle they are the harder."""
        grey = picture[memory.first_row :].astype(np.int16).sum(axis=-1) // 3
        edges = np.abs(np.diff(grey, axis=1)) > self.step
        side = memory.weights[:, 1:]
        pull = np.where(edges, np.sign(side) * (1.0 - np.abs(side)), 0.0).sum()
        yaw_rate = self.gain * float(pull) / max(int(edges.sum()), 8)
        return duties(self.speed, yaw_rate, full_speed=memory.full_speed, baseline=memory.baseline), memory


@dataclass(frozen=True)
class Smoothed:
    """Low-pass filters another agent's commands: each step it goes a share of the way to the new one."""

    agent: Agent
    share: float

    def begin(self, robot: Robot) -> tuple[Command, Any]:
        """At rest."""
        return np.zeros(2), self.agent.begin(robot)

    def act(self, picture: Picture, memory: tuple[Command, Any]) -> tuple[Command, tuple[Command, Any]]:
        """Go part of the way to what the other agent wants."""
        last, inner = memory
        wanted, inner = self.agent.act(picture, inner)
        command = last + self.share * (wanted - last)
        return command, (command, inner)


@dataclass(frozen=True)
class Laggy:
    """Issues another agent's commands some control steps late, as slow image processing does."""

    agent: Agent
    steps: int

    def begin(self, robot: Robot) -> tuple[tuple[Command, ...], Any]:
        """Rest commands until the first one is due."""
        return (np.zeros(2),) * self.steps, self.agent.begin(robot)

    def act(
        self, picture: Picture, memory: tuple[tuple[Command, ...], Any]
    ) -> tuple[Command, tuple[tuple[Command, ...], Any]]:
        """Queue the new command and issue the oldest."""
        waiting, inner = memory
        wanted, inner = self.agent.act(picture, inner)
        waiting = (*waiting, wanted)
        return waiting[0], (waiting[1:], inner)


@dataclass(frozen=True)
class Leaning:
    """Another agent on a robot whose right wheel it believes to be weaker than it is."""

    agent: Agent
    bias: float

    def begin(self, robot: Robot) -> Any:
        """As the other agent."""
        return self.agent.begin(robot)

    def act(self, picture: Picture, memory: Any) -> tuple[Command, Any]:
        """Give the left wheel less and the right wheel more."""
        command, memory = self.agent.act(picture, memory)
        return np.clip(command * np.array((1.0 - self.bias, 1.0 + self.bias)), -1.0, 1.0), memory


@dataclass(frozen=True)
class Wary:
    """Another agent's path, driven as fast as the yellow dashes look crisp.

    Motion smears the dashes into their gaps, so this agent drives at the speed at which it still sees well.

    Attributes:
        agent: Whose path it drives.
        contrast: How yellow a pixel must be to count as crisp (of 255).
        crisp: How many crisp pixels it takes to drive at full speed.
        slowest: Share of the speed it keeps when it sees none.
    """

    agent: Agent
    contrast: float
    crisp: float
    slowest: float = 0.3

    def begin(self, robot: Robot) -> tuple[Eye, float, Any]:
        """At its slowest."""
        return open_eye(robot, reach_m=0.5), self.slowest, self.agent.begin(robot)

    def act(self, picture: Picture, memory: tuple[Eye, float, Any]) -> tuple[Command, tuple[Eye, float, Any]]:
        """Adapt the speed over about half a second."""
        eye, share, inner = memory
        command, inner = self.agent.act(picture, inner)
        seen = yellow_pixels(picture, eye, contrast=self.contrast).size / self.crisp
        share += 0.1 * (min(1.0, max(self.slowest, seen)) - share)
        return share * command, (eye, share, inner)


AGENTS: Mapping[str, Agent] = MappingProxyType(
    {
        "crawler": LanePilot(speed=0.10, offset_gain=8.0, slope_gain=1.5),
        "stroller": LanePilot(speed=0.16, offset_gain=8.0, slope_gain=2.0),
        "steady": LanePilot(speed=0.20, offset_gain=8.0, slope_gain=2.0),
        "brisk": LanePilot(speed=0.30, offset_gain=10.0, slope_gain=3.0),
        "daredevil": LanePilot(speed=0.45, offset_gain=8.0, slope_gain=2.0),
        "pursuer_near": PursuitPilot(speed=0.22, look_ahead_m=0.25),
        "pursuer_far": PursuitPilot(speed=0.35, look_ahead_m=0.35, caution=0.6),
        "yellow_only": LanePilot(speed=0.25, offset_gain=8.0, slope_gain=2.0, markings="yellow", contrast=90.0),
        "white_only": LanePilot(speed=0.27, offset_gain=8.0, slope_gain=2.0, markings="white"),
        "smooth": Smoothed(LanePilot(speed=0.25, offset_gain=8.0, slope_gain=2.0), share=0.15),
        "laggy": Laggy(LanePilot(speed=0.22, offset_gain=8.0, slope_gain=2.0), steps=5),
        "drifter": Leaning(LanePilot(speed=0.18, offset_gain=2.5, slope_gain=0.6), bias=0.15),
        "wary": Wary(LanePilot(speed=0.50, offset_gain=14.0, slope_gain=4.5), contrast=120.0, crisp=14.0, slowest=0.15),
        "wary_pursuer": Wary(PursuitPilot(speed=0.60, look_ahead_m=0.25), contrast=118.0, crisp=20.0, slowest=0.15),
        "sharp_eyed": LanePilot(speed=0.22, offset_gain=8.0, slope_gain=2.0, markings="yellow", contrast=112.0),
        "braitenberg": Braitenberg(speed=0.20, push=14.0),
        "edges": EdgePilot(speed=0.15, gain=4.0),
    }
)
"""The agents that travel with the package, by name."""


NEEDS = ("begin", "act")


def load_agent(name: str, folder: Path) -> Agent:
    """The agent of this name.

    Args:
        name: A key of AGENTS, a plug-in, or `module:attribute`: an agent, or what makes one when called.
        folder: Where a user's modules lie besides the installed ones.

    Raises:
        ExtensionError: If there is no such agent.
    """
    return cast(Agent, make(name, kind="agent", beside=folder, needs=NEEDS, shipped=AGENTS))
