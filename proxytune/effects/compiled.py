"""Filters of long signals compiled by Numba, operation by operation as `effect` and `friction.Stiction` have them."""

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Flags

if vars(numba.config)["DISABLE_JIT"]:
    raise ImportError("NUMBA_DISABLE_JIT is set: uncompiled, these loops take a thousand times as long")


def low_pass(signal: NDArray[Any], value: NDArray[Any], remainder: float, mean_remainder: float) -> tuple[Any, Any]:
    """Follow a signal (…, time, channels) from a value (…, channels): the mean over each sample, and the last value."""
    mean, last = np.empty(signal.shape), np.array(value, dtype=float, order="C")
    rows, ends = signal.reshape(-1, *signal.shape[-2:]), last.reshape(-1, signal.shape[-1])
    _follow(rows, remainder, mean_remainder, ends, mean.reshape(rows.shape))
    return mean, last


def _filter(signal, remainder, mean_remainder, last, mean):  # type: ignore[no-untyped-def]
    gain, rest = 1.0 - remainder, remainder * last
    for row in range(signal.shape[0]):
        for sample in range(signal.shape[1]):
            for channel in range(signal.shape[2]):
                new, was = signal[row, sample, channel], last[row, channel]
                mean[row, sample, channel] = new + mean_remainder * (was - new)
                end = rest[row, channel] + gain * new
                rest[row, channel], last[row, channel] = 0.0 * new + remainder * end, end


def approach(goal: NDArray[Any], kept: NDArray[Any], value: NDArray[Any]) -> tuple[Any, Any]:
    """Go towards a goal (…, time), of which each sample keeps a share of the way: where each starts, and the end."""
    starts, end = np.empty(goal.shape), np.array(value, dtype=float, order="C")
    _near(
        goal.reshape(-1, goal.shape[-1]),
        kept.reshape(-1, goal.shape[-1]),
        end.reshape(-1),
        starts.reshape(-1, goal.shape[-1]),
    )
    return starts, end


def _come_near(goal, kept, end, starts):  # type: ignore[no-untyped-def]
    for row in range(goal.shape[0]):
        for sample in range(goal.shape[1]):
            share, starts[row, sample] = kept[row, sample], end[row]
            end[row] = (1.0 - share) * goal[row, sample] + share * end[row]


def trigger(signal: NDArray[Any], thresholds: NDArray[Any], sample: NDArray[Any], moving: Flags) -> tuple[Any, Any]:
    """Let a signal (…, time, channels) through while its trigger is on: that, and whether it is on at last.

    Thresholds (3, channels) are those above which it goes on, below which it goes off, and below which it does so where
    the sign changes; the sample before and whether it was on then are (…, 1, channels).
    """
    passed, on = np.empty(signal.shape), np.array(np.broadcast_to(moving, sample.shape))
    rows, channels = signal.reshape(-1, *signal.shape[-2:]), signal.shape[-1]
    before = np.array(sample, dtype=float, order="C").reshape(-1, channels)
    _switch(rows, thresholds, before, on.reshape(-1, channels), passed.reshape(rows.shape))
    return passed, on


def _pass(signal, thresholds, before, on, passed):  # type: ignore[no-untyped-def]
    for row in range(signal.shape[0]):
        for sample in range(signal.shape[1]):
            for channel in range(signal.shape[2]):
                new, was = signal[row, sample, channel], before[row, channel]
                size, turned = abs(new), new * was < 0.0
                if size >= thresholds[0, channel]:
                    on[row, channel] = True
                elif size < thresholds[1, channel] or (turned and size < thresholds[2, channel]):
                    on[row, channel] = False
                passed[row, sample, channel] = new if on[row, channel] else 0.0
                before[row, channel] = new


def play(signal: NDArray[Any], before: NDArray[Any], halves: NDArray[Any], out: NDArray[Any]) -> NDArray[Any]:
    """Drag values along (…, time, widths) by a signal (…, time), through plays of half widths, from those before."""
    now = np.array(np.broadcast_to(before, (*signal.shape[:-1], len(halves))), dtype=float, order="C")
    rows = signal.reshape(-1, signal.shape[-1])
    _drag(rows, now.reshape(len(rows), -1), halves, out.reshape(*rows.shape, -1))
    return out


def _pull(signal, now, halves, out):  # type: ignore[no-untyped-def]
    for row in range(signal.shape[0]):
        for sample in range(signal.shape[1]):
            here = signal[row, sample]
            for width in range(len(halves)):
                low, high = here - halves[width], here + halves[width]
                now[row, width] = min(max(now[row, width], low), high)
                out[row, sample, width] = now[row, width]


def ramp(
    signal: NDArray[Any], before: NDArray[Any], grows: NDArray[Any], shrinks: NDArray[Any], out: NDArray[Any]
) -> NDArray[Any]:
    """Follow a signal (…, time) by at most so much a sample (…, time, limits), from values before."""
    now = np.array(np.broadcast_to(before, (*signal.shape[:-1], len(grows))), dtype=float, order="C")
    rows, limits = signal.reshape(-1, signal.shape[-1]), np.array([grows, shrinks], dtype=float)
    _climb(rows, now.reshape(len(rows), -1), limits, out.reshape(*rows.shape, -1))
    return out


def _step(signal, now, limits, out):  # type: ignore[no-untyped-def]
    for row in range(signal.shape[0]):
        for sample in range(signal.shape[1]):
            here = signal[row, sample]
            for limit in range(limits.shape[1]):
                was = now[row, limit]
                most = limits[0, limit] if abs(here) > abs(was) else limits[1, limit]
                now[row, limit] = was + min(max(here - was, -most), most)
                out[row, sample, limit] = now[row, limit]


def ramps(wanted: NDArray[Any], start: NDArray[Any], step: float) -> NDArray[Any]:
    """Follow rows (rows, time) from where each starts by one step a sample at most, in one ramp while a value holds."""
    reached = np.array(wanted, dtype=float, order="C")
    _slew(np.array(start, dtype=float), step, reached)
    return reached


def _follow_steps(start, step, rows):  # type: ignore[no-untyped-def]
    for row in range(rows.shape[0]):
        here, value, held = start[row], rows[row, 0], 0
        gap = here - value
        for sample in range(rows.shape[1]):
            if rows[row, sample] != value:
                reach = held * step
                here = value + (gap - reach if gap > reach else gap + reach if gap < -reach else 0.0)
                value, held = rows[row, sample], 0
                gap = here - value
            held += 1
            sign = 1.0 if gap > 0.0 else -1.0 if gap < 0.0 else 0.0
            rows[row, sample] = value + sign * max(0.0, abs(gap) - held * step)


# Signatures are compiled on import, which finds out whether Numba works here. No fast mathematics: it changes bits
_compiled: dict[str, Any] = {"nopython": True, "nogil": True, "cache": True, "error_model": "numpy"}
_ROWS, _LAST = "float64[:,:,:]", "float64[:,::1]"
_follow = numba.jit(f"void({_ROWS}, float64, float64, {_LAST}, float64[:,:,::1])", **_compiled)(_filter)
_TABLE = "float64[:,:]"
_near = numba.jit(f"void({_TABLE}, {_TABLE}, float64[::1], float64[:,::1])", **_compiled)(_come_near)
_switch = numba.jit(f"void({_ROWS}, {_LAST}, {_LAST}, boolean[:,::1], float64[:,:,::1])", **_compiled)(_pass)
_drag = numba.jit(f"void({_TABLE}, {_LAST}, float64[::1], float64[:,:,::1])", **_compiled)(_pull)
_slew = numba.jit(f"void(float64[::1], float64, {_LAST})", **_compiled)(_follow_steps)
_climb = numba.jit(f"void({_TABLE}, {_LAST}, {_LAST}, float64[:,:,::1])", **_compiled)(_step)
