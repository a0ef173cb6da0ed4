"""Which camera effects are needed: the fewest whose fit is no worse than with all of them free."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.model.fitting import CameraFit
from proxytune.diagnosis.camera.model.normal_equations import eliminate
from proxytune.diagnosis.camera.model.optics import effects_of
from proxytune.effects import effect_of

Floats = NDArray[np.float64]

LEAST_NATS = 6.0
"""An effect is needed if leaving it out costs more evidence; by chance one in 2000 does."""

MOST = 4
"""No more than so many effects are named at once; a camera with more faults is better calibrated anew."""

TRIED = 3
"""So many sets of equal size are fitted, those that promise most."""


@dataclass(frozen=True)
class Subset:
    """A set of effects.

    Attributes:
        effects: Those besides what is declared.
        loss: What leaving all others out costs, at the least [nats].
    """

    effects: tuple[str, ...]
    loss: float


def rank_subsets(full: CameraFit, declared: Sequence[str], size: int) -> list[Subset]:
    """Sets of so many effects besides those declared, the best first.

    The loss is the quadratic form about the fit with everything free: exact where the camera is near its neutral
    values, and cheap enough for every set.
    """
    others = [effect for effect in effects_of(full.names) if effect not in declared]
    sets = [Subset(chosen, _loss(full, (*declared, *chosen))) for chosen in combinations(others, size)]
    return sorted(sets, key=lambda one: one.loss)


def _loss(full: CameraFit, effects: Sequence[str]) -> float:
    """What is lost if only these effects' parameters may differ from their neutral values [nats]."""
    kept = np.array([effect_of(name) in effects for name in full.names])
    if kept.all():
        return 0.0
    off = np.array([full.theta[name] - full.views.optics.neutral(name) for name in full.names])[~kept]
    matrix = full.information
    across, inner = matrix[np.ix_(~kept, kept)], matrix[np.ix_(kept, kept)]
    left = matrix[np.ix_(~kept, ~kept)]
    if kept.any():
        left = eliminate(left, across, inner + 1e-9 * np.diag(np.diag(inner)), across.T)
    return float(0.5 * off @ left @ off)
