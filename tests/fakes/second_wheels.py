"""Hidden effects of the second generator on messages, duties and wheels that the catalogue names.

In the catalogue's own form or in another; each is a function of the signal of its stage, the Run and its figures.
Wheel speeds are fractions of full speed.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from second_signals import (
    FULL_SPEED,
    MOTOR_LAG,
    RADIUS,
    Array,
    Run,
    Table,
    angles,
    lagging,
    newest,
    one_side,
    scanned,
    summed,
)


def _bursts(run: Run, enter: float, leave: float) -> NDArray[np.bool_]:
    """Messages that come through a link which breaks and mends at random (E, rows)."""
    luck = run.random.random(run.duties.shape[:2])
    link = np.ones(luck.shape, dtype=bool)
    for row in range(1, luck.shape[1]):
        link[:, row] = np.where(link[:, row - 1], luck[:, row] >= enter, luck[:, row] < leave)
    return link


def _polled(arrival: Array, period: float) -> Array:
    """A controller that looks for the newest message at times of its own."""
    return np.ceil(arrival / period) * period


SENT: Table = {  # messages (E, rows, 2)
    "command_quantisation": lambda u, run, step: np.rint(u / step) * step,
    "square_levels": lambda u, run, levels: np.sign(u) * (np.rint(np.sqrt(np.abs(u)) * levels) / levels) ** 2,
    "dropped_commands": lambda u, run, probability: newest(u, run.random.random(u.shape[:2]) >= probability),
    "broken_link": lambda u, run, enter, leave: newest(u, _bursts(run, enter, leave)),
    "moving_average": lambda u, run, rows: lfilter(np.full(rows, 1.0 / rows), [1.0], u, axis=1),
}

ARRIVED: Table = {  # when messages arrive (E, rows) [s]
    "delay_jitter": lambda t, run, spread: np.maximum.accumulate(t + spread * run.random.random(t.shape), axis=1),
    "exponential_jitter": lambda t, run, mean: np.maximum.accumulate(t + run.random.exponential(mean, t.shape), axis=1),
    "polled_commands": lambda t, run, period: _polled(t, period),
}


def _banded(u: Array, width: float) -> Array:
    return u - np.clip(u, -width, width)


def _gripping(u: Array, breakaway: float, release: float) -> Array:
    """A wheel starts at `breakaway`, goes on down to `release` of it, and stops where its duty changes sign."""

    def step(before: Array, now: Array) -> Array:
        least = np.where(before * now > 0.0, release * breakaway, breakaway)
        return np.where(np.abs(now) >= least, now, 0.0)

    return scanned(u, step)


def _driver(u: Array, offset: float, least: float = 0.01) -> Array:
    return np.where(np.abs(u) < least, 0.0, np.sign(u) * (offset + (1.0 - offset) * np.abs(u)))


def _ramp(u: Array, run: Run, up: float, down: float) -> Array:
    """Duties that grow and shrink no faster than over the whole range in `up` and `down` seconds."""

    def step(before: Array, now: Array) -> Array:
        grows = np.abs(now) > np.abs(before)
        most = run.step_s / np.where(grows, up, down)
        return before + np.clip(now - before, -most, most)

    return scanned(u, step)


DUTY: Table = {  # duties (E, T, 2) in force
    "dead_band": lambda u, run, width, wheel="both": one_side(_banded(u, width), u, wheel),
    "soft_dead_band": lambda u, run, width: u * (1.0 - np.exp(-((u / width) ** 2))),
    "stiction": lambda u, run, breakaway, release=0.5, wheel="both": one_side(
        _gripping(u, breakaway, release), u, wheel
    ),
    "saturation": lambda u, run, limit, wheel="both": one_side(np.clip(u, -limit, limit), u, wheel),
    "rounded_saturation": lambda u, run, limit: u / (1.0 + (np.abs(u) / limit) ** 6) ** (1.0 / 6.0),
    "driver_map": lambda u, run, offset: _driver(u, offset),
    "gated_driver": lambda u, run, offset, least: _driver(u, offset, least),
    "slew_rate": lambda u, run, rise: _ramp(u, run, rise, rise),
    "slow_start": lambda u, run, rise: _ramp(u, run, rise, rise / 3.0),
}


def _work(run: Run) -> Array:
    return np.abs(run.duties).mean(axis=2, keepdims=True)


def _battery(w: Array, run: Run, load: float = 0.0, fade: float = 0.0, clock: float = 0.0) -> Array:
    worked, time = summed(_work(run), run) / 60.0, run.times / 60.0
    return w * (1.0 - load * _work(run)) * np.exp(-fade * worked - clock * time)


def _warm(w: Array, run: Run, loss: float, *taus: float) -> Array:
    return w * (1.0 - loss * np.mean([lagging(_work(run), tau, run) for tau in taus], axis=0))


TARGET: Table = {  # speeds asked of the wheels (E, T, 2)
    "wheel_gain": lambda w, run, left=1.0, right=1.0: w * (left, right),
    "battery_sag": _battery,
    "cells_that_drop_out": lambda w, run, loss, every: (
        w * (1.0 - loss * np.floor(summed(_work(run), run) / every).clip(0, 3))
    ),
    "thermal_fade": lambda w, run, loss, tau: _warm(w, run, loss, tau),
    "case_and_winding": lambda w, run, loss, fast, slow: _warm(w, run, loss, fast, slow),
}

MOTOR: Table = {  # speeds of the wheels (E, T, 2): the mean over a step, or that at its beginning
    "motor_lag": lambda w, run, tau, wheel="both": one_side(lagging(w, tau, run), lagging(w, MOTOR_LAG, run), wheel),
}


def _play(w: Array, run: Run, gap: float, soft: float) -> Array:
    """Wheels lag their gears by at most half the gap [rad]; `soft` of the way is taken along within it."""
    gear = np.cumsum(w, axis=1) * (run.step_s * FULL_SPEED / RADIUS)
    loose = (1.0 - soft) * gap / 2.0
    moved = scanned(gear, lambda wheel, now: np.minimum(np.maximum(wheel, now - loose), now + loose))
    return np.diff(moved, axis=1, prepend=0.0) * (RADIUS / FULL_SPEED / run.step_s)


def _triangle(angle: Array) -> Array:
    return 2.0 / np.pi * np.arcsin(np.sin(angle))


WHEELS: Table = {  # speeds of the wheels (E, T, 2)
    "backlash": lambda w, run, gap, wheel="both": one_side(_play(w, run, gap, 0.0), w, wheel),
    "rubber_backlash": lambda w, run, gap: 0.5 * _play(w, run, gap, 0.0) + 0.5 * _play(w, run, gap / 2.0, 0.0),
    "wheel_ripple": lambda w, run, left, right, phase: (
        w * (1.0 + np.array((left, right)) * np.cos(angles(w, run) - phase))
    ),
    "triangular_ripple": lambda w, run, size: w * (1.0 + size * _triangle(angles(w, run))),
}
