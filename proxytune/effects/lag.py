"""First-order lags: what follows a signal with a time constant, exactly for a signal that holds over each sample."""

from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from proxytune.effects.effect import Signal

FEW = 8
"""Up to so many samples, a control step, a loop over them is faster than to set up a filter."""


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
    start = value[..., None, :]
    few = signal.ndim == 2 and len(signal) <= FEW
    ends = _ends_of_few(signal, value, lag) if few else _ends(signal, start, lag)
    starts = np.concatenate((start, ends[..., :-1, :]), axis=-2)
    return signal + lag.mean_remainder * (starts - signal), ends[..., -1, :]


def _ends(signal: Signal, start: Signal, lag: Lag) -> Signal:
    """What follows a signal from a value (…, 1, channels) on, at the end of each sample."""
    ends: Signal = lfilter([1.0 - lag.remainder], [1.0, -lag.remainder], signal, axis=-2, zi=lag.remainder * start)[0]
    return ends


def _ends_of_few(signal: Signal, value: Signal, lag: Lag) -> Signal:
    """The same of a signal (time, channels), in the filter's own arithmetic."""
    gain, remainder = 1.0 - lag.remainder, lag.remainder
    kept, ends = [remainder * before for before in value.tolist()], []
    for sample in signal.tolist():
        ends.append([rest + gain * new for rest, new in zip(kept, sample, strict=True)])
        kept = [0.0 * new + remainder * end for new, end in zip(sample, ends[-1], strict=True)]
    return np.array(ends)
