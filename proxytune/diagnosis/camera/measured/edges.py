"""Edges of white and yellow markings in pictures, to a fraction of a pixel."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, gaussian_filter, map_coordinates

Floats = NDArray[np.float64]

SMOOTHING_PX = 1.0
"""Standard deviation of the Gaussian whose slope is the gradient [pixel]."""

LEAST_SLOPE = 0.15
"""A weaker gradient of whiteness or yellowness, from 0 to 1, is none of a marking [1/pixel]."""

YELLOW = 0.55
"""How far a yellow marking's blue lies below its red and green, as a share of the range from the floor to white."""

SKY = 40
"""A pixel whose blue is so much above its red [grey levels] is sky; so are those within SKY_MARGIN pixels."""

SKY_MARGIN = 3

BORDER = 2
"""Edges nearer to the picture's border are left out [pixel]."""


class Edges(NamedTuple):
    """Points of markings' edges, n of them.

    Attributes:
        frame: Number of the picture (n,).
        white: Whether the marking is white, else yellow (n,).
        column: Place from the picture's left edge (n,) [pixel].
        row: Place from its upper edge (n,) [pixel].
        normal: Unit vector to the right and down from the floor into the marking (n, 2).
    """

    frame: NDArray[np.intp]
    white: NDArray[np.bool_]
    column: Floats
    row: Floats
    normal: Floats

    def only(self, chosen: NDArray[Any]) -> "Edges":
        """The points that are chosen, by a mask or their numbers."""
        return Edges._make(field[chosen] for field in self)


def find_edges(pictures: NDArray[np.uint8]) -> Edges:
    """Find the edges of markings in pictures (N, rows, columns, 3), red, green, blue; sorted by picture."""
    maps = [_colour_maps(picture) for picture in pictures]
    parts = [_edges_of(number, white, one) for number, pair in enumerate(maps) for white, one in pair]
    return Edges._make(np.concatenate(field) for field in zip(*parts, strict=True))


def _colour_maps(picture: NDArray[np.uint8]) -> tuple[tuple[bool, Floats], tuple[bool, Floats]]:
    """How white and how yellow each pixel is, from 0 to 1; NaN where there is sky."""
    colours = picture.astype(np.float32)
    red, green, blue = colours[..., 0], colours[..., 1], colours[..., 2]
    sky = binary_dilation(blue > red + SKY, iterations=SKY_MARGIN)
    least = colours.min(axis=-1)
    ground = ~sky
    if not ground.any():
        ground = np.ones_like(sky)
    dark = float(np.median(colours[ground].mean(axis=-1)))
    span = max(float(np.percentile(least[ground], 99.0)) - dark, 1.0)
    # No upper end: where a bright marking is clipped, its edges move outwards
    white = np.maximum((least - dark) / span, 0.0)
    yellow = np.maximum((np.minimum(red, green) - blue) / (YELLOW * span), 0.0)
    return (True, np.where(sky, np.nan, white)), (False, np.where(sky, np.nan, yellow))


def _edges_of(number: int, white: bool, share: Floats) -> Edges:
    """Edges of one colour in one picture."""
    known = np.isfinite(share)
    filled = np.where(known, share, 0.0)
    down = gaussian_filter(filled, SMOOTHING_PX, order=(1, 0), mode="nearest")
    right = gaussian_filter(filled, SMOOTHING_PX, order=(0, 1), mode="nearest")
    slope = np.hypot(down, right)
    known &= ~binary_dilation(~known, iterations=SKY_MARGIN) if not known.all() else known
    inner = np.zeros_like(known)
    inner[BORDER:-BORDER, BORDER:-BORDER] = True
    row, column = np.nonzero((slope >= LEAST_SLOPE) & known & inner)
    here = slope[row, column]
    step_down, step_right = down[row, column] / here, right[row, column] / here
    ahead, behind = (
        map_coordinates(slope, (row + way * step_down, column + way * step_right), order=1) for way in (1.0, -1.0)
    )
    bend = 2.0 * here - ahead - behind
    top = (here >= ahead) & (here > behind) & (bend > 1e-9)
    shift = ((ahead - behind) / np.where(top, 2.0 * bend, 1.0))[top]
    column, row, step_right, step_down = column[top], row[top], step_right[top], step_down[top]
    return Edges(
        np.full(len(row), number),
        np.full(len(row), white),
        column + 0.5 + shift * step_right,
        row + 0.5 + shift * step_down,
        np.stack((step_right, step_down), axis=-1).astype(float),
    )
