"""The profiles figure: what the target's scores leave of each parameter's range, and what they exclude."""

from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy.ndimage import gaussian_filter1d

from proxytune.arrays import Floats
from proxytune.report.numbers import span
from proxytune.report.style import BLUE, COLUMN, VERMILLION, dress, legend_below, with_unit
from proxytune.study import StudyResult

COLUMNS = 2
BINS = 60
"""Of a parameter's histogram, over the part of its range that counts."""
SMOOTH = 0.5
"""Of its standard deviation, divided by the fifth root of how many points count: what a histogram is smoothed by."""


def profiles_figure(result: StudyResult) -> Figure:
    """Draw how probable each value of each parameter is, given the target's scores, over the box that was searched.

    Grey is excluded: outside the 95 % interval, which is written above. The vertical line is the answer; the triangle
    is the θ that made the target, where that is known.
    """
    intervals = result.study.settings.space.intervals
    columns = min(COLUMNS, len(intervals))
    rows = ceil(len(intervals) / columns)
    figure = Figure(figsize=(COLUMN, 1.3 * rows + 0.45), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False)
    for place in range(len(intervals)):
        _panel(panels.ravel()[place], result, place)
    for axes in panels.ravel()[len(intervals) :]:
        axes.set_visible(False)
    for axes in panels[:, 0]:
        axes.set_ylabel("probability", fontsize=8)
    legend_below(figure, *panels.ravel()[: len(intervals)])
    return figure


def _panel(axes: Axes, result: StudyResult, place: int) -> None:
    box, learnt = result.study.settings.space.intervals[place], result.knowledge
    low, high = learnt.intervals[box.name]
    for ends in ((box.low, low), (high, box.high)):
        axes.axvspan(*ends, color="0.88", linewidth=0, label="excluded (95 %)")
    values, density = density_of(result, place)
    axes.fill_between(values, density, color=BLUE, alpha=0.35, linewidth=0)
    axes.plot(values, density, color=BLUE, linewidth=1.2)
    axes.axvline(result.best.trial.theta[box.name], color=VERMILLION, linewidth=1.2, label="answer")
    if result.truth is not None and box.name in result.truth:
        at_top = axes.get_xaxis_transform()
        (mark,) = axes.plot(result.truth[box.name], 1.0, "v", color="black", transform=at_top, label="truth")
        mark.set(markersize=5, clip_on=False, zorder=4)
    left = span((low, high))
    axes.set_title(f"unidentified: {left}" if box.name in learnt.unidentified else f"{left} remain", fontsize=7)
    axes.set_xlabel(with_unit(box.name, result.study.family.parameters[box.name].unit), fontsize=8)
    axes.set_xlim(box.low, box.high)
    axes.set_ylim(0.0, 1.08 * density.max())
    axes.xaxis.set_major_locator(MaxNLocator(3))
    axes.set_yticks([])
    dress(axes)


def density_of(result: StudyResult, place: int) -> tuple[Floats, Floats]:
    """Values of a parameter, and the density there: a smoothed histogram of the posterior's points.

    The density is per unit of the parameter; it is 0 where the posterior has no points at all.
    """
    box, posterior = result.study.settings.space.intervals[place], result.knowledge.posterior
    values = box.low + (box.high - box.low) * posterior.points[:, place]
    heights, edges = np.histogram(values, bins=BINS, weights=posterior.weights, density=True)
    # Mirrored at its ends: at an end of the box nothing leaks out of it.
    smooth = gaussian_filter1d(heights, _reach(values, posterior.weights) / (edges[1] - edges[0]), mode="reflect")
    centres = 0.5 * (edges[1:] + edges[:-1])
    places = np.concatenate([[box.low, edges[0]], centres, [edges[-1], box.high]])
    return places, np.concatenate([[0.0, smooth[0]], smooth, [smooth[-1], 0.0]])


def _reach(values: Floats, weights: Floats) -> float:
    """Over how much of its range a parameter's histogram is smoothed: the less, the more points count."""
    deviation = np.sqrt(weights @ (values - weights @ values) ** 2)
    return float(SMOOTH * deviation * (weights**2).sum() ** 0.2)
