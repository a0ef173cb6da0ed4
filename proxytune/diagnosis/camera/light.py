"""The light of a camera, and what hides the floor from it.

A drawn grey x is logged as 255 · gain · (x (1 − vignetting r²) / 255) ** gamma: `fit_light` fits that to the mean
brightness of flat places, by frame, paint and ring about the picture's middle. `find_blemishes` finds places fixed to
the camera, dirt or a bumper, in which brightness does not follow the drawn frames.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects, label, maximum_filter, median_filter, minimum_filter, uniform_filter
from scipy.stats import t as student

from proxytune.arrays import Flags, Floats
from proxytune.driving import COLOURS

Pictures = NDArray[np.uint8]

PAINTS = np.array([COLOURS[name] for name in ("asphalt", "white", "yellow")], dtype=float)
"""Red, green, blue of what is compared; what lies off the map is no paint that anyone declared."""
MARGIN = 3
"""Pixels that flat places keep from edges and from the horizon: tape, poses and poor focus shift edges by 2 px."""
RINGS = 6
"""Rings about the picture's middle in which brightness is averaged, even in squared radius."""
BLOCKS = 12
"""Runs of frames that are left out in turn: neighbouring frames show the same piece of floor."""
CLIPPED = (4.0, 246.0)
"""Means beyond these are of clipped pixels [grey level]."""
FEW = 20.0
"""A mean over so many pixels weighs half as much as one over many, whose error is the floor's texture."""
FEWEST_PIXELS = 8
"""Pixels that a mean needs."""
ROUNDS = 40
"""Rounds of the fit: it changes by less than 0.0005 after thirty."""
RANGES = ((0.2, 5.0), (0.3, 3.0), (-0.9, 0.9))
"""Gain, gamma and vignetting of any camera."""
UNKNOWN = 0.3
"""Gamma is off by this share at most where paints are off by 30 % from what is declared."""
WIDEST = (0.3, 0.3, 0.12)
"""Half an interval of gain, gamma or vignetting that still tells something."""


@dataclass(frozen=True)
class Fitted:
    """A fitted figure with its 95 % interval, and whether the frames can tell it."""

    value: float
    interval: tuple[float, float]
    identified: bool


@dataclass(frozen=True)
class Light:
    """The light that logs a drawn grey x as 255 · gain · (x (1 − vignetting r²) / 255) ** gamma; r is 1 in corners.

    Gain and gamma are relative to the declared paint: they make the drawn frames match, and say little of the camera
    where the paint is not known.
    """

    gain: Fitted
    gamma: Fitted
    vignetting: Fitted  # a share, which does not depend on the paint
    levels: Floats  # each frame's gain over that of all

    def shine(self, predicted: NDArray[Any]) -> NDArray[np.float32]:
        """Give what a camera of this light logs of drawn frames (N, rows, columns[, colours]), before it is rounded."""
        shape = (*predicted.shape[1:3], *(1,) * (predicted.ndim - 3))
        factor = 1.0 - self.vignetting.value * squared_radius(*predicted.shape[1:3]).reshape(shape)
        level = 255.0 * self.gain.value * self.levels.reshape(-1, *(1,) * (predicted.ndim - 1))
        shares = predicted * (factor / 255.0).astype(np.float32)
        return np.asarray(np.clip(level * shares**self.gamma.value, 0.0, 255.0), dtype=np.float32)


def squared_radius(rows: int, columns: int) -> Floats:
    """Squared distance of each pixel (rows, columns) from the picture's middle, 1 in the outermost corners."""
    across, down = np.arange(columns) + 0.5 - columns / 2.0, np.arange(rows) + 0.5 - rows / 2.0
    return np.asarray((across**2 + down[:, None] ** 2) / (columns**2 / 4.0 + rows**2 / 4.0))


def flat_places(predicted: NDArray[Any], floor: Flags) -> NDArray[np.int8]:
    """The number in PAINTS that a pixel (N, rows, columns) shows with its neighbours; −1 near edges and off floor."""
    paint = np.full(predicted.shape[:3], -1, dtype=np.int8)
    for number, colour in enumerate(PAINTS):
        paint[(np.abs(predicted - colour.astype(np.float32)) < 2.0).all(axis=-1)] = number
    paint[:, ~floor] = -2
    around = (1, 2 * MARGIN + 1, 2 * MARGIN + 1)
    alike = minimum_filter(paint, around) == maximum_filter(paint, around)
    return np.where(alike & (paint >= 0), paint, np.int8(-1))


def fit_light(measured: Pictures, predicted: NDArray[Any], floor: Flags, fixed_exposure: bool = False) -> Light:
    """Fit exposure and vignetting to flat places of the floor; with a fixed exposure all frames have one gain."""
    means = _means(measured, predicted, floor)
    if means.frame.size == 0:
        gain, gamma, vignetting = (Fitted(*figure, False) for figure in zip((1.0, 1.0, 0.0), RANGES, strict=True))
        return Light(gain, gamma, vignetting, np.ones(len(measured)))
    best, gains = _fit(means, fixed_exposure)
    run, paints = means.frame * BLOCKS // len(measured), np.unique(means.paint)
    half = jackknife(lambda one: _fit(means.without(run == one), fixed_exposure)[0], np.unique(run))
    if len(paints) < len(PAINTS):
        half[:2] = np.inf
    else:
        by_paint = jackknife(lambda one: _fit(means.without(means.paint == one), fixed_exposure)[0], paints)
        half[:2] = np.hypot(half, by_paint)[:2]
    # What is seen of vignetting is its product with gamma
    half[2] = np.hypot(half[2], abs(best[2]) * min(half[1] / best[1], UNKNOWN))
    levels = np.ones(len(measured))
    levels[: len(gains)] = gains
    figures = []
    for value, wide, (low, high), widest in zip(best, half, RANGES, WIDEST, strict=True):
        interval = (max(low, float(value - wide)), min(high, float(value + wide)))
        figures.append(Fitted(float(value), interval, bool(wide < widest)))
    gain, gamma, vignetting = figures
    return Light(gain, gamma, vignetting, levels)


def jackknife(fit: Callable[[int], Floats], parts: NDArray[np.intp]) -> Floats:
    """Half of the 95 % intervals of what is fitted without each of some parts in turn; infinite with one part only."""
    values = np.stack([fit(part) for part in parts])
    count = len(values)
    if count < 2:
        return np.full(values.shape[1], np.inf)
    variance = (count - 1) ** 2 / count * values.var(axis=0, ddof=1)
    return np.asarray(student.ppf(0.975, count - 1) * np.sqrt(variance))


class _Means(NamedTuple):
    """Mean brightness of places alike (M,): of one frame, paint (number in PAINTS), colour channel and ring."""

    frame: NDArray[np.intp]
    paint: NDArray[np.intp]
    colour: NDArray[np.intp]
    squared_radius: Floats
    log_grey: Floats
    weight: Floats

    def without(self, drop: Flags) -> Self:
        kept: Any = (values[~drop] for values in self)
        return type(self)(*kept)


def _means(measured: Pictures, predicted: NDArray[Any], floor: Flags) -> _Means:
    """Every mean over at least FEWEST pixels that are not clipped."""
    paint, radius = flat_places(predicted, floor), squared_radius(*floor.shape)
    ring = np.minimum((radius * RINGS).astype(int), RINGS - 1)
    frame, row, column = np.nonzero(paint >= 0)
    key = (frame * len(PAINTS) + paint[frame, row, column]) * RINGS + ring[row, column]
    count = np.bincount(key)
    kept = np.flatnonzero(count >= FEWEST_PIXELS)
    greys = [np.bincount(key, measured[frame, row, column, colour])[kept] / count[kept] for colour in range(3)]
    grey = np.stack(greys, axis=-1).ravel()
    places = np.repeat(kept, 3)
    means = _Means(
        frame=places // (RINGS * len(PAINTS)),
        paint=places // RINGS % len(PAINTS),
        colour=np.tile(np.arange(3), len(kept)),
        squared_radius=np.repeat(np.bincount(key, radius[row, column])[kept] / count[kept], 3),
        log_grey=np.log(np.clip(grey, 1.0, None) / 255.0),
        weight=np.repeat(count[kept] / (count[kept] + FEW), 3),
    )
    return means.without((grey < CLIPPED[0]) | (grey > CLIPPED[1]))


def _fit(means: _Means, fixed_exposure: bool) -> tuple[Floats, Floats]:
    """Gain, gamma and vignetting, and each frame's level, with a free level per paint and channel for vignetting."""
    weight, gamma, vignetting = means.weight, 1.0, 0.0
    level, paint = means.paint * 3 + means.colour, np.zeros(9)
    gains = np.zeros(means.frame.max() + 1)
    for _ in range(ROUNDS):
        shade = np.log1p(-vignetting * means.squared_radius)
        paint = _mean_by(level, means.log_grey - gains[means.frame] - gamma * shade, weight, 9)
        left = means.log_grey - paint[level] - gamma * shade
        if not fixed_exposure:
            gains = _mean_by(means.frame, left, weight, len(gains))
            gains -= gains[np.unique(means.frame)].mean()
        left = left - gains[means.frame]
        slope = -gamma * means.squared_radius / (1.0 - vignetting * means.squared_radius)
        # Least-squares step of what has this slope, with a free mean per level.
        inner = slope - _mean_by(level, slope, weight, 9)[level]
        step = float((weight * inner * left).sum() / max((weight * inner * inner).sum(), 1e-12))
        vignetting = float(np.clip(vignetting + step, *RANGES[2]))
        # Gain and gamma make the declared paints the levels of those that are in the frames
        levels = paint[np.unique(level)]
        declared = np.log(PAINTS / 255.0).ravel()[np.unique(level)]
        gamma = 1.0  # Asphalt alone tells none: its channels are too alike
        if np.ptp(declared) >= 0.5:
            gamma = float(np.clip(np.polyfit(declared, levels, 1)[0], *RANGES[1]))
        log_gain = float((levels - gamma * declared).mean())
        spread = 1.5 * 1.4826 * np.median(np.abs(left)) + 1e-6
        weight = means.weight * np.asarray(np.minimum(1.0, spread / np.maximum(np.abs(left), 1e-9)))
    return np.array([np.clip(np.exp(log_gain), *RANGES[0]), gamma, vignetting]), np.exp(gains)


def _mean_by(key: NDArray[np.intp], values: Floats, weight: Floats, count: int) -> Floats:
    """Weighted means by key (count,), 0 where there is none."""
    sums = np.bincount(key, weight, count)
    return np.asarray(np.bincount(key, weight * values, count) / np.where(sums > 0.0, sums, 1.0))


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
FEWEST_FRAMES = 75
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
REWEIGHTINGS = 5
"""Rounds of reweighting."""


@dataclass(frozen=True)
class Blemish:
    """A place of the picture in which the floor is hidden in all frames."""

    columns: tuple[int, int]  # first and last [pixel]
    rows: tuple[int, int]  # first and last [pixel]
    contrast: float  # share of the floor's contrast that is left: 0 behind a bumper
    share: float  # of the picture


def find_blemishes(measured: Pictures, predicted: NDArray[Any], floor: Flags, light: Light) -> tuple[Blemish, ...]:
    """Find where brightness does not follow the drawn frames', the largest place first.

    Windows in which too few markings pass, near the horizon and at the sides, are not judged: what is hidden may reach
    farther than is said.
    """
    contrast, error, variation = _contrast(measured, predicted, floor, light)
    if not np.isfinite(contrast).any():
        return ()
    left = _against_usual(contrast)
    hidden = (left + SURE * error < HIDDEN) & (_against_usual(variation) < SUBDUED)
    for third in np.array_split(np.arange(len(measured)), PARTS):
        here = replace(light, levels=light.levels[third])
        own, _, spread = _contrast(measured[third], predicted[third], floor, here, FEWEST_FRAMES // PARTS)
        with np.errstate(invalid="ignore"):  # What these frames do not show is NaN, and stays
            hidden &= ~((_against_usual(own) > HIDDEN) | (_against_usual(spread) > HIDDEN))
    parts, _ = label(hidden, structure=np.ones((3, 3)))
    blemishes = []
    for number, place in enumerate(find_objects(parts), start=1):
        part = parts == number
        if part.sum() < SMALLEST:
            continue
        rows, columns = (
            (max(0, side.start * STEP - 1), min(size - 1, (side.stop - 1) * STEP + 1))
            for side, size in zip(place, floor.shape, strict=True)
        )
        share = float(min(1.0, part.sum() * STEP**2 / floor.size))
        blemishes.append(Blemish(columns, rows, max(0.0, float(np.median(left[part]))), share))
    blemishes.sort(key=lambda blemish: -blemish.share)
    return tuple(blemishes) if blemishes and blemishes[0].share >= LEAST_SHARE else ()


def _against_usual(contrast: Singles) -> Singles:
    """Each window's contrast over that of its neighbourhood."""
    if not np.isfinite(contrast).any():
        return contrast
    filled = np.where(np.isfinite(contrast), contrast, np.nanmedian(contrast))
    usual = median_filter(filled, AROUND, mode="nearest")
    return np.asarray(contrast / np.maximum(usual, 0.5), dtype=np.float32)


def _contrast(
    measured: Pictures, predicted: NDArray[Any], floor: Flags, light: Light, fewest: int = FEWEST_FRAMES
) -> tuple[Singles, Singles, Singles]:
    """Slopes of measured on expected brightness of all windows, their errors, ratios of deviations; NaN if unknown."""
    green = np.ascontiguousarray(predicted[..., 1], dtype=np.float32)
    level = light.levels.astype(np.float32)[:, None, None]
    expected, logged = (
        uniform_filter(one, (0, WINDOW, WINDOW), mode="nearest")[:, ::STEP, ::STEP] / level
        for one in (light.shine(green), measured[..., 1].astype(np.float32))
    )
    on_map = minimum_filter(green, (0, WINDOW, WINDOW))[:, ::STEP, ::STEP] > DARKEST
    weight = on_map.astype(np.float32)
    slope, error = _regress(expected, logged, weight)
    spread = _spread(expected, weight)
    judged = minimum_filter(floor, WINDOW + 2 * HORIZON)[::STEP, ::STEP]
    judged &= (spread > VARIED) & (on_map.sum(axis=0) >= fewest)
    variation = _spread(logged, weight) / np.maximum(spread, 1e-3)
    return np.where(judged, slope, np.nan), error, np.where(judged, variation, np.nan)


def _spread(grey: Singles, weight: Singles) -> Singles:
    total = np.maximum(weight.sum(axis=0), 1.0)
    off = grey - (weight * grey).sum(axis=0) / total
    return np.asarray(np.sqrt((weight * off**2).sum(axis=0) / total), dtype=np.float32)


def _regress(expected: Singles, logged: Singles, weight: Singles) -> tuple[Singles, Singles]:
    """Robust slope over the frames and its standard error."""
    now = weight
    for _ in range(REWEIGHTINGS):
        total = np.maximum(now.sum(axis=0), 1.0)
        across = expected - (now * expected).sum(axis=0) / total
        up = logged - (now * logged).sum(axis=0) / total
        squares = np.maximum((now * across**2).sum(axis=0), 1.0)
        slope = (now * across * up).sum(axis=0) / squares
        left = up - slope * across
        scale = 2.0 * 1.4826 * np.median(np.abs(left), axis=0) + 1.0
        now = weight * np.minimum(1.0, scale / np.maximum(np.abs(left), 1e-3))
    return slope, np.sqrt(((now * across * left) ** 2).sum(axis=0)) / squares
