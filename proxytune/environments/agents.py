"""Agents of an environment by name: a function, what has `predict`, or one of the two that need no code."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from proxytune.environments.policies import ask_policy
from proxytune.errors import EpisodeError, ExtensionError, InputError
from proxytune.extensions import ask, describe, load

Act = Callable[[Any], Any]
"""From an observation to an action."""


def _random(space: Any, seed: int) -> Act:
    space.seed(seed)
    return lambda observation: space.sample()


def _zero(space: Any, seed: int) -> Act:
    rest = np.clip(0, getattr(space, "low", 0), getattr(space, "high", 0)) if hasattr(space, "low") else 0
    whole = int(getattr(space, "start", 0)) if space.shape == () else np.zeros(space.shape, dtype=space.dtype)
    action = np.asarray(rest, dtype=space.dtype) if hasattr(space, "low") else whole
    return lambda observation: action


BUILT_IN: Mapping[str, Callable[[Any, int], Act]] = MappingProxyType({"random": _random, "zero": _zero})


@dataclass
class Predicting:
    """What has `predict`, as the policies of stable-baselines3 do; a state that it answers with is handed back."""

    policy: Any
    state: Any = None

    def __call__(self, observation: Any) -> Any:
        """The action of its deterministic policy."""
        action, self.state = ask_policy(self.policy, observation, self.state)
        return action


def load_agent(name: str, folder: Path, space: Any, seed: int) -> Act:
    """An agent ready for one episode; a class is made anew for each.

    Args:
        name: "random", "zero", or `module:attribute`: a function, an object with `predict`, or a class of either.
        folder: Where a user's modules lie.
        space: The environment's actions.
        seed: Of the agent "random".

    Raises:
        InputError: If there is no such agent, or the actions have no zero.
    """
    if name in BUILT_IN:
        if name == "zero" and (space.shape is None or space.dtype is None):
            raise InputError(f"agent 'zero': the actions are {space}, which have no zero; take another")
        return BUILT_IN[name](space, seed)
    found = load(name, kind="agent", beside=folder, shipped=BUILT_IN)
    if inspect.isclass(found):
        found = ask(f"agent '{name}'", found)
    if hasattr(found, "predict"):
        return Predicting(found)
    if callable(found):
        act: Act = found
        return act
    raise ExtensionError(f"agent '{name}' is a {type(found).__name__}; give a function, or what has predict")


def ask_agent(act: Act, observation: Any, space: Any, step: int) -> Any:
    """An agent's next action, checked.

    Raises:
        EpisodeError: If it raises, or answers with what is no action.
    """
    try:
        answer = act(observation)
    except Exception as problem:
        raise EpisodeError(f"raised {describe(problem)} at step {step}") from problem
    if hasattr(space, "low"):
        return _in_box(answer, space, step)
    action = np.asarray(answer).item() if np.ndim(answer) == 0 else answer
    if not space.contains(action):
        raise EpisodeError(f"answered {answer!r} at step {step}, which is not in {space}")
    return action


def _in_box(answer: Any, space: Any, step: int) -> Any:
    """A Box action in its type; beyond its bounds it is cut off."""
    try:
        action = np.asarray(answer, dtype=space.dtype)
        whole = action.reshape(space.shape) if action.size == np.prod(space.shape) else None
    except (TypeError, ValueError):
        raise EpisodeError(f"answered {answer!r} at step {step}, which is no array of numbers") from None
    if whole is None or not np.isfinite(whole).all():
        raise EpisodeError(f"answered {answer!r} at step {step}; an action is {space.shape} finite numbers")
    return np.clip(whole, space.low, space.high)
