"""An environment that is at hand, with policies that are, as a function of θ, agent, start and seed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium

from proxytune.domain import make_episode
from proxytune.effects import PARAMETERS
from proxytune.environments.family import GymnasiumFamily, gymnasium_family
from proxytune.settings import Section
from proxytune.space import Space, Theta


@dataclass(frozen=True)
class PlayedEnvironment:
    """An environment as a function: its family plays it, and what has no registered name is made by `make`."""

    family: GymnasiumFamily
    name: str
    make: Callable[..., Any] | None

    def __call__(self, theta: Theta, agent: str, start: int, seed: int) -> Mapping[str, float]:
        """The metrics of one episode."""
        _register(self.name, self.make)
        return self.family.run(make_episode(theta, agent=agent, start=start, seed=seed))


def played_environment(
    given: Any, space: Space, policies: Mapping[str, Any], domain: Mapping[str, Any], path: Path
) -> PlayedEnvironment:
    """The function that plays an environment's episodes.

    Args:
        given: A registered name, or what makes the environment.
        space: What is tuned: effects by name, attributes with a point, else arguments of the constructor.
        policies: Agents by name.
        domain: Other keys of a `[domain]` table.
        path: The file that complaints name.

    Raises:
        InputError: If the environment, a parameter or a policy cannot be used.
    """
    make = None if isinstance(given, str) else given
    name = given if make is None else f"proxytune_tune/{getattr(make, '__name__', type(make).__name__).strip('<>')}-v0"
    _register(name, make)
    own = {
        one.name: {
            "attribute" if "." in one.name else "argument": one.name,
            "low": one.low,
            "high": one.high,
            "neutral": 0.5 * (one.low + one.high),
        }
        for one in space.intervals
        if one.name not in PARAMETERS
    }
    section = Section(path, "domain.", {"environment": name, "parameters": own, **domain})
    return PlayedEnvironment(gymnasium_family(section, model=None, policies=policies), name, make)


def _register(name: str, make: Callable[..., Any] | None) -> None:
    """Have Gymnasium know what makes an environment, in this process; once is enough."""
    known = gymnasium.registry.get(name)
    if make is not None and (known is None or known.entry_point is not make):
        gymnasium.registry.pop(name, None)
        gymnasium.register(name, entry_point=make)
