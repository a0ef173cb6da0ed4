"""An agent that does what a policy has learnt, and remembers nothing."""

from dataclasses import dataclass

from proxytune.domain import Policy
from proxytune.driving.agents.agent import Command, Picture
from proxytune.driving.robot import Robot


@dataclass(frozen=True)
class Pupil:
    """Answers each picture by a policy."""

    policy: Policy

    def begin(self, robot: Robot) -> None:
        """Nothing to remember."""

    def act(self, picture: Picture, memory: None) -> tuple[Command, None]:
        """The policy's command."""
        return self.policy(picture), None
