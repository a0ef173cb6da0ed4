"""The noise of a camera's pixels, told from the texture of the floor."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.look.light import MARGIN, Fitted, Floats, Pictures, flat_places

BANDS = 6
"""Bands of rows that are compared: a floor's texture changes with distance, noise does not."""

FEWEST = 500
"""Pixels of one paint that a band or a pair of frames needs."""

ROUNDING = 1.0 / 12.0
"""Variance of rounding to whole grey levels."""

STILL = 0.05
"""Mean difference of drawn frames between which the robot has not moved [grey level]."""

STEADY = 2.0
"""Between a low and a high end of less than this ratio, noise is told from texture."""

LITTLE = 0.5
"""Noise below this is none: rounding has a standard deviation of 0.3 [grey level]."""


@dataclass(frozen=True)
class Grain:
    """How noisy the pixels are.

    Attributes:
        noise: Standard deviation of a pixel as it is logged [grey level]. Where it is not identified, only the
            interval's upper end says something: the floor's texture may be all that was seen.
        still_pairs: How many pairs of frames from the same place it was taken from; 0 where the robot never stood.
    """

    noise: Fitted
    still_pairs: int


def fit_grain(measured: Pictures, predicted: NDArray[Any], floor: NDArray[np.bool_]) -> Grain:
    """Fit the noise, from frames between which the robot stood, else from the smoothest flat places.

    Args:
        measured: Frames (N, rows, columns, 3) as logged.
        predicted: What the model draws (N, rows, columns, 3) without any image effect.
        floor: Pixels (rows, columns) that look at the floor.
    """
    paint = flat_places(predicted, floor)
    still = _still_variances(measured, predicted, paint)
    if still.size:
        half = 2.0 * still.std() / np.sqrt(still.size) + 0.02 * still.mean()
        return Grain(_noise(still.mean() - half, still.mean(), still.mean() + half), still.size)
    near, wide = (_band_variances(measured, paint, apart) for apart in (1, MARGIN))
    if near.size == 0:
        return Grain(Fitted(0.0, (0.0, np.inf), False), 0)
    # Texture that varies by so much from band to band is taken to be as strong in the smoothest one.
    # Compression makes neighbours alike, so the upper end comes from pixels farther apart.
    return Grain(_noise(2.0 * near.min() - near.max(), near.min(), 1.05 * max(near.min(), wide.min())), 0)


def _noise(low: float, best: float, high: float) -> Fitted:
    """The standard deviation, from variances with rounding."""
    ends = np.sqrt(np.clip(np.array([low, best, high]) - ROUNDING, 0.0, None))
    return Fitted(float(ends[1]), (float(ends[0]), float(ends[2])), bool(ends[2] < max(STEADY * ends[0], LITTLE)))


def _still_variances(measured: Pictures, predicted: NDArray[Any], paint: NDArray[np.int8]) -> Floats:
    """Variance of a pixel between successive frames from the same place; the same frame twice tells nothing."""
    moved = [np.abs(after - before).mean() for before, after in pairwise(predicted)]
    variances = []
    for first in np.flatnonzero(np.array(moved) < STILL):
        change = measured[first + 1].astype(float) - measured[first]
        paints = [change[paint[first] == number] for number in (0, 1, 2)]
        # The exposure may change from frame to frame, by a level per paint
        left = np.concatenate([part - part.mean(axis=0) for part in paints if len(part)] or [np.zeros((0, 3))])
        if len(left) >= FEWEST and change.any():
            variances.append(_variance(left.ravel()) / 2.0)
    return np.array(variances)


def _band_variances(measured: Pictures, paint: NDArray[np.int8], apart: int) -> Floats:
    """Variance of a pixel about those so many columns to its left and right, by paint and band of rows."""
    frame, row, left = np.nonzero(paint[:, :, apart:-apart] >= 0)
    if frame.size == 0:
        return np.zeros(0)
    column = left + apart
    grey = [measured[frame, row, column + aside].astype(np.int16) for aside in (-apart, 0, apart)]
    bend = (2 * grey[1] - grey[0] - grey[2]) / np.sqrt(6.0)
    kept = (grey[1].min(axis=-1) > 1) & (grey[1].max(axis=-1) < 254)
    ends = np.quantile(row, np.arange(1, BANDS) / BANDS)
    group = np.where(kept, paint[frame, row, column] * BANDS + np.searchsorted(ends, row), -1)
    bends = [bend[group == one] for one in range(3 * BANDS)]
    return np.array([_variance(part.ravel()) for part in bends if len(part) >= FEWEST])


def _variance(values: Floats) -> float:
    """Of the values without stains and the like, beyond four standard deviations."""
    spread = 1.4826 * np.median(np.abs(values)) + 0.5
    kept = values[np.abs(values) < 4.0 * spread]
    return float(np.square(kept).mean())
