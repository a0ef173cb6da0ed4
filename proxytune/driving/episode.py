"""One episode: who drives, what a domain instance bends, where it starts and ends, and what it is worth.

An episode ends when the axle's middle leaves the map, when the robot hits something, or when its time is over. It is
worth what `score_trajectory` says: the lane of a pose is the one whose direction agrees with its heading (right-hand
traffic), and a robot is in it while it is at most half a lane width from its centre line, so whoever drives the wrong
way is in neither lane. `driving_score` is that of the paper's learning experiment.
"""

import functools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Floats
from proxytune.driving.agent import Command, Picture
from proxytune.driving.agents import Deciding, act_together
from proxytune.driving.lane import lane_length, lane_pose
from proxytune.driving.optics import Renderer, joined
from proxytune.driving.perception import Seen, rows_of
from proxytune.driving.plants import Drivetrain
from proxytune.driving.road import Road
from proxytune.driving.robot import Robot
from proxytune.effects import Chain, FilterContext, Signal
from proxytune.errors import EpisodeError
from proxytune.seeds import placement_generator

TICK_HZ = 60
"""How often plant, effects and sub-frames of the camera go on; control and camera rates divide it."""


@dataclass(frozen=True)
class Instance:
    """A domain instance S_θ, ready to drive."""

    robot: Robot  # whose figures the agents know
    drivetrain: Drivetrain  # command, actuation and motion effects
    camera: Renderer  # mounted as the camera effects have it
    image: Chain  # the image effects
    measurement: Chain  # the measurement effects


class Sight(NamedTuple):
    """Sight of an expert, who need not make do with the picture."""

    picture: Picture  # the newest picture
    pose: Signal  # where the robot truly is, (3,): x [m], y [m], heading [rad]


class Driver(Protocol):
    """Who drives: an agent, who sees pictures, or an expert, who sees the pose as well."""

    def begin(self, robot: Robot, /) -> Any:
        """The memory before the first command."""

    def act(self, seen: Any, memory: Any, /) -> tuple[Command, Any]:
        """The next command, and the memory for the one after it."""


class Drive(NamedTuple):
    """Record of an episode."""

    poses: Signal  # start, then the pose after every tick, (ticks + 1, 3): x [m], y [m], heading [rad]
    commands: Signal  # what the agent issued, (control steps, 2)
    crashed: bool  # whether it ended by hitting something or falling over
    memory: Any  # what the driver remembered in the end

    def columns(self, robot: Robot) -> tuple[dict[str, Signal], dict[str, Signal]]:
        """Poses and commands of the robot as columns by name, each with its `time` [s]."""
        control_hz = robot.figures["control_rate"]
        poses = dict(zip(("x", "y", "heading"), self.poses.T, strict=True))
        commands = dict(zip(robot.columns, self.commands.T, strict=True))
        posed, issued = np.arange(len(self.poses)) / TICK_HZ, np.arange(len(self.commands)) / control_hz
        return {"time": posed, **poses}, {"time": issued, **commands}


@dataclass(frozen=True)
class Course:
    """Start and end of an episode."""

    start: Signal  # starting pose (3,): x [m], y [m], heading [rad]
    seconds: float  # when time is over [s]
    seed: int  # seed of everything random in the effects
    ended: Callable[[float, float], bool]  # whether a robot at x, y [m] has left the course


Sees = Callable[[Picture, Signal], Any]
"""What a driver is shown of the newest picture and the true pose."""


def picture_only(picture: Picture, pose: Signal) -> Picture:
    """All that an agent sees."""
    return picture


def measured(instance: Instance, poses: Signal, seed: int) -> Signal:
    """Poses from the start on, one per tick, (ticks + 1, 3), as the measurement effects show them."""
    context = FilterContext(TICK_HZ, poses[0], instance.robot.figures, seed)
    return instance.measurement.apply(poses, instance.measurement.begin(context))[0]


def alike(drivers: Sequence[Driver]) -> list[Driver]:
    """Drivers, one and the same object for those that can answer together: equal ones with `act_many`."""
    distinct, found = list[Driver](), list[Driver]()
    for driver in drivers:
        same = (one for one in distinct if one is driver or (type(one) is type(driver) and one == driver))
        known = next(same, None) if hasattr(driver, "act_many") else driver
        if known is None:
            distinct.append(driver)
        found.append(driver if known is None else known)
    return found


def begin_all(drivers: Sequence[Driver], robots: Sequence[Robot]) -> tuple[list[Any], dict[int, EpisodeError]]:
    """Every driver's memory before the first command, and by its number why one has none."""
    memories: list[Any] = [None] * len(drivers)
    failed: dict[int, EpisodeError] = {}
    for number, (driver, robot) in enumerate(zip(drivers, robots, strict=True)):
        try:
            memories[number] = driver.begin(robot)
        except Exception as problem:
            failed[number] = EpisodeError(f"raised {type(problem).__name__} before the first picture: {problem}")
            failed[number].__cause__ = problem
    return memories, failed


def grouped(drivers: Sequence[Driver]) -> list[list[int]]:
    """Numbers of drivers that can be asked at once: those that say what they look at share what is found there."""
    members: dict[Any, list[int]] = {}
    for number, driver in enumerate(drivers):
        if _looks(driver):
            members.setdefault(None, []).append(number)
        elif hasattr(driver, "act_many"):
            members.setdefault(id(driver), []).append(number)
    return [numbers for key, numbers in members.items() if key is None or len(numbers) > 1]


Shown = list[tuple[list[int], Callable[[list[Any]], Any]]]
"""Numbers of drivers that are asked at once, and how: by what they look at, or by their own `act_many`."""


def show(drivers: Sequence[Driver], draw: Callable[[int], NDArray[np.uint8]], groups: Sequence[list[int]]) -> Shown:
    """Show each group its part of the pictures, to be kept while these are the newest."""
    shown: Shown = []
    for numbers in groups:
        of_group: list[Any] = [drivers[number] for number in numbers]
        if _looks(of_group[0]):
            shown.append((numbers, functools.partial(act_together, of_group, Seen(draw, rows_of(numbers)))))
        else:
            pictures = joined(draw(0)[rows_of(numbers)])
            shown.append((numbers, functools.partial(of_group[0].act_many, pictures)))
    return shown


def _looks(driver: Any) -> bool:
    """Tell whether it is of the shipped agents, which say what they look at."""
    return getattr(type(driver), "act_many", None) is Deciding.act_many


def ask_many(
    drivers: Sequence[Driver],
    shown: Shown,
    see: Callable[[list[int]], Iterable[Any]],
    memories: Sequence[Any],
    time_s: float,
) -> tuple[Signal, list[Any], dict[int, EpisodeError]]:
    """Ask drivers for their next commands, together where they can: one by one the culprit of an error is named.

    Those are asked by what they `see`. Gives commands (drivers, 2), memories, and by its number why a driver failed.
    """
    commands, after, failed = np.zeros((len(drivers), 2)), list(memories), {}
    alone = set(range(len(drivers)))
    for numbers, act in shown:
        together = _ask_together(act, [memories[number] for number in numbers])
        if together is not None:
            commands[numbers], kept = together
            alone.difference_update(numbers)
            for number, memory in zip(numbers, kept, strict=True):
                after[number] = memory
    for number, seen in zip(sorted(alone), see(sorted(alone)) if alone else (), strict=True):
        try:
            commands[number], after[number] = ask(drivers[number], seen, memories[number], time_s)
        except EpisodeError as problem:
            failed[number] = problem
    return commands, after, failed


def _ask_together(act: Callable[[list[Any]], Any], memories: list[Any]) -> tuple[Signal, Sequence[Any]] | None:
    """A group's commands and memories; None where it has to be asked one by one."""
    try:
        answer, kept = act(memories)
        commands = np.asarray(answer, dtype=float)
        sound = commands.shape == (len(memories), 2) and len(kept) == len(memories) and np.isfinite(commands).all()
    except Exception:
        return None
    return (commands, kept) if sound else None


COMMAND_FORM = "a command is two duties, left and right, or a car's throttle and steering"
"""What an answer must be."""


def ask(driver: Driver, seen: Any, memory: Any, time_s: float) -> tuple[Command, Any]:
    """A driver's next command and memory; refused, with the time [s], where it raises or these are none."""
    try:
        answer, memory = driver.act(seen, memory)
    except Exception as problem:
        raise EpisodeError(f"raised {type(problem).__name__} at {time_s:.2f} s: {problem}") from problem
    return command_of(answer, time_s), memory


def command_of(answer: Any, time_s: float) -> Command:
    """An answer as a command; refused, with the time [s], where it is not two finite numbers."""
    try:
        command = np.asarray(answer, dtype=float)
    except Exception as problem:
        told = f"answered with a {type(answer).__name__} at {time_s:.2f} s: {problem}"
        raise EpisodeError(f"{told}; {COMMAND_FORM}") from problem
    if command.shape != (2,):
        told = f"answered with shape {command.shape} at {time_s:.2f} s"
        raise EpisodeError(f"{told}; {COMMAND_FORM}")
    if not (math.isfinite(command[0]) and math.isfinite(command[1])):
        raise EpisodeError(f"answered {command.tolist()} at {time_s:.2f} s; duties must be finite")
    return command


METRICS: Mapping[str, str] = MappingProxyType(
    {
        "distance": "m",
        "survival_time": "s",
        "time_out_of_lane": "s",
        "deviation": "m",
        "early_distance": "m",
        "early_offset": "m",
        "speed": "m/s",
    }
)
"""What an episode yields, with units."""
EARLY_S = 5.0
"""What the first so many seconds show, no crash has cut off yet: of all that is measured it says most of θ."""


def start_pose(
    road: Road, index: int, *, seed: int, position_noise_m: float, heading_noise_deg: float
) -> tuple[float, float, float]:
    """Put the robot down at one of the map's starts, as exactly as a hand does: x [m], y [m], heading [rad].

    Noise is the standard deviation of x and of y, and of the heading; the same seed and index give the same pose.
    """
    x, y, heading_deg = road.starts[index]
    noise = placement_generator(seed, index).standard_normal(3)
    heading = math.radians(heading_deg + heading_noise_deg * float(noise[2]))
    return x + position_noise_m * float(noise[0]), y + position_noise_m * float(noise[1]), heading


def score_trajectory(road: Road, poses: Floats, *, tick_s: float, seconds: float) -> dict[str, float]:
    """Score a drive by the task's metrics.

    - distance [m]: net way along the lane's centre line in its direction, counted while in the lane; a step against it
      is negative. A step from one lane to the other counts nothing, one across a lane's edge counts half.
    - survival_time [s]: from the first pose to the first one off the map, or the last one; at most `seconds`.
    - time_out_of_lane [s]: time until then that was not spent in the lane.
    - deviation [m]: mean over that time of the distance from the lane's centre line, in the lane or out of it.
    - early_distance [m]: distance within the first 5 s.
    - early_offset [m]: mean over the first 5 s of how far left of the lane's centre line the robot is.
    - speed [m/s]: mean speed over ground, in the lane or out of it.

    Distances and times of a drive's parts, the pose at the cut in both, add up to the whole drive's.

    Args:
        road: The map.
        poses: x [m], y [m], heading [rad] at a constant rate, shape (samples, 3); the last one is where the robot hit
            something, if it did.
        tick_s: Time between two poses [s].
        seconds: When time is over [s].

    Raises:
        EpisodeError: If a pose is not finite.
    """
    driven = _driven(road, poses, tick_s=tick_s, seconds=seconds)
    pose = lane_pose(road, driven[:, :2], driven[:, 2])
    aside = np.abs(pose.deviation)
    in_lane = _over_steps((aside <= road.lane_width / 2.0).astype(float))
    # The way from each pose to the next is the short one round the loop
    lap = lane_length(road, pose.counter_clockwise[:-1])
    ahead = np.mod(np.diff(pose.along) + lap / 2.0, lap) - lap / 2.0
    along = in_lane * np.where(pose.counter_clockwise[1:] == pose.counter_clockwise[:-1], ahead, 0.0)
    early = round(EARLY_S / tick_s)
    way = np.hypot(*np.diff(driven[:, :2], axis=0).T)
    return {
        "distance": float(np.sum(along)),
        "survival_time": tick_s * len(in_lane),
        "time_out_of_lane": tick_s * float(np.sum(1.0 - in_lane)),
        "deviation": _mean_over_steps(aside),
        "early_distance": float(np.sum(along[:early])),
        "early_offset": _mean_over_steps(pose.deviation[: early + 1]),
        "speed": float(np.mean(way)) / tick_s if len(way) else 0.0,
    }


def driving_score(road: Road, poses: Floats, *, wheel_distance: float, tick_s: float, seconds: float) -> float:
    """Score a drive as the paper's learning experiment does: seconds driven, less those with a wheel out of the lane.

    Each second with one wheel outside the lane takes one off, each with both wheels two, so 60 s are worth −60 to 60.
    It ends where the robot leaves the map. Standing still in the lane counts as driving, as it does in the paper.
    Wheels are so far apart [m]; else as `score_trajectory`.
    """
    driven = _driven(road, poses, tick_s=tick_s, seconds=seconds)
    headings = driven[:, 2]
    aside = wheel_distance / 2.0 * np.stack((-np.sin(headings), np.cos(headings)), axis=-1)
    wheels = np.stack((driven[:, :2] + aside, driven[:, :2] - aside))
    out = np.abs(lane_pose(road, wheels, np.stack((headings, headings))).deviation) > road.lane_width / 2.0
    return tick_s * float(np.sum(1.0 - _over_steps(out.sum(axis=0).astype(float))))


def _driven(road: Road, poses: Floats, *, tick_s: float, seconds: float) -> Floats:
    """The poses until time is over or the first one is off the map, that one included."""
    in_time = poses[: math.floor(seconds / tick_s + 1e-9) + 1]  # 1e-9: a whole number of ticks may divide to just less
    off = np.any((in_time[:, :2] < 0.0) | (in_time[:, :2] > road.size), axis=1)
    driven = in_time[: int(np.argmax(off)) + 1] if off.any() else in_time
    if not np.isfinite(driven).all():
        step = int(np.argmin(np.isfinite(driven).all(axis=1)))
        raise EpisodeError(f"the pose is not finite at {step * tick_s:.2f} s; the plant cannot follow these commands")
    return driven


def _mean_over_steps(values: Floats) -> float:
    """Mean over time of what was sampled at the steps' ends; of a single sample that itself."""
    return float(np.mean(_over_steps(values) if len(values) > 1 else values))


def _over_steps(values: Floats) -> Floats:
    """Mean over each step of what was sampled at its two ends."""
    return (values[:-1] + values[1:]) / 2.0
