"""Agents: controllers that see only the camera's picture and know only the robot's nominal figures.

Some segment the markings by colour, project them on the floor and steer for the lane's centre; some go by the picture
itself. Around any of them others react later, smooth, lean to one side, or slow down where the view is smeared.
`load_agent` finds an agent by name: one of `AGENTS`, a plug-in, or a user's own as `module:attribute`.
"""

import math
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.agent import Agent, Command, Picture
from proxytune.driving.optics import parted
from proxytune.driving.perception import (
    Kind,
    Lane,
    Lower,
    Markings,
    Seen,
    count_yellow,
    find_lanes,
    lower_part,
    open_eye,
    take_picture,
    weigh_edges,
    weigh_markings,
)
from proxytune.driving.robot import Robot
from proxytune.extensions import load

Look = tuple[Kind, Any]
"""What an agent asks of its newest picture: how, and what of."""
Decision = Generator[Look, Any, tuple[Any, Any]]
"""Looks, until the answers lead to a command and the memory for the next picture."""


class Deciding(Protocol):
    """An agent that says what it looks at, so that it can look together with others: so do the shipped ones."""

    def begin(self, robot: Robot) -> Any:
        """The memory before the first picture."""

    def decide(self, memory: Any) -> Decision:
        """Look at the newest picture, and decide."""

    def act(self, picture: Picture, memory: Any) -> tuple[Command, Any]:
        """The command for the newest picture, and the memory for the next."""
        command, memory = _decide_alone(self, Seen(parted(picture[None])), memory)
        return np.asarray(command, dtype=float), memory

    def act_many(self, pictures: NDArray[np.uint8], memories: Sequence[Any]) -> tuple[NDArray[np.float64], list[Any]]:
        """The commands (n, 2) of several robots' pictures (n, rows, columns, 3), and their memories, as `act` does."""
        return act_together([self] * len(memories), pictures, memories)


def act_together(
    agents: Sequence[Deciding], pictures: NDArray[np.uint8] | Seen, memories: Sequence[Any]
) -> tuple[NDArray[np.float64], list[Any]]:
    """The commands (n, 2) that the agents of several robots would give by themselves, to the bit, and their memories.

    Pictures are the newest of each robot (n, rows, columns, 3); or what is known of them, while they are the newest.
    """
    seen = pictures if isinstance(pictures, Seen) else Seen(parted(pictures))
    if len(agents) == 1:
        command, memory = _decide_alone(agents[0], seen, memories[0])
        return np.array([command], dtype=float), [memory]
    decisions = [agent.decide(memory) for agent, memory in zip(agents, memories, strict=True)]
    commands: list[Any] = [None] * len(agents)
    after: list[Any] = [None] * len(agents)
    asked = {robot: next(decision) for robot, decision in enumerate(decisions)}
    while asked:
        kinds: dict[Kind, tuple[list[int], list[Any]]] = {}
        for robot, (kind, look) in sorted(asked.items()):
            robots, looks = kinds.setdefault(kind, ([], []))
            robots.append(robot)
            looks.append(look)
        asked = {}
        for kind, (robots, looks) in kinds.items():
            for robot, answer in zip(robots, seen.answer(kind, tuple(looks), robots), strict=True):
                try:
                    asked[robot] = decisions[robot].send(answer)
                except StopIteration as decided:
                    commands[robot], after[robot] = decided.value
    return np.array(commands, dtype=float), after


def _decide_alone(agent: Deciding, seen: Seen, memory: Any) -> tuple[Any, Any]:
    decision = agent.decide(memory)
    try:
        kind, look = next(decision)
        while True:
            kind, look = decision.send(seen.answer(kind, (look,), (0,))[0])
    except StopIteration as decided:
        return cast(tuple[Any, Any], decided.value)


def _decision(agent: Agent, memory: Any) -> Decision:
    """What an agent decides, which may be a user's and look at the whole picture."""
    own: Callable[[Any], Decision] | None = getattr(agent, "decide", None)
    if own:
        return (yield from own(memory))
    picture = yield take_picture, None
    return agent.act(picture, memory)


Duties = tuple[float, float]
"""Of the left and the right wheel."""


class PilotMemory(NamedTuple):
    """Memory of a pilot: what it looks at, the robot's figures that turn a twist into duties, the last lane seen."""

    look: Any
    full_speed: float
    baseline: float
    lane: Lane = Lane(0.0, 0.0, 0)


def _begin(robot: Robot, look: Any) -> PilotMemory:
    return PilotMemory(look, robot.figures["full_speed"], robot.figures["effective_baseline"])


def throttle_and_steering(robot: Robot, speed: float, curvature: float) -> Duties:
    """A car's command, within its range, for a forward speed [m/s] and a curvature [1/m] of its rear axle's path."""
    figures = robot.figures
    throttle = min(max(speed / figures["full_speed"], -1.0 if robot.reverse else 0.0), 1.0)
    angle = math.atan(figures["wheelbase"] * curvature) / math.radians(figures["wheel_angle"])
    return throttle, min(max(angle, -1.0), 1.0)


def duties(speed: float, yaw_rate: float, *, full_speed: float, baseline: float) -> Duties:
    """Duties for a forward speed [m/s] and a yaw rate [rad/s]; where a wheel saturates, turning goes first."""
    turn = yaw_rate * baseline / 2.0  # min and max take twice as long as comparing
    turn = -full_speed if turn < -full_speed else full_speed if turn > full_speed else turn
    room = full_speed - abs(turn)
    ahead = -room if speed < -room else room if speed > room else speed
    return (ahead - turn) / full_speed, (ahead + turn) / full_speed


@dataclass(frozen=True)
class LanePilot(Deciding):
    """Segments the markings by colour, projects them on the floor and steers by offset and direction (PD)."""

    speed: float  # forward speed [m/s]
    offset_gain: float  # yaw rate for the lane's offset [rad/s per m]
    slope_gain: float  # yaw rate for the lane's direction [rad/s]
    markings: Literal["both", "yellow", "white"] = "both"  # which markings it goes by
    reach_m: float = 0.5  # how far ahead it looks [m]
    contrast: float = 60.0  # how yellow a pixel must be (0 to 255)
    brightness: float = 150.0  # how white a pixel must be (0 to 255)

    def begin(self, robot: Robot) -> PilotMemory:
        """Nothing seen yet."""
        contrast = math.inf if self.markings == "white" else self.contrast
        brightness = math.inf if self.markings == "yellow" else self.brightness
        return _begin(robot, Markings(open_eye(robot, reach_m=self.reach_m), contrast, brightness))

    def decide(self, memory: PilotMemory) -> Decision:
        """Steer for the lane; where none is seen, as the last time."""
        look, full_speed, baseline, last = memory
        lane = (yield find_lanes, look) or last
        yaw_rate = self.offset_gain * lane.offset + self.slope_gain * lane.slope
        command = duties(self.speed, yaw_rate, full_speed=full_speed, baseline=baseline)
        return command, PilotMemory(look, full_speed, baseline, lane)


@dataclass(frozen=True)
class PursuitPilot(Deciding):
    """Pure pursuit of a point on the lane's centre as the markings show it."""

    speed: float  # forward speed on the straight [m/s]
    look_ahead_m: float  # distance of the point pursued [m]
    caution: float = 0.0  # share of the speed given up per unit of curvature times look-ahead

    def begin(self, robot: Robot) -> PilotMemory:
        """Nothing seen yet."""
        return _begin(robot, Markings(open_eye(robot, reach_m=1.6 * self.look_ahead_m), 60.0, 150.0))

    def decide(self, memory: PilotMemory) -> Decision:
        """Drive the arc through the point pursued."""
        look, full_speed, baseline, last = memory
        lane = (yield find_lanes, look) or last
        left = lane.offset + lane.slope * self.look_ahead_m
        curvature = 2.0 * left / (self.look_ahead_m**2 + left**2)
        speed = self.speed / (1.0 + self.caution * abs(curvature) * self.look_ahead_m)
        command = duties(speed, speed * curvature, full_speed=full_speed, baseline=baseline)
        return command, PilotMemory(look, full_speed, baseline, lane)


def _below(robot: Robot, share: float) -> Lower:
    return lower_part(int(robot.figures["camera_rows"]), int(robot.figures["camera_columns"]), share)


@dataclass(frozen=True)
class Braitenberg(Deciding):
    """Two eyes, crossed wires: yellow on the right pushes right, white on the left pushes left.

    Like Duckietown's Braitenberg exercise: what it sees drives the wheels and nothing is remembered.
    """

    speed: float  # forward speed [m/s]
    push: float  # yaw rate for a marking that fills its half of the picture's lower part [rad/s]
    first_row: float = 0.45  # where the lower part begins, as a share of the picture's height

    def begin(self, robot: Robot) -> PilotMemory:
        """Wires for this robot's camera."""
        return _begin(robot, _below(robot, self.first_row))

    def decide(self, memory: PilotMemory) -> Decision:
        """Steer away from yellow on the right and from white on the left, towards the room between them."""
        yellow, white = yield weigh_markings, memory.look
        yaw_rate = self.push * (white - yellow)
        return duties(self.speed, yaw_rate, full_speed=memory.full_speed, baseline=memory.baseline), memory


@dataclass(frozen=True)
class EdgePilot(Deciding):
    """Balances sharp edges: steers for the gap between the contours left and right of the picture's middle.

    It sees brightness steps, not colours, so a smeared picture leaves it little to go by.
    """

    speed: float  # forward speed [m/s]
    gain: float  # yaw rate when all contours are on one side [rad/s]
    step: float = 60.0  # smallest brightness step between neighbouring pixels that counts (of 255)
    first_row: float = 0.55  # where in the picture it begins to look, as a share of the height

    def begin(self, robot: Robot) -> PilotMemory:
        """Wires for this robot's camera."""
        return _begin(robot, (_below(robot, self.first_row), self.step))

    def decide(self, memory: PilotMemory) -> Decision:
        """Turn from the side with more edges, and the nearer to the middle they are the harder."""
        pull, edges = yield weigh_edges, memory.look
        yaw_rate = self.gain * pull / max(edges, 8)
        return duties(self.speed, yaw_rate, full_speed=memory.full_speed, baseline=memory.baseline), memory


@dataclass(frozen=True)
class Smoothed(Deciding):
    """Low-pass filters another agent's commands: each step it goes a share of the way to the new one."""

    agent: Agent
    share: float

    def begin(self, robot: Robot) -> tuple[Duties, Any]:
        """At rest."""
        return (0.0, 0.0), self.agent.begin(robot)

    def decide(self, memory: tuple[Duties, Any]) -> Decision:
        """Go part of the way to what the other agent wants."""
        last, inner = memory
        wanted, inner = yield from _decision(self.agent, inner)
        command = tuple([old + self.share * (new - old) for old, new in zip(last, wanted, strict=True)])
        return command, (command, inner)


@dataclass(frozen=True)
class Laggy(Deciding):
    """Issues another agent's commands some control steps late, as slow image processing does."""

    agent: Agent
    steps: int

    def begin(self, robot: Robot) -> tuple[tuple[Any, ...], Any]:
        """Rest commands until the first one is due."""
        return ((0.0, 0.0),) * self.steps, self.agent.begin(robot)

    def decide(self, memory: tuple[tuple[Any, ...], Any]) -> Decision:
        """Queue the new command and issue the oldest."""
        waiting, inner = memory
        wanted, inner = yield from _decision(self.agent, inner)
        waiting = (*waiting, wanted)
        return waiting[0], (waiting[1:], inner)


@dataclass(frozen=True)
class Leaning(Deciding):
    """Another agent on a robot whose right wheel it believes to be weaker than it is."""

    agent: Agent
    bias: float

    def begin(self, robot: Robot) -> Any:
        """As the other agent."""
        return self.agent.begin(robot)

    def decide(self, memory: Any) -> Decision:
        """Give the left wheel less and the right wheel more."""
        (left, right), memory = yield from _decision(self.agent, memory)
        left, right = left * (1.0 - self.bias), right * (1.0 + self.bias)
        return (min(max(left, -1.0), 1.0), min(max(right, -1.0), 1.0)), memory


@dataclass(frozen=True)
class Wary(Deciding):
    """Another agent's path, driven as fast as the yellow dashes look crisp.

    Motion smears the dashes into their gaps, so this agent drives at the speed at which it still sees well.
    """

    agent: Agent  # whose path it drives
    contrast: float  # how yellow a pixel must be to count as crisp (0 to 255)
    crisp: float  # how many crisp pixels it takes to drive at full speed
    slowest: float = 0.3  # share of the speed it keeps when it sees none

    def begin(self, robot: Robot) -> tuple[Markings, float, Any]:
        """At its slowest."""
        return Markings(open_eye(robot, reach_m=0.5), self.contrast), self.slowest, self.agent.begin(robot)

    def decide(self, memory: tuple[Markings, float, Any]) -> Decision:
        """Adapt the speed over about half a second."""
        look, share, inner = memory
        (left, right), inner = yield from _decision(self.agent, inner)
        seen = (yield count_yellow, look) / self.crisp
        share += 0.1 * (min(1.0, max(self.slowest, seen)) - share)
        return (share * left, share * right), (look, share, inner)


LANE_M, BASELINE_M = 0.22, 0.16
"""Width of the lanes that the agents were made for, and the effective baseline of the robot [m]: a Duckiebot's."""


@dataclass(frozen=True)
class AtTheWheel(Deciding):
    """An agent for two wheels in a car: it thinks that it drives a small robot in the lanes that it was made for.

    What it wants of two wheels is a speed and a curvature; to scale, these are the car's throttle and steering.
    """

    agent: Agent

    def begin(self, robot: Robot) -> tuple[Robot, float, Any]:
        """As the other agent on the small robot; with the car, and how many times as large it is."""
        figures = dict(robot.figures)
        scale = figures.get("lane_width", LANE_M) / LANE_M
        for name in ("camera_height", "camera_forward", "full_speed"):
            figures[name] /= scale
        figures["effective_baseline"] = BASELINE_M
        inner = self.agent.begin(replace(robot, figures=MappingProxyType(figures)))
        return robot, scale, inner

    def decide(self, memory: tuple[Robot, float, Any]) -> Decision:
        """Turn the wheels' speeds into throttle and steering."""
        robot, scale, inner = memory
        (left, right), inner = yield from _decision(self.agent, inner)
        ahead = (left + right) / 2.0
        # To turn on the spot is to turn as far as the wheels go
        curvature = (right - left) / math.copysign(max(abs(ahead), 1e-6), ahead) / (scale * BASELINE_M)
        return throttle_and_steering(robot, ahead * robot.figures["full_speed"], curvature), (robot, scale, inner)


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
    """The agent of this name: of AGENTS, a plug-in, or `module:attribute`; an ExtensionError if there is none."""
    return cast(Agent, load(name, kind="agent", beside=folder, needs=NEEDS, shipped=AGENTS, call=True))
