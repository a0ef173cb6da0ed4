"""One episode: an agent drives a plant through the effects of a domain instance until time or luck runs out."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from proxytune.driving.agents import Command, Picture
from proxytune.driving.cameras import Camera
from proxytune.driving.drivetrain import Drivetrain
from proxytune.driving.plant import Plant
from proxytune.driving.robot import Robot
from proxytune.driving.view import View
from proxytune.effects import Chain, Setting, Signal
from proxytune.errors import EpisodeError

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
    camera: Camera
    image: Chain
    measurement: Chain


class Sight(NamedTuple):
    """What an expert sees, who need not make do with the picture.

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
    """What an episode leaves behind.

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
    """What an episode starts from and how it ends.

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
        poses: After each tick of the last step, (ticks, 3): x [m], y [m], heading [rad]; before the first, the start.
        crashed: Whether the robot has hit something or fallen over.
    """

    def __init__(self, instance: Instance, plant: Plant, course: Course) -> None:
        figures = instance.robot.figures
        self._drivetrain, self._plant, self._course = instance.drivetrain, plant, course
        self._hold = round(TICK_HZ / figures["control_rate"])
        self._memory = instance.drivetrain.begin(_setting(figures, course))
        self._view = View(instance.camera, instance.image, Setting(TICK_HZ, course.start, figures, course.seed))
        self.steps = round(course.seconds * figures["control_rate"])
        self.poses: Signal = course.start[None]
        self.crashed = False

    @property
    def picture(self) -> Picture:
        """The newest picture."""
        return self._view.picture

    @property
    def ended(self) -> bool:
        """Whether the robot has crashed or left the course."""
        return self.crashed or self._course.ended(float(self.poses[-1, 0]), float(self.poses[-1, 1]))

    def step(self, command: Command) -> None:
        """Hold a command (2,) for one control step."""
        twists, self._memory = self._drivetrain.apply(np.repeat(command[None], self._hold, axis=0), self._memory)
        self.poses, self.crashed = self._plant.move(twists)
        self._view.pass_by(self.poses)


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


def _setting(figures: Mapping[str, float], course: Course) -> Setting:
    """The start of an episode, from rest."""
    return Setting(TICK_HZ, np.zeros(2), figures, course.seed, course.start[2:], course.start[None, :2])


def measured(instance: Instance, poses: Signal, seed: int) -> Signal:
    """Poses from the start on, one per tick, (ticks + 1, 3), as the measurement effects show them."""
    setting = Setting(TICK_HZ, poses[0], instance.robot.figures, seed)
    return instance.measurement.apply(poses, instance.measurement.begin(setting))[0]


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
