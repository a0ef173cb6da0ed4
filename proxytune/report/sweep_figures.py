"""Figures of a sweep: all measures along one parameter, overviews of several, and bars at three values."""

from collections.abc import Sequence
from itertools import cycle
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from proxytune.report import figure_style as style
from proxytune.report.wording import short, with_unit
from proxytune.space import Theta
from proxytune.sweep import Series, SweepCurve, SweepPoint, series_of
from proxytune.usefulness import POD_IMAGE, POD_POSE, PPV, PRPV, SRCC, Assessment, Measure

COLOURS = (style.BLUE, style.VERMILLION, style.GREEN, style.PURPLE, style.ORANGE)
MARKERS = "osD^v"
POD_NAMES = {POD_POSE: "POD, pose [m]", POD_IMAGE: "POD, image [full scale]"}
HEIGHT, BELOW = 1.2, 0.4
"""Heights of a row of panels, and of all below them [inch]."""


def sweep_figure(curves: Sequence[SweepCurve], truth: Theta | None = None) -> Figure:
    """Draw PRPV beside PPV, one row per parameter, bootstrap intervals as bands; lower is better in both.

    A dashed green line with its band is the noise floor, or the target's halves where there is no better, a dotted one
    chance. The dashed vertical line is where the parameter itself is held when others are swept, the triangle the θ
    that made the target, where that is known.
    """
    figure, panels = style.grid_of(HEIGHT * len(curves) + BELOW, len(curves), 2, sharey="col")
    for curve, row in zip(curves, panels, strict=True):
        draw_prpv_and_ppv(row[0], row[1], curve)
        for axes in row:
            axes.set_xlabel(label_of(curve), fontsize=8)
            mark_values(axes, curve, truth)
    # Only now: a limit set earlier would hide what later rows of the shared axis hold.
    for axes, measure in zip(panels[0], (PRPV, PPV), strict=True):
        axes.set_ylim(bottom=-0.03 * axes.get_ylim()[1])
        axes.set_title(axis_of(measure), fontsize=8)
    style.legend_below(figure, *panels.ravel(), without=["PRPV"])
    return figure


def panels_figure(curve: SweepCurve, truth: Theta | None = None) -> Figure:
    """Draw PRPV, PPV, SRCC and, where it was asked for, POD along one parameter, as the paper's figure does.

    Bands are 95 % bootstrap intervals; the dashed vertical line is where the parameter is held when others are swept,
    the triangle the θ that made the target, where that is known.
    """
    series, rows = series_of(curve), 3 if curve.has_pod else 2
    figure, panels = style.grid_of(HEIGHT * rows + BELOW, rows, 2)
    prpv, ppv, srcc, key, *pod = panels.flat
    draw_prpv_and_ppv(prpv, ppv, curve)
    chosen = [one for one in series if one.measure is SRCC]
    for one, colour, marker in zip(chosen, cycle(COLOURS), cycle(MARKERS), strict=False):
        draw_series(srcc, one, colour, marker, f"SRCC, {one.metric.replace('_', ' ')}")
    for axes, measure in zip(pod, POD_NAMES, strict=False):
        draw_series(axes, next(one for one in series if one.measure is measure), style.BLUE, "o", POD_NAMES[measure])
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


BESIDE = "lower and higher value"
SIDE = 1 / 3
"""The bars stand at the held value and so much of the parameter's box to either side."""
APART = 4.0
"""From one parameter's bars to the next one's."""
CHARACTERS = 50
"""That fit across the figure."""


def bars_figure(curves: Sequence[SweepCurve]) -> Figure:
    """Draw PRPV at three values of each parameter, its bootstrap interval, and the noise floor by its kind.

    The values are where the parameter is held, and the grid points nearest to a third of its range below and above;
    the held one is darker.
    """
    figure, axes = style.one_panel(2.9)
    ticks: list[tuple[float, str]] = []
    for place, curve in enumerate(curves):
        indices, held = bar_points(curve)
        chosen = [curve.points[index] for index in indices]
        spots = [place * APART + offset for offset in range(len(chosen))]
        ticks += [(spot, short(point.value)) for spot, point in zip(spots, chosen, strict=True)]
        _draw_bars(axes, spots, chosen, curve.points[held])
        name = fill(label_of(curve), max(5, CHARACTERS // len(curves)))
        axes.text(
            (spots[0] + spots[-1]) / 2, 1.02, name, transform=axes.get_xaxis_transform(),
            ha="center", va="bottom", fontsize=7,
        )  # fmt: skip
    found = [point.assessment for curve in curves for point in curve.points if point.assessment is not None]
    if found:
        draw_levels(axes, found)
        style.legend_below(figure, axes)
    style.dress(axes, up=axis_of(PRPV))
    axes.set_xticks([spot for spot, _ in ticks], [text for _, text in ticks], rotation=90)
    return figure


def bar_points(curve: SweepCurve) -> tuple[list[int], int]:
    """Points of a curve that stand for low, held and high, fewer where the held value is at an end; and the held one.

    The held value is the middle of the range where none was given.
    """
    values = np.array([point.value for point in curve.points])
    low, high = values[0], values[-1]
    middle = int(np.abs(values - curve.base.get(curve.parameter, (low + high) / 2)).argmin())
    wanted = values[middle] + SIDE * (high - low) * np.array([-1.0, 1.0])
    below, above = range(middle), range(middle + 1, len(values))
    sides = [
        [min(indices, key=lambda index: abs(values[index] - goal))] if indices else []
        for indices, goal in ((below, wanted[0]), (above, wanted[1]))
    ]
    return [*sides[0], middle, *sides[1]], middle


def _draw_bars(axes: Axes, spots: Sequence[float], chosen: Sequence[SweepPoint], held: SweepPoint) -> None:
    for spot, point in zip(spots, chosen, strict=True):
        if point.assessment is None:
            axes.annotate("failed", (spot, 0), rotation=90, ha="center", va="bottom", fontsize=7)
            continue
        inner, score = point.assessment.prpv_interval, point.assessment.prpv.value
        colour, label = (style.BLUE, HELD) if point is held else (style.LIGHT_BLUE, BESIDE)
        axes.bar(spot, score, width=0.85, color=colour, label=label)
        if inner.low is not None and inner.high is not None:
            ends = [[score - inner.low], [inner.high - score]]
            axes.errorbar(
                [spot], [score], yerr=ends, fmt="none", ecolor="0.2", elinewidth=1.0, capsize=2, label=INTERVAL
            )


HELD, INTERVAL = "held value", "95 % interval"
WIDEST = 20
"""Characters of a name that fit into the key."""


def draw_series(axes: Axes, series: Series, colour: str, marker: str, label: str = "", band: str = "") -> None:
    """A line through the scores, with its band of 95 % intervals, and names of both for a legend."""
    known = [(one.value, one.score) for one in series.estimates if one.score is not None]
    banded = [(one.value, *one.interval) for one in series.estimates if one.interval]
    if banded:
        places, lows, highs = np.array(banded).T
        axes.fill_between(places, lows, highs, color=colour, alpha=0.18, linewidth=0, label=band)
    values, scores = [value for value, _ in known], [score for _, score in known]
    axes.plot(values, scores, marker=marker, color=colour, ms=3, lw=1.2, label=label)


def draw_prpv_and_ppv(prpv: Axes, ppv: Axes, curve: SweepCurve) -> None:
    """PRPV over the values of a parameter, with the noise floor and chance, and PPV; both with their bands."""
    if found := [point.assessment for point in curve.points if point.assessment is not None]:
        draw_levels(prpv, found)
        series = {one.measure: one for one in series_of(curve)}
        draw_series(prpv, series[PRPV], style.BLUE, "o", "PRPV", INTERVAL)
        draw_series(ppv, series[PPV], style.BLUE, "o")


def draw_levels(axes: Axes, found: Sequence[Assessment]) -> None:
    """The noise floor by its kind, and chance: its mean, since it varies a little with the proxy's own order."""
    style.draw_noise_floor(axes, found[0].noise_floor)
    chance = float(np.mean([assessment.chance.mean for assessment in found]))
    axes.axhline(chance, color="0.45", linewidth=1.0, linestyle=":", label="chance")


def mark_values(axes: Axes, curve: SweepCurve, truth: Theta | None) -> None:
    """A line where the parameter is held when others are swept, a triangle at the top at the target's own value."""
    if curve.parameter in curve.base:
        axes.axvline(curve.base[curve.parameter], color="0.35", linewidth=0.9, linestyle=(0, (5, 2)), label=HELD)
    if truth is not None and curve.parameter in truth:
        style.mark_truth(axes, truth[curve.parameter])
    style.dress(axes)


def explain(axes: Axes, *panels: Axes) -> None:
    """Fill an empty panel with the key of others: each name once, the measure itself left to its axis."""
    axes.set_axis_off()
    named = style.named_handles(panels)
    named.pop("PRPV", None)
    names = [fill(name, WIDEST) for name in named]
    axes.legend(list(named.values()), names, loc="center", fontsize=7, frameon=False)


def axis_of(measure: Measure) -> str:
    """Name of a measure on an axis."""
    return with_unit(measure.name, measure.unit)


def label_of(curve: SweepCurve) -> str:
    """Name of a curve's parameter on an axis."""
    return curve.label.replace("_", " ")
