"""What an agent is: a controller that sees the camera's picture and nothing else."""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.robot import Robot

Picture = NDArray[np.uint8]
"""One camera picture, (rows, columns, 3): red, green, blue."""
Command = NDArray[np.float64]
"""Duties of the left and the right wheel, each in [−1, 1]."""


class Agent(Protocol):
    """A causal filter from pictures to commands; frozen, so one may drive in many episodes at once."""

    def begin(self, robot: Robot) -> Any:
        """The memory before the first picture; an agent knows the robot's *nominal* figures only."""

    def act(self, picture: Picture, memory: Any) -> tuple[Command, Any]:
        """The command for the newest picture, and the memory for the next; called at the control rate."""
