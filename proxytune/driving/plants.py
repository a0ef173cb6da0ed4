"""Plants by their names: one robot, or several side by side."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from proxytune.driving.bullet.plant import BulletPlant
from proxytune.driving.episode import TICK_HZ
from proxytune.driving.planar import PlanarFleet, PlanarPlant
from proxytune.driving.plant import Plant
from proxytune.driving.robot import Robot
from proxytune.effects import Signal

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
