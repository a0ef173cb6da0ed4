"""A domain family that is not proxytune's own, as a study asks it: guarded, and by the study's names of agents."""

import functools
import hashlib
import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from proxytune.domain import Episode
from proxytune.errors import ExtensionError
from proxytune.extensions import ask

MISSING = object()
ON_EPISODES = ("run", "record", "drive", "replay", "demonstrate", "guide", "examine")
"""Methods whose first argument is an episode."""
ON_SEVERAL = ("examine_together",)
"""Methods whose first argument is a list of them."""


@dataclass(frozen=True)
class UserFamily:
    """A domain family whose members are asked for one by one; what one of them raises is one line.

    Attributes:
        family: The family.
        name: Where it comes from, as a complaint names it.
        aliases: Pairs of an agent's name in the study and the name by which the family loads it.
    """

    family: Any
    name: str
    aliases: tuple[tuple[str, str], ...] = ()

    def __getattr__(self, member: str) -> Any:
        """Any member of the family.

        Raises:
            AttributeError: If it has no such member.
            ExtensionError: If asking for it raises.
        """
        if member.startswith("__"):
            raise AttributeError(member)
        value = ask(f"{member} of {self.name}", functools.partial(self._member, member))
        if value is MISSING:
            raise AttributeError(f"{self.name} has no '{member}'")
        if self.aliases and member in ON_EPISODES:
            return functools.partial(self._on_episode, value)
        return functools.partial(self._on_several, value) if self.aliases and member in ON_SEVERAL else value

    @property
    def identity(self) -> str:
        """The family's; other agents behind the same names make it another."""
        return self._named(self._text("identity"))

    @property
    def earlier_identities(self) -> tuple[str, ...]:
        """The family's, if it has any."""
        earlier = ask(f"earlier_identities of {self.name}", lambda: self._member("earlier_identities"))
        return () if earlier is MISSING else tuple(map(self._named, earlier))

    def check_agent(self, name: str) -> None:
        """Refuse an agent that the family cannot run.

        Raises:
            InputError: If there is no such agent, or looking for it raises.
        """
        loaded = self._loaded(name)
        ask(f"check_agent('{loaded}') of {self.name}", functools.partial(self.family.check_agent, loaded))

    def _member(self, member: str) -> Any:
        # A property that raises AttributeError is no missing one.
        if has_member(self.family, member):
            return getattr(self.family, member)
        return MISSING

    def _text(self, member: str) -> str:
        value = ask(f"{member} of {self.name}", functools.partial(getattr, self.family, member))
        if not isinstance(value, str):
            raise ExtensionError(f"{member} of {self.name} must be text, got {type(value).__name__}")
        return value

    def _loaded(self, agent: str) -> str:
        return dict(self.aliases).get(agent, agent)

    def _named(self, identity: str) -> str:
        text = repr((identity, sorted(self.aliases))).encode()
        return hashlib.sha256(text).hexdigest()[:16] if self.aliases else identity

    def _on_episode(self, method: Callable[..., Any], episode: Episode, *rest: Any, **named: Any) -> Any:
        return method(self._loaded_in(episode), *rest, **named)

    def _on_several(self, method: Callable[..., Any], episodes: Sequence[Episode], *rest: Any, **named: Any) -> Any:
        return method([self._loaded_in(episode) for episode in episodes], *rest, **named)

    def _loaded_in(self, episode: Episode) -> Episode:
        return replace(episode, agent=self._loaded(episode.agent))


def has_member(family: Any, member: str) -> bool:
    """Whether there is such a member, be it a property that raises."""
    return inspect.getattr_static(family, member, MISSING) is not MISSING or hasattr(family, member)
