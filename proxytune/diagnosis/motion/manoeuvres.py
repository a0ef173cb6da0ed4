"""A library of manoeuvres: what `record` drives, and where the design of a drive begins (`excitation`)."""

from collections.abc import Callable

import numpy as np

from proxytune.diagnosis.motion.drives import Floats
from proxytune.driving import Robot


def _wheels(forward: Floats, turn: Floats) -> Floats:
    return np.asarray(np.clip(np.stack((forward - turn, forward + turn), axis=-1), -1.0, 1.0))


def _sides(t: Floats, period_s: float) -> Floats:
    """1 and −1 in turn."""
    return np.asarray(np.sign(np.sin(2 * np.pi * t / period_s)))


LIBRARY: tuple[tuple[str, str, Callable[[Floats], Floats]], ...] = (
    (
        "figure-eight",
        "figures of eight at a middling speed, six seconds a side",
        lambda t: _wheels(np.full_like(t, 0.6), 0.25 * _sides(t, 12.0)),
    ),
    (
        "arcs",
        "steady arcs of three radii at four speeds",
        lambda t: _wheels(0.3 + 0.15 * (t // 15.0), 0.08 * (1.0 + t // 5.0 % 3) * np.sign(7.5 - t % 15.0)),
    ),
    (
        "creeping",
        "straight, the command rising and falling slowly through zero, a quarter of full speed at most",
        lambda t: _wheels(0.25 * np.sin(2 * np.pi * t / 20.0), np.zeros_like(t)),
    ),
    (
        "stop and go",
        "a second of driving, a second of rest, bending left and right in turn",
        lambda t: _wheels(0.5 * (t % 2.0 < 1.0), 0.1 * _sides(t, 8.0) * (t % 2.0 < 1.0)),
    ),
    (
        "spins",
        "turns on the spot, both ways, at three speeds",
        lambda t: _wheels(np.zeros_like(t), (0.2 + 0.15 * (t // 10.0 % 3)) * _sides(t, 5.0)),
    ),
    (
        "reversals",
        "forwards and backwards in turn every second and a half, at three speeds",
        lambda t: _wheels((0.2 + 0.2 * (t // 12.0 % 3)) * _sides(t, 3.0), 0.05 * np.ones_like(t)),
    ),
    (
        "full speed",
        "long straights at full command, short slow bends between them",
        lambda t: _wheels(np.where(t % 10.0 < 7.0, 1.0, 0.3), 0.1 * _sides(t, 14.0) * (t % 10.0 >= 7.0)),
    ),
    (
        "quick steps",
        "commands that jump about twice a second",
        lambda t: _wheels(0.4 + 0.3 * _sides(t, 0.7), 0.2 * _sides(t, 1.1)),
    ),
)


BEND = 2.0
"""How far a car steers [full lock] where its wheels would differ by half of full speed."""
ROLLING = 0.4
"""Throttle of a car in manoeuvres that turn on the spot, which it cannot."""


def mirrored(commands: Floats, robot: Robot) -> Floats:
    """Commands (…, 2) that bend the other way."""
    return np.asarray(commands * (1.0, -1.0)) if robot.drive == "ackermann" else commands[..., ::-1]


def commands_of(shape: Callable[[Floats], Floats], times: Floats, robot: Robot) -> Floats:
    """The commands of a manoeuvre at some times (rows, 2): duties of two wheels, or a car's throttle and steering."""
    duties = shape(times)
    if robot.drive == "differential":
        return duties
    forward = duties.mean(axis=1)
    throttle = np.where(np.any(forward != 0.0), forward, ROLLING)
    return np.stack((throttle, np.clip(BEND * (duties[:, 1] - duties[:, 0]), -1.0, 1.0)), axis=-1)
