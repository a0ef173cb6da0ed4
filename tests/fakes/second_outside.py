"""Hidden effects of the second generator that no catalogue has: functions as in second_wheels.py and second_body.py."""

import numpy as np
from numpy.typing import NDArray
from second_signals import (
    FULL_SPEED,
    MOTOR_LAG,
    ROW_S,
    Array,
    Run,
    Table,
    angles,
    lagging,
    newest,
    scanned,
    summed,
    twist_change,
)


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


SENT: Table = {"watchdog": lambda u, run, hold: _watched(u, hold)}

ARRIVED: Table = {
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


DUTY: Table = {
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


TARGET: Table = {
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


MOTOR: Table = {"overshooting_motor": _overshooting, "coasting": _coasting}


def _rate(signal: Array, run: Run) -> Array:
    return np.diff(signal, axis=1, prepend=np.zeros_like(signal[:, :1])) / run.step_s


WHEELS: Table = {
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


TWIST: Table = {
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


PLACES: Table = {
    "gusts": _gust,
    "banked_floor": lambda m, pose, time, gain: twist_change(
        m, turn=gain * np.abs(m[..., 0]) * np.tanh(pose[..., 1] / 0.4)
    ),
    "turning_tilt": lambda m, pose, time, gain: twist_change(m, turn=gain * np.abs(m[..., 0]) * np.sin(pose[..., 2])),
}

TRACKED: Table = {
    "warped_tracker": lambda p, size, metres: p + size * np.sin(p / metres) * (1.0, 1.0, 0.0),
    "skewed_headings": lambda p, size: p + size * np.sin(2.0 * p) * (0.0, 0.0, 1.0),
    "stretched_axis": lambda p, factor: p * (1.0, factor, 1.0),
}
