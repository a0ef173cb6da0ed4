"""Agents by name: those that travel with the package, and a user's own as `module:attribute`."""

import importlib
import sys
from pathlib import Path
from typing import cast

from proxytune.driving.agents import AGENTS, Agent
from proxytune.errors import SettingsError
from proxytune.settings import nearest


def load_agent(name: str, folder: Path) -> Agent:
    """The agent of this name.

    Args:
        name: A key of AGENTS, or `module:attribute`: an agent, or what makes one when called.
        folder: Where a user's modules may lie besides the installed ones.

    Raises:
        SettingsError: If there is no such agent.
    """
    if name in AGENTS:
        return AGENTS[name]
    if ":" not in name:
        raise SettingsError(
            f"agent '{name}' is unknown (your own is written module:attribute); {nearest(name, AGENTS)}"
        )
    found = _import(name, folder)
    made = found() if callable(found) else found
    if not (hasattr(made, "begin") and hasattr(made, "act")):
        raise SettingsError(f"agent '{name}' has no begin and act; see proxytune.driving.agents.Agent")
    return cast(Agent, made)


def _import(name: str, folder: Path) -> object:
    module, _, attribute = name.partition(":")
    sys.path.insert(0, str(folder))
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, SyntaxError) as problem:
        raise SettingsError(f"agent '{name}' cannot be loaded: {problem}; looked in {folder} too") from None
    finally:
        sys.path.remove(str(folder))
