"""An agent that plays recorded commands and keeps what it sees: the same drive in another domain."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.agents.agent import Command, Picture
from proxytune.driving.robot import Robot


class Seen(NamedTuple):
    """How many commands have been played, and the picture before each."""

    played: int
    pictures: tuple[Picture, ...]


class Observation(NamedTuple):
    """What recorded commands lead to.

    Attributes:
        poses: Start, then the pose after every tick, (ticks + 1, 3): x [m], y [m], heading [rad].
        pictures: The picture before every command, (steps, rows, columns, 3).
    """

    poses: NDArray[np.float64]
    pictures: NDArray[np.uint8]


@dataclass(frozen=True)
class Playback:
    """Plays commands (steps, 2) one per control step, then the last one for ever."""

    commands: NDArray[np.float64]

    def begin(self, robot: Robot) -> Seen:
        """Nothing played yet."""
        return Seen(0, ())

    def act(self, picture: Picture, memory: Seen) -> tuple[Command, Seen]:
        """The next command."""
        command = self.commands[min(memory.played, len(self.commands) - 1)]
        return command, Seen(memory.played + 1, (*memory.pictures, picture))
