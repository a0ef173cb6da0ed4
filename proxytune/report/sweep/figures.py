"""The figures of a sweep: all measures along one parameter, an overview of several, and the bars of PRPV."""

from collections.abc import Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.report.style import BLUE, GREEN, LIGHT_BLUE, ORANGE, PURPLE, VERMILLION, dress, floor_name, with_unit
from proxytune.sweep.curves import Series, series_of
from proxytune.sweep.sweep import Curve, SweepPoint
from proxytune.usefulness import Assessment, Measure
from proxytune.usefulness.catalogue import POD_IMAGE, POD_POSE, PPV, PRPV, SRCC

COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE)
MARKERS = "osD^v"
PANEL = (2.6, 2.0)
HELD, BESIDE = "held value", "lower and higher value"
INTERVAL = "95 % interval"
SIDE = 1 / 3
"""The bars stand at the held value and so much of the parameter's box to either side."""


def sweep_figure(curves: Sequence[Curve]) -> Figure:
    """Draw PRPV above PPV, one column per parameter, bootstrap intervals as bands; lower is better in both.

    A dashed line with its band is the noise floor, or the target's halves where there is no better, a dotted one
    chance; a thin vertical line is where the parameter itself is held when others are swept.
    """
    width, height = PANEL
    figure = Figure(figsize=(max(3.4, width * len(curves) + 0.4), 2 * height + 0.5), layout="constrained")
    panels = figure.subplots(2, len(curves), sharex="col", sharey="row", squeeze=False)
    for column, curve in enumerate(curves):
        upper, lower = panels[:, column]
        points = [(point.value, point.assessment) for point in curve.points if point.assessment is not None]
        _prpv(upper, points)
        _ppv(lower, points)
        lower.set_xlabel(_label(curve), fontsize=8)
        for axes in (upper, lower):
            _dress(axes, curve)
    # Only now: a limit set earlier would hide what later columns of the shared axis hold.
    for axes in panels[:, 0]:
        axes.set_ylim(bottom=-0.03 * axes.get_ylim()[1])
    panels[0, 0].set_ylabel(_axis(PRPV), fontsize=8)
    panels[1, 0].set_ylabel(_axis(PPV), fontsize=8)
    _explain(figure, panels[0, 0])
    return figure


def panels_figure(curve: Curve) -> Figure:
    """Draw PRPV, PPV, SRCC and, where it was asked for, POD along one parameter, as the paper's figure does.

    Bands are 95 % bootstrap intervals; the thin vertical line is where the parameter is held when others are swept,
    which is the truth where that is known.
    """
    series = series_of(curve)
    rows, columns = (2, 2) if curve.has_pod else (1, 3)
    figure = Figure(figsize=(PANEL[0] * columns + 0.4, PANEL[1] * rows + 0.4), layout="constrained")
    panels = figure.subplots(rows, columns, sharex=True).ravel()
    points = [(point.value, point.assessment) for point in curve.points if point.assessment is not None]
    _prpv(panels[0], points)
    _ppv(panels[1], points)
    _srcc(panels[2], series)
    for axes, measure in zip(panels, (PRPV, PPV, SRCC), strict=False):
        axes.set_ylabel(_axis(measure), fontsize=8)
    if curve.has_pod:
        _pod(panels[3], series)
    for axes in panels:
        _dress(axes, curve)
    for axes in panels[-columns:]:
        axes.set_xlabel(_label(curve), fontsize=8)
    for axes in panels[:2]:
        axes.set_ylim(bottom=-0.03 * axes.get_ylim()[1])
    _explain(figure, panels[0])
    return figure


def bars_figure(curves: Sequence[Curve]) -> Figure:
    """Draw PRPV at three values of each parameter, its bootstrap interval, and the noise floor by its kind.

    The values are where the parameter is held, and the grid points nearest to a third of its range below and above;
    the held one is darker.
    """
    figure = Figure(figsize=(max(3.4, 1.1 * len(curves) + 1.0), 2.8), layout="constrained")
    axes = figure.subplots()
    ticks: list[tuple[float, str]] = []
    for place, curve in enumerate(curves):
        indices, held = bar_points(curve)
        chosen = [curve.points[index] for index in indices]
        spots = [place * 4.0 + offset for offset in range(len(chosen))]
        ticks += [(spot, f"{point.value:.3g}".replace("-", "−")) for spot, point in zip(spots, chosen, strict=True)]
        _bars(axes, spots, chosen, curve.points[held])
        centre = (spots[0] + spots[-1]) / 2
        axes.annotate(
            _label(curve).replace(" [", "\n["),
            (centre, 0), xytext=(0, -20), xycoords=("data", "axes fraction"), textcoords="offset points",
            ha="center", va="top", fontsize=8,
        )  # fmt: skip
    found = [point.assessment for curve in curves for point in curve.points if point.assessment is not None]
    if found:
        _levels(axes, found)
        _explain(figure, axes)
    axes.set_xticks([spot for spot, _ in ticks], [text for _, text in ticks])
    axes.set_xlabel(" \n ", fontsize=8)
    axes.set_ylabel(_axis(PRPV), fontsize=8)
    dress(axes)
    return figure


def bar_points(curve: Curve) -> tuple[list[int], int]:
    """Which points of a curve stand for low, held and high, fewer where the held value is at an end; and the held one.

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


def _bars(axes: Axes, spots: Sequence[float], chosen: Sequence[SweepPoint], held: SweepPoint) -> None:
    for spot, point in zip(spots, chosen, strict=True):
        if point.assessment is None:
            axes.annotate("failed", (spot, 0), rotation=90, ha="center", va="bottom", fontsize=6)
            continue
        inner, score = point.assessment.prpv_interval, point.assessment.prpv.value
        colour, label = (BLUE, HELD) if point is held else (LIGHT_BLUE, BESIDE)
        axes.bar(spot, score, width=0.85, color=colour, label=label)
        if inner.low is not None and inner.high is not None:
            ends = [[score - inner.low], [inner.high - score]]
            axes.errorbar(
                [spot], [score], yerr=ends, fmt="none", ecolor="0.2", elinewidth=1.0, capsize=2, label=INTERVAL
            )


def _srcc(axes: Axes, series: Sequence[Series]) -> None:
    chosen = [one for one in series if one.measure is SRCC]
    for one, colour, marker in zip(chosen, cycle(COLOURS), cycle(MARKERS), strict=False):
        _line(axes, one, colour, marker, one.metric.replace("_", " "))
    axes.legend(fontsize=6, frameon=False)


def _pod(axes: Axes, series: Sequence[Series]) -> None:
    """Pose on the left axis, image on the right, each in the colour of its axis."""
    by_measure = {one.measure: one for one in series}
    right = axes.twinx()
    for one, panel, colour, marker, name in (
        (by_measure[POD_POSE], axes, BLUE, "o", "POD, pose [m]"),
        (by_measure[POD_IMAGE], right, VERMILLION, "s", "POD, image [of full scale]"),
    ):
        _line(panel, one, colour, marker, name)
        panel.set_ylabel(name, fontsize=8, color=colour)
        panel.tick_params(axis="y", labelsize=7, colors=colour)
        panel.set_ylim(bottom=min(0.0, -0.03 * panel.get_ylim()[1]))
    right.spines["top"].set_visible(False)


def _line(axes: Axes, series: Series, colour: str, marker: str, label: str) -> None:
    known = [(one.value, one.score) for one in series.estimates if one.score is not None]
    banded = [(one.value, *one.interval) for one in series.estimates if one.interval]
    if banded:
        places, lows, highs = np.array(banded).T
        axes.fill_between(places, lows, highs, color=colour, alpha=0.18, linewidth=0)
    values, scores = [value for value, _ in known], [score for _, score in known]
    axes.plot(values, scores, marker=marker, color=colour, ms=3, lw=1.2, label=label)


def _prpv(axes: Axes, points: Sequence[tuple[float, Assessment]]) -> None:
    values = [value for value, _ in points]
    found = [assessment for _, assessment in points]
    if not found:
        return
    _levels(axes, found)
    inner = [assessment.prpv_interval for assessment in found]
    if all(one.low is not None for one in inner):
        lows, highs = [one.low or 0.0 for one in inner], [one.high or 0.0 for one in inner]
        axes.fill_between(values, lows, highs, color=BLUE, alpha=0.18, linewidth=0, label=INTERVAL)
    scores = [assessment.prpv.value for assessment in found]
    axes.plot(values, scores, "o-", color=BLUE, markersize=3, linewidth=1.2, label="PRPV")


def _ppv(axes: Axes, points: Sequence[tuple[float, Assessment]]) -> None:
    known = [(value, found.ppv.value) for value, found in points if found.ppv.value is not None]
    banded = [(value, *found.intervals.ppv) for value, found in points if found.intervals and found.intervals.ppv]
    if banded:
        values, lows, highs = np.array(banded).T
        axes.fill_between(values, lows, highs, color=BLUE, alpha=0.18, linewidth=0)
    axes.plot([value for value, _ in known], [score for _, score in known], "o-", color=BLUE, ms=3, lw=1.2)


def _levels(axes: Axes, found: Sequence[Assessment]) -> None:
    """The noise floor by its kind, and chance: its mean, since it varies a little with the proxy's own order."""
    floor = found[0].noise_floor
    if floor.value is not None and floor.low is not None and floor.high is not None:
        axes.axhspan(floor.low, floor.high, color=GREEN, alpha=0.15, linewidth=0)
        axes.axhline(floor.value, color=GREEN, linewidth=1.0, linestyle="--", label=floor_name(floor))
    chance = float(np.mean([assessment.chance.mean for assessment in found]))
    axes.axhline(chance, color="0.45", linewidth=1.0, linestyle=":", label="chance")


def _dress(axes: Axes, curve: Curve) -> None:
    if curve.parameter in curve.base:
        axes.axvline(curve.base[curve.parameter], color="0.6", linewidth=0.8, label=HELD)
    dress(axes)


def _explain(figure: Figure, axes: Axes) -> None:
    """One legend below the figure: each label once, the measure itself left to its axis."""
    by_label = {label: handle for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    by_label.pop("PRPV", None)
    columns = 2 if figure.get_figwidth() < 5 else 4 if len(by_label) <= 4 else 3
    figure.legend(
        list(by_label.values()), list(by_label), loc="outside lower center", ncols=columns, fontsize=7, frameon=False
    )


def _axis(measure: Measure) -> str:
    return with_unit(measure.name, measure.unit)


def _label(curve: Curve) -> str:
    return curve.label.replace("_", " ")
