"""Looking up texels by NumPy."""

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.texels.table import Colours, Glimpses, Places, Table


def look_up(table: Table, places: Places) -> Glimpses:
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


def _look(table: Table, places: Places) -> NDArray[np.int32]:
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
