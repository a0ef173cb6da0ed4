"""Agents around agents: the same driver, slower to react, smoother, leaning to one side, or wary of a smeared view."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from proxytune.driving.agents.agent import Agent, Command, Picture
from proxytune.driving.agents.perception import Eye, open_eye, yellow_pixels
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


@dataclass(frozen=True)
class Wary:
    """Another agent's path, driven as fast as the yellow dashes look crisp.

    Motion smears the dashes into their gaps, so this agent drives at the speed at which it still sees well.

    Attributes:
        agent: Whose path it drives.
        contrast: How yellow a pixel must be to count as crisp (of 255).
        crisp: How many crisp pixels it takes to drive at full speed.
        slowest: Share of the speed it keeps when it sees none.
    """

    agent: Agent
    contrast: float
    crisp: float
    slowest: float = 0.3

    def begin(self, robot: Robot) -> tuple[Eye, float, Any]:
        """At its slowest."""
        return open_eye(robot, reach_m=0.5), self.slowest, self.agent.begin(robot)

    def act(self, picture: Picture, memory: tuple[Eye, float, Any]) -> tuple[Command, tuple[Eye, float, Any]]:
        """Adapt the speed over about half a second."""
        eye, share, inner = memory
        command, inner = self.agent.act(picture, inner)
        seen = yellow_pixels(picture, eye, contrast=self.contrast).size / self.crisp
        share += 0.1 * (min(1.0, max(self.slowest, seen)) - share)
        return share * command, (eye, share, inner)
