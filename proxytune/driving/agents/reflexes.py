"""Agents that go by the picture itself, without a notion of where the floor lies."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.agents.agent import Command, Picture
from proxytune.driving.agents.pilots import duties
from proxytune.driving.robot import Robot


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
