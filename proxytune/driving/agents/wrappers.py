"""Agents around agents: the same driver, slower to react, smoother, or leaning to one side."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from proxytune.driving.agents.agent import Agent, Command, Picture
from proxytune.driving.robot import Robot


@dataclass(frozen=True)
class Smoothed:
    """Low-pass filters another agent's commands: each step it goes a share of the way to the new one."""

    agent: Agent
    share: float

    def begin(self, robot: Robot) -> tuple[Command, Any]:
        """At rest."""
        return np.zeros(2), self.agent.begin(robot)

    def act(self, picture: Picture, memory: tuple[Command, Any]) -> tuple[Command, tuple[Command, Any]]:
        """Go part of the way to what the other agent wants."""
        last, inner = memory
        wanted, inner = self.agent.act(picture, inner)
        command = last + self.share * (wanted - last)
        return command, (command, inner)


@dataclass(frozen=True)
class Laggy:
    """Issues another agent's commands some control steps late, as slow image processing does."""

    agent: Agent
    steps: int

    def begin(self, robot: Robot) -> tuple[tuple[Command, ...], Any]:
        """Rest commands until the first one is due."""
        return (np.zeros(2),) * self.steps, self.agent.begin(robot)

    def act(
        self, picture: Picture, memory: tuple[tuple[Command, ...], Any]
    ) -> tuple[Command, tuple[tuple[Command, ...], Any]]:
        """Queue the new command and issue the oldest."""
        waiting, inner = memory
        wanted, inner = self.agent.act(picture, inner)
        waiting = (*waiting, wanted)
        return waiting[0], (waiting[1:], inner)


@dataclass(frozen=True)
class Leaning:
    """Another agent on a robot whose right wheel it believes to be weaker than it is."""

    agent: Agent
    bias: float

    def begin(self, robot: Robot) -> Any:
        """As the other agent."""
        return self.agent.begin(robot)

    def act(self, picture: Picture, memory: Any) -> tuple[Command, Any]:
        """Give the left wheel less and the right wheel more."""
        command, memory = self.agent.act(picture, memory)
        return np.clip(command * np.array((1.0 - self.bias, 1.0 + self.bias)), -1.0, 1.0), memory
