"""What is fixed to the camera and hides the floor: dirt on the lens, a bumper in view."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects, label, median_filter, minimum_filter, uniform_filter

from proxytune.diagnosis.camera.look.light import Light, Pictures

Singles = NDArray[np.float32]

WINDOW = 7
"""Side of the windows whose mean brightness is compared [pixel]: narrower ones miss tape that is 2 px off."""

STEP = 2
"""Between the middles of two windows [pixel]."""

AROUND = 31
"""Windows across the neighbourhood whose contrast is the usual one: poorly fitted light changes it slowly."""

HORIZON = 6
"""Pixels to keep from what is not floor: the floor's far end is too thin to be judged."""

DARKEST = 40.0
"""Less is drawn off the map [grey level], where nobody declared what there is to see."""

VARIED = 12.0
"""Standard deviation of the drawn brightness over the frames that shows a contrast [grey level]."""

FEWEST = 75
"""Frames that a window needs: with 60, two of five draws of photographed frames had false alarms."""

HIDDEN = 0.75
"""Contrast below which something lies between lens and floor: photographed floors alone seldom go below 0.75."""

SUBDUED = 0.65
"""Variation over the frames, against that of what is drawn, below which it does: tape that lies off and poses that
scatter spoil the first contrast, not this one."""

SURE = 3.0
"""Standard deviations by which the contrast must be below that."""

PARTS = 3
"""Parts of the log, one after another, each of which must show that a place is hidden: one odd passage is none."""

SMALLEST = 7
"""Windows that a blemish has at least."""

LEAST_SHARE = 0.0022
"""Share of the picture that the largest blemish covers, half of a spot of 10 pixels across: smaller ones alone are
stains of the floor that few passages showed."""

ROUNDS = 5
"""Rounds of reweighting."""


@dataclass(frozen=True)
class Blemish:
    """A place of the picture in which the floor is hidden in all frames.

    Attributes:
        columns: First and last [pixel].
        rows: First and last [pixel].
        contrast: Share of the floor's contrast that is left: 0 behind a bumper.
        share: Of the picture.
    """

    columns: tuple[int, int]
    rows: tuple[int, int]
    contrast: float
    share: float


def find_blemishes(
    measured: Pictures, predicted: NDArray[Any], floor: NDArray[np.bool_], light: Light
) -> tuple[Blemish, ...]:
    """Find where brightness does not follow the drawn frames', the largest place first.

    Windows in which too few markings pass, near the horizon and at the sides, are not judged: what is hidden may reach
    farther than is said.

    Args:
        measured: Frames (N, rows, columns, 3) as logged.
        predicted: What the model draws (N, rows, columns, 3) without any image effect.
        floor: Pixels (rows, columns) that look at the floor.
        light: What fit_light says.
    """
    contrast, error, variation = _contrast(measured, predicted, floor, light)
    if not np.isfinite(contrast).any():
        return ()
    left = _against_usual(contrast)
    hidden = (left + SURE * error < HIDDEN) & (_against_usual(variation) < SUBDUED)
    for third in np.array_split(np.arange(len(measured)), PARTS):
        hidden &= ~_follows(measured[third], predicted[third], floor, light.only(third))
    parts, _ = label(hidden, structure=np.ones((3, 3)))
    blemishes = [
        _blemish(parts == number, place, left, floor.shape)
        for number, place in enumerate(find_objects(parts), start=1)
        if (parts == number).sum() >= SMALLEST
    ]
    blemishes.sort(key=lambda blemish: -blemish.share)
    return tuple(blemishes) if blemishes and blemishes[0].share >= LEAST_SHARE else ()


def _follows(measured: Pictures, predicted: NDArray[Any], floor: NDArray[np.bool_], light: Light) -> NDArray[np.bool_]:
    """Windows whose brightness follows what is drawn in some of the frames; not where these do not show it."""
    contrast, _, variation = _contrast(measured, predicted, floor, light, FEWEST // PARTS)
    with np.errstate(invalid="ignore"):
        return np.asarray((_against_usual(contrast) > HIDDEN) | (_against_usual(variation) > HIDDEN))


def _against_usual(contrast: Singles) -> Singles:
    """Each window's contrast over that of its neighbourhood."""
    if not np.isfinite(contrast).any():
        return contrast
    filled = np.where(np.isfinite(contrast), contrast, np.nanmedian(contrast))
    usual = median_filter(filled, AROUND, mode="nearest")
    return np.asarray(contrast / np.maximum(usual, 0.5), dtype=np.float32)


def _blemish(
    part: NDArray[np.bool_], place: tuple[slice, ...], contrast: NDArray[Any], shape: tuple[int, ...]
) -> Blemish:
    """What a connected part of the windows' middles is called in pixels."""
    ends = [
        (max(0, side.start * STEP - 1), min(size - 1, (side.stop - 1) * STEP + 1))
        for side, size in zip(place, shape, strict=True)
    ]
    share = min(1.0, part.sum() * STEP**2 / (shape[0] * shape[1]))
    return Blemish(ends[1], ends[0], max(0.0, float(np.median(contrast[part]))), float(share))


def _contrast(
    measured: Pictures, predicted: NDArray[Any], floor: NDArray[np.bool_], light: Light, fewest: int = FEWEST
) -> tuple[Singles, Singles, Singles]:
    """How the measured brightness of each window follows the expected one over the frames; NaN if unknown.

    Returns:
        The slope, its standard error, and the standard deviation of the measured over that of the expected.
    """
    green = np.ascontiguousarray(predicted[..., 1], dtype=np.float32)
    level = light.levels.astype(np.float32)[:, None, None]
    expected, logged = (_windows(one) / level for one in (light.shine(green), measured[..., 1].astype(np.float32)))
    on_map = minimum_filter(green, (0, WINDOW, WINDOW))[:, ::STEP, ::STEP] > DARKEST
    weight = on_map.astype(np.float32)
    slope, error = _regress(expected, logged, weight)
    spread = _spread(expected, weight)
    judged = minimum_filter(floor, WINDOW + 2 * HORIZON)[::STEP, ::STEP]
    judged &= (spread > VARIED) & (on_map.sum(axis=0) >= fewest)
    variation = _spread(logged, weight) / np.maximum(spread, 1e-3)
    return np.where(judged, slope, np.nan), error, np.where(judged, variation, np.nan)


def _spread(grey: Singles, weight: Singles) -> Singles:
    """Standard deviation of each window over the frames."""
    total = np.maximum(weight.sum(axis=0), 1.0)
    off = grey - (weight * grey).sum(axis=0) / total
    return np.asarray(np.sqrt((weight * off**2).sum(axis=0) / total), dtype=np.float32)


def _windows(grey: Singles) -> Singles:
    """Mean brightness of each window in each frame."""
    return uniform_filter(grey, (0, WINDOW, WINDOW), mode="nearest")[:, ::STEP, ::STEP]


def _regress(expected: Singles, logged: Singles, weight: Singles) -> tuple[Singles, Singles]:
    """Robust slope over the frames and its standard error."""
    now = weight
    for _ in range(ROUNDS):
        total = np.maximum(now.sum(axis=0), 1.0)
        across = expected - (now * expected).sum(axis=0) / total
        up = logged - (now * logged).sum(axis=0) / total
        squares = np.maximum((now * across**2).sum(axis=0), 1.0)
        slope = (now * across * up).sum(axis=0) / squares
        left = up - slope * across
        scale = 2.0 * 1.4826 * np.median(np.abs(left), axis=0) + 1.0
        now = weight * np.minimum(1.0, scale / np.maximum(np.abs(left), 1e-3))
    error = np.sqrt(((now * across * left) ** 2).sum(axis=0)) / squares
    return slope, error
