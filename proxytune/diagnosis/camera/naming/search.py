"""Naming what a camera lacks: fit everything, find the fewest effects that do as well, and fit those."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from proxytune.diagnosis.camera.model.fitting import SCALE_PX, CameraFit, fit_camera
from proxytune.diagnosis.camera.model.normal_equations import EVIDENCE
from proxytune.diagnosis.camera.model.optics import MOVING
from proxytune.diagnosis.camera.model.projection import neutral_state, project
from proxytune.diagnosis.camera.model.scatter import PASSES, pose_scatter
from proxytune.diagnosis.camera.model.views import Views
from proxytune.diagnosis.camera.naming.choice import LEAST_NATS, MOST, TRIED, Subset, rank_subsets
from proxytune.effects import effect_of

FIRST = ("camera_pitch", "camera_roll", "camera_yaw", "camera_height", "field_of_view", "camera_latency")
"""What is fitted first, from far away: nothing of it stands in for something else."""

FAR = tuple(16.0 * SCALE_PX * 2.0 ** (-step / 2.0) for step in range(7))
NEAR = (3.0 * SCALE_PX, 2.0 * SCALE_PX, *(SCALE_PX,) * 4)
AGAIN = (SCALE_PX,) * 2
FROM_ALL = (4.0 * SCALE_PX, 2.0 * SCALE_PX, *(SCALE_PX,) * 5)
"""Scales of the loss: from far, near the answer, once more, and from the answer of all effects together [pixel]."""

LEAST_SHARE = 0.01
"""Effects whose absence costs a smaller share of all cost are not needed either."""

RIVAL_NATS = 3.0
"""Sets of effects that cost no more beyond the best are its rivals."""


@dataclass(frozen=True)
class Named:
    """What a camera was found to be.

    Attributes:
        declared: With the declared effects alone.
        model: With those that are needed besides.
        full: With every effect of the catalogue.
        effects: Needed besides those declared.
        losses: Of the best set of each size that was tried, all effects together being 0 [nats].
        alone: What each effect explains by itself beyond what is declared [nats].
        rivals: Other sets of as many effects that do as well.
    """

    declared: CameraFit
    model: CameraFit
    full: CameraFit
    effects: tuple[str, ...]
    losses: tuple[Subset, ...]
    alone: tuple[Subset, ...]
    rivals: tuple[tuple[str, ...], ...]


def fit_everything(views: Views, names: Sequence[str], fixed: Mapping[str, float], *, learn_scatter: bool) -> CameraFit:
    """Fit all parameters from far away.

    Args:
        views: What is fitted to; its pose scatter is replaced by what is found where that is to be learnt.
        names: All parameters that may differ from neutral, by name in θ.
        fixed: Values that are known.
        learn_scatter: Whether the tracker's scatter is not known.
    """
    theta = {name: views.optics.neutral(name) for name in (*views.optics.mounting, *MOVING)} | dict(fixed)
    start = neutral_state(views, theta)
    # From far away an edge may be taken for another: the tape must not follow it
    fit = fit_camera(replace(views, tape_m=0.0), start, [name for name in names if name in FIRST], FAR)
    fit = fit_camera(views, fit.state, names, NEAR)
    for _ in range(PASSES if learn_scatter else 0):
        fit = fit_camera(views.with_scatter(*pose_scatter(fit)), fit.state, names, AGAIN)
    return fit


def name_camera_effects(full: CameraFit, declared: Sequence[str]) -> Named:
    """Find the fewest effects besides those declared that explain what all together do."""
    least = cost_of(full)
    enough = max(LEAST_NATS, LEAST_SHARE * least)
    best: list[tuple[Subset, CameraFit]] = []
    rivals: list[Subset] = []
    for size in range(MOST + 1):
        sets = rank_subsets(full, declared, size)[:TRIED]
        if not sets:
            break
        fits = sorted((_fitted(full, least, declared, one) for one in sets), key=lambda pair: pair[0].loss)
        best.append(fits[0])
        rivals = [one for one, _ in fits[1:] if one.loss <= fits[0][0].loss + RIVAL_NATS]
        if fits[0][0].loss <= enough:
            break
    subset, model = best[-1]
    losses, others = tuple(one for one, _ in best), tuple(one.effects for one in rivals)
    return Named(best[0][1], model, full, subset.effects, losses, tuple(rank_subsets(full, declared, 1)), others)


def cost_of(fit: CameraFit) -> float:
    """Cost of a fit: that of its edge points, as the loss has it, and of what is added to poses and tape [nats]."""
    there = project(fit.views, fit.state)
    squares = (there.residual / SCALE_PX) ** 2
    points = np.where(there.valid, squares / (1.0 + squares), 1.0)[there.near].sum()
    poses = ((fit.state.poses / fit.views.pose_scatter) ** 2).sum()
    tape = ((fit.state.tape / fit.views.tape_scatter) ** 2).sum()
    return float(0.5 * (EVIDENCE * points + poses + tape))


def fit_set(full: CameraFit, effects: Sequence[str]) -> CameraFit:
    """The camera with the parameters of these effects alone, from where all together have them."""
    names = [name for name in full.names if effect_of(name) in effects]
    optics = full.views.optics
    theta = {name: optics.neutral(name) if name in full.names else value for name, value in full.theta.items()}
    state = replace(full.state, theta={**theta, **{name: full.theta[name] for name in names}})
    return fit_camera(full.views, state, names, FROM_ALL)


def _fitted(full: CameraFit, least: float, declared: Sequence[str], subset: Subset) -> tuple[Subset, CameraFit]:
    """A set fitted, with what it really costs beyond the full fit where that is less than promised."""
    fit = fit_set(full, (*declared, *subset.effects))
    return Subset(subset.effects, min(subset.loss, cost_of(fit) - least)), fit
