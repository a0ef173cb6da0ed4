"""The verdict: what the error that is left says, against what noise alone would leave."""

from typing import NamedTuple

from proxytune.diagnosis.windows import Rmse

AT_FLOOR = 1.15
"""An error of no more than so many times the floor is at it."""

WIDE = 1.5
"""A bracket whose upper end is no more than so many times its lower is narrow enough to say that all is explained."""

LOWERS = 0.95
"""A model lowers the error if it brings it to this share."""


class Bracket(NamedTuple):
    """Between which errors that of a model that is right lies.

    Attributes:
        lower: What the noise of measured poses alone makes [m].
        upper: The lowest error that any model reached, or what drives do not repeat where that is less [m].
        repeated: What drives do not repeat by the error after, over the windows that were driven again; None where too
            few were.
    """

    lower: float
    upper: float
    repeated: Rmse | None


def bracket(lower: float, reached: float, repeated: Rmse | None) -> Bracket:
    """The bracket; its lower end is an estimate too, and never above what a model reached.

    Args:
        lower: What the noise of poses makes [m].
        reached: The lowest error of any model [m].
        repeated: What drives do not repeat, by the error after.
    """
    upper = reached * min(1.0, repeated.interval[1]) if repeated else reached
    return Bracket(min(lower, reached), max(upper, min(lower, reached)), repeated)


def verdict(after: float, floor: Bracket, *, named: bool, unnamed: bool) -> str:
    """One of five answers; none says that all is explained where the error is beyond the floor.

    Args:
        after: The error that is left [m].
        floor: The floor's bracket at the same horizon.
        named: Whether effects were added.
        unnamed: Whether a signal explains more of the rest than any named effect.
    """
    if at_floor(after, floor, unnamed=unnamed):
        return "explained" if named else "nothing missing"
    if unnamed or _beyond(floor):
        return "partly explained" if named else "unexplained"
    return "cannot be told"


def at_floor(after: float, floor: Bracket, *, unnamed: bool) -> bool:
    """Whether an error is no more than noise: of poses, or of what drives do not repeat, or nothing lowers it."""
    if after <= AT_FLOOR * floor.lower:
        return True
    if unnamed:
        return False
    if floor.repeated is not None:
        return floor.repeated.value >= 1.0 / AT_FLOOR
    return floor.upper >= LOWERS * after and floor.upper < WIDE * floor.lower


def _beyond(floor: Bracket) -> bool:
    """Whether drives repeat more than the model predicts."""
    return floor.repeated is not None and floor.repeated.interval[1] < 1.0 / AT_FLOOR
