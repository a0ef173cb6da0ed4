"""The inner loops compiled by Numba: the arithmetic of `loops`, operation by operation, in a fifth of the time."""

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Floats
from proxytune.driving import loops
from proxytune.driving.loops import FEWEST, HALF_LANE_M, RIDGE, Eyes, Places, TexelTable

if vars(numba.config)["DISABLE_JIT"]:
    raise ImportError("NUMBA_DISABLE_JIT is set: uncompiled, these loops take a thousand times as long")

# Signatures are compiled on import, which finds out whether Numba works here. No fast mathematics: it changes bits
_compiled: dict[str, Any] = {"nopython": True, "nogil": True, "cache": True, "error_model": "numpy"}


def expose(table: TexelTable, places: Places, weights: NDArray[np.float32], planes: NDArray[Any]) -> None:
    """Write what robots see as the ends of planes (n, 3, pixels): means over their places (n · times, 6)."""
    if planes.dtype == np.uint8:
        _expose(places, weights, table.plane, table.last, table.first, table.side, table.texels, planes)
    else:
        loops.expose(table, places, weights, planes)


def find_lanes(eyes: Eyes, yellow: NDArray[np.uint8], bright: NDArray[np.uint8]) -> Floats:
    """Offset [m], slope and number of pixels of lines through the lane's centre, (robots, 3)."""
    lanes = np.zeros((len(yellow), 3))
    _find_lanes(*eyes, yellow, bright, lanes)
    return lanes


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


def _mix(places, weights, plane, last, first, side, texels, planes):  # type: ignore[no-untyped-def]
    times, pixels = weights.shape[0], plane.shape[1]
    shown, sums = np.empty((times, pixels), np.uint32), np.empty(pixels, np.float32)
    for robot in range(planes.shape[0]):
        _look_up(places[robot * times : (robot + 1) * times], plane, last, first, side, texels, shown)
        for colour in range(3):
            shift, levels = np.uint32(8 * colour), planes[robot, colour, planes.shape[2] - pixels :]
            sums[:] = 0.0
            for time in range(times):
                weight = weights[time]
                for pixel in range(pixels):
                    level = (shown[time, pixel] >> shift) & np.uint32(255)
                    sums[pixel] += weight * np.float32(np.int32(level))
            for pixel in range(pixels):
                levels[pixel] = np.uint8(np.int32(np.rint(sums[pixel])))


def _pairs(values, first, count):  # type: ignore[no-untyped-def]
    """Sum as NumPy's `add.reduce` does, pairwise in blocks of eight sums: the same bits."""
    if count < 8:
        total = -0.0
        for number in range(first, first + count):
            total += values[number]
        return total
    if count > 128:
        half = count // 2 - count // 2 % 8
        return _pairs(values, first, half) + _pairs(values, first + half, count - half)  # type: ignore[no-untyped-call]
    sums, rest = values[first : first + 8].copy(), count % 8
    for number in range(first + 8, first + count - rest, 8):
        for place in range(8):
            sums[place] += values[number + place]
    total = ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]))
    for number in range(first + count - rest, first + count):
        total += values[number]
    return total


def _fit(ahead, left, eyes, yellow, white, golden, shining, lanes):  # type: ignore[no-untyped-def]  # noqa: C901
    pixels = golden.shape[1]
    line, edge, marked = np.empty(pixels, np.int64), np.empty(pixels, np.int64), np.empty(pixels, np.bool_)
    along, aside = np.empty(2 * pixels), np.empty(2 * pixels)
    for robot in range(golden.shape[0]):
        eye, on_line, on_edge = eyes[robot], 0, 0
        gold, shine, more, brighter = golden[robot], shining[robot], yellow[robot], white[robot]
        for pixel in range(pixels):  # by itself, so that many pixels are compared at once
            marked[pixel] = (gold[pixel] > more[pixel]) | (shine[pixel] > brighter[pixel])
        for pixel in range(pixels):
            if marked[pixel]:
                if gold[pixel] > more[pixel]:
                    line[on_line] = pixel
                    on_line += 1
                if shine[pixel] > brighter[pixel]:
                    edge[on_edge] = pixel
                    on_edge += 1
        for number in range(on_line):
            aside[number] = left[eye, line[number]]
        end = (0.0 + _sum(aside, 0, on_line)) / on_line if on_line else HALF_LANE_M
        for number in range(on_line):
            along[number], aside[number] = ahead[eye, line[number]], aside[number] - HALF_LANE_M
        count = on_line
        for number in range(on_edge):
            if left[eye, edge[number]] < end:
                along[count], aside[count] = ahead[eye, edge[number]], left[eye, edge[number]] + HALF_LANE_M
                count += 1
        lanes[robot, 2] = count
        if count >= FEWEST:
            mean_ahead, mean_left = (0.0 + _sum(along, 0, count)) / count, (0.0 + _sum(aside, 0, count)) / count
            for number in range(count):
                centred = along[number] - mean_ahead
                aside[number] *= centred
                along[number] = centred * centred
            slope = (0.0 + _sum(aside, 0, count)) / ((0.0 + _sum(along, 0, count)) + RIDGE * count)
            lanes[robot, 0], lanes[robot, 1] = mean_left - slope * mean_ahead, slope


_TABLE = "float32[:,::1], float32[::1], int32[::1], int32[::1], uint32[::1]"
_look_up = numba.jit(f"void(float32[:,::1], {_TABLE}, uint32[:,::1])", **_compiled)(_find)
_expose = numba.jit(f"void(float32[:,::1], float32[::1], {_TABLE}, uint8[:,:,::1])", **_compiled)(_mix)
_sum = numba.jit("float64(float64[::1], int64, int64)", **_compiled)(_pairs)
_EYES = "float64[:,::1], float64[:,::1], int64[::1], uint8[:,::1], uint8[:,::1]"
_find_lanes = numba.jit(f"void({_EYES}, uint8[:,:], uint8[:,:], float64[:,::1])", **_compiled)(_fit)
