"""Random features: a linear fit to random waves over a small picture, in closed form."""

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sklearn.kernel_approximation import RBFSampler
from sklearn.linear_model import Ridge

from proxytune.arrays import Floats, one_thread
from proxytune.domain import Demonstration
from proxytune.errors import LearnerError
from proxytune.learning.cloning import grey_cells
from proxytune.learning.learner import Weights


@dataclass(frozen=True)
class RandomFeatures:
    """Ridge regression on random Fourier features (Rahimi and Recht 2007) of a picture averaged over cells.

    From weights learnt elsewhere it fits what these leave to explain: samples change the answer to pictures like
    theirs, and leave that to others as it was.

    Attributes:
        top: Share of the picture's rows, from the top, that is not looked at.
        rows: Cells above one another in the rest.
        columns: Cells beside one another.
        features: Number of random features.
        reach: How far apart two pictures are that have little to do with each other (root mean square over cells;
            black and white are 1 apart).
        penalty: What it costs to move the weights, against squared errors [duty²] summed over samples.
    """

    top: float = 0.25
    rows: int = 12
    columns: int = 16
    features: int = 1000
    reach: float = 0.15
    penalty: float = 0.2

    def train(self, samples: Demonstration, start: Weights | None, seed: int) -> Weights:
        """Fit to the samples from scratch, or to what weights learnt elsewhere leave of them."""
        if not len(samples.commands):
            raise LearnerError("there is no sample to learn from; collect some, or do not train")
        before: Weights = start or {
            "seed": np.array(seed),
            "centre": samples.commands.mean(axis=0),
            "slopes": np.zeros((self.features, samples.commands.shape[1])),
        }
        seen = self._waves(before, samples.observations)
        if before["slopes"].shape != (seen.shape[1], samples.commands.shape[1]):
            raise LearnerError(
                f"the weights to start from do not fit: slopes is {before['slopes'].shape} where these samples need "
                f"{(seen.shape[1], samples.commands.shape[1])}; train the start with as many features and commands"
            )
        left = samples.commands - before["centre"] - seen @ before["slopes"]
        with one_thread():
            fitted = Ridge(alpha=self.penalty, fit_intercept=False, solver="cholesky").fit(seen, left)
        return {**before, "slopes": before["slopes"] + fitted.coef_.T}

    def act(self, weights: Weights, observation: NDArray[np.uint8]) -> Floats:
        """The command for one picture, within [−1, 1]."""
        command: Floats = weights["centre"] + self._waves(weights, observation[None])[0] @ weights["slopes"]
        return np.clip(command, -1.0, 1.0)

    def _waves(self, weights: Weights, pictures: NDArray[np.uint8]) -> Floats:
        """Random features (n, features) of pictures, always the same for the same weights."""
        cells = grey_cells(pictures, top=self.top, rows=self.rows, columns=self.columns)
        gamma = 0.5 / (cells.shape[1] * self.reach**2)
        directions, phases = _fourier_features(cells.shape[1], self.features, gamma, int(weights["seed"]))
        waves: Floats = np.sqrt(2.0 / self.features) * np.cos(cells @ directions + phases)
        return waves


@functools.lru_cache(maxsize=8)
def _fourier_features(cells: int, features: int, gamma: float, seed: int) -> tuple[Floats, Floats]:
    """Directions (cells, features) and phases (features,) of the waves that approximate a Gaussian kernel."""
    sampler = RBFSampler(gamma=gamma, n_components=features, random_state=seed).fit(np.zeros((1, cells)))
    return sampler.random_weights_, sampler.random_offset_
