"""A user's domain family behind a guard: what a member of it raises is one line, and agents have the study's names.

It goes to every process of a study, which starts in a quarter of the time as nothing of the study is loaded with it.
"""

import functools
import inspect
from dataclasses import dataclass, replace
from typing import Any

from proxytune.domain import Episode
from proxytune.errors import ExtensionError
from proxytune.extensions import ask
from proxytune.identity import digest

MISSING = object()
ON_EPISODES = ("run", "record", "drive", "replay", "demonstrate", "guide", "examine")
"""Methods whose first argument is an episode."""
ON_SEVERAL = ("run_many", "examine_together")
"""Methods whose first argument is a list of them."""


@dataclass(frozen=True)
class UserFamily:
    """A domain family whose members are asked for one by one; what one of them raises is one line."""

    family: Any
    name: str  # where it comes from, as a complaint has it
    aliases: tuple[tuple[str, str], ...] = ()  # agents' names, each with that by which it is loaded

    def __getattr__(self, member: str) -> Any:
        """Any member of the family; what asking for it raises is an ExtensionError."""
        if member.startswith("__"):
            raise AttributeError(member)

        def read() -> Any:
            # A property that raises AttributeError is no missing one.
            return getattr(self.family, member) if has_member(self.family, member) else MISSING

        value = ask(f"{member} of {self.name}", read)
        if value is MISSING:
            raise AttributeError(f"{self.name} has no '{member}'")
        if self.aliases and member in ON_EPISODES:
            return lambda episode, *rest, **named: value(self._loaded_in(episode), *rest, **named)
        if self.aliases and member in ON_SEVERAL:
            return lambda episodes, *rest, **named: value([*map(self._loaded_in, episodes)], *rest, **named)
        return value

    @property
    def identity(self) -> str:
        """The family's; other agents behind the same names make it another."""
        identity = ask(f"identity of {self.name}", lambda: self.family.identity)
        if not isinstance(identity, str):
            raise ExtensionError(f"identity of {self.name} must be text, got {type(identity).__name__}")
        return digest(identity, sorted(self.aliases)) if self.aliases else identity

    def check_agent(self, name: str) -> None:
        """Refuse an agent that the family cannot run."""
        loaded = self._loaded(name)
        ask(f"check_agent('{loaded}') of {self.name}", functools.partial(self.family.check_agent, loaded))

    def _loaded(self, agent: str) -> str:
        return dict(self.aliases).get(agent, agent)

    def _loaded_in(self, episode: Episode) -> Episode:
        return replace(episode, agent=self._loaded(episode.agent))


def has_member(family: Any, member: str) -> bool:
    """Tell whether there is such a member, be it a property that raises."""
    return inspect.getattr_static(family, member, MISSING) is not MISSING or hasattr(family, member)
