"""The two inner loops of lane following: what pixels show of the floor, and the lane's line through what they show.

By Numba where that pays, else by NumPy, to the same bit, so that which one is taken may change under way.
"""

import functools
import sys
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Floats, SmallBuffers, Whole, compiled_loops

PAYS_OFF = 30_000
"""So many pictures NumPy looks up before Numba, which takes 0.4 s to load and would have saved that."""
_used = [0]

HALF_LANE_M = 0.128
"""From a lane's centre to the middle of the marking on either side of it [m]."""
FEWEST = 6
"""So many pixels it takes to see a lane."""
RIDGE = 0.005
"""For each pixel, it keeps a handful of them at one distance from spinning the line round [m²]."""


class TexelTable(NamedTuple):
    """For each of a camera's pixels, a point in the robot's frame and a square of texels that shows it."""

    plane: NDArray[np.float32]  # the point and 1, in texels a metre, (3, pixels): x ahead, y to the left, 1
    begin: NDArray[np.float32]  # the first column and row of the pixel's square, 0, (pixels,)
    last: NDArray[np.float32]  # the last column and row of the pixel's square, (pixels,)
    first: NDArray[np.int32]  # index of the first texel of that square, (pixels,)
    side: NDArray[np.int32]  # texels along its side, (pixels,)
    texels: NDArray[np.uint32]  # all squares one after another: red, green, blue and a spare byte in one number each

    def without(self, pixels: int) -> "TexelTable":
        """The same but for the first pixels."""
        cut: list[Any] = [np.ascontiguousarray(one[..., pixels:]) for one in self[:-1]]
        return TexelTable._make((*cut, self.texels))


Places = NDArray[np.float32]
"""Robots' frames in that of the floor's picture, (n, 6): x and y of what is ahead, of what is to the left, and of the
robot's place from the corner of the picture [m]."""


def look_up(table: TexelTable, places: Places) -> NDArray[np.uint32]:
    """The texels (n, pixels) that pixels show; what is beyond the floor shows its edge."""
    with SmallBuffers():
        ahead, left, place = places.T.reshape(3, 2, -1, 1)
        # Not a matrix product: BLAS rounds differently from processor to processor, and so would the pictures
        where = ahead * table.plane[0]
        part = left * table.plane[1]
        where += part
        where += np.multiply(place, table.plane[2], out=part)
        # Both at once, np.clip, takes twice as long, and so does a number instead of an array
        np.maximum(where, table.begin, out=where)
        np.minimum(where, table.last, out=where)
        column, row = where.astype(np.int32)
        row *= table.side
        row += column
        row += table.first
        shown: NDArray[np.uint32] = table.texels.take(row, mode="wrap")
    return shown


def expose(table: TexelTable, places: Places, weights: NDArray[np.float32], planes: NDArray[Any]) -> None:
    """Write what robots see as the ends of planes (n, 3, pixels): weighted means over their places (n · times, 6).

    They are rounded if planes are of bytes, and exact for weights as `Blur` has them.
    """
    times, pixels = len(weights), len(table.last)
    exact = np.empty((times, 4 * pixels), dtype=np.float32)
    for robot, plane in enumerate(planes[..., -pixels:]):
        shown = look_up(table, places[robot * times : (robot + 1) * times]).view(np.uint8)
        mean: NDArray[Any] = shown[0]
        if times > 1:
            exact[...] = shown
            mean = weights @ exact
            if planes.dtype == np.uint8:
                mean = np.rint(mean, out=mean).astype(np.uint8)
        for colour in range(3):
            plane[colour] = mean[colour::4]


class Eyes(NamedTuple):
    """The parts of pictures that robots look at for markings, and what they take for one."""

    ahead: Floats  # how far ahead of the axle the floor lies that the nominal camera sees there [m], (eyes, pixels)
    left: Floats  # how far to the left [m], (eyes, pixels)
    eye: Whole  # which eye each robot has, (robots,)
    yellow: NDArray[np.uint8]  # more is the yellow line, (robots, pixels); 255 where it does not look
    white: NDArray[np.uint8]  # more is the white line, (robots, pixels); 255 where it does not look


def find_lanes(eyes: Eyes, yellow: NDArray[np.uint8], bright: NDArray[np.uint8]) -> Floats:
    """Fit a line through the lane's centre, right of the yellow line and left of the white one, by least squares.

    White pixels to the left of the yellow ones belong to the other lane's edge and are left out. Of how yellow and how
    bright what they see is (robots, pixels), it makes offset [m], slope and number of pixels, (robots, 3); where these
    are fewer than FEWEST, they alone count.
    """
    lanes = np.zeros((len(yellow), 3))
    golden, shining = yellow > eyes.yellow, bright > eyes.white
    for robot, eye in enumerate(eyes.eye.tolist()):
        line, edge, left_of = golden[robot].nonzero()[0], shining[robot].nonzero()[0], eyes.left[eye]
        on_line, on_edge = left_of.take(line), left_of.take(edge)
        right = on_edge < (float(np.add.reduce(on_line)) / len(on_line) if len(on_line) else HALF_LANE_M)
        ahead = eyes.ahead[eye].take(np.concatenate((line, edge[right])))
        left = np.concatenate((on_line - HALF_LANE_M, on_edge[right] + HALF_LANE_M))
        count, slope, offset = len(ahead), 0.0, 0.0
        if count >= FEWEST:
            mean_ahead, mean_left = float(np.add.reduce(ahead)) / count, float(np.add.reduce(left)) / count
            ahead -= mean_ahead
            left *= ahead
            ahead *= ahead
            slope = float(np.add.reduce(left)) / (float(np.add.reduce(ahead)) + RIDGE * count)
            offset = mean_left - slope * mean_ahead
        lanes[robot] = offset, slope, count
    return lanes


def fastest(pictures: int) -> ModuleType:
    """The way that takes least time for some more pictures, loading included: this module, or the compiled one."""
    _used[0] += pictures
    return by_numba() if _used[0] > PAYS_OFF else _BY_NUMPY


@functools.cache
def by_numba() -> ModuleType:
    """The compiled way where it works, else that of NumPy."""
    return compiled_loops("proxytune.driving.compiled") or _BY_NUMPY


_BY_NUMPY = sys.modules[__name__]
