"""Texels: what a camera's pixels show of the floor, by Numba where that pays, else by NumPy, to the same bit.

The ways to look up give the same, so that which one is taken may change under way.
"""

import functools
import itertools
import sys
from typing import NamedTuple, Protocol, cast

import numpy as np
from numpy.typing import NDArray

PAYS_OFF = 20_000
"""So often is NumPy used before Numba, which takes half a second to load: by then it would have saved as much."""

_uses = itertools.count()


class TexelTable(NamedTuple):
    """For each of a camera's pixels, a point in the robot's frame and a square of texels that shows it.

    Attributes:
        plane: The point and 1, in texels a metre, (3, pixels): x ahead, y to the left, 1.
        last: The last column and row of the pixel's square, (pixels,).
        first: Index of the first texel of that square, (pixels,).
        side: Texels along its side, (pixels,).
        texels: All squares one after another, (texels,): red, green, blue and a spare byte in one number each.
    """

    plane: NDArray[np.float32]
    last: NDArray[np.float32]
    first: NDArray[np.int32]
    side: NDArray[np.int32]
    texels: NDArray[np.uint32]


Places = NDArray[np.float32]
"""Where robots are, (n, 4): cosine and sine of the heading, x and y from the corner of the floor's picture [m]."""

Glimpses = NDArray[np.uint32]
"""The texels (n, pixels) that pixels show from n places."""

Colours = NDArray[np.uint8]
"""Red, green, blue of pixels, (pixels, 3)."""


def look_up(table: TexelTable, places: Places) -> Glimpses:
    """The texels (n, pixels) that pixels show from these places; what is beyond the floor shows its edge."""
    column, row = _look(table, places)
    row *= table.side
    row += column
    row += table.first
    glimpses: Glimpses = table.texels.take(row, mode="clip")
    return glimpses


def average(glimpses: Glimpses, weights: NDArray[np.float32], colours: Colours) -> None:
    """Write the weighted mean of glimpses into colours; exact for weights as `Blur` has them."""
    of_all = glimpses.view(np.uint8).reshape(len(glimpses), -1)
    mean = np.rint(weights @ of_all.astype(np.float32)).astype(np.uint8).reshape(-1, 4)
    keep_colours(mean, colours)


def keep_colours(levels: NDArray[np.uint8], colours: NDArray[np.uint8]) -> None:
    """Write levels (…, 4), the last of them spare, into colours (…, 3)."""
    for colour in range(3):  # four times as fast as one copy of [..., :3]
        colours[..., colour] = levels[..., colour]


def _look(table: TexelTable, places: Places) -> NDArray[np.int32]:
    """Column and row (2, n, pixels) of each pixel's texel in its square."""
    cos, sin, x, y = places.T
    # Not a matrix product: BLAS rounds differently from processor to processor, and so would the pictures
    where: NDArray[np.float32] = np.array((cos, sin))[..., None] * table.plane[0]
    where += np.array((-sin, cos))[..., None] * table.plane[1]
    where += np.array((x, y))[..., None] * table.plane[2]
    # Both at once, np.clip, takes twice as long
    np.maximum(where, 0.0, out=where)
    np.minimum(where, table.last, out=where)
    return where.astype(np.int32)


class Lookup(Protocol):
    """A way to look up texels: this module, or the compiled one."""

    def look_up(self, table: TexelTable, places: Places) -> Glimpses:
        """The texels (n, pixels) that pixels show from these places; what is beyond the floor shows its edge."""
        ...

    def average(self, glimpses: Glimpses, weights: NDArray[np.float32], colours: Colours) -> None:
        """Write the weighted mean of glimpses into colours; exact for weights as `Blur` has them."""
        ...


def fastest() -> Lookup:
    """The way that takes least time, loading included: asked anew for every use."""
    return by_numba() if next(_uses) >= PAYS_OFF else _BY_NUMPY


@functools.cache
def by_numba() -> Lookup:
    """The compiled way where it works, else that of NumPy."""
    try:
        from proxytune.driving import compiled_texels as compiled
    except Exception:  # Numba is not installed, does not know this NumPy, or finds no place for what it compiles
        return _BY_NUMPY
    return compiled


_BY_NUMPY = cast(Lookup, sys.modules[__name__])
