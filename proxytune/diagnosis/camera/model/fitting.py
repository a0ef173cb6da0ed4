"""Fitting a camera to edge points, with the tape, the whole map and every frame's pose as nuisances."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.model.normal_equations import Counted, count_points, eliminate, eliminate_poses
from proxytune.diagnosis.camera.model.projection import (
    Projection,
    State,
    camera_slopes,
    map_slopes,
    project,
    tape_slopes,
)
from proxytune.diagnosis.camera.model.views import MAP_SCATTER, Tape, Views

Floats = NDArray[np.float64]

SCALE_PX = 1.0
"""Standard deviation of an edge point in the end; what is far beyond counts no more."""

LARGEST_STEP = 0.75
"""No parameter of the camera moves farther in one step, in spreads of it."""


@dataclass(frozen=True)
class CameraFit:
    """A camera fitted to views.

    Attributes:
        views: What it was fitted to.
        names: Parameters that were free, by name in θ.
        state: All values.
        information: What the views say of the free parameters, tape, map and poses left open (names, names).
        tape_sd: Standard deviations of the tape's errors [m].
        offset_sd: Standard deviations of the map's offset (3,).
        pose_sd: Standard deviations of what is added to poses (N, 3).
    """

    views: Views
    names: tuple[str, ...]
    state: State
    information: Floats
    tape_sd: Floats
    offset_sd: Floats
    pose_sd: Floats

    @property
    def theta(self) -> Mapping[str, float]:
        """Values of the camera, by name in θ."""
        return self.state.theta

    @property
    def sd(self) -> Floats:
        """Standard deviations of the free parameters (names,)."""
        return np.sqrt(np.diag(np.linalg.inv(self.information + np.diag(_precisions(self.views, self.names)))))


class _Step(NamedTuple):
    """A linear step with all that it came from: the columns are camera, map, tape."""

    common: Floats
    poses: Floats
    matrix: Floats
    pose_sd: Floats


def fit_camera(
    views: Views,
    state: State,
    names: Sequence[str],
    scales_px: Sequence[float],
    frames: NDArray[np.bool_] | None = None,
) -> CameraFit:
    """Fit by Gauss–Newton with a redescending loss.

    Args:
        views: Edge points.
        state: Where to begin.
        names: Free parameters by name in θ; those not named stay where they are.
        scales_px: The loss' scale in each step, large ones first where the beginning is far off [pixel].
        frames: Which frames count (N,); all if not given.
    """
    names = tuple(names)
    for scale in scales_px:
        there = project(views, state)
        step = _solve(views, state, names, there, count_points(views, there, scale, frames))
        state = _moved(views, state, names, step)
    return _fit_of(views, names, state, step)


def _solve(views: Views, state: State, names: tuple[str, ...], there: Projection, points: Counted) -> _Step:
    columns = common_slopes(views, state, there, names)[points.rows]
    matrix, right, inverse, coupling, own = eliminate_poses(views, state, there, points, columns)
    precision, pull = _priors(views, state, names)
    matrix[np.diag_indices_from(matrix)] += precision
    common = np.asarray(-np.linalg.solve(matrix, right + pull), dtype=float)
    poses = -own - np.einsum("fij,j->fi", coupling, common)
    return _Step(common, poses, matrix, np.sqrt(np.diagonal(inverse, axis1=1, axis2=2)))


def common_slopes(views: Views, state: State, there: Projection, names: tuple[str, ...]) -> Floats:
    """How residuals change with camera, map and tape (n, names + 3 + tape)."""
    first = len(names) + 3
    columns = np.zeros((len(there.residual), first + Tape(views.markings.stretches).size))
    columns[:, : len(names)] = camera_slopes(views, state, there, names)
    columns[:, len(names) : first] = map_slopes(views, state, there)
    rows = np.arange(len(columns))
    for place, slope in tape_slopes(views, there):
        columns[rows, first + place] += slope
    return columns


def _precisions(views: Views, names: tuple[str, ...]) -> Floats:
    return np.array([views.optics.spread(name) ** -2.0 for name in names])


def _priors(views: Views, state: State, names: tuple[str, ...]) -> tuple[Floats, Floats]:
    """Precision of each common column, and its pull to where it is expected."""
    precision = np.concatenate((_precisions(views, names), MAP_SCATTER**-2.0, views.tape_scatter**-2.0))
    off = np.array([state.theta[name] - views.optics.neutral(name) for name in names])
    return precision, precision * np.concatenate((off, state.offset, state.tape))


def _moved(views: Views, state: State, names: tuple[str, ...], step: _Step) -> State:
    theta = dict(state.theta)
    for name, by in zip(names, step.common, strict=False):
        most = LARGEST_STEP * views.optics.spread(name)
        theta[name] = views.optics.clipped(name, theta[name] + float(np.clip(by, -most, most)))
    first = len(names)
    offset, tape = state.offset + step.common[first : first + 3], state.tape + step.common[first + 3 :]
    return replace(state, theta=theta, offset=offset, tape=tape, poses=state.poses + step.poses)


def _fit_of(views: Views, names: tuple[str, ...], state: State, step: _Step) -> CameraFit:
    camera, rest = slice(len(names)), slice(len(names), None)
    matrix = step.matrix
    across = matrix[camera, rest]
    information = eliminate(matrix[camera, camera], across, matrix[rest, rest], across.T)
    sd = np.sqrt(np.diag(np.linalg.inv(matrix)))[len(names) :]
    return CameraFit(
        views, names, state, information - np.diag(_precisions(views, names)), sd[3:], sd[:3], step.pose_sd
    )
