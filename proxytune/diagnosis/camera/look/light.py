"""How a camera's brightness differs from the drawn frames': exposure and vignetting."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter
from scipy.stats import t as student

from proxytune.driving.road.texture import COLOURS

Floats = NDArray[np.float64]
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

FEWEST = 8
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
    """A fitted figure.

    Attributes:
        value: The best one.
        interval: Holds the true one with 95 %.
        identified: Whether the frames can tell it.
    """

    value: float
    interval: tuple[float, float]
    identified: bool


@dataclass(frozen=True)
class Light:
    """How a drawn grey x becomes a logged one, 255 · gain · (x (1 − vignetting r²) / 255) ** gamma.

    r is the distance from the picture's middle, 1 in its corners. Gain and gamma are relative to the declared paint:
    they make the drawn frames match, and say little of the camera where the paint is not known. Vignetting does not
    depend on the paint.

    Attributes:
        gain: Of all frames; where the exposure is automatic, the geometric mean of theirs.
        gamma: Exponent.
        vignetting: How much darker the corners are, as a share.
        levels: Gain of each frame (N,) over that of all.
    """

    gain: Fitted
    gamma: Fitted
    vignetting: Fitted
    levels: Floats

    def only(self, frames: NDArray[np.intp]) -> "Light":
        """The light of some frames."""
        return replace(self, levels=self.levels[frames])

    def shine(self, predicted: NDArray[Any]) -> NDArray[np.float32]:
        """What a camera of this light logs of drawn frames (N, rows, columns[, colours]), before it is rounded."""
        shape = (*predicted.shape[1:3], *(1,) * (predicted.ndim - 3))
        factor = 1.0 - self.vignetting.value * squared_radius(*predicted.shape[1:3]).reshape(shape)
        level = 255.0 * self.gain.value * self.levels.reshape(-1, *(1,) * (predicted.ndim - 1))
        shares = predicted * (factor / 255.0).astype(np.float32)
        return np.asarray(np.clip(level * shares**self.gamma.value, 0.0, 255.0), dtype=np.float32)


def squared_radius(rows: int, columns: int) -> Floats:
    """Squared distance of each pixel (rows, columns) from the picture's middle, 1 in the outermost corners."""
    across, down = np.arange(columns) + 0.5 - columns / 2.0, np.arange(rows) + 0.5 - rows / 2.0
    return np.asarray((across**2 + down[:, None] ** 2) / (columns**2 / 4.0 + rows**2 / 4.0))


def flat_places(predicted: NDArray[Any], floor: NDArray[np.bool_], margin: int = MARGIN) -> NDArray[np.int8]:
    """Which of PAINTS each pixel (N, rows, columns) shows with its neighbours; −1 near edges and off the floor."""
    paint = np.full(predicted.shape[:3], -1, dtype=np.int8)
    for number, colour in enumerate(PAINTS):
        paint[(np.abs(predicted - colour.astype(np.float32)) < 2.0).all(axis=-1)] = number
    paint[:, ~floor] = -2
    around = (1, 2 * margin + 1, 2 * margin + 1)
    alike = minimum_filter(paint, around) == maximum_filter(paint, around)
    return np.where(alike & (paint >= 0), paint, np.int8(-1))


def fit_light(
    measured: Pictures, predicted: NDArray[Any], floor: NDArray[np.bool_], fixed_exposure: bool = False
) -> Light:
    """Fit exposure and vignetting to flat places of the floor.

    Args:
        measured: Frames (N, rows, columns, 3) as logged.
        predicted: What the model draws (N, rows, columns, 3) without any image effect.
        floor: Pixels (rows, columns) that look at the floor.
        fixed_exposure: Whether all frames have one gain.
    """
    means = _means(measured, predicted, floor)
    if means.frame.size == 0:
        gain, gamma, vignetting = (Fitted(*figure, False) for figure in zip((1.0, 1.0, 0.0), RANGES, strict=True))
        return Light(gain, gamma, vignetting, np.ones(len(measured)))
    best, gains = _fit(means, fixed_exposure)
    half = _half_intervals(means, best, lambda kept: _fit(kept, fixed_exposure)[0], len(measured))
    levels = np.ones(len(measured))
    levels[: len(gains)] = gains
    gain, gamma, vignetting = (_fitted(*figure) for figure in zip(best, half, RANGES, WIDEST, strict=True))
    return Light(gain, gamma, vignetting, levels)


def _half_intervals(means: "_Means", best: Floats, fit: Callable[["_Means"], Floats], frames: int) -> Floats:
    """Half of the intervals (3,), without runs of frames in turn and, for gain and gamma, without paints."""
    run, paints = means.frame * BLOCKS // frames, np.unique(means.paint)
    half = jackknife(lambda one: fit(means.without(run == one)), np.unique(run))
    if len(paints) < len(PAINTS):
        half[:2] = np.inf
    else:
        half[:2] = np.hypot(half, jackknife(lambda one: fit(means.without(means.paint == one)), paints))[:2]
    # What is seen of vignetting is its product with gamma
    half[2] = np.hypot(half[2], abs(best[2]) * min(half[1] / best[1], UNKNOWN))
    return half


def jackknife(fit: Callable[[int], Floats], parts: NDArray[np.intp]) -> Floats:
    """Half of the 95 % intervals of what is fitted without each of some parts in turn; infinite with one part only."""
    values = np.stack([fit(part) for part in parts])
    count = len(values)
    if count < 2:
        return np.full(values.shape[1], np.inf)
    variance = (count - 1) ** 2 / count * values.var(axis=0, ddof=1)
    return np.asarray(student.ppf(0.975, count - 1) * np.sqrt(variance))


def _fitted(value: float, half: float, ends: tuple[float, float], widest: float) -> Fitted:
    low, high = ends
    interval = (max(low, float(value - half)), min(high, float(value + half)))
    return Fitted(float(value), interval, bool(half < widest))


class _Means(NamedTuple):
    """Mean brightness of places alike (M,): of one frame, paint (number in PAINTS), colour channel and ring."""

    frame: NDArray[np.intp]
    paint: NDArray[np.intp]
    colour: NDArray[np.intp]
    squared_radius: Floats
    log_grey: Floats
    weight: Floats

    def without(self, drop: NDArray[np.bool_]) -> Self:
        kept: Any = (values[~drop] for values in self)
        return type(self)(*kept)


def _means(measured: Pictures, predicted: NDArray[Any], floor: NDArray[np.bool_]) -> _Means:
    """Every mean over at least FEWEST pixels that are not clipped."""
    paint, radius = flat_places(predicted, floor), squared_radius(*floor.shape)
    ring = np.minimum((radius * RINGS).astype(int), RINGS - 1)
    frame, row, column = np.nonzero(paint >= 0)
    key = (frame * len(PAINTS) + paint[frame, row, column]) * RINGS + ring[row, column]
    count = np.bincount(key)
    kept = np.flatnonzero(count >= FEWEST)
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
        vignetting = float(np.clip(vignetting + _slope(slope, left, level, weight), *RANGES[2]))
        log_gain, gamma = _exposure(paint, np.unique(level))
        weight = means.weight * _huber(left)
    return np.array([np.clip(np.exp(log_gain), *RANGES[0]), gamma, vignetting]), np.exp(gains)


def _mean_by(key: NDArray[np.intp], values: Floats, weight: Floats, count: int) -> Floats:
    """Weighted means by key (count,), 0 where there is none."""
    sums = np.bincount(key, weight, count)
    return np.asarray(np.bincount(key, weight * values, count) / np.where(sums > 0.0, sums, 1.0))


def _slope(slope: Floats, left: Floats, level: NDArray[np.intp], weight: Floats) -> float:
    """Least-squares step of what has this slope, with a free mean per level."""
    inner = slope - _mean_by(level, slope, weight, 9)[level]
    return float((weight * inner * left).sum() / max((weight * inner * inner).sum(), 1e-12))


def _exposure(paint: Floats, seen: NDArray[np.intp]) -> tuple[float, float]:
    """Logarithm of the gain, and gamma, that make the declared paints the levels of those that are in the frames."""
    declared = np.log(PAINTS / 255.0).ravel()[seen]
    if np.ptp(declared) < 0.5:  # Asphalt alone: its channels are too alike
        return float((paint[seen] - declared).mean()), 1.0
    gamma = float(np.clip(np.polyfit(declared, paint[seen], 1)[0], *RANGES[1]))
    return float((paint[seen] - gamma * declared).mean()), gamma


def _huber(left: Floats) -> Floats:
    """Weights of residuals, below 1 beyond one and a half standard deviations."""
    spread = 1.5 * 1.4826 * np.median(np.abs(left)) + 1e-6
    return np.asarray(np.minimum(1.0, spread / np.maximum(np.abs(left), 1e-9)))
