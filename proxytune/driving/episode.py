"""One episode: a driver, a plant and a camera behind the effects of a domain instance, until time or luck runs out.

`drive` asks a driver for commands; `Rollout` is the same one command at a time. `follow` drives recorded commands
without a camera. An episode ends when the axle's middle leaves the map, when the robot hits something, or when its time
is over. It is worth what `score_trajectory` says: the lane of a pose is the one whose direction agrees with its heading
(right-hand traffic), and a robot is in it while it is at most half a lane width from its centre line, so whoever drives
the wrong way is in neither lane. `driving_score` is that of the paper's learning experiment.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

import numpy as np

from proxytune.arrays import Floats
from proxytune.driving.agent import Command, Picture
from proxytune.driving.bullet import BulletPlant
from proxytune.driving.cameras import Views
from proxytune.driving.lane import LanePose, lane_length, lane_pose
from proxytune.driving.optics import Renderer
from proxytune.driving.plants import Drivetrain, PlanarFleet, PlanarPlant, Plant
from proxytune.driving.road import Road
from proxytune.driving.robot import Robot
from proxytune.effects import Chain, FilterContext, Signal
from proxytune.errors import EpisodeError
from proxytune.seeds import placement_generator

TICK_HZ = 60
"""How often plant, effects and sub-frames of the camera go on; control and camera rates divide it."""


@dataclass(frozen=True)
class Instance:
    """A domain instance S_θ, ready to drive.

    Attributes:
        robot: Whose figures the agents know.
        drivetrain: Command, actuation and motion effects.
        camera: Mounted as the camera effects have it.
        image: The image effects.
        measurement: The measurement effects.
    """

    robot: Robot
    drivetrain: Drivetrain
    camera: Renderer
    image: Chain
    measurement: Chain


class Sight(NamedTuple):
    """Sight of an expert, who need not make do with the picture.

    Attributes:
        picture: The newest picture.
        pose: Where the robot truly is, (3,): x [m], y [m], heading [rad].
    """

    picture: Picture
    pose: Signal


class Driver(Protocol):
    """Who drives: an agent, who sees pictures, or an expert, who sees the pose as well."""

    def begin(self, robot: Robot, /) -> Any:
        """The memory before the first command."""
        ...

    def act(self, seen: Any, memory: Any, /) -> tuple[Command, Any]:
        """The next command, and the memory for the one after it."""
        ...


class Drive(NamedTuple):
    """Record of an episode.

    Attributes:
        poses: Start, then the pose after every tick, (ticks + 1, 3): x [m], y [m], heading [rad].
        commands: What the agent issued, (control steps, 2).
        crashed: Whether it ended by hitting something or falling over.
        memory: What the driver remembered in the end.
    """

    poses: Signal
    commands: Signal
    crashed: bool
    memory: Any

    def columns(self, control_hz: float) -> tuple[dict[str, Signal], dict[str, Signal]]:
        """Poses and commands as columns by name, each with its `time` [s]; the robot is asked at `control_hz`."""
        poses = dict(zip(("x", "y", "heading"), self.poses.T, strict=True))
        commands = dict(zip(("left", "right"), self.commands.T, strict=True))
        return (
            {"time": np.arange(len(self.poses)) / TICK_HZ, **poses},
            {"time": np.arange(len(self.commands)) / control_hz, **commands},
        )


@dataclass(frozen=True)
class Course:
    """Start and end of an episode.

    Attributes:
        start: Starting pose (3,): x [m], y [m], heading [rad].
        seconds: When time is over [s].
        seed: Seed of everything random in the effects.
        ended: Whether a robot at x, y [m] has left the course.
    """

    start: Signal
    seconds: float
    seed: int
    ended: Callable[[float, float], bool]


class Rollout:
    """An episode under way, one command after the other: `drive` asks an agent for them, an environment its user.

    Attributes:
        steps: How many commands there is time for.
        picture: The newest picture.
        poses: After each tick of the last step, (ticks, 3): x [m], y [m], heading [rad]; before the first, the start.
        crashed: Whether the robot has hit something or fallen over.
    """

    def __init__(self, instance: Instance, plant: Plant, course: Course) -> None:
        figures = instance.robot.figures
        self._drivetrain, self._plant, self._course = instance.drivetrain, plant, course
        self._hold = round(TICK_HZ / figures["control_rate"])
        resting = FilterContext(TICK_HZ, np.zeros(2), figures, course.seed, course.start[2:], course.start[None, :2])
        self._memory = instance.drivetrain.begin(resting)
        seen = FilterContext(TICK_HZ, course.start, figures, course.seed)
        self._views = Views(instance.camera, instance.image, (seen,))
        self.picture: Picture = self._views.pictures((0,))[0]
        self.steps = round(course.seconds * figures["control_rate"])
        self.poses: Signal = course.start[None]
        self.crashed = False

    @property
    def ended(self) -> bool:
        """Tell whether the robot has crashed or left the course."""
        return self.crashed or self._course.ended(float(self.poses[-1, 0]), float(self.poses[-1, 1]))

    def step(self, command: Command) -> None:
        """Hold a command (2,) for one control step."""
        twists, self._memory = self._drivetrain.apply(np.repeat(command[None], self._hold, axis=0), self._memory)
        self.poses, self.crashed = self._plant.move(twists)
        self._views.pass_by(self.poses[None], (0,))
        if self._views.changed:
            self.picture = self._views.pictures((0,))[0]


def picture_only(picture: Picture, pose: Signal) -> Picture:
    """All that an agent sees."""
    return picture


def drive(
    instance: Instance,
    plant: Plant,
    driver: Driver,
    course: Course,
    sees: Callable[[Picture, Signal], Any] = picture_only,
) -> Drive:
    """Drive until the time is over, the robot crashes or the course ends.

    Args:
        instance: What bends commands, motion and pictures.
        plant: What moves, at its start.
        driver: Who drives.
        course: What it drives.
        sees: What the driver is shown of the picture and the true pose; an expert's is `Sight`.

    Raises:
        EpisodeError: If the agent raises, or its answer is not two finite duties.
    """
    rollout, control_hz = Rollout(instance, plant, course), instance.robot.figures["control_rate"]
    remembered = _begin(driver, instance.robot)
    poses, commands = [rollout.poses], []
    for step in range(rollout.steps):
        seen = sees(rollout.picture, rollout.poses[-1])
        command, remembered = ask(driver, seen, remembered, step / control_hz)
        rollout.step(command)
        poses.append(rollout.poses)
        commands.append(command)
        if rollout.ended:
            break
    return Drive(np.concatenate(poses), np.array(commands), rollout.crashed, remembered)


def measured(instance: Instance, poses: Signal, seed: int) -> Signal:
    """Poses from the start on, one per tick, (ticks + 1, 3), as the measurement effects show them."""
    context = FilterContext(TICK_HZ, poses[0], instance.robot.figures, seed)
    return instance.measurement.apply(poses, instance.measurement.begin(context))[0]


def _begin(driver: Driver, robot: Robot) -> Any:
    try:
        return driver.begin(robot)
    except Exception as problem:
        raise EpisodeError(f"raised {type(problem).__name__} before the first picture: {problem}") from problem


def ask(driver: Driver, seen: Any, memory: Any, time_s: float) -> tuple[Command, Any]:
    """A driver's next command and memory; an error tells the time [s]."""
    try:
        answer, memory = driver.act(seen, memory)
        command = np.asarray(answer, dtype=float)
    except Exception as problem:
        raise EpisodeError(f"raised {type(problem).__name__} at {time_s:.2f} s: {problem}") from problem
    check_command(command, time_s)
    return command, memory


def check_command(command: Command, time_s: float) -> None:
    """Refuse what are not two finite duties.

    Raises:
        EpisodeError: With the time [s].
    """
    if command.shape != (2,):
        raise EpisodeError(
            f"answered with shape {command.shape} at {time_s:.2f} s; a command is two duties, left and right"
        )
    if not (math.isfinite(command[0]) and math.isfinite(command[1])):
        raise EpisodeError(f"answered {command.tolist()} at {time_s:.2f} s; duties must be finite")


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
    """Put the robot down at one of the map's starts, as exactly as a hand does.

    Args:
        road: The map.
        index: Which start.
        seed: Seed of the episode; the same seed and index give the same pose.
        position_noise_m: Standard deviation of x and of y [m].
        heading_noise_deg: Standard deviation of the heading [deg].

    Returns:
        x [m], y [m], heading [rad].
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
    along, early = in_lane * _steps_along(road, pose), round(EARLY_S / tick_s)
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

    Args:
        road: The map.
        poses: x [m], y [m], heading [rad] at a constant rate, shape (samples, 3).
        wheel_distance: Distance between the wheels [m].
        tick_s: Time between two poses [s].
        seconds: When time is over [s].

    Raises:
        EpisodeError: If a pose is not finite.
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


def _steps_along(road: Road, pose: LanePose) -> Floats:
    """Way along the lane from each pose to the next [m], the short way round the loop."""
    lap = lane_length(road, pose.counter_clockwise[:-1])
    way = np.mod(np.diff(pose.along) + lap / 2.0, lap) - lap / 2.0
    return np.where(pose.counter_clockwise[1:] == pose.counter_clockwise[:-1], way, 0.0)


def _mean_over_steps(values: Floats) -> float:
    """Mean over time of what was sampled at the steps' ends; of a single sample that itself."""
    return float(np.mean(_over_steps(values) if len(values) > 1 else values))


def _over_steps(values: Floats) -> Floats:
    """Mean over each step of what was sampled at its two ends."""
    return (values[:-1] + values[1:]) / 2.0


def follow(instance: Instance, plant: Plant, start: Signal, duties: Signal, seed: int) -> Signal:
    """Drive commands on open floor.

    Args:
        instance: Whose effects bend commands, motion and measurement.
        plant: What moves, at its start.
        start: That start (3,): x [m], y [m], heading [rad].
        duties: Commands (rows, 2), one per control step.
        seed: Of everything random in the effects.

    Returns:
        The measured pose at each command (rows, 3).
    """
    figures = instance.robot.figures
    hold = round(TICK_HZ / figures["control_rate"])
    train = instance.drivetrain
    memory = train.begin(FilterContext(TICK_HZ, np.zeros(2), figures, seed, start[2:], start[None, :2]))
    poses = [start[None]]
    for command in duties[:-1]:
        twists, memory = train.apply(np.repeat(command[None], hold, axis=0), memory)
        poses.append(plant.move(twists)[0])
    return np.asarray(measured(instance, np.concatenate(poses), seed)[::hold])


PLANTS = ("bullet", "planar")


class Fleet(Protocol):
    """Robots side by side, each on a floor of its own."""

    def move(self, twists: Signal, robots: Sequence[int], /) -> tuple[Signal, Sequence[bool]]:
        """Let some robots follow their twists, of all robots' (all, time, 3), each for one tick.

        Returns:
            Their poses after each tick (robots, time, 3), and whether each has hit something or fallen over.
        """
        ...


@dataclass(frozen=True)
class Plants:
    """A plant for each robot."""

    plants: Sequence[Plant]

    def move(self, twists: Signal, robots: Sequence[int]) -> tuple[Signal, Sequence[bool]]:
        """Let one robot after the other follow its twists."""
        poses, crashed = zip(*(self.plants[robot].move(twists[robot]) for robot in robots), strict=True)
        return np.stack(poses), crashed


def plant_at(plant: str, robot: Robot, start: Signal) -> Plant:
    """One of PLANTS with the robot at a starting pose (3,)."""
    return BulletPlant(robot, start, 1.0 / TICK_HZ) if plant == "bullet" else PlanarPlant(start, 1.0 / TICK_HZ)


@contextmanager
def fleet_at(plant: str, robot: Robot, starts: Signal) -> Iterator[Fleet]:
    """One of PLANTS with such a robot at each of several starting poses (robots, 3)."""
    if plant == "planar":
        yield PlanarFleet(starts, 1.0 / TICK_HZ)
        return
    with ExitStack() as stack:
        yield Plants([stack.enter_context(plant_at(plant, robot, start)) for start in starts])
