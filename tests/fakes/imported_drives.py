"""A drive to import, made by hand."""

import numpy as np

from proxytune.importing.source import Commands, Drive, Poses


def poses(times, *, turn=0.0):
    """A robot that drives along x and is turned by `turn` (N,) [rad]."""
    times = np.asarray(times, dtype=float)
    places = np.stack((0.3 * (times - times[0]), np.zeros(len(times)), np.zeros(len(times))), axis=1)
    return Poses(times, places, np.zeros(len(times)) + turn, np.zeros(len(times)))


def commands(times, values=None):
    times = np.asarray(times, dtype=float)
    return Commands("twist", times, np.ones((len(times), 2)) if values is None else values)


def drive(pose_times, command_times):
    return Drive("run", commands(command_times), poses(pose_times))


def turning(lag_s, *, seconds=40.0, seed=1):
    """A drive that turns at the commanded rate, so much later."""
    random = np.random.default_rng(seed)
    times = np.arange(0.0, seconds, 0.02)
    issued = np.arange(0.0, seconds, 0.1)
    rates = np.repeat(random.uniform(-1.5, 1.5, len(issued) // 8 + 1), 8)[: len(issued)]
    fine = np.arange(-1.0, seconds, 0.001)
    held = rates[np.clip(np.searchsorted(issued, fine - lag_s, side="right") - 1, 0, len(rates) - 1)]
    heading = np.interp(times, fine, np.cumsum(held) * 0.001)
    return Drive("run", commands(issued, np.stack((0.2 + 0.0 * rates, rates), axis=1)), poses(times, turn=heading))
