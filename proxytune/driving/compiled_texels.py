"""Texels looked up by Numba, an extra: the arithmetic of `texels`, operation by operation, in a quarter of the time."""

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from proxytune.driving.texels import Colours, Glimpses, Places, TexelTable

if vars(numba.config)["DISABLE_JIT"]:
    raise ImportError("NUMBA_DISABLE_JIT is set: uncompiled, these loops take a thousand times as long")

# Signatures are compiled on import, which finds out whether Numba works here. No fast mathematics: it changes bits
_compiled: dict[str, Any] = {"nopython": True, "nogil": True, "cache": True, "error_model": "numpy"}


def look_up(table: TexelTable, places: Places) -> Glimpses:
    """The texels (n, pixels) that pixels show from these places; what is beyond the floor shows its edge."""
    glimpses = np.empty((len(places), len(table.last)), dtype=np.uint32)
    _look_up(places, table.plane, table.last, table.first, table.side, table.texels, glimpses)
    return glimpses


def average(glimpses: Glimpses, weights: NDArray[np.float32], colours: Colours) -> None:
    """Write the weighted mean of glimpses into colours; exact for weights as `Blur` has them."""
    _average(glimpses.view(np.uint8), weights, colours)


def _find(places, plane, last, first, side, texels, glimpses):  # type: ignore[no-untyped-def]
    nothing = np.float32(0.0)
    for place in range(places.shape[0]):
        cos, sin, x, y = places[place]
        for pixel in range(plane.shape[1]):
            ahead, left, scale, end = plane[0, pixel], plane[1, pixel], plane[2, pixel], last[pixel]
            column = (cos * ahead + -sin * left) + x * scale
            row = (sin * ahead + cos * left) + y * scale
            # Written so, what is not a number is in the picture as well
            column = column if column > nothing else nothing
            column = column if column < end else end
            row = row if row > nothing else nothing
            row = row if row < end else end
            glimpses[place, pixel] = np.int32(row) * side[pixel] + np.int32(column) + first[pixel]
        for pixel in range(plane.shape[1]):  # by itself, so that the loop above is done many pixels at once
            glimpses[place, pixel] = texels[glimpses[place, pixel]]


def _mix(glimpses, weights, colours):  # type: ignore[no-untyped-def]
    sums = np.zeros(glimpses.shape[1], np.float32)
    levels = np.empty(glimpses.shape[1], np.uint8)
    for number in range(glimpses.shape[0]):
        weight = weights[number]
        for byte in range(sums.size):
            sums[byte] += weight * np.float32(glimpses[number, byte])
    for byte in range(sums.size):
        levels[byte] = np.uint8(np.int32(np.rint(sums[byte])))
    for pixel in range(colours.shape[0]):
        for colour in range(3):
            colours[pixel, colour] = levels[4 * pixel + colour]


_TABLE = "float32[:,::1], float32[::1], int32[::1], int32[::1], uint32[::1]"
_look_up = numba.jit(f"void(float32[:,::1], {_TABLE}, uint32[:,::1])", **_compiled)(_find)
_average = numba.jit("void(uint8[:,::1], float32[::1], uint8[:,::1])", **_compiled)(_mix)
