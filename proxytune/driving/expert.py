"""Drivers besides agents: the expert that learners imitate, and those that replay or do what was learnt.

The expert is pure pursuit of the lane's centre line on the robot's true pose.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.domain import Demonstration, Policy
from proxytune.driving.agent import Command, Picture
from proxytune.driving.agents import duties, throttle_and_steering
from proxytune.driving.episode import Sight
from proxytune.driving.lane import lane_point, lane_pose
from proxytune.driving.road import Road
from proxytune.driving.robot import Robot
from proxytune.effects import Signal
from proxytune.seeds import expert_generator

MEMORY = 0.9
"""Share of the disturbance of one control step that is left in the next: it lasts for half a second."""


PUSHES = {"differential": np.array((-1.0, 1.0)), "ackermann": np.array((0.0, 1.0))}
"""What a disturbance to the left adds to the columns of a command."""


class LessonMemory(NamedTuple):
    """Memory of what a lesson has shown so far."""

    robot: Robot  # whose nominal figures are known
    disturbance: float  # what was added to the steering at the last step [duty]
    pictures: tuple[Picture, ...]  # one before every command
    commands: tuple[Command, ...]  # what the expert would do, undisturbed
    on_road: tuple[bool, ...]  # whether the middle of its axle was on the road then, whichever lane

    @property
    def samples(self) -> Demonstration:
        """Samples worth imitating: steps off the road are not."""
        kept = np.array(self.on_road)
        return Demonstration(np.stack(self.pictures)[kept], np.stack(self.commands)[kept])


@dataclass(frozen=True)
class Expert:
    """Drives by the true pose, and is pushed off its line so as to show how to come back to it.

    Whoever imitates an expert that never errs has not seen what to do after its own first error, so the steering is
    disturbed while the command that is shown is the undisturbed one (Laskey et al. 2017, DART).
    """

    road: Road  # the map
    look_ahead_m: float  # how far along the lane's centre line the pursued point lies [m]
    speed: float  # forward speed [m/s]
    gain: float  # steering relative to the arc through that point
    disturbance: float  # standard deviation of what is added to the steering [duty]
    seed: int  # seed of the disturbance

    def begin(self, robot: Robot) -> LessonMemory:
        """Nothing shown yet."""
        return LessonMemory(robot, 0.0, (), (), ())

    def act(self, sight: Sight, memory: LessonMemory) -> tuple[Command, LessonMemory]:
        """Steer for the point pursued, disturbed."""
        command, on_road = self._command(sight.pose, memory.robot)
        drawn = expert_generator(self.seed, len(memory.commands)).standard_normal()
        push = MEMORY * memory.disturbance + np.sqrt(1.0 - MEMORY**2) * self.disturbance * float(drawn)
        shown = memory._replace(
            disturbance=push,
            pictures=(*memory.pictures, sight.picture),
            commands=(*memory.commands, command),
            on_road=(*memory.on_road, on_road),
        )
        return np.clip(command + PUSHES[memory.robot.drive] * push, -1.0, 1.0), shown

    def _command(self, pose: Signal, robot: Robot) -> tuple[Command, bool]:
        seen = lane_pose(self.road, pose[:2], pose[2])
        ahead = lane_point(self.road, seen.counter_clockwise, seen.along + self.look_ahead_m) - pose[:2]
        left = float(np.cos(pose[2]) * ahead[1] - np.sin(pose[2]) * ahead[0])
        if robot.drive == "ackermann":
            command = np.array(throttle_and_steering(robot, self.speed, self.gain * 2.0 * left / float(ahead @ ahead)))
        else:
            full_speed, baseline = robot.figures["full_speed"], robot.figures["effective_baseline"]
            yaw_rate = self.gain * self.speed * 2.0 * left / float(ahead @ ahead)
            command = np.array(duties(self.speed, yaw_rate, full_speed=full_speed, baseline=baseline))
        from_middle = abs(self.road.lane_offset - float(seen.deviation))
        return command, from_middle <= self.road.lane_offset + self.road.lane_width / 2.0


@dataclass(frozen=True)
class Guide:
    """Lets a policy drive, and tells what the expert would do wherever that leads (Ross et al. 2011, DAgger)."""

    expert: Expert
    policy: Policy

    def begin(self, robot: Robot) -> LessonMemory:
        """Nothing shown yet."""
        return self.expert.begin(robot)

    def act(self, sight: Sight, memory: LessonMemory) -> tuple[Command, LessonMemory]:
        """The policy's command, and the expert's in memory."""
        return self.policy(sight.picture), self.expert.act(sight, memory)[1]


def lesson_driver(road: Road, robot: Robot, seed: int, policy: Policy | None) -> Expert | Guide:
    """Who drives in a lesson: the robot's expert, or a policy that it guides."""
    expert = Expert(road, *robot.expert_figures(), seed=seed)
    return expert if policy is None else Guide(expert, policy)


class Played(NamedTuple):
    """Number of commands played, and the picture before each."""

    played: int
    pictures: tuple[Picture, ...]


class Observation(NamedTuple):
    """Poses and pictures that recorded commands lead to."""

    poses: NDArray[np.float64]  # start, then the pose after every tick, (ticks + 1, 3): x [m], y [m], heading [rad]
    pictures: NDArray[np.uint8]  # the picture before every command, (steps, rows, columns, 3)


@dataclass(frozen=True)
class Playback:
    """Plays commands (steps, 2) one per control step, then the last one for ever."""

    commands: NDArray[np.float64]

    def begin(self, robot: Robot) -> Played:
        """Nothing played yet."""
        return Played(0, ())

    def act(self, picture: Picture, memory: Played) -> tuple[Command, Played]:
        """The next command."""
        command = self.commands[min(memory.played, len(self.commands) - 1)]
        return command, Played(memory.played + 1, (*memory.pictures, picture))


@dataclass(frozen=True)
class Pupil:
    """Answers each picture by a policy."""

    policy: Policy

    def begin(self, robot: Robot) -> None:
        """Nothing to remember."""

    def act(self, picture: Picture, memory: None) -> tuple[Command, None]:
        """The policy's command."""
        return self.policy(picture), None

    def act_many(self, pictures: NDArray[np.uint8], memories: Sequence[None]) -> tuple[Signal, Sequence[None]]:
        """The policy's commands for pictures (n, rows, columns, 3), all at once where it can."""
        many = getattr(self.policy, "act_many", None)
        return many(pictures) if many else np.stack([self.policy(picture) for picture in pictures]), memories
