"""The protocol of a learner: from demonstrations to weights, and from weights and an observation to a command."""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from proxytune.domain import Demonstration, Policy

Weights = Mapping[str, NDArray[Any]]
"""What has been learnt, as arrays by name: kept on disk as they are, never pickled."""


class Learner(Protocol):
    """Learns to imitate; bring your own as `module:attribute`, in PyTorch say.

    It is a frozen dataclass or has a `repr` that tells its settings: that and the source of its module, with the
    modules beside it from which that takes classes or functions, identify what it has learnt. It may have a
    method `act_many(weights, observations)` that answers many observations (n, …) at once, each as `act` does, to the
    bit: examinations are then faster.
    """

    def train(self, samples: Demonstration, start: Weights | None, seed: int) -> Weights:
        """Learn from samples, from scratch or from weights learnt elsewhere; the same input, the same weights.

        Raises:
            LearnerError: If the samples cannot be learnt from, or do not fit the weights.
        """
        ...

    def act(self, weights: Weights, observation: NDArray[Any]) -> NDArray[np.float64]:
        """The command that the weights answer one observation with."""
        ...


@dataclass(frozen=True)
class Taught:
    """A policy that also answers many observations at once."""

    act: Policy
    act_many: Callable[[NDArray[Any]], NDArray[np.float64]]

    def __call__(self, observation: NDArray[Any], /) -> NDArray[np.float64]:
        """The command for one observation."""
        return self.act(observation)


def policy_of(learner: Learner, weights: Weights) -> Policy:
    """The policy that a learner's weights make: for many observations at once too, where it can."""
    act, act_many = functools.partial(learner.act, weights), getattr(learner, "act_many", None)
    return act if act_many is None else Taught(act, functools.partial(act_many, weights))
