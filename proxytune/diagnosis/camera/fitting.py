"""Fitting a camera to edge points, with the tape, the whole map and every frame's pose as nuisances.

Gauss–Newton steps on Geman and McClure's loss ρ(r) = ½ r² / (1 + r²/s²) of the distances r of edge points from the
map's markings, with Gaussian priors; every frame's pose is eliminated from the normal equations by the Schur complement
A − B C⁻¹ Bᵀ (`Normal.marginal`, `eliminate`). What fits add to tracked poses tells how much the tracker scatters
(`pose_scatter`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Flags, Floats
from proxytune.diagnosis.camera import model
from proxytune.diagnosis.camera.edges import MAP_SCATTER, Views

EVIDENCE = 0.1
"""Edge points of a picture are not independent: so much of a point's evidence counts."""
LEAST_WEIGHT = 1e-4
"""Edge points of less weight are left out of a fit: they would only cost time."""


class Counted(NamedTuple):
    """Edge points that count in a fit: which (m,), ascending, and the share of evidence of each that counts."""

    rows: NDArray[np.intp]
    weight: Floats


def count_points(
    views: Views, there: model.Projection, scale_px: float, frames: Flags | None = None, least: float = LEAST_WEIGHT
) -> Counted:
    """Weigh edge points of some frames by Geman and McClure: 1 on the map's markings, none far beyond the scale."""
    valid = there.valid if frames is None else there.valid & frames[views.edges.frame]
    weight = np.where(valid, 1.0 / (1.0 + (there.residual / scale_px) ** 2) ** 2, 0.0)
    rows = np.flatnonzero(weight >= least)
    return Counted(rows, EVIDENCE * weight[rows])


class Marginal(NamedTuple):
    """Normal equations of the common columns with every frame's pose eliminated."""

    matrix: Floats
    right: Floats
    inverse: Floats  # of each pose's block (N, 3, 3)
    coupling: Floats  # how poses follow the common columns (N, 3, columns)
    own: Floats  # where poses would go by themselves (N, 3)


def eliminate_poses(
    views: Views, state: model.State, there: model.Projection, points: Counted, columns: Floats
) -> Marginal:
    """Normal equations of these columns (m, columns) of the points that count, poses eliminated under their prior."""
    rows, weight = points
    problem = Normal(columns, model.pose_slopes(there)[rows], there.residual[rows], weight)
    return problem.marginal(views.edges.frame[rows], state.poses, views.pose_scatter)


def eliminate(own: Floats, across: Floats, inner: Floats, other: Floats) -> Floats:
    """Eliminate all other unknowns from the normal equations of some, or their right side: the Schur complement."""
    return np.asarray(own - across @ np.linalg.solve(inner, other))


class Normal(NamedTuple):
    """A weighted linear problem: columns that all frames share, and three of each frame's own pose."""

    columns: Floats
    poses: Floats
    residual: Floats
    weight: Floats

    def marginal(self, frame: NDArray[np.intp], corrections: Floats, scatter: Floats) -> Marginal:
        """Eliminate every frame's pose under its prior, corrected so far and of this scatter; frames ascend."""
        weighted = self.columns * self.weight[:, None]
        matrix, right = weighted.T @ self.columns, weighted.T @ self.residual
        count = len(corrections)
        first = np.searchsorted(frame, np.arange(count + 1))
        # Each pose's block, its part with the common columns, and its right side
        blocks, cross = np.zeros((count, 3, 3)), np.zeros((count, 3, self.columns.shape[1]))
        pulls = np.zeros((count, 3))
        for number in range(count):
            own = slice(first[number], first[number + 1])
            slopes = self.poses[own] * self.weight[own, None]
            blocks[number], cross[number] = slopes.T @ self.poses[own], slopes.T @ self.columns[own]
            pulls[number] = slopes.T @ self.residual[own]
        blocks[:, (0, 1, 2), (0, 1, 2)] += 1.0 / scatter**2
        pulls += corrections / scatter**2
        inverse = np.asarray(np.linalg.inv(blocks), dtype=float)
        coupling = inverse @ cross
        own_step = (inverse @ pulls[..., None])[..., 0]
        flat = cross.reshape(3 * count, self.columns.shape[1])
        matrix -= flat.T @ coupling.reshape(3 * count, self.columns.shape[1])
        right -= flat.T @ own_step.ravel()
        return Marginal(matrix, right, inverse, coupling, own_step)


SCALE_PX = 1.0
"""Standard deviation of an edge point in the end; what is far beyond counts no more."""
LARGEST_STEP = 0.75
"""No parameter of the camera moves farther in one step, in spreads of it."""


@dataclass(frozen=True)
class CameraFit:
    """A camera fitted to views."""

    views: Views  # what it was fitted to
    names: tuple[str, ...]  # parameters that were free, by name in θ
    state: model.State  # all values
    information: Floats  # what the views say of the free parameters, tape, map and poses left open (names, names)
    tape_sd: Floats  # standard deviations of the tape's errors [m]
    offset_sd: Floats  # standard deviations of the map's offset (3,)
    pose_sd: Floats  # standard deviations of what is added to poses (N, 3)

    @property
    def theta(self) -> Mapping[str, float]:
        """Values of the camera, by name in θ."""
        return self.state.theta

    @property
    def sd(self) -> Floats:
        """Standard deviations of the free parameters (names,)."""
        return np.sqrt(np.diag(np.linalg.inv(self.information + np.diag(_precisions(self.views, self.names)))))


def fit_camera(
    views: Views, state: model.State, names: Sequence[str], scales_px: Sequence[float], frames: Flags | None = None
) -> CameraFit:
    """Fit the parameters of these names by Gauss–Newton with a redescending loss, of a scale [pixel] for each step.

    Those not named stay where they are; scales are large at first where the beginning is far off.
    """
    names, first, optics = tuple(names), len(names), views.optics
    camera_precision = _precisions(views, names)
    precision = np.concatenate((camera_precision, MAP_SCATTER**-2.0, views.tape_scatter**-2.0))
    for scale in scales_px:
        there = model.project(views, state)
        points = count_points(views, there, scale, frames)
        columns = common_slopes(views, state, there, names)[points.rows]
        matrix, right, inverse, coupling, own = eliminate_poses(views, state, there, points, columns)
        off = np.array([state.theta[name] - optics.neutral(name) for name in names])
        pull = precision * np.concatenate((off, state.offset, state.tape))
        matrix[np.diag_indices_from(matrix)] += precision
        common = np.asarray(-np.linalg.solve(matrix, right + pull), dtype=float)
        theta = dict(state.theta)
        for name, by in zip(names, common, strict=False):
            most = LARGEST_STEP * optics.spread(name)
            theta[name] = optics.clipped(name, theta[name] + float(np.clip(by, -most, most)))
        offset, tape = state.offset + common[first : first + 3], state.tape + common[first + 3 :]
        state = model.State(theta, tape, offset, state.poses + (-own - np.einsum("fij,j->fi", coupling, common)))
    across = matrix[:first, first:]
    information = eliminate(matrix[:first, :first], across, matrix[first:, first:], across.T)
    sd = np.sqrt(np.diag(np.linalg.inv(matrix)))[first:]
    pose_sd = np.sqrt(np.diagonal(inverse, axis1=1, axis2=2))
    return CameraFit(views, names, state, information - np.diag(camera_precision), sd[3:], sd[:3], pose_sd)


def common_slopes(views: Views, state: model.State, there: model.Projection, names: tuple[str, ...]) -> Floats:
    """Slopes of the residuals by camera, map and tape (n, names + 3 + tape)."""
    first = len(names) + 3
    columns = np.zeros((len(there.residual), first + views.tape.size))
    columns[:, : len(names)] = model.camera_slopes(views, state, there, names)
    columns[:, len(names) : first] = model.map_slopes(views, state, there)
    rows = np.arange(len(columns))
    for place, slope in model.tape_slopes(views, there):
        columns[rows, first + place] += slope
    return columns


def _precisions(views: Views, names: tuple[str, ...]) -> Floats:
    return np.array([views.optics.spread(name) ** -2.0 for name in names])


PASSES = 4
"""The scatter is estimated so many times over, each with poses fitted under the one before."""


def pose_scatter(fit: CameraFit) -> tuple[float, float]:
    """Standard deviations of places [m] and headings [rad], as expectation maximisation has them."""
    squares = fit.state.poses**2 + fit.pose_sd**2
    return float(np.sqrt(squares[:, :2].mean())), float(np.sqrt(squares[:, 2].mean()))
