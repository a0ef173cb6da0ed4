"""The low-pass of long signals compiled by Numba: the arithmetic of `effect.low_pass`, operation by operation."""

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

if vars(numba.config)["DISABLE_JIT"]:
    raise ImportError("NUMBA_DISABLE_JIT is set: uncompiled, this loop takes a thousand times as long")


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


# Compiled on import, which finds out whether Numba works here. No fast mathematics: it changes bits
_follow = numba.jit(
    "void(float64[:,:,:], float64, float64, float64[:,::1], float64[:,:,::1])",
    nopython=True,
    nogil=True,
    cache=True,
    error_model="numpy",
)(_filter)
