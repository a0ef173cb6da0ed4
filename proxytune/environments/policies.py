"""A policy that was trained elsewhere, as an agent of a study."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from proxytune.driving.agents import Command, Picture
from proxytune.driving.robot import Robot
from proxytune.errors import ExtensionError


class Policy(Protocol):
    """What has learnt to act, as stable-baselines3's algorithms and policies."""

    def predict(self, observation: Any, *, deterministic: bool) -> Any:
        """The action for an observation, or the action and a state, which it is given back as `state=`."""
        ...


def ask_policy(policy: Policy, observation: Any, state: Any, *, deterministic: bool = True) -> tuple[Any, Any]:
    """A policy's action, and its state for the next observation, None where it has none."""
    known = {} if state is None else {"state": state}
    answer = policy.predict(observation, deterministic=deterministic, **known)
    return answer if isinstance(answer, tuple) and len(answer) == 2 else (answer, state)


@dataclass(frozen=True)
class PolicyAgent:
    """Does what a policy says to each picture.

    Attributes:
        policy: Trained on pictures as the environment shows them, (rows, columns, 3).
        deterministic: Whether it takes its likeliest action; one that draws would make episodes differ at one seed.
    """

    policy: Policy
    deterministic: bool = True

    def begin(self, robot: Robot) -> None:
        """No state yet."""

    def act(self, picture: Picture, memory: Any) -> tuple[Command, Any]:
        """The policy's duties, and its state for the next picture."""
        action, memory = ask_policy(self.policy, picture, memory, deterministic=self.deterministic)
        return np.clip(np.asarray(action, dtype=float), -1.0, 1.0), memory


def agent_of(policy: Policy, *, deterministic: bool = True) -> PolicyAgent:
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
