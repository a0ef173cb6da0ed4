"""What a learnt remainder is worth beside named effects, and whether it does better without them.

A learnt shape read back into a name: the named effect that does to the windows what the curves do.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from proxytune.diagnosis.motion.discrepancy import Remainder, remainder
from proxytune.diagnosis.motion.drives import Drives, Floats
from proxytune.diagnosis.motion.evidence import Findings
from proxytune.diagnosis.motion.innovations import span, theta_at
from proxytune.diagnosis.motion.prediction import FITTED_S, Ratio, Rmse, blocks_of, cut, pose_errors, ratio, rmse
from proxytune.diagnosis.motion.screening import Candidate, candidates
from proxytune.diagnosis.rules import RULES
from proxytune.driving import Robot
from proxytune.effects import effect_of
from proxytune.space import Theta

PROMISING = 3
"""So many forms are tuned, those whose probes gain most."""

EVALUATIONS = 25
"""So often the windows are replayed to tune one."""


class Lookalike(NamedTuple):
    """A named effect that keeps most of what curves gain.

    Attributes:
        effect: Its name.
        form: What is special about its form.
        theta: Its values by their names in θ.
        share: The share of the gain that it keeps; it was tuned to all windows, the curves to others than these.
    """

    effect: str
    form: str
    theta: Mapping[str, float]
    share: float


def lookalike(drives: Drives, theta: Theta, beside: Remainder, taken: Iterable[str]) -> Lookalike | None:
    """The named effect that is most like a remainder, if it keeps most of its gain.

    Args:
        drives: What both were fitted to.
        theta: The model beside which the remainder was learnt.
        beside: The remainder.
        taken: Names of effects that the model has.
    """
    windows = cut(drives, FITTED_S)

    def loss(candidate: Candidate, values: Floats) -> float:
        low, high = np.array([span(coordinate, drives.robot) for coordinate in candidate.free]).T
        moved = theta_at({**theta, **candidate.fixed}, candidate.free, np.clip(values, low, high))
        return float(np.mean(pose_errors(drives, moved, windows)[:, 0] ** 2))

    plain = float(np.mean(pose_errors(drives, theta, windows)[:, 0] ** 2))
    gained = plain - float(beside.held_out.mean())
    if gained <= 0.0:
        return None
    forms = candidates(drives.robot, theta, taken)
    probed = [min((loss(one, np.array(p)), number, p) for p in one.probes) for number, one in enumerate(forms)]
    tuned = [
        _tune(forms[number], np.array(probe), loss, drives.robot) for _, number, probe in sorted(probed)[:PROMISING]
    ]
    least, form, values = min(tuned, key=lambda found: found[0])
    share = (plain - least) / gained
    found = theta_at(form.fixed, form.free, values)
    return Lookalike(form.effect, form.form, found, share) if share >= RULES.lookalike_share else None


def _tune(
    form: Candidate, probe: Floats, loss: Callable[[Candidate, Floats], float], robot: Robot
) -> tuple[float, Candidate, Floats]:
    """The least loss of a form near a probe, and where it is."""
    low, high = np.array([span(coordinate, robot) for coordinate in form.free]).T
    start = (probe - low) / (high - low)
    simplex = np.vstack((start, start + np.eye(len(start)) * np.where(start < 0.9, 0.1, -0.1)))

    def left(shares: Floats, *_: Any, **__: Any) -> float:
        return loss(form, low + shares * (high - low))

    options: Any = {"initial_simplex": simplex, "maxfev": EVALUATIONS}
    found = minimize(left, start, method="Nelder-Mead", options=options)
    return float(found.fun), form, np.clip(low + found.x * (high - low), low, high)


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
