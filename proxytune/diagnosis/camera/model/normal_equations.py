"""Normal equations of edge points, with what is of no interest eliminated: every frame's pose, or other unknowns."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.model.projection import Projection, State, pose_slopes
from proxytune.diagnosis.camera.model.views import Views

Floats = NDArray[np.float64]

EVIDENCE = 0.1
"""Edge points of a picture are not independent: so much of a point's evidence counts."""

LEAST_WEIGHT = 1e-4
"""Edge points of less weight are left out of a fit: they would only cost time."""


class Counted(NamedTuple):
    """Edge points that count in a fit.

    Attributes:
        rows: Which (m,), in ascending order.
        weight: Of each (m,), the share of its evidence that counts included.
    """

    rows: NDArray[np.intp]
    weight: Floats


def robust_weight(residual: Floats, scale_px: float) -> Floats:
    """Weights of Geman and McClure's loss: 1 at zero, none far beyond the scale."""
    return np.asarray(1.0 / (1.0 + (residual / scale_px) ** 2) ** 2)


def count_points(
    views: Views,
    there: Projection,
    scale_px: float,
    frames: NDArray[np.bool_] | None = None,
    least: float = LEAST_WEIGHT,
) -> Counted:
    """Weigh edge points by how far they lie from the map's markings.

    Args:
        views: Whose edge points these are.
        there: Where they fall; those that are not valid have no weight.
        scale_px: The loss' scale [pixel].
        frames: Which frames count (N,); all if not given.
        least: Points of less weight are left out.
    """
    valid = there.valid if frames is None else there.valid & frames[views.edges.frame]
    weight = np.where(valid, robust_weight(there.residual, scale_px), 0.0)
    rows = np.flatnonzero(weight >= least)
    return Counted(rows, EVIDENCE * weight[rows])


class Marginal(NamedTuple):
    """Normal equations of the common columns with every frame's pose eliminated.

    Attributes:
        matrix: Of the common columns.
        right: Their right side.
        inverse: Of each pose's block (N, 3, 3).
        coupling: How poses follow the common columns (N, 3, columns).
        own: Where poses would go by themselves (N, 3).
    """

    matrix: Floats
    right: Floats
    inverse: Floats
    coupling: Floats
    own: Floats


def eliminate_poses(views: Views, state: State, there: Projection, points: Counted, columns: Floats) -> Marginal:
    """Normal equations of these columns (m, columns) of the points that count, poses eliminated under their prior."""
    rows, weight = points
    problem = Normal(columns, pose_slopes(there)[rows], there.residual[rows], weight)
    return problem.marginal(views.edges.frame[rows], state.poses, views.pose_scatter)


def eliminate(own: Floats, across: Floats, inner: Floats, other: Floats) -> Floats:
    """What is left of normal equations for some unknowns with all others eliminated: the Schur complement.

    Args:
        own: Block or right side of the unknowns that are kept.
        across: Their part with the others.
        inner: Block of the others.
        other: The others' part with those kept, or their right side.
    """
    return np.asarray(own - across @ np.linalg.solve(inner, other))


class Normal(NamedTuple):
    """A weighted linear problem: columns that all frames share, and three of each frame's own pose."""

    columns: Floats
    poses: Floats
    residual: Floats
    weight: Floats

    def marginal(self, frame: NDArray[np.intp], corrections: Floats, scatter: Floats) -> Marginal:
        """Eliminate every frame's pose under its prior.

        Args:
            frame: Of each row (n,), in ascending order.
            corrections: What is added to each frame's tracked pose so far (N, 3).
            scatter: Standard deviations of tracked poses (3,).
        """
        weighted = self.columns * self.weight[:, None]
        matrix, right = weighted.T @ self.columns, weighted.T @ self.residual
        count = len(corrections)
        blocks, cross, pulls = self._by_frame(frame, count)
        blocks[:, (0, 1, 2), (0, 1, 2)] += 1.0 / scatter**2
        pulls += corrections / scatter**2
        inverse = np.asarray(np.linalg.inv(blocks), dtype=float)
        coupling = inverse @ cross
        own_step = (inverse @ pulls[..., None])[..., 0]
        flat = cross.reshape(3 * count, self.columns.shape[1])
        matrix -= flat.T @ coupling.reshape(3 * count, self.columns.shape[1])
        right -= flat.T @ own_step.ravel()
        return Marginal(matrix, right, inverse, coupling, own_step)

    def _by_frame(self, frame: NDArray[np.intp], count: int) -> tuple[Floats, Floats, Floats]:
        """Each pose's block (count, 3, 3), its part with the common columns (count, 3, columns) and right side."""
        first = np.searchsorted(frame, np.arange(count + 1))
        blocks, cross = np.zeros((count, 3, 3)), np.zeros((count, 3, self.columns.shape[1]))
        pulls = np.zeros((count, 3))
        for number in range(count):
            own = slice(first[number], first[number + 1])
            slopes = self.poses[own] * self.weight[own, None]
            blocks[number], cross[number] = slopes.T @ self.poses[own], slopes.T @ self.columns[own]
            pulls[number] = slopes.T @ self.residual[own]
        return blocks, cross, pulls
