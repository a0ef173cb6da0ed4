"""The figure of PRPV at a lower, the held and a higher value of each parameter."""

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.report.numbers import short
from proxytune.report.style import BLUE, COLUMN, LIGHT_BLUE, dress, legend_below
from proxytune.report.sweep.lines import HELD, INTERVAL, axis_of, draw_levels, label_of
from proxytune.sweep import Curve, SweepPoint
from proxytune.usefulness import PRPV

BESIDE = "lower and higher value"
SIDE = 1 / 3
"""The bars stand at the held value and so much of the parameter's box to either side."""
APART = 4.0
"""From one parameter's bars to the next one's."""
CHARACTERS = 50
"""That fit across the figure."""


def bars_figure(curves: Sequence[Curve]) -> Figure:
    """Draw PRPV at three values of each parameter, its bootstrap interval, and the noise floor by its kind.

    The values are where the parameter is held, and the grid points nearest to a third of its range below and above;
    the held one is darker.
    """
    figure = Figure(figsize=(COLUMN, 2.9), layout="constrained")
    axes = figure.subplots()
    ticks: list[tuple[float, str]] = []
    for place, curve in enumerate(curves):
        indices, held = bar_points(curve)
        chosen = [curve.points[index] for index in indices]
        spots = [place * APART + offset for offset in range(len(chosen))]
        ticks += [(spot, short(point.value)) for spot, point in zip(spots, chosen, strict=True)]
        _bars(axes, spots, chosen, curve.points[held])
        name = fill(label_of(curve), max(5, CHARACTERS // len(curves)))
        axes.text(
            (spots[0] + spots[-1]) / 2, 1.02, name, transform=axes.get_xaxis_transform(),
            ha="center", va="bottom", fontsize=7,
        )  # fmt: skip
    found = [point.assessment for curve in curves for point in curve.points if point.assessment is not None]
    if found:
        draw_levels(axes, found)
        legend_below(figure, axes)
    dress(axes)
    axes.set_xticks([spot for spot, _ in ticks], [text for _, text in ticks], rotation=90)
    axes.set_ylabel(axis_of(PRPV), fontsize=8)
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
