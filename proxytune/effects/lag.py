"""First-order lags: what follows a signal with a time constant, exactly for a signal that holds over each sample."""

from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from proxytune.effects.effect import Signal


class Lag(NamedTuple):
    """How much of a step is left after one sample, and on average over it."""

    remainder: float
    mean_remainder: float


def lag_of(samples: float) -> Lag:
    """The lag of a time constant that lasts so many samples."""
    if samples == 0.0:
        return Lag(0.0, 0.0)
    remainder = float(np.exp(-1.0 / samples))
    return Lag(remainder, samples * (1.0 - remainder))


def follow(signal: Signal, value: Signal, lag: Lag) -> tuple[Signal, Signal]:
    """What follows a signal (…, time, channels) from a value (…, channels) on.

    Returns:
        Its mean over each sample (…, time, channels), and its value after the last one (…, channels).
    """
    kept = lag.remainder
    start = value[..., None, :]
    ends, _ = lfilter([1.0 - kept], [1.0, -kept], signal, axis=-2, zi=kept * start)
    starts = np.concatenate((start, ends[..., :-1, :]), axis=-2)
    return signal + lag.mean_remainder * (starts - signal), ends[..., -1, :]
