"""A policy that was trained elsewhere, as an agent of a study."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from proxytune.driving.agents import Command, Picture
from proxytune.driving.robot import Robot
from proxytune.errors import ExtensionError


class Predictor(Protocol):
    """What has learnt to act, as stable-baselines3's algorithms and policies."""

    def predict(self, observation: Any, *, deterministic: bool) -> tuple[Any, Any]:
        """The action for an observation and the policy's state, None where it has none; it takes `state=` then."""
        ...


@dataclass(frozen=True)
class PolicyAgent:
    """Does what a policy says to each picture.

    Attributes:
        policy: Trained on pictures as the environment shows them, (rows, columns, 3).
        deterministic: Whether it takes its likeliest action; one that draws would make episodes differ at one seed.
    """

    policy: Predictor
    deterministic: bool = True

    def begin(self, robot: Robot) -> None:
        """No state yet."""

    def act(self, picture: Picture, memory: Any) -> tuple[Command, Any]:
        """The policy's duties, and its state for the next picture."""
        state = {} if memory is None else {"state": memory}
        action, memory = self.policy.predict(picture, deterministic=self.deterministic, **state)
        return np.clip(np.asarray(action, dtype=float), -1.0, 1.0), memory


def agent_of(policy: Predictor, *, deterministic: bool = True) -> PolicyAgent:
    """An agent for studies of anything with `predict(observation, deterministic=…) -> (action, state)`.

    Args:
        policy: As `stable_baselines3.PPO.load` gives it; trained on the environment's pictures as they are.
        deterministic: Whether it takes its likeliest action.

    Raises:
        ExtensionError: If it cannot predict.
    """
    if not callable(getattr(policy, "predict", None)):
        raise ExtensionError(f"a {type(policy).__name__} has no predict(observation, deterministic=…); add it")
    return PolicyAgent(policy, deterministic)
