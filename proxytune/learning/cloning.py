"""Behaviour cloning: a small network from a small picture to the expert's command.

Learners see a camera's picture as grey values, averaged over cells (`grey_cells`).
"""

import functools
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor

from proxytune.arrays import Floats, one_thread
from proxytune.domain import Demonstration
from proxytune.errors import LearnerError
from proxytune.learning.learner import Weights


def grey_cells(pictures: NDArray[np.uint8], *, top: float, rows: int, columns: int) -> Floats:
    """Grey cells (n, rows · columns), −0.5 to 0.5, of pictures (n, rows, columns, 3) but for a share at the top.

    Refused if the pictures are no colour pictures or have fewer pixels than there are cells.
    """
    height, width = pictures.shape[1:3] if pictures.ndim == 4 else (0, 0)
    first = round(top * height)
    if height - first < rows or width < columns:
        raise LearnerError(
            f"pictures have shape {pictures.shape[1:]}, and {rows} × {columns} cells below row {first} "
            "do not fit in; give (rows, columns, 3) with more pixels, or take fewer cells"
        )
    seen = pictures[:, first:]
    # Adding 16-bit channels is exact, and twice as fast as a mean over them
    grey = (seen[..., 0].astype(np.uint16) + seen[..., 1] + seen[..., 2]) / 3.0
    means = _cell_means(_cell_means(grey, rows, axis=1), columns, axis=2)
    return means.reshape(len(pictures), -1) / 255.0 - 0.5


def _cell_means(values: Floats, cells: int, axis: int) -> Floats:
    """Means over cells of nearly equal size along an axis."""
    firsts, sizes = _cells(values.shape[axis], cells)
    shape = [1] * values.ndim
    shape[axis] = cells
    return np.asarray(np.add.reduceat(values, firsts, axis=axis) / sizes.reshape(shape))


@functools.lru_cache
def _cells(length: int, cells: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First pixel of each cell along an axis, and its number of pixels."""
    edges = np.linspace(0, length, cells + 1).round().astype(int)
    return edges[:-1], np.diff(edges)


@dataclass(frozen=True)
class BehaviourCloning:
    """A multi-layer perceptron on a picture averaged over cells, trained by Adam.

    From scratch it takes a fixed number of gradient steps. From weights learnt elsewhere it goes over each sample a
    fixed number of times, so that a handful of samples does not make it forget the rest.

    Attributes:
        top: Share of the picture's rows, from the top, that is not looked at.
        rows: Cells above one another in the rest.
        columns: Cells beside one another.
        hidden: Neurons of the hidden layers.
        steps: Gradient steps from scratch, and the most there are of them.
        passes: How often each sample is gone over when starting from weights.
        batch: Samples of a step.
        rate: Learning rate.
        penalty: Weight decay.
    """

    top: float = 0.25
    rows: int = 12
    columns: int = 16
    hidden: tuple[int, ...] = (64,)
    steps: int = 2000
    passes: int = 15
    batch: int = 64
    rate: float = 1e-3
    penalty: float = 1e-4

    def train(self, samples: Demonstration, start: Weights | None, seed: int) -> Weights:
        """Fit to the samples from scratch, or go on from weights learnt elsewhere."""
        if not len(samples.commands):
            raise LearnerError("there is no sample to learn from; collect some, or do not train")
        seen = self.features(samples.observations)
        scale = start or _scale(samples.commands)
        wanted = (samples.commands - scale["centre"]) / scale["spread"]
        network = self._network(len(wanted), seed)
        with one_thread(), warnings.catch_warnings():
            # The number of steps is fixed: that the loss might still fall is known.
            warnings.simplefilter("ignore", ConvergenceWarning)
            if start is not None:
                _settle(network, seen, wanted, start)
                network.set_params(max_iter=min(self.passes, network.max_iter))
            network.fit(seen, wanted)
        return {"centre": scale["centre"], "spread": scale["spread"], **_layers(network)}

    def act(self, weights: Weights, observation: NDArray[np.uint8]) -> Floats:
        """The command for one picture, within [−1, 1]."""
        command: Floats = self.act_many(weights, observation[None])[0]
        return command

    def act_many(self, weights: Weights, observations: NDArray[np.uint8]) -> Floats:
        """The commands (n, 2) for pictures (n, rows, columns, 3), each as `act` has it, to the bit."""
        # A product for each row: one over all rows rounds by how many there are
        signal = self.features(observations)[:, None]
        for layer in range(len(self.hidden)):
            signal = np.maximum(0.0, signal @ weights[f"weight{layer}"] + weights[f"bias{layer}"])
        signal = signal @ weights[f"weight{len(self.hidden)}"] + weights[f"bias{len(self.hidden)}"]
        commands: Floats = np.clip(weights["centre"] + weights["spread"] * signal[:, 0], -1.0, 1.0)
        return commands

    def features(self, pictures: NDArray[np.uint8]) -> Floats:
        """Grey cells (n, rows · columns) of pictures (n, rows, columns, 3), from −0.5 to 0.5."""
        return grey_cells(pictures, top=self.top, rows=self.rows, columns=self.columns)

    def _network(self, count: int, seed: int) -> MLPRegressor:
        batch = min(self.batch, count)
        return MLPRegressor(
            hidden_layer_sizes=self.hidden,
            alpha=self.penalty,
            batch_size=batch,
            learning_rate_init=self.rate,
            max_iter=max(1, round(self.steps * batch / count)),
            n_iter_no_change=self.steps + 1,
            random_state=seed,
            warm_start=True,
        )


def _settle(network: MLPRegressor, seen: Floats, wanted: Floats, start: Weights) -> None:
    """Put learnt weights into a network: scikit-learn lays it out in a first fit, and then goes on from there."""
    longest = network.max_iter
    layers = _layers(network.set_params(max_iter=1).fit(seen, wanted))
    network.set_params(max_iter=longest)
    for name, values in layers.items():
        if name not in start or start[name].shape != values.shape:
            was = start[name].shape if name in start else "missing"
            raise LearnerError(
                f"the weights to start from do not fit: {name} is {was} where these samples need {values.shape}; "
                "train the start on pictures and a network of the same size"
            )
    network.coefs_ = [np.array(start[name]) for name in layers if name.startswith("weight")]
    network.intercepts_ = [np.array(start[name]) for name in layers if name.startswith("bias")]


def _scale(commands: Floats) -> dict[str, Floats]:
    """Centre and spread of the commands; where they do not vary, spread 1."""
    spread = commands.std(axis=0)
    return {"centre": commands.mean(axis=0), "spread": np.where(spread > 1e-9, spread, 1.0)}


def _layers(network: MLPRegressor) -> dict[str, Floats]:
    weights = {f"weight{layer}": values for layer, values in enumerate(network.coefs_)}
    return {**weights, **{f"bias{layer}": values for layer, values in enumerate(network.intercepts_)}}
