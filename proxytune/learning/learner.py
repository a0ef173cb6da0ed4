"""What a learner is: from demonstrations to weights, and from weights and an observation to a command."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from proxytune.domain import Demonstration

Weights = Mapping[str, NDArray[Any]]
"""What has been learnt, as arrays by name: kept on disk as they are, never pickled."""


class Learner(Protocol):
    """Learns to imitate; bring your own as `module:attribute`, in PyTorch say.

    It is a frozen dataclass or has a `repr` that tells its settings: that and the source of its module, with the
    modules beside it from which that takes classes or functions, identify what it has learnt.
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
