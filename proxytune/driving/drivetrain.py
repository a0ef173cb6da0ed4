"""From duties to the motion that the wheels ask of the body: the part that both plants share."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from proxytune.driving.robot import Robot
from proxytune.effects import CHANNELS, Chain, Effect, Setting, Signal, Stage, stage_chain
from proxytune.effects.effect import Memory


class Progress(NamedTuple):
    """What the three stages remember."""

    command: Memory
    actuation: Memory
    motion: Memory


@dataclass(frozen=True)
class Drivetrain:
    """Command, actuation and motion effects with the robot's kinematics; itself a causal filter.

    Takes duties (…, time, 2), left and right in [−1, 1]; gives twists (…, time, 3): forward and sideways speed [m/s]
    and yaw rate [rad/s], each the mean over its sample interval.
    """

    robot: Robot
    command: Chain
    actuation: Chain
    motion: Chain

    def begin(self, setting: Setting) -> Progress:
        """As if the resting command of `setting` had been given for ever."""
        still = np.zeros((*np.shape(setting.rest)[:-1], len(CHANNELS[Stage.MOTION])))
        return Progress(
            self.command.begin(setting),
            self.actuation.begin(setting),
            self.motion.begin(replace(setting, rest=still)),
        )

    def apply(self, signal: Signal, memory: Progress) -> tuple[Signal, Progress]:
        """The twists that the next chunk of duties leads to."""
        arrived, command = self.command.apply(signal, memory.command)
        wheels, actuation = self.actuation.apply(np.minimum(np.maximum(arrived, -1.0), 1.0), memory.actuation)
        twists, motion = self.motion.apply(self.ideal(wheels), memory.motion)
        return twists, Progress(command, actuation, motion)

    def ideal(self, wheels: Signal) -> Signal:
        """The twists that wheel speeds (…, time, 2) ask for, nothing slipping."""
        full_speed, baseline = self.robot.figures["full_speed"], self.robot.figures["effective_baseline"]
        left, right = wheels[..., 0], wheels[..., 1]
        twists = np.zeros((*left.shape, 3))
        twists[..., 0] = (left + right) * (full_speed / 2.0)
        twists[..., 2] = (right - left) * (full_speed / baseline)
        return twists


def drivetrain(robot: Robot, effects: Iterable[Effect]) -> Drivetrain:
    """A robot's drivetrain with these effects."""
    chosen = tuple(effects)
    stages = (Stage.COMMAND, Stage.ACTUATION, Stage.MOTION)
    return Drivetrain(robot, *(stage_chain(chosen, stage) for stage in stages))
