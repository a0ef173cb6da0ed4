"""Learning curves: the scores of a learner in the target, by number of target samples and repetition."""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Curve:
    """A learning curve: scores in the target by number of target samples.

    Attributes:
        counts: Numbers of target samples, rising, the first 0.
        scores: Scores (repetitions, counts); NaN where nobody was examined, or nothing could drive.

    Raises:
        InputError: If the counts do not rise from 0, or do not match the scores.
    """

    counts: tuple[int, ...]
    scores: Array

    def __post_init__(self) -> None:
        if not self.counts or self.counts[0] != 0:
            raise InputError("a learning curve starts at 0 target samples; add 0 to the grid")
        if any(later <= earlier for earlier, later in itertools.pairwise(self.counts)):
            raise InputError(f"the grid of target samples must rise, got {list(self.counts)}")
        if self.scores.ndim != 2 or self.scores.shape[1] != len(self.counts) or not len(self.scores):
            raise InputError(f"scores have shape {self.scores.shape}; give (seeds, {len(self.counts)})")

    @property
    def examined(self) -> NDArray[np.intp]:
        """Repetition and place in `counts` of every examination (examinations, 2)."""
        return np.argwhere(np.isfinite(self.scores))

    @property
    def repetitions(self) -> int:
        """How many repetitions have an examination."""
        return int(np.isfinite(self.scores).any(axis=1).sum())
