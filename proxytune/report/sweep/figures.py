"""The figures of a sweep: all measures along one parameter, and an overview of several."""

from collections.abc import Sequence
from itertools import cycle

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from proxytune.report.style import BLUE, COLUMN, GREEN, ORANGE, PURPLE, VERMILLION, legend_below
from proxytune.report.sweep.lines import axis_of, draw_ppv, draw_prpv, draw_series, explain, label_of, mark_values
from proxytune.space import Theta
from proxytune.sweep import Curve, Series, series_of
from proxytune.usefulness import POD_IMAGE, POD_POSE, PPV, PRPV, SRCC

COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE)
MARKERS = "osD^v"
POD_NAMES = {POD_POSE: "POD, pose [m]", POD_IMAGE: "POD, image [full scale]"}
HEIGHT, BELOW = 1.2, 0.4
"""Of a row of panels, and of what is below them [inch]."""


def sweep_figure(curves: Sequence[Curve], truth: Theta | None = None) -> Figure:
    """Draw PRPV beside PPV, one row per parameter, bootstrap intervals as bands; lower is better in both.

    A dashed green line with its band is the noise floor, or the target's halves where there is no better, a dotted one
    chance. The dashed vertical line is where the parameter itself is held when others are swept, the triangle the θ
    that made the target, where that is known.
    """
    figure = Figure(figsize=(COLUMN, HEIGHT * len(curves) + BELOW), layout="constrained")
    panels = figure.subplots(len(curves), 2, sharey="col", squeeze=False)
    for curve, row in zip(curves, panels, strict=True):
        points = [(point.value, point.assessment) for point in curve.points if point.assessment is not None]
        draw_prpv(row[0], points)
        draw_ppv(row[1], points)
        for axes in row:
            axes.set_xlabel(label_of(curve), fontsize=8)
            mark_values(axes, curve, truth)
    # Only now: a limit set earlier would hide what later rows of the shared axis hold.
    for axes, measure in zip(panels[0], (PRPV, PPV), strict=True):
        axes.set_ylim(bottom=-0.03 * axes.get_ylim()[1])
        axes.set_title(axis_of(measure), fontsize=8)
    legend_below(figure, *panels.ravel(), without=["PRPV"])
    return figure


def panels_figure(curve: Curve, truth: Theta | None = None) -> Figure:
    """Draw PRPV, PPV, SRCC and, where it was asked for, POD along one parameter, as the paper's figure does.

    Bands are 95 % bootstrap intervals; the dashed vertical line is where the parameter is held when others are swept,
    the triangle the θ that made the target, where that is known.
    """
    series, rows = series_of(curve), 3 if curve.has_pod else 2
    figure = Figure(figsize=(COLUMN, HEIGHT * rows + BELOW), layout="constrained")
    prpv, ppv, srcc, key, *pod = figure.subplots(rows, 2).ravel()
    points = [(point.value, point.assessment) for point in curve.points if point.assessment is not None]
    draw_prpv(prpv, points)
    draw_ppv(ppv, points)
    _srcc(srcc, series)
    for axes, measure in zip(pod, POD_NAMES, strict=False):
        _pod(axes, next(one for one in series if one.measure is measure))
    for axes, name in zip((prpv, ppv, srcc, *pod), (PRPV, PPV, SRCC, *POD_NAMES), strict=False):
        axes.set_title(POD_NAMES.get(name) or axis_of(name), fontsize=8)
        mark_values(axes, curve, truth)
        axes.set_xlim(prpv.get_xlim())
        axes.xaxis.set_major_locator(MaxNLocator(4))
    for axes in (prpv, ppv, *pod):
        axes.set_ylim(bottom=min(0.0, -0.03 * axes.get_ylim()[1]))
    figure.supxlabel(label_of(curve), fontsize=8)
    explain(key, prpv, srcc)
    return figure


def _srcc(axes: Axes, series: Sequence[Series]) -> None:
    chosen = [one for one in series if one.measure is SRCC]
    for one, colour, marker in zip(chosen, cycle(COLOURS), cycle(MARKERS), strict=False):
        draw_series(axes, one, colour, marker, f"SRCC, {one.metric.replace('_', ' ')}")


def _pod(axes: Axes, series: Series) -> None:
    draw_series(axes, series, BLUE, "o", POD_NAMES[series.measure])
