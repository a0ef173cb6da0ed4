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
from proxytune.driving.loops import FEWEST, Eyes, fastest
from proxytune.driving.optics import CameraFigures, ground_points, joined
from proxytune.driving.robot import Robot


class Lane(NamedTuple):
    """A straight line through the lane's centre in the robot's frame: left(x) = offset + slope · x."""

    offset: float  # how far to the left of the axle's middle the lane's centre lies [m]
    slope: float  # tangent of the lane's direction, positive to the left
    pixels: int  # how many pixels say so


@dataclass(frozen=True, eq=False)
class Eye:
    """The part of the picture that the nominal camera takes for nearby floor."""

    first: int  # the pixels from here on are looked at
    ahead: Floats  # how far ahead of the axle each of them lies [m], NaN beyond reach
    left: Floats  # how far to the left [m]
    near: Flags  # whether it lies within reach


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
"""Draws pictures as planes (n, 3, rows, columns) that are right from the pixel of this number on."""


class Seen:
    """The newest pictures of robots, and what has been made out in them.

    Whoever asks again before there are new pictures is answered from memory. Only what is looked at is drawn.
    """

    def __init__(self, planes: NDArray[np.uint8] | Draw, rows: Any = slice(None)) -> None:
        """Look at nothing yet, but later at these rows of the planes (n, 3, rows, columns) or of what draws them."""
        self._planes, self._rows = planes, rows
        self._first: float = math.inf
        self._known: dict[tuple[Any, ...], list[Any]] = {}

    def planes(self, first: int) -> NDArray[np.uint8]:
        """The pictures (n, 3, rows, columns), right from the first pixel on."""
        drawn = self._planes(first) if callable(self._planes) else self._planes
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
            planes = self.planes(first)
            red, green, blue = planes.reshape(len(planes), 3, -1)[..., first:].swapaxes(0, 1)
            golden = np.minimum(red, green)
            self._bright = np.minimum(golden, blue)
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
    """A look at the markings on the floor."""

    eye: Eye  # the part of the picture that is looked at
    contrast: float = math.inf  # red and green of the dashed centre line are brighter than blue by more (0 to 255)
    brightness: float = math.inf  # every colour of the solid edge lines is brighter than this (0 to 255)


@functools.lru_cache(maxsize=8)
def _eyes(looks: tuple[Markings, ...]) -> tuple[int, Eyes]:
    """The first pixel that any of them looks at, and the eyes that look."""
    distinct = list(dict.fromkeys(look.eye for look in looks))
    first, last = min(eye.first for eye in distinct), distinct[0].first + len(distinct[0].near)
    places = np.zeros((2, len(distinct), last - first))
    for number, eye in enumerate(distinct):
        places[:, number, eye.first - first :] = eye.ahead, eye.left
    levels = np.full((2, len(looks), last - first), 255, dtype=np.uint8)
    for robot, look in enumerate(looks):
        for marking, least in zip(levels, (look.contrast, look.brightness), strict=True):
            marking[robot, look.eye.first - first :][look.eye.near] = math.floor(min(max(least, 0.0), 255.0))
    (ahead, left), (yellow, white) = places, levels
    return first, Eyes(ahead, left, np.array([distinct.index(look.eye) for look in looks]), yellow, white)


def find_lanes(seen: Seen, looks: tuple[Markings, ...], robots: Sequence[int]) -> list[Lane | None]:
    """The line through the lane's centre as each robot sees it; None where too few pixels show it."""
    first, eyes = _eyes(looks)
    lanes = fastest(0).find_lanes(eyes, *seen.colours(first, robots))
    return [Lane(offset, slope, int(count)) if count >= FEWEST else None for offset, slope, count in lanes.tolist()]


def count_yellow(seen: Seen, looks: tuple[Markings, ...], robots: Sequence[int]) -> list[int]:
    """How many pixels of the dashed centre line there are."""
    first, eyes = _eyes(looks)
    yellow, _ = seen.colours(first, robots)
    return [int(np.count_nonzero(one)) for one in yellow > eyes.yellow]


@dataclass(frozen=True, eq=False)
class Lower:
    """The lower part of a picture."""

    first_row: int  # the rows from here on
    first: int  # the pixels from here on
    yellow: NDArray[np.uint8]  # more is yellow, and on the right or in the middle, (pixels,)
    white: NDArray[np.uint8]  # more is white, and on the right, (pixels,)
    pull: Floats  # how near to the picture's middle each is, from −1 to 1, on the left below zero; from column 1 on


@functools.lru_cache
def lower_part(rows: int, columns: int, share: float) -> Lower:
    """The part of a picture below a share of its height."""
    first = int(share * rows)
    side = np.repeat(np.linspace(-1.0, 1.0, columns)[None, :], rows - first, axis=0)
    levels = np.where(side > -0.35, 60, 255), np.where(side >= 0.35, 150, 255)
    yellow, white = (level.astype(np.uint8).ravel() for level in levels)
    pull = np.sign(side) * (1.0 - np.abs(side))
    return Lower(first, first * columns, yellow, white, pull[:, 1:].copy())


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
        grey = seen.planes(look.first)[robot, :, look.first_row :].astype(np.int16).sum(axis=0) // 3
        edges = np.abs(np.diff(grey, axis=1)) > step
        weighed.append((float(np.where(edges, look.pull, 0.0).sum()), int(edges.sum())))
    return weighed


def take_picture(seen: Seen, looks: tuple[None, ...], robots: Sequence[int]) -> list[Picture]:
    """The pictures themselves."""
    return list(joined(seen.planes(0)[rows_of(robots)]))
