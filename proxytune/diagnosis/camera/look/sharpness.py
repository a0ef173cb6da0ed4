"""How blurred a camera's edges are, by the robot's motion and by poor focus."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, map_coordinates

from proxytune.diagnosis.camera.look.light import BLOCKS, Fitted, Floats, Pictures, jackknife

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
class Edges:
    """Points on the edges of markings in measured frames.

    Attributes:
        frame: Number of the frame (P,).
        place: Column and row (P, 2) [pixel]; the first pixel's middle is at 0.5.
        normal: Unit vector (P, 2) from dark to bright, columns and rows.
        speed: How fast the edge moves through the picture along its normal (P,) [pixel/s]; 0 in still frames.
    """

    frame: NDArray[np.intp]
    place: Floats
    normal: Floats
    speed: Floats


@dataclass(frozen=True)
class Sharpness:
    """What makes edges soft.

    Attributes:
        blur: How long an exposure lasts [s].
        defocus: Standard deviation of the blur of poor focus, as a share of the picture's height.
    """

    blur: Fitted
    defocus: Fitted


def fit_sharpness(measured: Pictures, edges: Edges, draw: Draw) -> Sharpness:
    """Fit motion blur and defocus: motion widens fast edges, poor focus widens all.

    An edge's squared width is that of its drawing, plus defocus², plus blur² · speed² / 12. Read off directly it is
    biased by pixels and narrow tape; so both are what gives the model's own frames the measured widths.

    Args:
        measured: Frames (N, rows, columns, 3) as logged.
        edges: Points on the edges of markings.
        draw: Draws the model's frames, best with the fitted light; the middle of each exposure is to be at the
            instant of the frame's pose.
    """
    edges = _thinned(edges)
    if len(edges.frame) == 0:
        return Sharpness(Fitted(0.0, (0.0, np.inf), False), Fitted(0.0, (0.0, np.inf), False))
    rows, seen = measured.shape[1], _profiles(measured, edges)
    squares, response, last = np.zeros(2), RESPONSE, None
    for _ in range(DRAWS):
        drawn = _profiles(draw(*_values(squares, rows)), edges)
        step, half = _missing(seen, drawn, edges, len(measured))
        if last is not None:
            response = _response(squares - last[0], last[1] - step, response)
        last = squares, step
        squares = np.maximum(squares + step / response, 0.0)
        if (np.abs(squares - last[0]) * response < half / 10.0).all():
            break
    half = np.hypot(WIDER * half, (0.0, ROUGH))
    low, high = _values(squares - half / response, rows), _values(squares + half / response, rows)
    return Sharpness(*(_fitted(*ends) for ends in zip(_values(squares, rows), low, high, WIDEST, strict=True)))


def _values(squares: Floats, rows: int) -> tuple[float, float]:
    """Blur [s] and defocus of squared blur [s²] and squared defocus [pixel²]."""
    blur, defocus = np.sqrt(np.maximum(squares, 0.0))
    return float(blur), float(defocus) / rows


def _fitted(value: float, low: float, high: float, widest: float) -> Fitted:
    return Fitted(value, (low, high), high - low < widest)


def _response(moved: Floats, followed: Floats, response: Floats) -> Floats:
    """How much squared widths follow what is fitted, from the last draw, where that was another."""
    far = np.abs(moved) > 1e-6
    measured = np.divide(followed, moved, out=response.copy(), where=far)
    return np.clip(measured, 0.3, 1.5)


def _thinned(edges: Edges) -> Edges:
    every = max(1, -(-len(edges.frame) // MOST))
    return Edges(edges.frame[::every], edges.place[::every], edges.normal[::every], edges.speed[::every])


def _profiles(pictures: NDArray[Any], edges: Edges) -> tuple[Floats, Floats]:
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
    seen: tuple[Floats, Floats], drawn: tuple[Floats, Floats], edges: Edges, frames: int
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
