"""What a search is after: the outputs that the target has, how well they are known, and the score composed of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.search.proposer import Compose

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Goal:
    """The target as a search sees it.

    Attributes:
        outputs: Agent and metric of each output of a trial.
        values: What each output is on the target, shape (outputs,); NaN where that is not known.
        noise: Variance of the difference between a trial and the target at the same θ, by placement noise on both
            sides, shape (outputs,).
        compose: The score (PRPV) of outputs (…, outputs).
    """

    outputs: tuple[tuple[str, str], ...]
    values: Array
    noise: Array
    compose: Compose

    def __post_init__(self) -> None:
        count = len(self.outputs)
        if self.values.shape != (count,) or self.noise.shape != (count,):
            raise ValueError(f"{count} outputs, but values {self.values.shape} and noise {self.noise.shape}")
