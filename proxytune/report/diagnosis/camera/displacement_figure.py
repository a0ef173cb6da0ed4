"""How far markings lie from where the model has them, over the picture."""

from textwrap import fill
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from proxytune.arrays import Floats
from proxytune.diagnosis import CameraDiagnosis, CameraFit, ResidualField, project
from proxytune.report.diagnosis.camera.models import COLOURS, camera_models, label_places
from proxytune.report.style import COLUMN

ACROSS = 12
"""Arrows across the picture."""

FEWEST = 50
"""Edge points that an arrow needs."""

FARTHEST_PX = 6.0
"""Edges that lie farther off are not those of the map."""

HELD = 0.05
"""Part of an arrow along edges, of which nothing is seen, as a share of the points' weight: it is drawn short."""

KEYS_PX = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
"""Lengths that the scale may show [pixel]."""


TITLE = 28
"""Characters in a line above a panel."""


class Arrows(NamedTuple):
    """Displacements (n, 2), right and down [pixel], at places (n, 2) [pixel]."""

    places: Floats
    lengths: Floats


def displacement_figure(diagnosis: CameraDiagnosis) -> Figure:
    """Mean displacements of the edges above, beneath them what of it is fixed to the camera, all on one scale."""
    models = camera_models(diagnosis)
    measured = [measured_displacements(fit) for fit in models.values()]
    gates = diagnosis.residual_fields if len(models) > 1 else diagnosis.residual_fields[1:]
    arrows = [*measured, *(_field(diagnosis, gate, own.places) for gate, own in zip(gates, measured, strict=True))]
    names = [*(fill(f"markings, {name}", TITLE) for name in models), *(_say(gate) for gate in gates)]
    rows, columns = diagnosis.gathered.pictures.shape[1:3]
    top = max(0.0, min(float(one.places[:, 1].min(initial=rows)) for one in measured) - 2.0 * columns / ACROSS)
    down = 2 if len(models) > 1 else 1
    height = 0.45 + down * (0.35 + 1.45 * (rows - top) / columns)
    figure = Figure(figsize=(COLUMN, height), layout="constrained")
    panels = figure.subplots(down, 2, sharex=True, sharey=True, squeeze=False)
    longest = max(float(np.hypot(*one.lengths.T).max(initial=0.0)) for one in arrows)
    for number, (axes, one) in enumerate(zip(panels.ravel(), arrows, strict=True)):
        axes.set(xlim=(0, columns), ylim=(rows, top), aspect="equal")
        axes.set_title(names[number], fontsize=7)
        _draw(axes, one, COLOURS[number % len(models)], longest, columns / ACROSS)
    label_places(panels)
    return figure


def measured_displacements(fit: CameraFit) -> Arrows:
    """Mean displacement of the edges in each square of the picture that shows enough of them.

    An edge shows its displacement along its normal alone; edges of all directions together show both.
    """
    there, edges, optics = project(fit.views, fit.state), fit.views.edges, fit.views.optics
    used = there.valid & (np.abs(there.residual) < FARTHEST_PX)
    side = optics.columns / ACROSS
    column, row = (np.floor_divide(place[used], side).astype(int) for place in (edges.column, edges.row))
    cell, normal = row * ACROSS + column, edges.normal[used]
    count = np.bincount(cell)
    products = (normal[:, :, None] * normal[:, None, :]).reshape(-1, 4)
    matrix = _sums(cell, products).reshape(-1, 2, 2) + HELD * count[:, None, None] * np.eye(2) + 1e-9 * np.eye(2)
    right = _sums(cell, -normal * there.residual[used][:, None])
    kept = np.flatnonzero(count >= FEWEST)
    lengths = np.linalg.solve(matrix[kept], right[kept][..., None])[..., 0]
    places = (np.stack((kept % ACROSS, kept // ACROSS), axis=-1) + 0.5) * side
    return Arrows(np.asarray(places, dtype=float), np.asarray(lengths, dtype=float))


def _sums(cell: NDArray[np.intp], values: Floats) -> Floats:
    return np.stack([np.bincount(cell, column) for column in values.T], axis=-1)


def _field(diagnosis: CameraDiagnosis, gate: ResidualField, places: Floats) -> Arrows:
    rows, columns = diagnosis.gathered.pictures.shape[1:3]
    right, down = (2.0 * places / (columns, rows) - 1.0).T
    return Arrows(places, gate.displacement(right, down))


def _say(gate: ResidualField) -> str:
    share = max(0.0, 100.0 * gate.share)
    return f"fixed to the camera:\n{gate.rms_px:.2f} px, {share:.0f} % of cost"


def _draw(axes: Axes, arrows: Arrows, colour: str, longest: float, room: float) -> None:
    """Arrows with one of a round length as their scale; the longest of all panels is as long as there is room."""
    key = max((one for one in KEYS_PX if one <= longest), default=KEYS_PX[0])
    quiver = axes.quiver(
        *arrows.places.T,
        *arrows.lengths.T,
        color=colour,
        angles="xy",
        scale_units="xy",
        scale=max(longest, KEYS_PX[0]) / (1.5 * room),
        width=0.006,
        pivot="middle",
    )
    axes.quiverkey(quiver, 0.88, 0.93, key, f"{key:g} px", labelpos="S", fontproperties={"size": 7})
