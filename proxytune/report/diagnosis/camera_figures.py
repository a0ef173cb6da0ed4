"""Figures of a camera's diagnosis: markings, displacements, what each effect explains alone, errors by frame."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from proxytune.arrays import Floats
from proxytune.diagnosis import LEAST_NATS, CameraDiagnosis, CameraFit, Edges, effects_of, project, rank_subsets
from proxytune.report import figure_style as style
from proxytune.report.diagnosis.error_figures import DECLARED_MODEL, with_effects
from proxytune.report.wording import plain

LEAST_LOSS = 1.0
"""Losses below this are all alike [nats]."""
ADDED = style.Role("added", style.BLUE)
RIVAL = style.Role("fits as well as what was added", style.LIGHT_BLUE)
OTHER = style.Role("other effect", style.GREY)


def camera_figures(diagnosis: CameraDiagnosis) -> Mapping[str, Figure]:
    """Draw everything that a camera's diagnosis has to show, by the name of the figure."""
    figures = {
        "camera_markings": markings_figure(diagnosis),
        "camera_displacement": displacement_figure(diagnosis),
        "camera_ranking": _ranking_figure(diagnosis),
        "camera_error": _errors_figure(diagnosis),
    }
    return {name: figure for name, figure in figures.items() if figure is not None}


def _ranking_figure(diagnosis: CameraDiagnosis) -> Figure | None:
    """Draw what is lost with each effect alone, against all effects together; None where all are declared."""
    if not (tried := diagnosis.candidates):
        return None
    # With the declared effects alone, in the measure that the candidates are ranked by [nats]
    named = diagnosis.named
    nothing = rank_subsets(named.full, effects_of(named.declared.names), 0)[0].loss
    figure, axes = style.one_panel(1.3 + 0.16 * len(tried))
    added = {effect.effect for effect in diagnosis.effects}
    rivals = {rival for effect in diagnosis.effects for rival in effect.rivals}
    roles = [ADDED if own <= added else RIVAL if own <= rivals else OTHER for own in (set(o.effects) for o in tried)]
    names = [" and ".join(map(plain, one.effects)) for one in tried]
    losses = [max(one.loss, 0.0) for one in tried]
    style.draw_ranked(axes, list(zip(names, losses, roles, strict=True)), nothing)
    axes.axvline(max(nothing, 0.0), color=style.VERMILLION, lw=1.0, ls=":", label="nothing added")
    axes.axvline(LEAST_NATS, color="0.45", lw=1.0, ls=":", label=f"least that counts, {LEAST_NATS:g} nats")
    axes.set_xscale("symlog", linthresh=10.0 * LEAST_LOSS, linscale=0.7)
    axes.set_xlim(-0.5, 1.5 * max(10.0 * LEAST_LOSS, nothing, *(one.loss for one in tried)))
    label = "evidence lost if only this effect is added [nats]\n0: none against all effects"
    axes.set_xlabel(label, fontsize=8, loc="right")
    style.legend_below(figure, axes)
    return figure


def _errors_figure(diagnosis: CameraDiagnosis) -> Figure:
    """Frame by frame on frames kept aside: displacement of markings, and brightness."""
    figure, ((place, grey),) = style.grid_of(2.4, 1, 2)
    bent = [effect.effect for effect in diagnosis.effects if effect.nats is not None]
    every = [effect.effect for effect in diagnosis.effects]
    _draw_frames(place, diagnosis.pixels.before.frames, diagnosis.pixels.after.frames, bent)
    if diagnosis.pixels.floor is not None:
        place.axhline(diagnosis.pixels.floor.value, color=style.GREEN, lw=1.4, label="floor: any camera, mean")
    _draw_frames(grey, diagnosis.grey.before.frames, diagnosis.grey.after.frames, every)
    place.set_ylabel("displacement\nof markings [px]", fontsize=8)
    grey.set_ylabel("difference in brightness\n[grey levels]", fontsize=8)
    style.legend_below(figure, place, grey)
    return figure


def _draw_frames(axes: Axes, before: Floats, after: Floats, effects: list[str]) -> None:
    """Each frame's error before, and after where something was added, the largest error before last."""
    order = np.argsort(before)[: int(np.isfinite(before).sum())]
    spots = np.arange(1, len(order) + 1)
    if effects:
        axes.vlines(spots, before[order], after[order], color=style.GREY, lw=0.4, alpha=0.6)
    axes.plot(spots, before[order], ".", color=style.VERMILLION, ms=3, label=DECLARED_MODEL)
    if effects:
        axes.plot(spots, after[order], ".", color=style.BLUE, ms=3, label="with effects added")
    axes.set_ylim(bottom=0.0)
    style.dress(axes, "frames kept aside,\nby error before")


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
PIXELS = ("column [px]", "row [px]")
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
    rows, columns = diagnosis.gathered.pictures.shape[1:3]
    arrows, names = [*measured], [fill(f"markings, {name}", TITLE) for name in models]
    for gate, own in zip(gates, measured, strict=True):
        right, down = (2.0 * own.places / (columns, rows) - 1.0).T
        arrows.append(Arrows(own.places, gate.displacement(right, down)))
        share = max(0.0, 100.0 * gate.share)
        names.append(f"fixed to the camera:\n{gate.rms_px:.2f} px, {share:.0f} % of cost")
    top = max(0.0, min(float(one.places[:, 1].min(initial=rows)) for one in measured) - 2.0 * columns / ACROSS)
    lines = 2 if len(models) > 1 else 1
    height = 0.45 + lines * (0.35 + 1.45 * (rows - top) / columns)
    figure, panels = style.grid_of(height, lines, 2, sharex=True, sharey=True)
    longest = max(float(np.hypot(*one.lengths.T).max(initial=0.0)) for one in arrows)
    # The longest of all is as long as there is room, and one of a round length is their scale.
    key = max((one for one in KEYS_PX if one <= longest), default=KEYS_PX[0])
    look: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "width": 0.006, "pivot": "middle"}
    look["scale"] = max(longest, KEYS_PX[0]) / (1.5 * columns / ACROSS)
    for number, (axes, one) in enumerate(zip(panels.ravel(), arrows, strict=True)):
        axes.set(xlim=(0, columns), ylim=(rows, top), aspect="equal")
        axes.set_title(names[number], fontsize=7)
        quiver = axes.quiver(*one.places.T, *one.lengths.T, color=COLOURS[number % len(models)], **look)
        axes.quiverkey(quiver, 0.88, 0.93, key, f"{key:g} px", labelpos="S", fontproperties={"size": 7})
    style.label_sides(panels, *PIXELS)
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


SHOWN = 2
"""Frames, one of each half of the log."""


def markings_figure(diagnosis: CameraDiagnosis) -> Figure:
    """The frames on which the effects that were added change most, the outlines of the map's markings over them."""
    models, frames = list(camera_models(diagnosis).items()), telling_frames(diagnosis)
    down, across = (SHOWN, len(models)) if len(models) > 1 else (1, SHOWN)
    pictures = diagnosis.gathered.pictures
    rows, columns = pictures.shape[1:3]
    figure, panels = style.grid_of(0.35 + down * (0.2 + 1.4 * rows / columns), down, across)
    shown = product(frames, zip(models, COLOURS, strict=False))
    for axes, (frame, ((name, fit), colour)) in zip(panels.ravel(), shown, strict=True):
        style.show_photo(axes, pictures[frame], extent=(0, columns, rows, 0), interpolation="nearest")
        for white in (True, False):
            across_, up, distance = outline_field(fit, frame, white)
            if np.isfinite(distance).any() and np.nanmin(distance) < 0.0 < np.nanmax(distance):
                axes.contour(across_, up, distance, levels=[0.0], colors=colour, linewidths=0.9)
        axes.set_title(fill(f"{name}, frame {diagnosis.gathered.numbers[frame]}", TITLE), fontsize=7)
    style.label_sides(panels, *PIXELS)
    return figure


def telling_frames(diagnosis: CameraDiagnosis) -> list[int]:
    """Frames with many markings, one of each half of the log, on which the error changes most."""
    before, after, views = diagnosis.pixels.before, diagnosis.pixels.after, diagnosis.named.full.views
    points = np.bincount(views.edges.frame, minlength=views.count)
    change = np.nan_to_num(np.abs(before.frames - after.frames)) + 1e-9
    merit = np.where(points >= np.median(points), change * points, 0.0)
    return [int(half[np.argmax(merit[half])]) for half in np.array_split(np.arange(views.count), SHOWN)]


def outline_field(fit: CameraFit, frame: int, white: bool) -> tuple[Floats, Floats, Floats]:
    """Signed distance of every pixel from the nearest marking of a colour, NaN where it is too far off to compare.

    Tape, pose and timing of the rows are those of the fit.
    """
    optics = fit.views.optics
    columns, rows = np.meshgrid(np.arange(optics.columns) + 0.5, np.arange(optics.rows) + 0.5)
    count = columns.size
    sideways = np.tile((1.0, 0.0), (count, 1))
    every = Edges(np.full(count, frame), np.full(count, white), columns.ravel(), rows.ravel(), sideways)
    there = project(replace(fit.views, edges=every), fit.state)
    return columns, rows, np.where(there.near, there.residual, np.nan).reshape(columns.shape)


COLOURS = (style.VERMILLION, style.BLUE)
"""Colours of the declared model, and of the one with effects added."""


def camera_models(diagnosis: CameraDiagnosis) -> Mapping[str, CameraFit]:
    """The declared camera, and the one with what bends it added; one model where only the pictures' look changed.

    Both look at the map as the second one has it, from the same poses: the declared one bends these to hide its faults.
    """
    bent = [effect.effect for effect in diagnosis.effects if effect.nats is not None]
    declared, model = diagnosis.named.declared, diagnosis.named.model
    before = replace(declared, state=replace(model.state, theta=declared.theta))
    return {DECLARED_MODEL: before} | ({with_effects(bent): model} if bent else {})
