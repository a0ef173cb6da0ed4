"""Texels looked up by Numba, an extra: the arithmetic of `texels`, operation by operation, in a quarter of the time."""

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from proxytune.driving import texels
from proxytune.driving.texels import Places, TexelTable

if vars(numba.config)["DISABLE_JIT"]:
    raise ImportError("NUMBA_DISABLE_JIT is set: uncompiled, these loops take a thousand times as long")

# Signatures are compiled on import, which finds out whether Numba works here. No fast mathematics: it changes bits
_compiled: dict[str, Any] = {"nopython": True, "nogil": True, "cache": True, "error_model": "numpy"}


def look_up(table: TexelTable, places: Places) -> NDArray[np.uint32]:
    """The texels (n, pixels) that pixels show; what is beyond the floor shows its edge."""
    glimpses = np.empty((len(places), len(table.last)), dtype=np.uint32)
    _look_up(places, table.plane, table.last, table.first, table.side, table.texels, glimpses)
    return glimpses


def average(glimpses: NDArray[np.uint8], weights: NDArray[np.float32], pictures: NDArray[Any]) -> None:
    """Write weighted means of glimpses (n, times, levels) as the ends of pictures (n, 3 · pixels), rounded if bytes."""
    if pictures.dtype == np.uint8:
        _average(glimpses.view(np.uint32), weights, pictures)
    else:
        texels.average(glimpses, weights, pictures)


def _find(places, plane, last, first, side, texels, glimpses):  # type: ignore[no-untyped-def]
    nothing = np.float32(0.0)
    for place in range(places.shape[0]):
        ahead_x, ahead_y, left_x, left_y, x, y = places[place]
        for pixel in range(plane.shape[1]):
            ahead, left, scale, end = plane[0, pixel], plane[1, pixel], plane[2, pixel], last[pixel]
            column = (ahead_x * ahead + left_x * left) + x * scale
            row = (ahead_y * ahead + left_y * left) + y * scale
            # Written so, what is not a number is in the picture as well
            column = column if column > nothing else nothing
            column = column if column < end else end
            row = row if row > nothing else nothing
            row = row if row < end else end
            glimpses[place, pixel] = np.int32(row) * side[pixel] + np.int32(column) + first[pixel]
        for pixel in range(plane.shape[1]):  # by itself, so that the loop above is done many pixels at once
            glimpses[place, pixel] = texels[glimpses[place, pixel]]


def _mix(glimpses, weights, pictures):  # type: ignore[no-untyped-def]
    pixels = glimpses.shape[2]
    sums, first = np.empty((3, pixels), np.float32), pictures.shape[1] - 3 * pixels
    for robot in range(glimpses.shape[0]):
        sums[:] = 0.0
        for number in range(glimpses.shape[1]):
            weight = weights[number]
            for colour in range(3):
                shift = np.uint32(8 * colour)
                for pixel in range(pixels):
                    level = (glimpses[robot, number, pixel] >> shift) & np.uint32(255)
                    sums[colour, pixel] += weight * np.float32(np.int32(level))
        for pixel in range(pixels):
            for colour in range(3):
                pictures[robot, first + 3 * pixel + colour] = np.uint8(np.int32(np.rint(sums[colour, pixel])))


_TABLE = "float32[:,::1], float32[::1], int32[::1], int32[::1], uint32[::1]"
_look_up = numba.jit(f"void(float32[:,::1], {_TABLE}, uint32[:,::1])", **_compiled)(_find)
_average = numba.jit("void(uint32[:,:,::1], float32[::1], uint8[:,::1])", **_compiled)(_mix)
