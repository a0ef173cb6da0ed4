"""The look of a camera's pictures besides where things are in them: brightness, sharpness, noise and blemishes.

Sharpness: an edge's squared width is that of its drawing, plus defocus², plus blur² · speed² / 12; both are what gives
the model's own frames the measured widths (`fit_sharpness`). Noise is told from the texture of the floor by frames
between which the robot stood, else by the smoothest band of rows (`fit_grain`). `look_at` fits all of them with the
light; `changes` says which there is no doubt of.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, map_coordinates

from proxytune.arrays import Flags, Floats
from proxytune.diagnosis.camera.edges import Gathered
from proxytune.diagnosis.camera.fitting import CameraFit
from proxytune.diagnosis.camera.light import (
    BLOCKS,
    MARGIN,
    Blemish,
    Fitted,
    Light,
    Pictures,
    find_blemishes,
    fit_light,
    flat_places,
    jackknife,
)
from proxytune.diagnosis.camera.model import BLUR, NOISE, draw_pictures, pose_slopes, project
from proxytune.driving import ground_points
from proxytune.effects import PARAMETERS, effect_of

Draw = Callable[[float, float], NDArray[Any]]
"""Draws all frames (N, rows, columns, 3) with a blur [s] and a defocus, a share of the picture's height."""
STEP = 0.5
"""Between two points of an edge's profile [pixel]."""
REACH = 24
"""Steps to both sides over which a profile goes: 12 pixels, half of what 0.1 s blurs at 240 pixel/s."""
SHIFT = 8
"""Steps from its place within which an edge is looked for: tape and poses move it by up to 4 pixels."""
SLOWER = 1.0 - 0.5 ** np.arange(1, 7)
"""Shares of the edges that are slower than each group but the first: few are fast, and these tell the most."""
FOOT = 0.15
"""An edge ends where it is less steep than this share of its steepest."""
FAINT = 0.35
"""Edges that the model draws with less than this share of the measured steepness are not the same ones."""
MOST = 12000
"""Edge points that are enough."""
DRAWS = 4
"""Times that the model is drawn: an edge's squared width is nearly linear in the squares of what is fitted."""
RESPONSE = np.array([1.0, 0.5])
"""How much wider an edge gets than in theory: of a pixel's own width, part of a little defocus is not seen."""
WIDER = 1.5
"""What the jackknife's intervals are too narrow by: they held 14 of 20 planted blurs, for a foot's end jumps."""
ROUGH = 0.06
"""What widths of profiles half a pixel apart are wrong by, besides their scatter [pixel²]."""
SLOW = 5.0
"""Edges that all move alike to this tell nothing of blur [pixel/s]."""
WIDEST = (0.06, 0.01)
"""Intervals of blur [s] and defocus that still tell something."""


@dataclass(frozen=True)
class MovingEdges:
    """Points on the edges of markings in measured frames."""

    frame: NDArray[np.intp]  # (P,)
    place: Floats  # columns and rows (P, 2) [pixel], 0.5 in the first pixel's middle
    normal: Floats  # from dark to bright (P, 2)
    speed: Floats  # along the normal (P,) [pixel/s], 0 in still frames


@dataclass(frozen=True)
class Sharpness:
    """The softness of edges: how long an exposure lasts [s], and the blur of poor focus as a share of the height."""

    blur: Fitted
    defocus: Fitted


def fit_sharpness(measured: Pictures, edges: MovingEdges, draw: Draw) -> Sharpness:
    """Fit motion blur and defocus: motion widens fast edges, poor focus widens all.

    Read off directly, an edge's squared width is biased by pixels and narrow tape; so both are what gives the frames
    that `draw` makes of the model the measured widths, best with the fitted light and at the middle of each exposure.
    """
    every = max(1, -(-len(edges.frame) // MOST))
    edges = MovingEdges(edges.frame[::every], edges.place[::every], edges.normal[::every], edges.speed[::every])
    if len(edges.frame) == 0:
        return Sharpness(Fitted(0.0, (0.0, np.inf), False), Fitted(0.0, (0.0, np.inf), False))
    rows, seen = measured.shape[1], _profiles(measured, edges)
    squares, response, last = np.zeros(2), RESPONSE, None
    for _ in range(DRAWS):
        drawn = _profiles(draw(*_values(squares, rows)), edges)
        step, half = _missing(seen, drawn, edges, len(measured))
        if last is not None:
            # How much squared widths follow what is fitted, from the last draw, where that was another.
            moved, followed = squares - last[0], last[1] - step
            measured_response = np.divide(followed, moved, out=response.copy(), where=np.abs(moved) > 1e-6)
            response = np.clip(measured_response, 0.3, 1.5)
        last = squares, step
        squares = np.maximum(squares + step / response, 0.0)
        if (np.abs(squares - last[0]) * response < half / 10.0).all():
            break
    half = np.hypot(WIDER * half, (0.0, ROUGH))
    low, high = _values(squares - half / response, rows), _values(squares + half / response, rows)
    ends = zip(_values(squares, rows), low, high, WIDEST, strict=True)
    return Sharpness(*(Fitted(value, (least, most), most - least < widest) for value, least, most, widest in ends))


def _values(squares: Floats, rows: int) -> tuple[float, float]:
    """Blur [s] and defocus of squared blur [s²] and squared defocus [pixel²]."""
    blur, defocus = np.sqrt(np.maximum(squares, 0.0))
    return float(blur), float(defocus) / rows


def _profiles(pictures: NDArray[Any], edges: MovingEdges) -> tuple[Floats, Floats]:
    """Brightness along each edge's normal, the steepest place in the middle (P, 2 REACH + 1), and how steep that is."""
    along = np.arange(-REACH - SHIFT, REACH + SHIFT + 1) * STEP
    column, row = (edges.place[:, axis, None] - 0.5 + edges.normal[:, axis, None] * along for axis in (0, 1))
    frame = np.broadcast_to(edges.frame[:, None], row.shape)
    grey = pictures[..., :2].mean(axis=-1, dtype=np.float32)  # Yellow is dark in blue
    profile = map_coordinates(grey, [frame, row, column], order=1, mode="nearest").astype(float)
    slope = gaussian_filter1d(np.gradient(profile, axis=1), 2.0 / STEP, axis=1)[:, REACH : REACH + 2 * SHIFT + 1]
    places = slope.argmax(axis=1)[:, None] + np.arange(2 * REACH + 1)
    return np.take_along_axis(profile, places, axis=1), slope.max(axis=1)


def _missing(
    seen: tuple[Floats, Floats], drawn: tuple[Floats, Floats], edges: MovingEdges, frames: int
) -> tuple[Floats, Floats]:
    """Squared blur [s²] and defocus [pixel²] that the drawn edges lack, and half of their intervals."""
    same = drawn[1] > FAINT * seen[1]
    if not same.any():
        return np.zeros(2), np.full(2, np.inf)
    speed, run = np.abs(edges.speed[same]), edges.frame[same] * BLOCKS // frames
    group = np.searchsorted(np.unique(np.quantile(speed, SLOWER)), speed)
    columns = [np.ones((len(speed), 1)), speed[:, None] ** 2, seen[0][same], drawn[0][same]]
    sums = np.zeros((BLOCKS, group.max() + 1, 2 + 2 * (2 * REACH + 1)))
    np.add.at(sums, (run, group), np.concatenate(columns, axis=1))
    runs = np.unique(run)
    half = jackknife(lambda one: _lack(sums[runs[runs != one]].sum(axis=0)), runs)
    if speed.max() < SLOW:
        half[0] = np.inf
    return _lack(sums.sum(axis=0)), half


def _lack(sums: Floats) -> Floats:
    """Squared blur and defocus that the drawn edges lack, of sums per group of edges alike in speed."""
    count = sums[:, 0]
    squared_speed, *profiles = np.split(sums[count > 0, 1:] / count[count > 0, None], [1, 2 * REACH + 2], axis=1)
    if len(squared_speed) == 0:
        return np.zeros(2)
    seen, drawn = (_squared_width(profile) for profile in profiles)
    weight = np.sqrt(count[count > 0]) / (0.3 + drawn)
    design = np.concatenate((squared_speed / 12.0, np.ones_like(squared_speed)), axis=1)
    if squared_speed.max() < SLOW**2:
        design[:, 0] = 0.0
    return np.asarray(np.linalg.lstsq(design * weight[:, None], (seen - drawn) * weight, rcond=None)[0])


def _squared_width(profiles: Floats) -> Floats:
    """Variance of the place where brightness rises (groups,) [pixel²], over the rise in the middle of each profile."""
    slope = np.diff(profiles, axis=1)
    middle = REACH - SHIFT // 2 + slope[:, REACH - SHIFT // 2 : REACH + SHIFT // 2].argmax(axis=1)
    steepest = np.take_along_axis(slope, middle[:, None], axis=1)
    index = np.arange(slope.shape[1])
    flat = slope < FOOT * steepest
    first = np.where(flat & (index < middle[:, None]), index, -1).max(axis=1)
    last = np.where(flat & (index > middle[:, None]), index, len(index)).min(axis=1)
    rise = np.where((index > first[:, None]) & (index < last[:, None]), slope, 0.0)
    rise = rise / np.maximum(rise.sum(axis=1, keepdims=True), 1e-9)
    mean = (rise * index).sum(axis=1, keepdims=True)
    return np.asarray((rise * (index - mean) ** 2).sum(axis=1)) * STEP**2


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
    """The noise of pixels."""

    noise: Fitted  # [grey level]; not identified, it is below its interval's end: a floor's texture may be all of it
    still_pairs: int  # pairs of frames from the same place that tell it; 0 if the robot never stood


def fit_grain(measured: Pictures, predicted: NDArray[Any], floor: Flags) -> Grain:
    """Fit the noise, from frames between which the robot stood, else from the smoothest flat places."""
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
    """Variance without stains and the like, beyond four standard deviations."""
    spread = 1.4826 * np.median(np.abs(values)) + 0.5
    return float(np.square(values[np.abs(values) < 4.0 * spread]).mean())


SHARP_PX = 2.0
"""Edges that lie farther from the map's are not those that the model draws."""
HORIZON_ROWS = 3
"""So many rows beneath the horizon are left out: what a pixel covers there is a metre long."""


@dataclass(frozen=True)
class Appearance:
    """All figures of the pictures' look."""

    light: Light
    grain: Grain
    sharpness: Sharpness
    blemishes: tuple[Blemish, ...]

    @property
    def figures(self) -> Mapping[str, Fitted]:
        """Every figure by its name in θ."""
        return {
            "vignetting": self.light.vignetting,
            "exposure.gain": self.light.gain,
            "exposure.gamma": self.light.gamma,
            "image_noise": self.grain.noise,
            "defocus": self.sharpness.defocus,
            "blur": self.sharpness.blur,
        }


LEAST: Mapping[str, float] = {
    "vignetting": 0.05,
    "exposure.gain": 0.08,
    "exposure.gamma": 0.1,
    "image_noise": 2.0,
    "defocus": 0.006,
    "blur": 0.01,
}
"""How far from its neutral value a figure must lie to matter for what an agent sees."""
NARROW = 0.12
"""Half of an interval of gain or gamma that is found only where every paint is as declared."""


def look_at(gathered: Gathered, fit: CameraFit) -> Appearance:
    """Fit the look of a log's pictures to a fitted camera's."""
    views, state, pictures = fit.views, fit.state, gathered.pictures
    every = np.arange(views.count)

    def soft(blur_s: float, defocus: float) -> NDArray[Any]:
        values = {BLUR: blur_s, "defocus": defocus}
        theta = {name: PARAMETERS[name].clipped(float(value)) for name, value in values.items()}
        return draw_pictures(views, state, theta, every)

    drawn, floor = draw_pictures(views, state, {}, every), floor_pixels(fit)
    light = fit_light(pictures, drawn, floor, gathered.frames.fixed_exposure)
    there, edges = project(views, state), views.edges
    same = there.valid & (np.abs(there.residual) < SHARP_PX)
    speed = np.abs((pose_slopes(there) * there.rates).sum(axis=1))
    place = np.stack((edges.column, edges.row), axis=-1)
    moving = MovingEdges(edges.frame[same], place[same], edges.normal[same], speed[same])
    sharpness = fit_sharpness(pictures, moving, lambda blur, defocus: light.shine(soft(blur, defocus)))
    blurred = soft(sharpness.blur.value, sharpness.defocus.value)
    grain, blemishes = fit_grain(pictures, drawn, floor), find_blemishes(pictures, blurred, floor, light)
    return Appearance(light, grain, sharpness, blemishes)


def floor_pixels(fit: CameraFit) -> Flags:
    """Pixels (rows, columns) that look at the floor, a little beneath the horizon."""
    on_floor = np.isfinite(ground_points(fit.views.optics.figures(fit.theta))[..., 0])
    below = np.ones_like(on_floor)
    below[HORIZON_ROWS:] = on_floor[:-HORIZON_ROWS]
    return np.asarray(on_floor & below)


def changes(look: Appearance) -> tuple[str, ...]:
    """The effects on pictures that there is no doubt of, and that matter, by name.

    Exposure is told where every paint says the same of it: else the paint may be another than the map declares. Noise
    is told by its size: no floor's texture is so strong everywhere.
    """
    names = []
    for name, figure in look.figures.items():
        parameter, (low, high) = PARAMETERS[name], figure.interval
        neutral = parameter.neutral_value({})
        sure = name == NOISE or not low <= neutral <= high
        possible = parameter.low <= figure.value <= parameter.high
        if sure and possible and abs(figure.value - neutral) >= LEAST[name]:
            names.append(name)
    exposure = {name: one.interval for name, one in look.figures.items() if name.startswith("exposure.")}
    if any((high - low) / 2.0 > NARROW for low, high in exposure.values()):
        names = [name for name in names if name not in exposure]
    return tuple(dict.fromkeys(effect_of(name) for name in names))
