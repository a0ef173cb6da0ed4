"""What a learnt remainder is worth beside named effects, and whether it does better without them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.horizon.window_slopes import FITTED_S
from proxytune.diagnosis.horizon.windows import Ratio, Rmse, blocks_of, cut, pose_errors, ratio, rmse
from proxytune.diagnosis.measured.drives import Drives, Floats
from proxytune.diagnosis.naming.findings import Findings
from proxytune.diagnosis.remainder.lookalike import Lookalike, lookalike
from proxytune.diagnosis.remainder.remainder import Remainder, remainder
from proxytune.diagnosis.rules import RULES
from proxytune.effects import effect_of


class LearntError(NamedTuple):
    """The error with names and remainder, on drives that were not fitted.

    Attributes:
        horizon_s: Length of the windows [s].
        after: Position [m].
        heading: Heading [rad].
        ratio: Position, by that with names alone.
    """

    horizon_s: float
    after: Rmse
    heading: Rmse
    ratio: Ratio


@dataclass(frozen=True)
class Learning:
    """The learnt remainder and what it is worth.

    Attributes:
        remainder: The curves, beside all named effects.
        errors: What they are worth, by horizon, shortest first; empty where they are not used.
        names_doubtful: Whether curves beside what is declared alone predict clearly better: then the names are wrong.
        looks_like: The named effect that would do nearly as well as the curves, or None.
    """

    remainder: Remainder
    errors: tuple[LearntError, ...]
    names_doubtful: bool
    looks_like: Lookalike | None = None

    @property
    def theta(self) -> Mapping[str, float]:
        """What the extended model has besides its named effects, by name in θ."""
        return self.remainder.theta if self.remainder.used else {}

    def depends_on(self, others: Iterable[str]) -> tuple[str, ...]:
        """The signals of the curves that are used, largest share first, and others, each once."""
        share = self.remainder.share if self.remainder.used else {}
        return tuple(dict.fromkeys([*sorted(share, key=lambda title: -share[title]), *others]))


def learn(found: Findings, tested: Drives, horizons_s: Iterable[float]) -> Learning:
    """Learn what the named effects leave over, and test it.

    Args:
        found: The models, fitted.
        tested: Drives that were not fitted.
        horizons_s: Lengths of the windows that are told [s].
    """
    beside = remainder(found.model.drives, found.model.theta)
    errors = [_error(found, beside, tested, horizon_s) for horizon_s in horizons_s] if beside.used else []
    known = tuple(error for error in errors if error is not None)
    taken = {effect_of(name) for name in found.model.theta}
    like = lookalike(found.model.drives, found.model.theta, beside, taken) if beside.used else None
    return Learning(beside, known, _names_are_doubtful(found, beside), like)


def _error(found: Findings, beside: Remainder, drives: Drives, horizon_s: float) -> LearntError | None:
    windows = cut(drives, horizon_s)
    blocks = blocks_of(drives, windows)
    if len(np.unique(blocks)) < 2:
        return None
    names = pose_errors(drives, found.model.theta, windows) ** 2
    both = pose_errors(drives, {**found.model.theta, **beside.theta}, windows) ** 2
    compared = ratio(both[:, 0], names[:, 0], blocks)
    return LearntError(horizon_s, rmse(both[:, 0], blocks), rmse(both[:, 1], blocks), compared)


def _names_are_doubtful(found: Findings, beside: Remainder) -> bool:
    if not found.adopted or not len(beside.held_out):
        return False
    drives = found.model.drives
    blocks = blocks_of(drives, cut(drives, FITTED_S))

    def does_better(alone: Floats) -> bool:
        compared = ratio(alone, beside.held_out, blocks)
        return compared.value < RULES.doubtful_names and compared.below

    return remainder(drives, found.declared.theta, does_better).used
