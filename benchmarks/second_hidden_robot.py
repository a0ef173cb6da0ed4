"""Hidden effects of the second generator, functions of the signal of their stage and of what they may look at.

Some have the catalogue's own form, some another, and some are such that no catalogue has. Signals are of one run of its
robot, shape (episodes, time, …); wheel speeds are fractions of full speed.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

FULL_SPEED, BASELINE, RADIUS, MOTOR_LAG = 0.6, 0.16, 0.0318, 0.20
ROW_S = 0.05

Array = NDArray[np.float64]
Effect = Callable[..., Array]
Table = Mapping[str, Effect]


class Run(NamedTuple):
    """What an effect may look at."""

    random: np.random.Generator  # random numbers of its own
    step_s: float  # length of a step [s]
    exact: bool  # whether a step is integrated exactly, or by Euler's rule from its beginning
    duties: Array  # duties in force (E, T, 2); before they arrive, those that were sent (E, rows, 2)

    @property
    def times(self) -> Array:
        """The middle of each step, or its beginning [s] (T, 1)."""
        return (np.arange(self.duties.shape[1])[:, None] + 0.5 * self.exact) * self.step_s


def one_side(changed: Array, signal: Array, wheel: str) -> Array:
    """The change at one wheel only, or at both."""
    return np.where({"both": (True, True), "left": (True, False), "right": (False, True)}[wheel], changed, signal)


def lagging(signal: Array, tau: float, run: Run) -> Array:
    """What follows a signal that holds over each step with a lag: its mean over the step, or its value at its start."""
    kept = np.exp(-run.step_s / tau) if run.exact else 1.0 - run.step_s / tau
    ends = lfilter([1.0 - kept], [1.0, -kept], signal, axis=1)
    starts = np.concatenate((np.zeros_like(ends[:, :1]), ends[:, :-1]), axis=1)
    return signal + tau / run.step_s * (1.0 - kept) * (starts - signal) if run.exact else starts


def summed(rate: Array, run: Run) -> Array:
    """The integral of a rate up to the middle of each step, or up to its beginning."""
    return (np.cumsum(rate, axis=1) - rate * (0.5 if run.exact else 1.0)) * run.step_s


def angles(speeds: Array, run: Run) -> Array:
    """How far each wheel has turned [rad]."""
    return summed(speeds, run) * (FULL_SPEED / RADIUS)


def newest(signal: Array, valid: NDArray[np.bool_]) -> Array:
    """The newest valid sample (E, T) of a signal (E, T, n), zero before the first."""
    held = np.zeros_like(signal)
    for now in range(signal.shape[1]):
        held[:, now] = np.where(valid[:, now, None], signal[:, now], held[:, now - 1] if now else 0.0)
    return held


def scanned(signal: Array, step: Callable[[Array, Array], Array]) -> Array:
    """A state (E, n) that starts at zero and goes on with each sample, after each of them."""
    state, states = np.zeros_like(signal[:, 0]), np.empty_like(signal)
    for now in range(signal.shape[1]):
        state = states[:, now] = step(state, signal[:, now])
    return states


def twist_change(m: Array, ahead: Array | float = 0.0, aside: Array | float = 0.0, turn: Array | float = 0.0) -> Array:
    """A twist (…, 3) with something added to its forward, sideways [m/s] and yaw part [rad/s]."""
    changed = np.array(m)
    changed[..., 0] += ahead
    changed[..., 1] += aside
    changed[..., 2] += turn
    return changed


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
    "motor_lag": lambda w, run, tau, wheel="both": one_side(lagging(w, tau, run), lagging(w, MOTOR_LAG, run), wheel)
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


def _twice_lagging(m: Array, run: Run, tau: float) -> Array:
    late = lagging(lagging(m[..., 2:], tau / 2.0, run), tau / 2.0, run)[..., 0]
    return twist_change(m, turn=late - m[..., 2])


TWIST: Table = {  # twists (E, T, 3)
    "yaw_scrub": lambda m, run, baseline: m * (1.0, 1.0, BASELINE / baseline),
    "scrub_when_slow": lambda m, run, share: m * (1.0 - np.exp(-np.abs(m[..., 2:]) / 1.5) * (0.0, 0.0, share)),
    "understeer": lambda m, run, gain: m / (1.0 + np.abs(m[..., :1]) * (0.0, 0.0, gain)),
    "understeer_with_square": lambda m, run, gain: m / (1.0 + m[..., :1] ** 2 * (0.0, 0.0, gain)),
    "yaw_lag": lambda m, run, tau: twist_change(m, turn=lagging(m[..., 2:], tau, run)[..., 0] - m[..., 2]),
    "yaw_lag_of_second_order": lambda m, run, tau: _twice_lagging(m, run, tau),
    "turn_slip": lambda m, run, loss: m * (1.0 - np.abs(m[..., 2:]) * (loss, 0.0, 0.0)).clip(0.0),
    "turn_slip_with_root": lambda m, run, loss: m * (1.0 - np.sqrt(np.abs(m[..., 2:])) * (loss, 0.0, 0.0)).clip(0.0),
    "lateral_slip": lambda m, run, slip: twist_change(m, aside=-slip * m[..., 0] * m[..., 2]),
    "slip_angle": lambda m, run, slip, most: twist_change(
        m, aside=-m[..., 0] * most * np.tanh(slip / most * m[..., 2])
    ),
    "cross_coupling": lambda m, run, ahead=0.0, turn=0.0: twist_change(
        m, ahead=ahead * m[..., 2] ** 2, turn=turn * np.abs(m[..., 0])
    ),
}


def _sloping(m: Array, pose: Array, x: float, y: float, push: float = 0.0) -> Array:
    """Slower uphill, pushed aside across the slope; little of it below 2 cm/s."""
    share = np.minimum(1.0, np.abs(m[..., 0]) / 0.02)
    east, north = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    return twist_change(m, -share * (x * east + y * north), share * push * (x * north - y * east))


def _far(pose: Array, x: float, y: float) -> Array:
    return np.hypot(pose[..., 0] - x, pose[..., 1] - y)[..., None]


PLACES: Table = {  # twists (E, 3) at poses (E, 3) and a time [s]
    "floor_slope": lambda m, pose, time, x, y, push=0.0: _sloping(m, pose, x, y, push),
    "hilly_floor": lambda m, pose, time, x, y: (
        m + (1.0 + 0.4 * np.sin(2.0 * pose[:, :1])) * (_sloping(m, pose, x, y) - m)
    ),
    "slippery_patch": lambda m, pose, time, loss, x, y, radius: (
        m * (1.0 - loss * ((radius - _far(pose, x, y)) / 0.1 + 0.5).clip(0.0, 1.0))
    ),
    "oil_that_thins_out": lambda m, pose, time, loss, x, y, radius: (
        m * (1.0 - loss * np.exp(-((_far(pose, x, y) / radius) ** 2)))
    ),
}


def _seen_from(p: Array, ahead: float, left: float) -> Array:
    east, north = np.cos(p[..., 2]), np.sin(p[..., 2])
    return twist_change(p, ahead * east - left * north, ahead * north + left * east)


def _smoothed(p: Array, tau: float) -> Array:
    """A tracker's own low-pass, row by row, from the first pose on."""
    kept = np.exp(-ROW_S / tau)
    return p[:, :1] + lfilter([1.0 - kept], [1.0, -kept], p - p[:, :1], axis=1)


TRACKED: Table = {  # poses (E, rows, 3) that a tracker reports
    "marker_offset": lambda p, ahead=0.0, left=0.0: _seen_from(p, ahead, left),
    "heading_offset": lambda p, degrees: twist_change(p, turn=np.radians(degrees)),
    "smoothed_poses": _smoothed,
}


# Effects that no catalogue has


def _since(event: NDArray[np.bool_]) -> Array:
    """Steps since the last event, itself included; a great many before the first (E, T, n)."""
    number = np.arange(event.shape[1])[None, :, None]
    return number - np.maximum.accumulate(np.where(event, number, -(10**9)), axis=1)


def _turned_round(signal: Array, least: float) -> NDArray[np.bool_]:
    """Where a signal (E, T, n) has another sign than the last time that it was above `least`."""
    way = np.where(np.abs(signal) > least, np.sign(signal), 0.0)
    sides = [newest(way[..., n : n + 1], way[..., n] != 0.0) for n in range(way.shape[2])]
    last = np.concatenate(sides, axis=2)
    return np.diff(last, axis=1, prepend=last[:, :1]) * np.roll(last, 1, axis=1) != 0.0


def _watched(u: Array, hold: float) -> Array:
    """A watchdog stops the motors while the same message has come for longer than `hold`."""
    changed = np.any(np.diff(u, axis=1, prepend=np.nan) != 0.0, axis=2, keepdims=True)
    return np.where(_since(changed) * ROW_S > hold, 0.0, u)


SENT = {**SENT, "watchdog": lambda u, run, hold: _watched(u, hold)}

ARRIVED = {
    **ARRIVED,
    "busy_computer": lambda t, run, longer: np.maximum.accumulate(t + longer * np.abs(run.duties).mean(axis=2), axis=1),
}


def _braked(u: Array, run: Run, pause: float) -> Array:
    """A driver lets a motor stand still for a while before it turns the other way round."""
    return np.where(_since(_turned_round(u, 0.0)) * run.step_s < pause, 0.0, u)


def _kicked(u: Array, run: Run, kick: float, pulse: float) -> Array:
    """A driver starts a resting motor with a pulse."""
    moving = np.abs(u) > 0.02
    starts = moving & ~np.concatenate((np.zeros_like(moving[:, :1]), moving[:, :-1]), axis=1)
    kicked = moving & (_since(starts) * run.step_s < pulse)
    return np.where(kicked, np.sign(u) * np.maximum(np.abs(u), kick), u)


DUTY = {
    **DUTY,
    "sticky_throttle": lambda u, run, play: scanned(u, lambda out, now: np.clip(out, now - play, now + play)),
    "brake_before_reversing": _braked,
    "kick_start": _kicked,
    "shared_current": lambda u, run, limit: (
        u * np.minimum(1.0, limit / np.maximum(1e-9, np.abs(u).sum(axis=2, keepdims=True)))
    ),
    "biased_driver": lambda u, run, bias: u + (bias, 0.0),
}


def _warm_trim(w: Array, run: Run, gain: float, tau: float) -> Array:
    heat = lagging(np.abs(run.duties).mean(axis=2, keepdims=True), tau, run)
    return w * (1.0 + gain * heat * (-1.0, 1.0))


TARGET = {
    **TARGET,
    "leaking_voltage": lambda w, run, share: w - share * w[..., ::-1] * (1.0, 0.0),
    "warm_trim": _warm_trim,
    "breathing_supply": lambda w, run, size, period: w * (1.0 + size * np.sin(2.0 * np.pi * run.times / period)),
}


def _overshooting(w: Array, run: Run, hz: float, damping: float) -> Array:
    """A speed controller of second order, underdamped; its roots, one the other's conjugate, are integrated each."""
    root = 2.0 * np.pi * hz * (-damping + 1j * np.sqrt(1.0 - damping**2))
    kept = np.exp(root * run.step_s) if run.exact else 1.0 + root * run.step_s
    modes = scanned(w.astype(complex), lambda mode, now: now + kept * (mode - now))
    ends = modes.real - root.real / root.imag * modes.imag
    starts = np.concatenate((np.zeros_like(ends[:, :1]), ends[:, :-1]), axis=1)
    return (starts + ends) / 2.0 if run.exact else starts


def _coasting(w: Array, run: Run, tau: float) -> Array:
    """A wheel without a duty rolls on for longer."""
    taus = np.where(np.abs(w) < 0.02, tau, MOTOR_LAG)
    left = np.exp(-run.step_s / taus) if run.exact else 1.0 - run.step_s / taus
    speed, speeds = np.zeros_like(w[:, 0]), np.empty_like(w)
    for now in range(w.shape[1]):
        gap = speed - w[:, now]
        speeds[:, now] = w[:, now] + taus[:, now] / run.step_s * (1.0 - left[:, now]) * gap if run.exact else speed
        speed = w[:, now] + left[:, now] * gap
    return speeds


MOTOR = {**MOTOR, "overshooting_motor": _overshooting, "coasting": _coasting}


def _rate(signal: Array, run: Run) -> Array:
    return np.diff(signal, axis=1, prepend=np.zeros_like(signal[:, :1])) / run.step_s


WHEELS = {
    **WHEELS,
    "one_way_flat": lambda w, run, loss: w * (1.0 - loss * np.sin(angles(w, run)).clip(0.0) * (w > 0.0) * (1.0, 0.0)),
    "wheelspin": lambda w, run, gain: w * (1.0 - gain * np.abs(_rate(w, run))).clip(0.0),
    "wearing_tyre": lambda w, run, per_metre: (
        w * (1.0 - per_metre * FULL_SPEED * summed(np.abs(w), run) * (1.0, 0.0)).clip(0.0)
    ),
}


def _flipping(m: Array, run: Run, kick: float, metres: float) -> Array:
    """After a reversal the caster turns round and drags the robot with it, for some way."""
    ahead = m[..., :1]
    way = np.cumsum(np.abs(ahead), axis=1) * run.step_s
    turned = _turned_round(ahead, 0.01)
    back = np.maximum.accumulate(np.where(turned, way, -1e3), axis=1)
    return twist_change(m, turn=(kick * ahead * np.exp((back - way) / metres))[..., 0])


TWIST = {
    **TWIST,
    "grip_limit": lambda m, run, most: (
        m * np.where((0, 0, 1), most / np.maximum(most, np.abs(m[..., :1] * m[..., 2:])), 1.0)
    ),
    "turn_limit": lambda m, run, most: twist_change(m, turn=np.clip(m[..., 2], -most, most) - m[..., 2]),
    "weak_left_turns": lambda m, run, factor: twist_change(m, turn=(factor - 1.0) * m[..., 2].clip(0.0)),
    "caster_flip": _flipping,
    "tail_swing": lambda m, run, gain: twist_change(m, aside=gain * _rate(m[..., :1], run)[..., 0]),
}


def _gust(m: Array, pose: Array, time: float, speed: float, period: float) -> Array:
    """Wind along x that comes and goes pushes the robot, moving or not."""
    wind = speed * np.sin(2.0 * np.pi * time / period)
    return twist_change(m, wind * np.cos(pose[..., 2]), -wind * np.sin(pose[..., 2]))


PLACES = {
    **PLACES,
    "gusts": _gust,
    "banked_floor": lambda m, pose, time, gain: twist_change(
        m, turn=gain * np.abs(m[..., 0]) * np.tanh(pose[..., 1] / 0.4)
    ),
    "turning_tilt": lambda m, pose, time, gain: twist_change(m, turn=gain * np.abs(m[..., 0]) * np.sin(pose[..., 2])),
}

TRACKED = {
    **TRACKED,
    "warped_tracker": lambda p, size, metres: p + size * np.sin(p / metres) * (1.0, 1.0, 0.0),
    "skewed_headings": lambda p, size: p + size * np.sin(2.0 * p) * (0.0, 0.0, 1.0),
    "stretched_axis": lambda p, factor: p * (1.0, factor, 1.0),
}
