"""When a robot answers its commands, by cross-correlation: two clocks show before anything is fitted."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import correlate, correlation_lags

from proxytune.importing.source import Drive, Floats

STEP_S = 0.01
FURTHEST_S = 2.0
"""Answers are looked for so far from their commands."""

CLEAR = 0.4
"""A correlation below this tells no lag."""

SMOOTH_S = 0.1
"""Measured turns are taken over so long."""


@dataclass(frozen=True)
class Reaction:
    """How commanded and measured turning fit together in a drive.

    Attributes:
        lag_s: By how much the measured turning follows the commanded one [s]; below 0 it comes before.
        correlation: How well they fit there, −1 to 1.
    """

    lag_s: float
    correlation: float


def reaction_of(drive: Drive) -> Reaction | None:
    """The lag of measured behind commanded turning; None where the robot hardly turned, or without commands."""
    if drive.commands is None:
        return None
    times = np.arange(drive.poses.times[0], drive.poses.times[-1], STEP_S)
    if len(times) * STEP_S < 3.0 * FURTHEST_S:
        return None
    commanded, measured = _commanded_turn(drive, times), _measured_turn(drive, times)
    size = np.linalg.norm(commanded) * np.linalg.norm(measured)
    if not size > 0.0:
        return None
    lags = correlation_lags(len(measured), len(commanded)) * STEP_S
    strength = correlate(measured, commanded) / size
    near = np.abs(lags) <= FURTHEST_S
    best = int(np.argmax(strength[near]))
    found = Reaction(float(lags[near][best]), float(strength[near][best]))
    return found if found.correlation > CLEAR else None


def _commanded_turn(drive: Drive, times: Floats) -> Floats:
    """The commanded turning at each time, in whatever unit, its mean taken out."""
    commands = drive.commands
    assert commands is not None
    held = commands.values[np.maximum(np.searchsorted(commands.times, times, side="right") - 1, 0)]
    turn = held[:, 1] if commands.kind == "twist" else held[:, 1] - held[:, 0]
    return np.asarray(turn - turn.mean())


def _measured_turn(drive: Drive, times: Floats) -> Floats:
    """The measured yaw rate at each time, its mean taken out."""
    heading = np.interp(times, drive.poses.times, np.unwrap(drive.poses.headings))
    half = round(SMOOTH_S / STEP_S / 2.0)
    rate = np.zeros(len(times))
    rate[half:-half] = heading[2 * half :] - heading[: -2 * half]
    return np.asarray(rate - rate.mean())
