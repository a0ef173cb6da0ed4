"""Values that are known beforehand, sample by sample, and beyond them those that a rate leads to."""

from typing import NamedTuple

import numpy as np

from proxytune.effects.effect import Setting, Signal


class Known(NamedTuple):
    """Values known beforehand (…, n), number of the next sample, its value (…, 1), and samples per second."""

    values: Signal
    next: int
    newest: Signal
    rate_hz: float


def beforehand(values: Signal, setting: Setting) -> Known:
    """Values known beforehand (…, n) for every member of the batch that the setting's rest (…, channels) is of."""
    known = np.asarray(values, dtype=float)
    shape = np.broadcast_shapes(known.shape[:-1], np.shape(setting.rest)[:-1])
    known = np.broadcast_to(known, (*shape, known.shape[-1]))
    return Known(known, 0, known[..., :1], setting.rate_hz)


def values_along(rates: Signal, memory: Known) -> tuple[Signal, Known]:
    """Values at the start of each sample (…, time): known ones, and beyond them those that the rates lead to."""
    length = rates.shape[-1]
    known = memory.values[..., memory.next : memory.next + length]
    given = known.shape[-1]
    newest = known[..., -1:] if given else memory.newest
    gained = np.cumsum(rates[..., max(0, given - 1) :], axis=-1) / memory.rate_hz
    path = np.concatenate((known[..., :-1], newest, newest + gained), axis=-1)
    return path[..., :length], memory._replace(next=memory.next + length, newest=path[..., length:])
