"""Agents by name: those shipped, plug-ins, and a user's own as `module:attribute`."""

from pathlib import Path
from typing import cast

from proxytune.driving.agents import AGENTS, Agent
from proxytune.extensions import make

NEEDS = ("begin", "act")


def load_agent(name: str, folder: Path) -> Agent:
    """The agent of this name.

    Args:
        name: A key of AGENTS, a plug-in, or `module:attribute`: an agent, or what makes one when called.
        folder: Where a user's modules lie besides the installed ones.

    Raises:
        ExtensionError: If there is no such agent.
    """
    return cast(Agent, make(name, kind="agent", beside=folder, needs=NEEDS, shipped=AGENTS))
