"""One episode of an environment: an agent acts through effects until the environment or the time ends it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from proxytune.effects import Effect
from proxytune.environments.actuators import Actuators
from proxytune.environments.agents import Act, ask_agent
from proxytune.environments.sensors import Sensors
from proxytune.environments.settings import EpisodeMetric
from proxytune.environments.spaces import Spaces
from proxytune.errors import EpisodeError
from proxytune.extensions import describe
from proxytune.settings import nearest

Infos = list[Mapping[str, Any]]
FOLDS: Mapping[str, Any] = {"sum": np.sum, "mean": np.mean, "max": np.max, "min": np.min}


class Wrapped:
    """An environment behind effects, in the midst of an episode."""

    def __init__(self, environment: Any, actuators: Actuators, sensors: Sensors) -> None:
        self._environment, self._actuators, self._sensors = environment, actuators, sensors
        self.rewards: list[float] = []
        self.infos: Infos = []

    def reset(self, seed: int, later: np.random.Generator) -> Any:
        """Begin from the state that the seed gives; what is drawn later in the episode comes from `later`."""
        try:
            observation, _ = self._environment.reset(seed=seed)
        except Exception as problem:
            raise EpisodeError(f"the environment's reset raised {describe(problem)}") from problem
        self._environment.unwrapped.np_random = later
        return self._sensors.show(observation)

    def step(self, action: Any) -> tuple[Any, bool]:
        """The next observation, and whether the episode is over."""
        try:
            seen, reward, terminated, truncated, info = self._environment.step(self._actuators.pass_on(action))
        except Exception as problem:
            raise EpisodeError(f"the environment raised {describe(problem)} at step {len(self.rewards)}") from problem
        self.rewards.append(float(reward))
        self.infos.append(dict(info))
        return self._sensors.show(seen), bool(terminated or truncated)


def play(wrapped: Wrapped, act: Act, first: Any, space: Any, steps: int) -> None:
    """Let an agent act from its first observation on, for so many steps at most.

    Raises:
        EpisodeError: If agent or environment fail.
    """
    observation = first
    for step in range(steps):
        observation, over = wrapped.step(ask_agent(act, observation, space, step))
        if over:
            return


def score(wrapped: Wrapped, metrics: tuple[EpisodeMetric, ...]) -> dict[str, float]:
    """The metrics of an episode that is over.

    Raises:
        EpisodeError: If info lacks an entry, or it is no number.
    """
    whole = {"return": float(np.sum(wrapped.rewards)), "length": float(len(wrapped.rewards))}
    return {one.name: whole[one.source] if one.source in whole else _of_info(wrapped.infos, one) for one in metrics}


def _of_info(infos: Infos, metric: EpisodeMetric) -> float:
    steps = infos[-1:] if metric.fold == "last" else infos
    try:
        values = [float(info[metric.entry]) for info in steps]
    except KeyError:
        known = sorted({key for info in steps for key in info})
        hint = nearest(metric.entry, known) if known else "info is empty"
        raise EpisodeError(f"metric '{metric.name}': info has no '{metric.entry}' at every step; {hint}") from None
    except (TypeError, ValueError):
        raise EpisodeError(f"metric '{metric.name}': '{metric.entry}' of info is no number; name another") from None
    return values[-1] if metric.fold == "last" else float(FOLDS[metric.fold](values))


def wrap(
    environment: Any, effects: tuple[Effect, ...], spaces: Spaces, state: tuple[int, ...] | None, seed: int
) -> Wrapped:
    """An environment behind the effects of a domain instance."""
    return Wrapped(environment, Actuators(effects, spaces, seed), Sensors(effects, spaces, state, seed))
