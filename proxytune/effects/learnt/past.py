"""What a signal was like before: low-passes of it, and how far a wheel has rolled since it last turned."""

import numpy as np
from scipy.signal import lfilter

from proxytune.effects.effect import Signal
from proxytune.effects.learnt.bases import Knots

DAMPING = 0.25
"""Of the swings, as a share of critical damping."""


def low_passes(signal: Signal, slow: Signal, constants: Knots, rate_hz: float) -> Signal:
    """First-order low-passes of a signal (…, time), one for each time constant [s] (…, time, constants)."""
    out = np.empty((*signal.shape, len(constants)))
    for number, constant in enumerate(constants):
        kept = float(np.exp(-1.0 / (np.asarray(constant) * rate_hz)))
        start = kept * slow[..., number][..., None]
        out[..., number], _ = lfilter([1.0 - kept], [1.0, -kept], signal, axis=-1, zi=start)
    return out


def rings(change: Signal, before: Signal, frequencies_hz: Knots, rate_hz: float) -> Signal:
    """Damped swings that changes of a signal (…, time) set off, complex (…, time, frequencies)."""
    out = np.empty((*change.shape, len(frequencies_hz)), dtype=complex)
    for number, frequency in enumerate(frequencies_hz):
        turn = 2.0 * np.pi * np.asarray(frequency) / rate_hz
        kept = complex(np.exp(turn * (-DAMPING + 1j * np.sqrt(1.0 - DAMPING**2))))
        start = kept * before[..., number][..., None]
        out[..., number], _ = lfilter([1.0], [1.0, -kept], change.astype(complex), axis=-1, zi=start)
    return out


def play(signal: Signal, before: Signal, halves: Knots) -> Signal:
    """What is dragged along by a signal (…, time) through plays of these half widths (…, time, widths)."""
    out, now = np.empty((*signal.shape, len(halves))), before
    half = np.asarray(halves)
    for step in range(signal.shape[-1] if len(halves) else 0):
        here = signal[..., step, None]
        now = np.clip(now, here - half, here + half)
        out[..., step, :] = now
    return out


def moved_since(speed: Signal, before: Signal, rest_speed: float, rate_hz: float) -> Signal:
    """How long ago a wheel last stood [s] (…, time), 0 while it does.

    Args:
        speed: Its speed (…, time).
        before: How long ago that was before the first sample (…,).
        rest_speed: It stands where it is slower than this, in the same unit.
        rate_hz: Samples per second.
    """
    number = np.arange(1.0, speed.shape[-1] + 1.0)
    stood = np.where(np.abs(speed) < rest_speed, number, -before[..., None] * rate_hz)
    return np.asarray((number - np.maximum.accumulate(stood, axis=-1)) / rate_hz)


def rolled_since(speed: Signal, before: Signal, rate_hz: float) -> Signal:
    """How far a wheel has rolled since it last turned the other way [m] (…, time), negative backwards.

    Args:
        speed: Its speed [m/s] (…, time).
        before: How far it had rolled so before the first sample (…,), 0 where it has not moved yet.
        rate_hz: Samples per second.
    """
    sign = np.concatenate((np.sign(before)[..., None], np.sign(speed)), axis=-1)
    place = np.arange(sign.shape[-1])
    newest = np.maximum.accumulate(np.where(sign != 0.0, place, 0), axis=-1)
    course = np.take_along_axis(sign, newest, axis=-1)
    way = np.concatenate((np.abs(before)[..., None], np.abs(speed) / rate_hz), axis=-1).cumsum(axis=-1)
    turned = course[..., 1:] != course[..., :-1]
    since = np.maximum.accumulate(np.where(turned, way[..., :-1], 0.0), axis=-1)
    return np.asarray(course[..., 1:] * (way[..., 1:] - since))
