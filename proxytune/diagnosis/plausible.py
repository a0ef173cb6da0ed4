"""Whether a log can bear the question at all: is there motion, and do commands and poses share one clock?"""

import numpy as np

from proxytune.diagnosis.drives import Drives, Floats, sum_by
from proxytune.diagnosis.replay import increments
from proxytune.errors import LogError
from proxytune.space import Theta

LEAST_TRAVEL_M = 0.5
LEAST_TURN_RAD = 1.0
"""A robot that moved less than both has shown nothing."""

FURTHEST_S = 10.0
"""Two clocks are looked for up to so far apart."""

EARLY_S = 0.15
LATE_S = 1.0
"""Motion this much before its command is impossible; so much after it no delay accounts for it."""

CLEARLY = 0.15
"""Another offset must make the correlation better by so much."""


def check_motion(name: str, drives: Drives) -> None:
    """Refuse a log in which the robot stands or is never told to move.

    Raises:
        LogError: Saying which.
    """
    if np.abs(drives.duties).max() < 1e-6:
        raise LogError(f"{name}: every command is zero; nothing can be learnt from a robot that is never told to move")
    way, turn = drives.travel.sum(axis=0)
    if way < LEAST_TRAVEL_M and turn < LEAST_TURN_RAD:
        raise LogError(
            f"{name}: the robot moved {way:.2f} m and turned {turn:.2f} rad in all; nothing can be learnt from a robot "
            "that stands still: check the poses, or drive"
        )


def check_clocks(name: str, drives: Drives, theta: Theta) -> None:
    """Refuse a log whose poses come from another clock than its commands.

    Raises:
        LogError: With how far they are apart.
    """
    said, seen = (_rates(drives, values) for values in (increments(drives, theta), drives.measured))
    step = 1.0 / drives.rate_hz
    reach = round(FURTHEST_S / step)
    shifts = np.arange(-reach, reach + 1)
    agreement = np.array([_correlation(said, seen, int(shift)) for shift in shifts])
    best = int(np.argmax(agreement))
    apart = float(shifts[best] * step)
    near = agreement[(shifts * step >= -EARLY_S) & (shifts * step <= LATE_S)].max()
    if not -EARLY_S <= apart <= LATE_S and agreement[best] > near + CLEARLY:
        raise LogError(
            f"{name}: poses and commands fit best when the poses are taken {abs(apart):.2f} s "
            f"{'earlier' if apart > 0 else 'later'}; they seem to come from two clocks: put them on one"
        )


def _rates(drives: Drives, steps: Floats) -> Floats:
    """Forward motion and turn per row of the longest grid, scaled alike (E, rows, 2)."""
    ticks = round(drives.tick_hz / drives.rate_hz)
    rows = drives.duties.shape[1] // ticks
    label = drives.episode * rows + (drives.last // ticks - 1)
    grid = sum_by(label, steps[:, [0, 2]], len(drives.duties) * rows).reshape(len(drives.duties), rows, 2)
    return np.asarray(grid / (grid.std(axis=(0, 1)) + 1e-12))


def _correlation(said: Floats, seen: Floats, shift: int) -> float:
    """How well motion measured `shift` rows later agrees with what was said."""
    rows = said.shape[1] - abs(shift)
    if rows < 10:
        return -1.0
    one = said[:, max(0, -shift) : max(0, -shift) + rows].reshape(-1, 2)
    other = seen[:, max(0, shift) : max(0, shift) + rows].reshape(-1, 2)
    one, other = one - one.mean(axis=0), other - other.mean(axis=0)
    size = float(np.sqrt((one**2).sum() * (other**2).sum()))
    return float((one * other).sum()) / size if size > 0.0 else -1.0
