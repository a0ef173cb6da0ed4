"""A library of manoeuvres: what `record` drives, and where the design of a drive begins (`excitation`)."""

from collections.abc import Callable

import numpy as np

from proxytune.diagnosis.motion.drives import Floats
from proxytune.driving import Robot


def _figure_eight(t: Floats) -> Floats:
    return _wheels(np.full_like(t, 0.6), 0.25 * np.sign(np.sin(2 * np.pi * t / 12.0)))


def _arcs(t: Floats) -> Floats:
    return _wheels(0.3 + 0.15 * np.floor(t / 15.0), 0.08 * (1.0 + np.floor(t / 5.0) % 3) * np.sign(7.5 - t % 15.0))


def _creeping(t: Floats) -> Floats:
    return _wheels(0.25 * np.sin(2 * np.pi * t / 20.0), np.zeros_like(t))


def _stop_and_go(t: Floats) -> Floats:
    return _wheels(0.5 * (t % 2.0 < 1.0), 0.1 * np.sign(np.sin(2 * np.pi * t / 8.0)) * (t % 2.0 < 1.0))


def _spins(t: Floats) -> Floats:
    return _wheels(np.zeros_like(t), (0.2 + 0.15 * (np.floor(t / 10.0) % 3)) * np.sign(np.sin(2 * np.pi * t / 5.0)))


def _reversals(t: Floats) -> Floats:
    return _wheels(
        (0.2 + 0.2 * (np.floor(t / 12.0) % 3)) * np.sign(np.sin(2 * np.pi * t / 3.0)), 0.05 * np.ones_like(t)
    )


def _full_speed(t: Floats) -> Floats:
    return _wheels(np.where(t % 10.0 < 7.0, 1.0, 0.3), 0.1 * np.sign(np.sin(2 * np.pi * t / 14.0)) * (t % 10.0 >= 7.0))


def _quick_steps(t: Floats) -> Floats:
    forward = 0.4 + 0.3 * np.sign(np.sin(2 * np.pi * t / 0.7))
    return _wheels(forward, 0.2 * np.sign(np.sin(2 * np.pi * t / 1.1)))


def _wheels(forward: Floats, turn: Floats) -> Floats:
    return np.asarray(np.clip(np.stack((forward - turn, forward + turn), axis=-1), -1.0, 1.0))


LIBRARY: tuple[tuple[str, str, Callable[[Floats], Floats]], ...] = (
    ("figure-eight", "figures of eight at a middling speed, six seconds a side", _figure_eight),
    ("arcs", "steady arcs of three radii at four speeds", _arcs),
    (
        "creeping",
        "straight, the command rising and falling slowly through zero, a quarter of full speed at most",
        _creeping,
    ),
    ("stop and go", "a second of driving, a second of rest, bending left and right in turn", _stop_and_go),
    ("spins", "turns on the spot, both ways, at three speeds", _spins),
    ("reversals", "forwards and backwards in turn every second and a half, at three speeds", _reversals),
    ("full speed", "long straights at full command, short slow bends between them", _full_speed),
    ("quick steps", "commands that jump about twice a second", _quick_steps),
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
