"""The error of a camera on frames that it was not fitted to, in pixels of marking displacement."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.model.fitting import SCALE_PX, fit_camera
from proxytune.diagnosis.camera.model.normal_equations import count_points, eliminate_poses
from proxytune.diagnosis.camera.model.projection import State, project
from proxytune.diagnosis.camera.model.views import Views

Floats = NDArray[np.float64]

FOLDS = 3
"""Every frame is left out once, a third of them at a time."""

SCALES = (2.0 * SCALE_PX, *(SCALE_PX,) * 4)
POSE_STEPS = 4
CAP_PX = 4.0
"""A marking that lies farther off counts as so far [pixel]: what is no marking has no distance."""

DRAWS = 400
"""Bootstrap samples over frames."""


@dataclass(frozen=True)
class PictureError:
    """Mean error on unseen frames.

    Attributes:
        value: Over all points, in pixels or grey levels.
        interval: 95 %, from a bootstrap over frames.
        frames: Mean of each frame, NaN where it shows no marking (N,).
    """

    value: float
    interval: tuple[float, float]
    frames: Floats


def unseen_residuals(views: Views, state: State, names: Sequence[str]) -> Floats:
    """Residuals of every edge point (n,) [pixel], by cameras that were fitted without its frame.

    Poses of frames left out are fitted under the tracker's scatter. CAP_PX where no marking is near.
    """
    residuals = np.full(len(views.edges.row), CAP_PX)
    for fold in range(FOLDS):
        out = np.arange(views.count) % FOLDS == fold
        fit = fit_camera(views, state, names, SCALES, ~out)
        own = out[views.edges.frame]
        there = project(views, fit_poses(views, fit.state, out))
        residuals[own] = np.where(there.valid, np.clip(there.residual, -CAP_PX, CAP_PX), CAP_PX)[own]
    return residuals


def fit_poses(views: Views, state: State, frames: NDArray[np.bool_]) -> State:
    """Fit the poses of some frames (N,), everything else held."""
    state = replace(state, poses=np.where(frames[:, None], 0.0, state.poses))
    for scale in np.geomspace(4.0 * SCALE_PX, SCALE_PX, POSE_STEPS):
        there = project(views, state)
        points = count_points(views, there, scale, frames, least=0.0)
        own = eliminate_poses(views, state, there, points, np.zeros((len(points.rows), 0))).own
        state = replace(state, poses=state.poses - np.where(frames[:, None], own, 0.0))
    return state


def pixel_errors(views: Views, residuals: Sequence[Floats], seed: int) -> list[PictureError]:
    """Errors of several cameras over the same points: those that any of them brings to a marking."""
    sizes = np.abs(np.stack(residuals))
    chosen = (sizes < CAP_PX).any(axis=0)
    frame = views.edges.frame[chosen]
    counts = np.bincount(frame, minlength=views.count).astype(float)
    sums = [np.bincount(frame, each[chosen], minlength=views.count) for each in sizes]
    return [error_over(total.astype(float), counts, seed) for total in sums]


def error_over(sums: Floats, counts: Floats, seed: int) -> PictureError:
    """The mean over all points of frames, from each frame's sum and number of points (N,)."""
    draws = np.random.default_rng(seed).integers(0, len(sums), (DRAWS, len(sums)))
    means = sums[draws].sum(axis=1) / np.maximum(counts[draws].sum(axis=1), 1.0)
    low, high = np.quantile(means, (0.025, 0.975))
    with np.errstate(invalid="ignore", divide="ignore"):
        frames = np.where(counts > 0, sums / counts, np.nan)
    return PictureError(float(sums.sum() / max(counts.sum(), 1.0)), (float(low), float(high)), frames)
