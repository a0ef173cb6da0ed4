"""The pictures of a log's camera, small enough to hold many of them."""

import struct
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from proxytune.errors import LogError
from proxytune.logs.log import Frames

Pictures = NDArray[np.uint8]

BROKEN = (OSError, SyntaxError, ValueError, EOFError, struct.error, zlib.error, Image.DecompressionBombError)
"""What Pillow raises at files that are cut off or damaged."""


def read_pictures(frames: Frames, numbers: Sequence[int], columns: int = 160) -> Pictures:
    """Read some of a log's pictures, one after another, wider ones averaged down.

    Args:
        frames: All of them.
        numbers: Which, by their places in `frames`, n of them.
        columns: How wide a picture is at most; its rows are in proportion.

    Returns:
        Red, green and blue (n, rows, columns, 3), 0 to 255.

    Raises:
        LogError: If a file cannot be read, or is of another size than the first.
    """
    pictures, first = np.empty((0, 0, 0, 3), dtype=np.uint8), (0, 0)
    for place, number in enumerate(numbers):
        path = frames.paths[number]
        picture, size = _read_picture(path, columns)
        if place == 0:
            pictures, first = np.empty((len(numbers), *picture.shape), dtype=np.uint8), size
        if size != first:
            sizes = f"is {size[0]} × {size[1]}, but {frames.paths[numbers[0]].name} is {first[0]} × {first[1]}"
            raise LogError(f"{path}: {sizes}; give all pictures one size")
        pictures[place] = picture
    return pictures


def _read_picture(path: Path, columns: int) -> tuple[Pictures, tuple[int, int]]:
    """A picture averaged down, and the width and height of its file."""
    try:
        with Image.open(path, formats=("PNG", "JPEG")) as image:
            size = image.size
            if image.mode.startswith(("I", "F")):
                raise LogError(f"{path}: has more than 8 bits a pixel; save it with 8 bits for each colour")
            wanted = _size_within(size, columns)
            image.draft(None, (2 * wanted[0], 2 * wanted[1]))  # Half of what a JPEG averages is left to the box
            whole = image.convert("RGB")
    except FileNotFoundError:
        raise LogError(f"{path}: no such file; add the picture") from None
    except BROKEN:
        raise LogError(f"{path}: is not a whole PNG or JPEG picture; save it again or leave its frame out") from None
    small = whole if whole.size == wanted else whole.resize(wanted, Image.Resampling.BOX)
    return np.asarray(small), size


def _size_within(size: tuple[int, int], columns: int) -> tuple[int, int]:
    """Width and height, at most so many columns wide."""
    width, height = size
    return size if width <= columns else (columns, max(1, round(height * columns / width)))
