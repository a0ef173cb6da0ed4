"""Where each pixel of a camera looks, and what can be seen there."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Table(NamedTuple):
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
