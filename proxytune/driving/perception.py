"""What agents perceive in pictures: many robots' pictures at once, each as if it were the only one, to the bit.

An agent asks a `Look` of its newest picture. Looks of one kind are answered together: colours are compared for all
robots at once, and sums go over each robot's own pixels, in their order.
"""

import functools
import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Flags, Floats, SmallBuffers
from proxytune.driving.agent import Picture
from proxytune.driving.optics import CameraFigures, ground_points
from proxytune.driving.robot import Robot

HALF_LANE_M = 0.128
"""From a lane's centre to the middle of the marking on either side of it [m]."""

FEWEST = 6
"""So many pixels it takes to see a lane."""


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
        lefts: How far to the left those within reach lie, in order.
    """

    first: int
    ahead: Floats
    left: Floats
    near: Flags
    lefts: list[float]


@functools.lru_cache
def _eye(figures: CameraFigures, reach_m: float) -> Eye:
    ground = ground_points(figures)
    near = ground[..., 0] <= reach_m
    first_row = int(np.argmax(near.any(axis=1)))
    floor = np.where(near[..., None], ground, np.nan)[first_row:].reshape(-1, 2)
    ahead, left = np.ascontiguousarray(floor.T)
    near = near[first_row:].ravel()
    return Eye(first_row * figures.columns, ahead, left, near, np.sort(left[near]).tolist())


def open_eye(robot: Robot, *, reach_m: float = 0.7) -> Eye:
    """The eye of an agent on this robot, looking no further ahead than `reach_m`."""
    return _eye(robot.camera_figures(), reach_m)


class Seen:
    """The newest pictures (n, rows, columns, 3) of robots, and what has been made out in them.

    Whoever asks again before there are new pictures is answered from memory.
    """

    def __init__(self, pictures: NDArray[np.uint8]) -> None:
        """Look at nothing yet."""
        self.pictures = pictures
        self._first = math.inf
        self._known: dict[tuple[Any, ...], list[Any]] = {}

    def answer(self, kind: "Kind", looks: tuple[Any, ...], robots: Sequence[int]) -> list[Any]:
        """Answer looks of one kind, each at the picture of one of these robots."""
        asked = (kind, looks, tuple(robots))
        if asked not in self._known:
            self._known[asked] = kind(self, looks, robots)
        return self._known[asked]

    def colours(self, first: int, robots: Sequence[int]) -> tuple[NDArray[np.int16], NDArray[np.uint8]]:
        """How yellow pixels are and how bright, (robots, pixels), from one of them on: −255 to 255, and 0 to 255."""
        if first < self._first:
            pixels = self.pictures.reshape(len(self.pictures), -1, 3)[:, first:]
            blue = pixels[..., 2].copy()
            yellow = np.minimum(pixels[..., 0], pixels[..., 1])
            self._yellow, self._bright = np.subtract(yellow, blue, dtype=np.int16), np.minimum(yellow, blue)
            self._first = first
        start, these = int(first - self._first), _rows(robots, len(self.pictures))
        return self._yellow[these, start:], self._bright[these, start:]


def _rows(robots: Sequence[int], count: int) -> Any:
    """Rows of some robots, without a copy where they follow one another."""
    first, end = robots[0], robots[-1] + 1
    return slice(first, end) if end - first == len(robots) else list(robots)


Kind = Callable[[Seen, tuple[Any, ...], Sequence[int]], list[Any]]
"""A way to answer looks of one kind."""


class Markings(NamedTuple):
    """A look at the markings on the floor.

    Attributes:
        eye: The part of the picture that is looked at.
        contrast: Red and green of the dashed centre line are brighter than blue by more than this (of 255).
        brightness: Every colour of the solid edge lines is brighter than this (of 255).
    """

    eye: Eye
    contrast: float = math.inf
    brightness: float = math.inf


class _Plan(NamedTuple):
    """All that looks have in common whatever the pictures show; a robot's row is nothing, then its pixels twice.

    Attributes:
        first: The first pixel that any of them looks at.
        contrast: Yellow is more than this, (robots, 1).
        near: Which pixels may be yellow, (robots, pixels).
        brightness: White is at least this, (robots, 1).
        rank: How many of its eye's pixels lie further right than each, (robots, pixels); beyond counting where it may
            not be white.
        rows: Where the rows begin among all that may be yellow and among all, two of (robots + 1,).
        shifts: From there to the eyes' own numbers of pixels, two of (robots,).
        left: How far to the left the pixels of all eyes lie [m].
        ahead: How far ahead, twice [m].
        middle: How far to the left the lane's middle lies if they are of the centre line, and of the edge line [m].
    """

    first: int
    contrast: NDArray[np.int16]
    near: Flags
    brightness: NDArray[np.uint8]
    rank: NDArray[np.int32]
    rows: tuple[NDArray[np.intp], NDArray[np.intp]]
    shifts: tuple[NDArray[np.intp], NDArray[np.intp]]
    left: Floats
    ahead: Floats
    middle: Floats


_NEVER = np.iinfo(np.int32).max


@functools.lru_cache(maxsize=8)
def _plan(looks: tuple[Markings, ...]) -> _Plan:
    eyes = list(dict.fromkeys(look.eye for look in looks))
    first, last = min(eye.first for eye in eyes), eyes[0].first + len(eyes[0].near)
    pixels, numbers = last - first, np.arange(len(looks) + 1)
    near, rank = np.zeros((len(looks), pixels), dtype=bool), np.full((len(looks), pixels), _NEVER, dtype=np.int32)
    for robot, look in enumerate(looks):
        seen, eye = slice(pixels - len(look.eye.near), None), look.eye
        near[robot, seen] = eye.near
        if look.brightness < 255.0:
            rank[robot, seen] = np.where(eye.near, np.searchsorted(eye.lefts, eye.left), _NEVER)
    tables = []
    for eye in eyes:
        ahead, left = np.concatenate((np.zeros((2, 1 + pixels - len(eye.near))), (eye.ahead, eye.left)), axis=1)
        middle = np.concatenate((left[:1], left[1:] - HALF_LANE_M, left[1:] + HALF_LANE_M))
        tables.append((left, np.concatenate((ahead, ahead[1:])), middle))
    shifts = np.array([eyes.index(look.eye) for look in looks]) - numbers[:-1]
    return _Plan(
        first,
        np.array([[math.floor(min(max(look.contrast, -256.0), 256.0))] for look in looks], dtype=np.int16),
        near,
        np.array([[math.floor(min(max(look.brightness, -1.0), 254.0)) + 1] for look in looks], dtype=np.uint8),
        rank,
        (numbers * (1 + pixels), numbers * (1 + 2 * pixels)),
        (shifts * (1 + pixels), shifts * (1 + 2 * pixels)),
        *(np.concatenate(table) for table in zip(*tables, strict=True)),
    )


def find_lanes(seen: Seen, looks: tuple[Markings, ...], robots: Sequence[int]) -> list[Lane | None]:
    """Fit a line through the lane's centre, right of the yellow line and left of the white one, by least squares.

    White pixels to the left of the yellow ones belong to the other lane's edge and are left out.

    Returns:
        The lanes, None where fewer than FEWEST pixels are left to fit.
    """
    plan = _plan(looks)
    yellow, bright = seen.colours(plan.first, robots)
    pixels = yellow.shape[1]
    # Sums over pieces begin with their first number, sums over arrays with 0: each row has that in front
    hits = np.empty((len(looks), 1 + 2 * pixels), dtype=bool)
    hits[:, 0] = True
    on_line, on_edge = hits[:, 1 : 1 + pixels], hits[:, 1 + pixels :]
    with SmallBuffers():
        np.greater(yellow, plan.contrast, out=on_line)
        on_line &= plan.near
        bounds, where = _located(hits[:, : 1 + pixels], plan.rows[0], plan.shifts[0])
        sums = np.add.reduceat(plan.left.take(where), bounds[:-1]).tolist()
        counts = (bounds[1:] - bounds[:-1] - 1).tolist()
        limits = [
            [bisect_left(look.eye.lefts, total / count if count else HALF_LANE_M)]
            for look, total, count in zip(looks, sums, counts, strict=True)
        ]
        np.greater_equal(bright, plan.brightness, out=on_edge)
        on_edge &= plan.rank < np.array(limits, dtype=np.int32)
    bounds, where = _located(hits, plan.rows[1], plan.shifts[1])
    starts, sizes = bounds[:-1], bounds[1:] - bounds[:-1]
    ahead, left = plan.ahead.take(where), plan.middle.take(where)
    counts = (sizes - 1).tolist()
    means = [
        (a / max(count, 1), b / max(count, 1))
        for a, b, count in zip(
            np.add.reduceat(ahead, starts).tolist(), np.add.reduceat(left, starts).tolist(), counts, strict=True
        )
    ]
    centred = ahead - np.repeat([mean for mean, _ in means], sizes)
    centred[starts] = 0.0
    tilts = np.add.reduceat(centred * left, starts).tolist()
    spreads = np.add.reduceat(centred * centred, starts).tolist()
    return list(map(_fitted, counts, means, tilts, spreads))


def _located(hits: Flags, rows: NDArray[np.intp], shift: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Where each row's hits begin among all hits, (rows + 1,), and the hits in their eyes' own numbers."""
    found = np.flatnonzero(hits)
    bounds = np.searchsorted(found, rows)
    found += np.repeat(shift, bounds[1:] - bounds[:-1])
    return bounds, found


def _fitted(count: int, mean: tuple[float, float], tilt: float, spread: float) -> Lane | None:
    if count < FEWEST:
        return None
    # a ridge keeps a handful of pixels at one distance from spinning the line round
    slope = tilt / (spread + 0.005 * count)
    return Lane(mean[1] - slope * mean[0], slope, count)


def count_yellow(seen: Seen, looks: tuple[Markings, ...], robots: Sequence[int]) -> list[int]:
    """How many pixels of the dashed centre line there are."""
    plan = _plan(looks)
    yellow, _ = seen.colours(plan.first, robots)
    with SmallBuffers():
        on_line = (yellow > plan.contrast) & plan.near
    return [int(np.count_nonzero(one)) for one in on_line]


@dataclass(frozen=True, eq=False)
class Lower:
    """The lower part of a picture.

    Attributes:
        first_row: The rows from here on.
        side: Of each of their pixels, from −1 at the left to 1 at the right, (rows, columns).
        pull: How near to the picture's middle each is, from −1 to 1, on the left below zero; from the second column on.
    """

    first_row: int
    side: Floats
    pull: Floats


@functools.lru_cache
def lower_part(rows: int, columns: int, share: float) -> Lower:
    """The part of a picture below a share of its height."""
    first = int(share * rows)
    side = np.repeat(np.linspace(-1.0, 1.0, columns)[None, :], rows - first, axis=0)
    inner = side[:, 1:]
    return Lower(first, side, np.sign(inner) * (1.0 - np.abs(inner)))


def weigh_markings(seen: Seen, looks: tuple[Lower, ...], robots: Sequence[int]) -> list[tuple[float, float]]:
    """Shares of the lower part that are yellow on the right or in the middle, and white on the right."""
    columns, shares = seen.pictures.shape[2], []
    for robot, look in zip(robots, looks, strict=True):
        yellow, bright = seen.colours(look.first_row * columns, (robot,))
        right, middle = look.side.ravel() >= 0.35, look.side.ravel() > -0.35
        shown = (yellow[0] > 60) & middle, (bright[0] > 150) & right
        shares.append((int(shown[0].sum()) / right.size, int(shown[1].sum()) / right.size))
    return shares


def weigh_edges(seen: Seen, looks: tuple[tuple[Lower, float], ...], robots: Sequence[int]) -> list[tuple[float, int]]:
    """Sums of the pulls of edges in the lower part, where brightness steps by more (of 255), and their numbers."""
    weighed = []
    for robot, (look, step) in zip(robots, looks, strict=True):
        grey = seen.pictures[robot, look.first_row :].astype(np.int16).sum(axis=-1) // 3
        edges = np.abs(np.diff(grey, axis=1)) > step
        weighed.append((float(np.where(edges, look.pull, 0.0).sum()), int(edges.sum())))
    return weighed


def take_picture(seen: Seen, looks: tuple[None, ...], robots: Sequence[int]) -> list[Picture]:
    """The pictures themselves."""
    return [seen.pictures[robot] for robot in robots]
