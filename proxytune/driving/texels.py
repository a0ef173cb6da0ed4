"""Texels: what a camera's pixels show of the floor, by Numba where that pays, else by NumPy, to the same bit.

The ways to look up give the same, so that which one is taken may change under way.
"""

import functools
import sys
from typing import Any, NamedTuple, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import SmallBuffers

PAYS_OFF = 40_000
"""So many pictures NumPy looks up before Numba, which takes half a second to load and would have saved that."""

_used = [0]


AT_ONCE = 8
"""So many pictures are looked up at once: what is worked on stays in the processor's cache."""


class TexelTable(NamedTuple):
    """For each of a camera's pixels, a point in the robot's frame and a square of texels that shows it.

    Attributes:
        plane: The point and 1, in texels a metre, (3, pixels): x ahead, y to the left, 1.
        begin: The first column and row of the pixel's square, 0, (pixels,).
        last: The last column and row of the pixel's square, (pixels,).
        first: Index of the first texel of that square, (pixels,).
        side: Texels along its side, (pixels,).
        texels: All squares one after another, (texels,): red, green, blue and a spare byte in one number each.
    """

    plane: NDArray[np.float32]
    begin: NDArray[np.float32]
    last: NDArray[np.float32]
    first: NDArray[np.int32]
    side: NDArray[np.int32]
    texels: NDArray[np.uint32]

    def without(self, pixels: int) -> "TexelTable":
        """The same but for the first pixels."""
        cut: list[Any] = [np.ascontiguousarray(one[..., pixels:]) for one in self[:-1]]
        return TexelTable._make((*cut, self.texels))


Places = NDArray[np.float32]
"""Robots' frames in that of the floor's picture, (n, 6): x and y of what is ahead, of what is to the left, and of the
robot's place from the corner of the picture [m]."""


def look_up(table: TexelTable, places: Places) -> NDArray[np.uint32]:
    """The texels (n, pixels) that pixels show; what is beyond the floor shows its edge."""
    texels = np.empty((len(places), len(table.last)), dtype=np.uint32)
    with SmallBuffers():
        for first in range(0, len(texels), AT_ONCE):
            ahead, left, place = places[first : first + AT_ONCE].T.reshape(3, 2, -1, 1)
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
            table.texels.take(row, mode="wrap", out=texels[first : first + AT_ONCE])
    return texels


def average(glimpses: NDArray[np.uint8], weights: NDArray[np.float32], pictures: NDArray[Any]) -> None:
    """Write weighted means of glimpses (n, times, levels) as the ends of pictures (n, 3 · pixels), rounded if bytes.

    They are exact for weights as `Blur` has them.
    """
    exact = np.empty(glimpses.shape[1:], dtype=np.float32)
    first = pictures.shape[1] - glimpses.shape[2] // 4 * 3
    for glimpse, picture in zip(glimpses, pictures, strict=True):
        mean: NDArray[Any] = glimpse[0]
        if len(weights) > 1:
            exact[...] = glimpse
            mean = weights @ exact
            if pictures.dtype == np.uint8:
                mean = np.rint(mean, out=mean).astype(np.uint8)
        for colour in range(3):  # four times as fast as one copy of [..., :3]
            picture[first + colour :: 3] = mean[colour::4]


class Lookup(Protocol):
    """A way to look up texels: this module, or the compiled one."""

    def look_up(self, table: TexelTable, places: Places) -> NDArray[np.uint32]:
        """The texels (n, pixels) that pixels show; what is beyond the floor shows its edge."""
        ...

    def average(self, glimpses: NDArray[np.uint8], weights: NDArray[np.float32], pictures: NDArray[Any]) -> None:
        """Write weighted means of glimpses (n, times, levels) as the ends of pictures (n, 3 · pixels)."""
        ...


def fastest(pictures: int) -> Lookup:
    """The way that takes least time for some pictures, loading included: asked anew for every use."""
    _used[0] += pictures
    return by_numba() if _used[0] > PAYS_OFF else _BY_NUMPY


@functools.cache
def by_numba() -> Lookup:
    """The compiled way where it works, else that of NumPy."""
    try:
        from proxytune.driving import compiled_texels as compiled
    except Exception:  # Numba is not installed, does not know this NumPy, or finds no place for what it compiles
        return _BY_NUMPY
    return compiled


_BY_NUMPY = cast(Lookup, sys.modules[__name__])
