"""What learners see of a camera's picture: its grey values, averaged over cells."""

import functools

import numpy as np
from numpy.typing import NDArray

from proxytune.errors import LearnerError

Array = NDArray[np.float64]


def grey_cells(pictures: NDArray[np.uint8], *, top: float, rows: int, columns: int) -> Array:
    """Grey cells (n, rows · columns) of pictures (n, rows, columns, 3), from −0.5 to 0.5.

    Args:
        pictures: As the camera gives them.
        top: Share of the picture's rows, from the top, that is not looked at.
        rows: Cells above one another in the rest.
        columns: Cells beside one another.

    Raises:
        LearnerError: If the pictures are no colour pictures or have fewer pixels than there are cells.
    """
    height, width = pictures.shape[1:3] if pictures.ndim == 4 else (0, 0)
    first = round(top * height)
    if height - first < rows or width < columns:
        raise LearnerError(
            f"pictures have shape {pictures.shape[1:]}, and {rows} × {columns} cells below row {first} "
            "do not fit in; give (rows, columns, 3) with more pixels, or take fewer cells"
        )
    seen = pictures[:, first:]
    # Adding 16-bit channels is exact, and twice as fast as a mean over them
    grey = (seen[..., 0].astype(np.uint16) + seen[..., 1] + seen[..., 2]) / 3.0
    means = _cell_means(_cell_means(grey, rows, axis=1), columns, axis=2)
    return means.reshape(len(pictures), -1) / 255.0 - 0.5


def _cell_means(values: Array, cells: int, axis: int) -> Array:
    """Means over cells of nearly equal size along an axis."""
    firsts, sizes = _cells(values.shape[axis], cells)
    shape = [1] * values.ndim
    shape[axis] = cells
    return np.asarray(np.add.reduceat(values, firsts, axis=axis) / sizes.reshape(shape))


@functools.lru_cache
def _cells(length: int, cells: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Where each cell begins along an axis, and how many pixels it has."""
    edges = np.linspace(0, length, cells + 1).round().astype(int)
    return edges[:-1], np.diff(edges)
