"""Measured frames with the model's markings drawn over them."""

from dataclasses import replace
from itertools import product
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.arrays import Floats
from proxytune.diagnosis import CameraDiagnosis, CameraFit, Edges, project
from proxytune.report.diagnosis.camera.models import COLOURS, camera_models, label_places
from proxytune.report.style import COLUMN

SHOWN = 2
"""Frames, one of each half of the log."""

TITLE = 28
"""Characters in a line above a panel."""


def markings_figure(diagnosis: CameraDiagnosis) -> Figure:
    """The frames on which the effects that were added change most, the outlines of the map's markings over them."""
    models, frames = list(camera_models(diagnosis).items()), telling_frames(diagnosis)
    down, across = (SHOWN, len(models)) if len(models) > 1 else (1, SHOWN)
    rows, columns = diagnosis.gathered.pictures.shape[1:3]
    height = 0.35 + down * (0.2 + 1.4 * rows / columns)
    figure = Figure(figsize=(COLUMN, height), layout="constrained")
    panels = figure.subplots(down, across, squeeze=False)
    shown = product(frames, zip(models, COLOURS, strict=False))
    for axes, (frame, ((name, fit), colour)) in zip(panels.ravel(), shown, strict=True):
        axes.imshow(diagnosis.gathered.pictures[frame], extent=(0, columns, rows, 0), interpolation="nearest")
        draw_outlines(axes, fit, frame, colour)
        axes.set_title(fill(f"{name}, frame {diagnosis.gathered.numbers[frame]}", TITLE), fontsize=7)
    label_places(panels)
    return figure


def telling_frames(diagnosis: CameraDiagnosis) -> list[int]:
    """Of each half of the log the frame with many markings on which the error changes most."""
    before, after, views = diagnosis.pixels.before, diagnosis.pixels.after, diagnosis.named.full.views
    points = np.bincount(views.edges.frame, minlength=views.count)
    change = np.nan_to_num(np.abs(before.frames - after.frames)) + 1e-9
    merit = np.where(points >= np.median(points), change * points, 0.0)
    halves = np.array_split(np.arange(views.count), SHOWN)
    return [int(half[np.argmax(merit[half])]) for half in halves]


def draw_outlines(axes: Axes, fit: CameraFit, frame: int, colour: str) -> None:
    """Draw where the model has the markings' edges, as far as edges are compared."""
    for white in (True, False):
        columns, rows, distance = outline_field(fit, frame, white)
        if np.isfinite(distance).any() and np.nanmin(distance) < 0.0 < np.nanmax(distance):
            axes.contour(columns, rows, distance, levels=[0.0], colors=colour, linewidths=0.9)


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
    distance = np.where(there.near, there.residual, np.nan)
    return columns, rows, distance.reshape(columns.shape)
