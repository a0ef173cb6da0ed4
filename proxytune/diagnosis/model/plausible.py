"""Whether a log can bear the question at all: is there motion, in the units and axes of the commands?"""

import numpy as np

from proxytune.diagnosis.measured.drives import Drives
from proxytune.diagnosis.model.replay import increments
from proxytune.errors import LogError
from proxytune.space import Theta

LEAST_TRAVEL_M = 0.05
LEAST_TURN_RAD = 0.2
"""A robot that got no further than both from where it was most of the time has shown nothing but noise."""

MOST_TIMES = 6.0
"""A robot that drove so many times as far as it was told, or as much less, is in other units."""

MOST_ASKEW_DEG = 60.0
"""A robot that drives further than this from its heading has another zero of the heading."""


def check_motion(name: str, drives: Drives) -> None:
    """Refuse a log in which the robot stands or is never told to move.

    Raises:
        LogError: Saying which.
    """
    if np.abs(drives.duties).max() < 1e-6:
        raise LogError(f"{name}: every command is zero; nothing can be learnt from a robot that is never told to move")
    way, turn = _reach(drives)
    if way < LEAST_TRAVEL_M and turn < LEAST_TURN_RAD:
        raise LogError(
            f"{name}: the robot got {way:.3f} m far and turned {turn:.2f} rad; nothing can be learnt from a robot that "
            "stands still: check the poses, or drive"
        )


def _reach(drives: Drives) -> tuple[float, float]:
    """How far the robot got from its middle pose in any episode, outliers apart: [m], [rad]."""
    furthest = np.zeros(2)
    for episode in np.unique(drives.episode):
        poses = drives.poses[drives.episode == episode, 1]
        off = np.abs(poses - np.median(poses, axis=0))
        furthest = np.maximum(furthest, np.quantile((np.hypot(off[:, 0], off[:, 1]), off[:, 2]), 0.9, axis=1))
    return float(furthest[0]), float(furthest[1])


def check_units(name: str, drives: Drives, theta: Theta) -> None:
    """Refuse poses in other units or axes than the commands can have led to.

    Raises:
        LogError: Saying which.
    """
    asked = increments(drives, theta)
    way, driven = float(np.abs(asked[:, 0]).sum()), float(drives.travel[:, 0].sum())
    if way > LEAST_TRAVEL_M and not 1.0 / MOST_TIMES < driven / way < MOST_TIMES:
        raise LogError(
            f"{name}: the poses say that the robot drove {driven:.3g} m where its commands say {way:.3g} m; check the "
            "units (m, rad) and the robot's figures"
        )
    moved = drives.measured
    course = float(np.degrees(np.arctan2(asked[:, 0] @ moved[:, 1], asked[:, 0] @ moved[:, 0])))
    if abs(course) > MOST_ASKEW_DEG:
        raise LogError(
            f"{name}: the robot drives {course:.0f}° from where its heading points; check the heading's zero, and "
            "which way x and y go"
        )
    turn, turned = asked[:, 2], moved[:, 2]
    if turn @ turned < -0.5 * np.sqrt((turn @ turn) * (turned @ turned)):
        raise LogError(f"{name}: the robot turns the other way than its commands say; check the signs, left and right")
