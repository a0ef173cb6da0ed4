"""What agents perceive in pictures: many robots' pictures at once, each as if it were the only one, to the bit.

An agent asks a `Look` of its newest picture. Looks of one kind are answered together: colours are compared for all
robots at once, and sums go over each robot's own pixels, in their order.
"""

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Flags, Floats
from proxytune.driving.agent import Picture
from proxytune.driving.optics import CameraFigures, ground_points
from proxytune.driving.robot import Robot

HALF_LANE_M = 0.128
"""From a lane's centre to the middle of the marking on either side of it [m]."""

FEWEST = 6
"""So many pixels it takes to see a lane."""

RIDGE = 0.005
"""For each pixel, it keeps a handful of them at one distance from spinning the line round [m²]."""


class Lane(NamedTuple):
    """A straight line through the lane's centre in the robot's frame: left(x) = offset + slope · x.

    Attributes:
        offset: How far to the left of the axle's middle the lane's centre lies [m].
        slope: Tangent of the lane's direction, positive to the left.
        pixels: How many pixels say so.
    """

    offset: float
    slope: float
    pixels: int


@dataclass(frozen=True, eq=False)
class Eye:
    """The part of the picture that the nominal camera takes for nearby floor.

    Attributes:
        first: The pixels from here on are looked at.
        ahead: How far ahead of the axle each of them lies [m], NaN beyond reach.
        left: How far to the left [m].
        near: Whether it lies within reach.
    """

    first: int
    ahead: Floats
    left: Floats
    near: Flags


@functools.lru_cache
def _eye(figures: CameraFigures, reach_m: float) -> Eye:
    ground = ground_points(figures)
    near = ground[..., 0] <= reach_m
    first_row = int(np.argmax(near.any(axis=1)))
    floor = np.where(near[..., None], ground, np.nan)[first_row:].reshape(-1, 2)
    ahead, left = np.ascontiguousarray(floor.T)
    near = near[first_row:].ravel()
    return Eye(first_row * figures.columns, ahead, left, near)


def open_eye(robot: Robot, *, reach_m: float = 0.7) -> Eye:
    """The eye of an agent on this robot, looking no further ahead than `reach_m`."""
    return _eye(robot.camera_figures(), reach_m)


Draw = Callable[[int], NDArray[np.uint8]]
"""Pictures (n, rows, columns, 3) that are right from the pixel of this number on."""


class Seen:
    """The newest pictures (n, rows, columns, 3) of robots, and what has been made out in them.

    Whoever asks again before there are new pictures is answered from memory. Only what is looked at is drawn.

    """

    def __init__(self, pictures: NDArray[np.uint8] | Draw, rows: Any = slice(None)) -> None:
        """Look at nothing yet, but later at these rows of the pictures or of what draws them."""
        self._pictures, self._rows = pictures, rows
        self._first: float = math.inf
        self._known: dict[tuple[Any, ...], list[Any]] = {}

    def pictures(self, first: int) -> NDArray[np.uint8]:
        """The pictures, right from the first pixel on."""
        drawn = self._pictures(first) if callable(self._pictures) else self._pictures
        return np.asarray(drawn[self._rows])

    def answer(self, kind: "Kind", looks: tuple[Any, ...], robots: Sequence[int]) -> list[Any]:
        """Answer looks of one kind, each at the picture of one of these robots."""
        asked = (kind, looks, tuple(robots))
        if asked not in self._known:
            self._known[asked] = kind(self, looks, robots)
        return self._known[asked]

    def colours(self, first: int, robots: Sequence[int]) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """How yellow some robots' pixels are from one of them on, and how bright, (robots, pixels), 0 to 255."""
        if first < self._first:
            drawn = self.pictures(first)
            levels = drawn.reshape(len(drawn), -1)[:, 3 * first :]
            # Compared as they lie, two thirds in vain, then parted: faster than to part red and green first
            golden = np.minimum(levels[:, :-2], levels[:, 1:-1])[:, ::3].copy()
            self._bright = np.minimum(golden, levels[:, 2::3])
            self._yellow = np.subtract(golden, self._bright, out=golden)
            self._first = first
        pixels = rows_of(robots), slice(first - int(self._first), None)
        return self._yellow[pixels], self._bright[pixels]


def rows_of(robots: Sequence[int]) -> Any:
    """Rows of some robots, in ascending order, without a copy where they follow one another."""
    first, end = robots[0], robots[-1] + 1
    return slice(first, end) if end - first == len(robots) else list(robots)


Kind = Callable[[Seen, tuple[Any, ...], Sequence[int]], list[Any]]
"""A way to answer looks of one kind."""


class Markings(NamedTuple):
    """A look at the markings on the floor.

    Attributes:
        eye: The part of the picture that is looked at.
        contrast: Red and green of the dashed centre line are brighter than blue by more than this (0 to 255).
        brightness: Every colour of the solid edge lines is brighter than this (0 to 255).
    """

    eye: Eye
    contrast: float = math.inf
    brightness: float = math.inf


class _Plan(NamedTuple):
    """All that looks have in common whatever the pictures show.

    A robot's row is one place that always counts, then its pixels as they may be yellow, and as they may be white.

    Attributes:
        first: The first pixel that any of them looks at.
        yellow: More is yellow, (robots, pixels).
        white: More is white, (robots, pixels).
        starts: Where each robot's row begins, where in it what is white, and one more place, (2 · robots + 2,).
        shifts: From there to what is known of its eye, (2 · robots + 1,).
        left: How far to the left the places of the eyes' rows lie [m].
        lines: How far ahead they lie, and how far to the left the lane's middle does if they are markings, (2, …) [m].
    """

    first: int
    yellow: NDArray[np.uint8]
    white: NDArray[np.uint8]
    starts: NDArray[np.intp]
    shifts: NDArray[np.intp]
    left: Floats
    lines: Floats


@functools.lru_cache(maxsize=8)
def _plan(looks: tuple[Markings, ...]) -> _Plan:
    eyes = list(dict.fromkeys(look.eye for look in looks))
    first, last = min(eye.first for eye in eyes), eyes[0].first + len(eyes[0].near)
    pixels = last - first
    length = 1 + 2 * pixels
    thresholds = np.full((2, len(looks), pixels), 255, dtype=np.uint8)
    for robot, look in enumerate(looks):
        for marking, least in zip(thresholds, (look.contrast, look.brightness), strict=True):
            marking[robot, look.eye.first - first :][look.eye.near] = math.floor(min(max(least, 0.0), 255.0))
    known = np.zeros((3, len(eyes), length))
    for (left, ahead, middle), eye in zip(known.transpose(1, 0, 2), eyes, strict=True):
        for end, aside in ((1 + pixels, -HALF_LANE_M), (length, HALF_LANE_M)):
            here = slice(end - len(eye.near), end)
            left[here], ahead[here], middle[here] = eye.left, eye.ahead, eye.left + aside
    rows = np.arange(len(looks) + 1) * length
    own = np.array([*(eyes.index(look.eye) * length for look in looks), 0]) - rows
    starts = np.stack((rows, rows + 1 + pixels), axis=1).ravel()
    starts[-1] = rows[-1] + 1
    sides, lines = known[0].ravel(), known[1:].reshape(2, -1)
    return _Plan(first, thresholds[0], thresholds[1], starts, own.repeat(2)[:-1], sides, lines)


def find_lanes(seen: Seen, looks: tuple[Markings, ...], robots: Sequence[int]) -> list[Lane | None]:
    """Fit a line through the lane's centre, right of the yellow line and left of the white one, by least squares.

    White pixels to the left of the yellow ones belong to the other lane's edge and are left out.

    Returns:
        The lanes, None where fewer than FEWEST pixels are left to fit.
    """
    plan = _plan(looks)
    yellow, bright = seen.colours(plan.first, robots)
    count, pixels = yellow.shape
    if count == 1:
        return [_find_lane(looks[0].eye, (yellow > plan.yellow)[0].nonzero()[0], (bright > plan.white)[0].nonzero()[0])]
    hits = np.empty(count * (1 + 2 * pixels) + 1, dtype=bool)
    rows = hits[:-1].reshape(count, -1)
    # Sums over pieces begin with their first number, those over arrays with 0: so each row begins with 0
    rows[:, 0] = hits[-1] = True
    np.greater(yellow, plan.yellow, out=rows[:, 1 : 1 + pixels])
    np.greater(bright, plan.white, out=rows[:, 1 + pixels :])
    found = hits.nonzero()[0]
    starts = found.searchsorted(plan.starts)
    sizes = starts[1:] - starts[:-1]
    known = found + plan.shifts.repeat(sizes)
    left = plan.left.take(known)
    totals = np.add.reduceat(left, starts[:-1]).tolist()
    ends: list[float] = []
    for total, size in zip(totals[:-1:2], sizes[:-1:2].tolist(), strict=True):
        ends += math.inf, total / (size - 1) if size > 1 else HALF_LANE_M
    ends.append(-math.inf)
    right = left < np.array(ends).repeat(sizes)
    starts = found[right].searchsorted(plan.starts[::2])
    lines = plan.lines.take(known[right], axis=1)
    return _fit(lines, starts[:-1], starts[1:] - starts[:-1])


def _find_lane(eye: Eye, yellow: NDArray[np.intp], white: NDArray[np.intp]) -> Lane | None:
    """The same for one robot: what many share costs one alone more than it saves."""
    on_line, on_edge = eye.left.take(yellow), eye.left.take(white)
    right = on_edge < (float(np.add.reduce(on_line)) / len(on_line) if len(on_line) else HALF_LANE_M)
    ahead = eye.ahead.take(np.concatenate((yellow, white[right])))
    left = np.concatenate((on_line - HALF_LANE_M, on_edge[right] + HALF_LANE_M))
    count = len(ahead)
    if count < FEWEST:
        return None
    mean_ahead, mean_left = float(np.add.reduce(ahead)) / count, float(np.add.reduce(left)) / count
    ahead -= mean_ahead
    left *= ahead
    ahead *= ahead
    slope = float(np.add.reduce(left)) / (float(np.add.reduce(ahead)) + RIDGE * count)
    return Lane(mean_left - slope * mean_ahead, slope, count)


def _fit(lines: Floats, starts: NDArray[np.intp], sizes: NDArray[np.intp]) -> list[Lane | None]:
    """Lines through places.

    Args:
        lines: How far ahead they lie and to the left, (2, places); overwritten.
        starts: Where those of each picture begin; the first of them does not count and is 0.
        sizes: How many they are.
    """
    counts = sizes - 1
    weights = np.maximum(counts, 1)
    ahead, left = np.add.reduceat(lines, starts, axis=1) / weights
    centred = lines[0] - ahead.repeat(sizes)
    centred[starts] = 0.0
    lines[0] = centred
    lines *= centred
    spread, tilt = np.add.reduceat(lines, starts, axis=1)
    slope = tilt / (spread + RIDGE * weights)
    found = zip((left - slope * ahead).tolist(), slope.tolist(), counts.tolist(), strict=True)
    return [Lane(*line) if line[2] >= FEWEST else None for line in found]


def count_yellow(seen: Seen, looks: tuple[Markings, ...], robots: Sequence[int]) -> list[int]:
    """How many pixels of the dashed centre line there are."""
    plan = _plan(looks)
    yellow, _ = seen.colours(plan.first, robots)
    return [int(np.count_nonzero(one)) for one in yellow > plan.yellow]


@dataclass(frozen=True, eq=False)
class Lower:
    """The lower part of a picture.

    Attributes:
        first_row: The rows from here on.
        first: The pixels from here on.
        yellow: More is yellow, and on the right or in the middle, (pixels,).
        white: More is white, and on the right, (pixels,).
        pull: How near to the picture's middle each is, from −1 to 1, on the left below zero; from the second column on.
    """

    first_row: int
    first: int
    yellow: NDArray[np.uint8]
    white: NDArray[np.uint8]
    pull: Floats


@functools.lru_cache
def lower_part(rows: int, columns: int, share: float) -> Lower:
    """The part of a picture below a share of its height."""
    first = int(share * rows)
    side = np.repeat(np.linspace(-1.0, 1.0, columns)[None, :], rows - first, axis=0)
    yellow, white = np.where(side > -0.35, 60, 255), np.where(side >= 0.35, 150, 255)
    pull = np.sign(side) * (1.0 - np.abs(side))
    return Lower(
        first, first * columns, yellow.astype(np.uint8).ravel(), white.astype(np.uint8).ravel(), pull[:, 1:].copy()
    )


def weigh_markings(seen: Seen, looks: tuple[Lower, ...], robots: Sequence[int]) -> list[tuple[float, float]]:
    """Shares of the lower part that are yellow on the right or in the middle, and white on the right."""
    yellow, bright = seen.colours(min(look.first for look in looks), robots)
    shares: list[tuple[float, float]] = []
    for golden, shining, look in zip(yellow, bright, looks, strict=True):
        size = look.yellow.size
        counts = (np.count_nonzero(golden[-size:] > look.yellow), np.count_nonzero(shining[-size:] > look.white))
        shares.append((counts[0] / size, counts[1] / size))
    return shares


def weigh_edges(seen: Seen, looks: tuple[tuple[Lower, float], ...], robots: Sequence[int]) -> list[tuple[float, int]]:
    """Sums of the pulls of edges in the lower part, where brightness steps by more (of 255), and their numbers."""
    weighed = []
    for robot, (look, step) in zip(robots, looks, strict=True):
        grey = seen.pictures(look.first)[robot, look.first_row :].astype(np.int16).sum(axis=-1) // 3
        edges = np.abs(np.diff(grey, axis=1)) > step
        weighed.append((float(np.where(edges, look.pull, 0.0).sum()), int(edges.sum())))
    return weighed


def take_picture(seen: Seen, looks: tuple[None, ...], robots: Sequence[int]) -> list[Picture]:
    """The pictures themselves."""
    pictures = seen.pictures(0)
    return [pictures[robot] for robot in robots]
