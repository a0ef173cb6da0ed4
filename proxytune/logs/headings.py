"""Headings: in radians, without jumps by whole turns."""

import math

import numpy as np

from proxytune.logs.log import POSE, Floats
from proxytune.logs.rows import Rows


def check_headings(samples: Rows, command: str, rate_hz: float) -> None:
    """Refuse headings in degrees: they jump by 360, or fit the course over ground far better than as radians.

    Raises:
        LogError: If they are.
    """
    heading = samples.values["heading"]
    if command == "none" or np.isnan(heading).all():
        return
    largest = int(np.nanargmax(np.abs(heading)))
    beyond = abs(heading[largest]) > 7.0
    jumps = samples.follows & (np.abs(np.abs(np.diff(heading)) - 360.0) < 30.0)
    if (beyond and jumps.any()) or _fits_as_degrees(samples, rate_hz, beyond=bool(beyond)):
        problem = f"{heading[largest]:g} and the others look like degrees; write headings in radians"
        raise samples.error(largest, "heading", problem)


def _fits_as_degrees(samples: Rows, rate_hz: float, *, beyond: bool) -> bool:
    """Whether course over ground and heading keep together with the heading in degrees only.

    Angles are doubled, so that a robot may go backwards, and longer ways weigh more. Where headings go beyond a turn
    of radians, a course that hardly varies is told by its direction too.
    """
    span = max(2, 2 * round(rate_hz / 4.0))
    x, y, heading = samples.columns(POSE).T
    if len(x) <= span:
        return False
    way = (x[span:] - x[:-span]) + 1j * (y[span:] - y[:-span])
    middle = heading[span // 2 : -span // 2]
    moving = (samples.episode[span:] == samples.episode[:-span]) & (np.abs(way) > 0.02) & np.isfinite(middle)
    if moving.sum() < 20:
        return False
    way, middle = way[moving], middle[moving]
    doubled = way**2 / np.abs(way) / np.abs(way).sum()
    degrees, radians = (complex(np.sum(doubled * np.exp(-2j * h))) for h in (np.radians(middle), middle))
    scattered = abs(degrees) > 0.6 and abs(degrees) > abs(radians) + 0.3
    return scattered or (beyond and degrees.real > 0.8 and degrees.real > radians.real + 0.3)


def unwrapped(samples: Rows) -> Floats:
    """Headings without jumps by whole turns within an episode, gaps passed over."""
    heading = samples.values["heading"].copy()
    measured = np.flatnonzero(np.isfinite(heading))
    if not len(measured):
        return heading
    episode = samples.episode[measured]
    turns = np.append(0.0, np.rint(np.diff(heading[measured]) / math.tau)).cumsum()
    begins = np.append(True, np.diff(episode) > 0)
    start = turns[np.maximum.accumulate(np.where(begins, np.arange(len(measured)), 0))]
    heading[measured] -= (turns - start) * math.tau
    return heading
