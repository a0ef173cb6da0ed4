"""The verdict: the error that is left, against what noise alone would leave."""

from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.horizon.repeats import Repeated
from proxytune.diagnosis.rules import RULES


class Bracket(NamedTuple):
    """The two errors between which that of a right model lies.

    Attributes:
        lower: What the noise of measured poses alone makes [m].
        upper: What a right model might have by chance where this was the lowest error that any model reached, less what
            drives repeat of it [m].
        reached: The lowest error that any model reached [m].
        again: What drives from the same commands say; None where too few were driven.
    """

    lower: float
    upper: float
    reached: float
    again: Repeated | None


def bracket(lower: float, reached: float, again: Repeated | None) -> Bracket:
    """Bracket the error of a right model; the lower end is an estimate too, and never above what a model reached.

    Args:
        lower: What the noise of poses makes [m].
        reached: The lowest error of any model [m].
        again: What drives from the same commands say.
    """
    lower = min(lower, reached)
    upper = reached if again is None else _upper_from_repeats(reached, again)
    return Bracket(lower, max(lower, RULES.lowest_by_chance * upper), reached, again)


def _upper_from_repeats(reached: float, again: Repeated) -> float:
    """The most of an error that can be noise [m]: all of it in windows that were driven once."""
    most = min(reached, again.apart * again.share.interval[1] / again.share.value)
    return float(np.sqrt((1.0 - again.part) * reached**2 + again.part * most**2))


def verdict(after: float, floor: Bracket, *, named: bool, unnamed: bool) -> str:
    """Give one of five answers; none says that all is explained where the error is beyond the floor.

    Args:
        after: The error that is left [m].
        floor: The floor's bracket at the same horizon.
        named: Whether effects were added.
        unnamed: Whether a signal explains more of the rest than any named effect.
    """
    if is_at_floor(after, floor, unnamed=unnamed):
        return "explained" if named else "nothing missing"
    if unnamed or _repeats_more(floor):
        return "partly explained" if named else "unexplained"
    return "cannot be told"


def is_at_floor(after: float, floor: Bracket, *, unnamed: bool) -> bool:
    """Whether an error is no more than noise: of poses, or of what drives do not repeat, or nothing lowers it."""
    if after <= RULES.floor_factor * floor.lower:
        return True
    if unnamed or floor.reached < RULES.lowers * after:
        return False
    if floor.again is not None:
        return floor.again.share.value >= 1.0 / RULES.floor_factor and after <= RULES.repeats_alike * floor.again.apart
    return floor.upper < RULES.lowest_by_chance * RULES.narrow_bracket * floor.lower


def _repeats_more(floor: Bracket) -> bool:
    """Whether drives repeat more than the model predicts."""
    return floor.again is not None and floor.again.share.interval[1] < 1.0 / RULES.floor_factor
