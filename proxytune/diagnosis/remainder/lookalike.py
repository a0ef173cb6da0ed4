"""A learnt shape read back into a name: the named effect that does to the windows what the curves do."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from proxytune.diagnosis.horizon.window_slopes import FITTED_S
from proxytune.diagnosis.horizon.windows import cut, pose_errors
from proxytune.diagnosis.measured.drives import Drives, Floats
from proxytune.diagnosis.model.coordinates import span, theta_at
from proxytune.diagnosis.naming.candidates import Candidate, candidates
from proxytune.diagnosis.remainder.remainder import Remainder
from proxytune.diagnosis.rules import RULES
from proxytune.driving.robot import Robot
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
