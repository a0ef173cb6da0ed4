"""Whether anything fixed to the camera is left over: a smooth field of displacements over the picture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.model.fitting import SCALE_PX, CameraFit, common_slopes
from proxytune.diagnosis.camera.model.normal_equations import count_points, eliminate, eliminate_poses
from proxytune.diagnosis.camera.model.projection import Projection, project
from proxytune.diagnosis.camera.model.views import MAP_SCATTER, Views

Floats = NDArray[np.float64]

POWERS = tuple((right, down) for right in range(4) for down in range(4) if right + down <= 3)
"""The terms of a cubic polynomial of the place in the picture."""

FIELD_PX = 1.0
"""Standard deviation that each term's coefficient is expected to have [pixel]."""

LEAST_NATS = 2.5
"""A field that explains less on frames that it was not fitted to is chance."""

LEAST_SHARE = 0.035
"""A field that explains a smaller share of the cost is of no matter."""

LEAST_PX = 0.1
"""A smaller field is of no matter either [pixel, root mean square over the points]."""


@dataclass(frozen=True)
class Leftover:
    """A field of displacements that a fitted camera leaves over.

    Attributes:
        nats: What it explains on frames that it was not fitted to.
        share: The same as a share of those frames' cost.
        rms_px: Root mean square over the edge points [pixel].
        field: Coefficients of POWERS to the right and down (terms, 2) [pixel].
    """

    nats: float
    share: float
    rms_px: float
    field: Floats

    @property
    def open(self) -> bool:
        """Whether something fixed to the camera is left over."""
        return self.nats > LEAST_NATS and self.share > LEAST_SHARE and self.rms_px > LEAST_PX

    def displacement(self, right: Floats, down: Floats) -> Floats:
        """How far the model has markings from where they lie [pixel], at places from −1 to 1 across the picture."""
        return _terms(right, down) @ self.field


def find_leftover(fit: CameraFit) -> Leftover:
    """Fit the field to one half of the frames and test it on the other, both ways.

    What the free parameters, the tape, the map and the poses could explain is left to them.
    """
    there = project(fit.views, fit.state)
    halves = [np.arange(fit.views.count) % 2 == part for part in (0, 1)]
    systems = [_system(fit, there, half) for half in halves]
    ridge = np.eye(len(systems[0][1])) / FIELD_PX**2
    fields = [np.asarray(-np.linalg.solve(matrix + ridge, right), dtype=float) for matrix, right, _ in systems]
    gains = [_gain(fields[1 - part], *systems[part][:2]) for part in (0, 1)]
    cost = sum(system[2] for system in systems)
    field = np.mean(fields, axis=0).reshape(2, -1).T
    moved = _terms(*_places(fit.views))[there.valid] @ field
    rms = float(np.sqrt((moved**2).sum(axis=1).mean())) if len(moved) else 0.0
    return Leftover(float(sum(gains)), float(sum(gains) / max(cost, 1e-9)), rms, field)


def _gain(field: Floats, matrix: Floats, right: Floats) -> float:
    return float(-(right @ field + 0.5 * field @ matrix @ field))


def _system(fit: CameraFit, there: Projection, half: NDArray[np.bool_]) -> tuple[Floats, Floats, float]:
    """Normal equations of the field on some frames, all else eliminated, and those frames' cost [nats]."""
    views, names = fit.views, fit.names
    points = count_points(views, there, SCALE_PX, half)
    terms, normal = _terms(*_places(views))[points.rows], views.edges.normal[points.rows]
    field = np.concatenate((normal[:, :1] * terms, normal[:, 1:] * terms), axis=1)
    columns = np.concatenate((field, common_slopes(views, fit.state, there, names)[points.rows]), axis=1)
    matrix, right, *_ = eliminate_poses(views, fit.state, there, points, columns)
    own, rest = slice(field.shape[1]), slice(field.shape[1], None)
    precision = np.concatenate((np.full(len(names), 1e-9), MAP_SCATTER**-2.0, views.tape_scatter**-2.0))
    pull = precision * np.concatenate((np.zeros(len(names)), fit.state.offset, fit.state.tape))
    across, inner = matrix[own, rest], matrix[rest, rest] + np.diag(precision)
    cost = 0.5 * float((points.weight * there.residual[points.rows] ** 2).sum())
    return (
        eliminate(matrix[own, own], across, inner, matrix[rest, own]),
        eliminate(right[own], across, inner, right[rest] + pull),
        cost,
    )


def _places(views: Views) -> tuple[Floats, Floats]:
    """Places of the edge points from −1 to 1 across and down the picture."""
    optics = views.optics
    return 2.0 * views.edges.column / optics.columns - 1.0, 2.0 * views.edges.row / optics.rows - 1.0


def _terms(right: Floats, down: Floats) -> Floats:
    return np.stack([right**one * down**other for one, other in POWERS], axis=-1)
