"""The evaluations figure: where the trials went, and the region that the target's scores leave of the box."""

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy.ndimage import gaussian_filter

from proxytune.arrays import Floats
from proxytune.report.style import COLUMN, LIGHT_BLUE, VERMILLION, dress, floor_name, with_unit
from proxytune.study import StudyResult

PANEL = 0.92
"""Width in inches of a pair's panel, at least."""
COLOURS = "viridis"
CELLS, SMOOTH, EDGE, RIM = (6, 30), 1.0, 0.2, 0.2
"""The region's shadow: fewest and most cells across it, how many it is smoothed over, the level at which its edge is
drawn, and how much of its width is left free round it."""
WIDEST = 18
"""Characters of a parameter's name that fit beside a panel; a longer one is broken."""
REGION = "95 % region"
MARKS = {"answer": (VERMILLION, "o", 8.0, "none"), "truth": ("black", "v", 4.5, "black")}
"""Colour, marker, size and filling."""


def evaluations_figure(result: StudyResult) -> Figure:
    """Draw where the trials went, each pair of parameters in a panel, on the shadow of the 95 % region.

    A long, slanting shadow is a pair that makes up for each other. The darker a point, the lower its PRPV; an open one
    was cut off, and its PRPV is an estimate; crosses are trials that failed; the ring is the answer, the triangle the θ
    that made the target, where that is known. Of a single parameter, PRPV is drawn over its range.
    """
    count = len(result.study.settings.space.intervals)
    cells = max(1, count - 1)
    columns = max(2, cells)
    width = max(COLUMN, PANEL * columns + 0.5)
    figure = Figure(figsize=(width, 0.9 * width * cells / columns + 0.25), layout="constrained")
    grid = figure.add_gridspec(cells, columns)
    scores = [trial.score for trial in result.trials if trial.score is not None]
    norm = Normalize(min(scores), max(scores))
    pairs = [(column, row) for row in range(1, count) for column in range(row)]
    for column, row in pairs:
        _pair(figure.add_subplot(grid[row - 1, column]), result, (column, row), norm)
    if not pairs:
        _alone(figure.add_subplot(grid[0, 0]), result, norm)
    floor = "" if result.floor.value is None else f"\n{floor_name(result.floor)} {result.floor.value:.1f}"
    _key(figure.add_subplot(grid[0, 1:]), figure.axes[: len(pairs) or 1], norm, f"PRPV [ordered pairs]{floor}")
    return figure


def _pair(axes: Axes, result: StudyResult, places: tuple[int, int], norm: Normalize) -> None:
    """The shadow of the region, the trials on it, then the answer and the truth; limits of the box."""
    intervals = result.study.settings.space.intervals
    _shadow(axes, result, places)
    points = np.array([[trial.theta[intervals[place].name] for place in places] for trial in result.trials])
    _trials(axes, result, points, norm)
    _mark(axes, [result.best.trial.theta[intervals[place].name] for place in places], "answer")
    if result.truth is not None and {intervals[place].name for place in places} <= set(result.truth):
        _mark(axes, [result.truth[intervals[place].name] for place in places], "truth")
    across, up = (intervals[place] for place in places)
    axes.set_xlim(across.low, across.high)
    axes.set_ylim(up.low, up.high)
    _name(axes, result, places)


def _alone(axes: Axes, result: StudyResult, norm: Normalize) -> None:
    """PRPV of the trials over the range of a single parameter, on its 95 % interval."""
    (box,) = result.study.settings.space.intervals
    axes.axvspan(*result.knowledge.intervals[box.name], color=LIGHT_BLUE, alpha=0.35, linewidth=0, label=REGION)
    points = np.array([[trial.theta[box.name], trial.score or 0.0] for trial in result.trials])
    _trials(axes, result, points, norm)
    _mark(axes, [result.best.trial.theta[box.name], result.best.assessment.prpv.value], "answer")
    if result.truth is not None and box.name in result.truth:
        _mark(axes, [result.truth[box.name], 0.0], "truth")
    axes.set_xlim(box.low, box.high)
    axes.set_xlabel(with_unit(box.name, result.study.family.parameters[box.name].unit), fontsize=8)
    axes.set_ylabel("PRPV [ordered pairs]", fontsize=8)
    dress(axes)


def _trials(axes: Axes, result: StudyResult, points: Floats, norm: Normalize) -> None:
    scored = np.array([trial.score is not None for trial in result.trials])
    scores = [trial.score for trial in result.trials if trial.score is not None]
    across, up = points[scored].T
    axes.scatter(across, up, c=scores, cmap=COLOURS, norm=norm, s=14, linewidths=0, clip_on=False, zorder=2)
    cut = np.array([trial.state == "cut" for trial in result.trials])
    if cut.any():
        # Hollow: their colour is an estimate.
        across, up = points[cut & scored].T
        axes.scatter(across, up, color="white", s=4, linewidths=0, clip_on=False, zorder=3)
        axes.scatter([], [], facecolors="white", edgecolors="0.4", s=10, linewidths=1.2, label="stopped early")
    if not scored.all():
        across, up = points[~scored].T
        axes.scatter(across, up, marker="x", color="black", s=12, linewidths=0.8, clip_on=False, label="failed")


def _mark(axes: Axes, place: list[float], label: str) -> None:
    colour, marker, size, face = MARKS[label]
    axes.plot(*place, marker, color=colour, markersize=size, markerfacecolor=face, linestyle="none", label=label,
              clip_on=False, zorder=4)  # fmt: skip


def _shadow(axes: Axes, result: StudyResult, places: tuple[int, int]) -> None:
    """Where the 95 % region lies, whatever the other parameters are."""
    intervals, posterior = result.study.settings.space.intervals, result.knowledge.posterior
    inside = posterior.points[posterior.inside][:, places]
    low, high = inside.min(axis=0), inside.max(axis=0)
    rim = RIM * (high - low) + 0.01
    low, high = np.maximum(0.0, low - rim), np.minimum(1.0, high + rim)
    cells = int(np.clip(1.5 * np.sqrt(len(inside)), *CELLS))
    edges = [np.linspace(low[side], high[side], cells + 1) for side in (0, 1)]
    counts, _, _ = np.histogram2d(inside[:, 0], inside[:, 1], bins=edges)
    smooth = np.pad(gaussian_filter(np.minimum(counts, 1.0), SMOOTH, mode="nearest"), 1, mode="edge")
    smooth /= smooth.max()
    across, up = (
        intervals[place].low
        + (intervals[place].high - intervals[place].low) * np.concatenate([e[:1], 0.5 * (e[1:] + e[:-1]), e[-1:]])
        for place, e in zip(places, edges, strict=True)
    )
    axes.contourf(across, up, smooth.T, levels=[EDGE, 2.0], colors=[LIGHT_BLUE], alpha=0.35, zorder=0)
    axes.fill_between([], [], color=LIGHT_BLUE, alpha=0.35, linewidth=0, label=REGION)


def _name(axes: Axes, result: StudyResult, places: tuple[int, int]) -> None:
    """Names and figures only at the left and the bottom; three figures a side, which is what fits."""
    intervals, units = result.study.settings.space.intervals, result.study.family.parameters
    dress(axes)
    axes.xaxis.set_major_locator(MaxNLocator(2))
    axes.yaxis.set_major_locator(MaxNLocator(3))
    if places[1] == len(intervals) - 1:
        name = intervals[places[0]].name
        axes.set_xlabel(fill(with_unit(name, units[name].unit), WIDEST), fontsize=7)
    else:
        axes.set_xticklabels([])
    if places[0] == 0:
        name = intervals[places[1]].name
        axes.set_ylabel(fill(with_unit(name, units[name].unit), WIDEST), fontsize=7)
    else:
        axes.set_yticklabels([])


def _key(axes: Axes, panels: Sequence[Axes], norm: Normalize, title: str) -> None:
    """The colours of PRPV and what the marks are, in the corner that the pairs leave free."""
    axes.set_axis_off()
    bar = axes.figure.colorbar(
        ScalarMappable(norm, COLOURS), cax=axes.inset_axes((0.15, 0.8, 0.8, 0.08)), orientation="horizontal"
    )
    bar.ax.set_title(title, fontsize=7)
    bar.ax.tick_params(labelsize=7)
    named = {label: handle for one in panels for handle, label in zip(*one.get_legend_handles_labels(), strict=True)}
    axes.legend(
        list(named.values()), list(named), loc="upper center", bbox_to_anchor=(0.55, 0.62), fontsize=7, frameon=False
    )
