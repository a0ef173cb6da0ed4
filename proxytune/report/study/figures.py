"""Figures of a study: how the answer improved, what is left of each parameter, where the trials were, what matters."""

from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter
from scipy.ndimage import gaussian_filter, gaussian_filter1d

from proxytune.arrays import Floats
from proxytune.report import figure_style as style
from proxytune.report.wording import fixed, plain, span, with_unit
from proxytune.study import PRPV, StudyResult

TWO_LINES = 0.14
"""Distance between names of two lines, as a share of the panel's height."""


def convergence_figure(result: StudyResult) -> Figure:
    """Draw PRPV, or another objective, of every trial and of the answer so far; at the ends nominal θ and answer."""
    figure, axes = style.one_panel(2.9)
    _draw_trials(axes, result)
    pairs = zip(result.trials, result.answers, strict=True)
    answers = [(trial.number, result.value_of(answer)) for trial, answer in pairs if answer is not None]
    # Where fresh episodes chose another answer in the end, the line ends at that one's.
    ends = [*answers, (result.trials[-1].number + 1, result.value_of(result.best.trial))]
    named = [style.LineName("answer\nso far", style.VERMILLION, ends[-1][1] or 0.0)]
    axes.step(*zip(*ends, strict=True), where="post", color=style.VERMILLION, linewidth=1.5, label=named[0].words)
    if result.study.objective == PRPV:
        fresh, nominal = result.expected, result.nominal.expected if result.nominal else None
        told = [(ends[-1][0], fresh, style.VERMILLION, "D", "answer, fresh episodes")] if fresh else []
        told += [(0, nominal, "black", "s", "simulator as it is")] if nominal else []
        for place, expected, colour, mark, name in told:
            value, low, high = expected.prpv.value
            look: dict[str, Any] = {"fmt": mark, "color": colour, "label": name, "ms": 5, "capsize": 2, "zorder": 4}
            axes.errorbar([place], [value], yerr=[[max(0.0, value - low)], [max(0.0, high - value)]], **look)
        chance, floor = result.judged.chance, result.floor
        named.append(style.LineName(f"chance\n{chance.mean:.1f}", style.GREY, chance.mean))
        axes.axhline(chance.mean, color=style.GREY, linewidth=1.0, linestyle=":", label=named[-1].words)
        level = style.LineName(f"{style.floor_name(floor)}\n{floor.value or 0.0:.1f}", style.GREEN, floor.value or 0.0)
        named += [level] if style.draw_noise_floor(axes, floor, level.words) else []
        axes.set_ylim(bottom=min(-0.4, -0.02 * axes.get_ylim()[1]))
        axes.yaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    style.dress(axes, "trial", _label(result))
    style.name_lines(axes, named, TWO_LINES)
    style.legend_below(figure, axes, without=[name.words for name in named])
    return figure


def _label(result: StudyResult) -> str:
    objective = result.study.objective
    return "PRPV [ordered pairs]" if objective == PRPV else objective.label


def _scores(result: StudyResult) -> list[float]:
    """The objective of every trial that has one; of those cut off it is an estimate."""
    return [result.study.objective.sign * trial.score for trial in result.trials if trial.score is not None]


def _draw_trials(axes: Axes, result: StudyResult) -> None:
    scored = [(trial.number, value) for trial in result.trials if (value := result.value_of(trial)) is not None]
    failed = [trial.number for trial in result.trials if trial.state == "failed"]
    bounds = [(trial.number, trial.bound) for trial in result.trials if trial.bound is not None]
    initial = result.study.settings.initial
    _draw_points(axes, [point for point in scored if point[0] <= initial], "white", "design")
    _draw_points(axes, [point for point in scored if point[0] > initial], style.BLUE, "proposed")
    if failed:
        axes.plot(failed, np.zeros(len(failed)), "x", color="black", markersize=4, label="failed")
    if bounds:
        axes.plot(*zip(*bounds, strict=True), "^", color=style.GREY, markersize=4, label="stopped early, at least")


def _draw_points(axes: Axes, points: list[tuple[int, float]], face: str, label: str) -> None:
    if points:
        numbers, scores = zip(*points, strict=True)
        axes.plot(numbers, scores, "o", color=style.BLUE, markerfacecolor=face, markersize=4, zorder=3, label=label)


BINS = 60
"""Bins of a parameter's histogram, over the part of its range that counts."""
SMOOTH_PROFILE = 0.5
"""Share of its standard deviation, divided by the fifth root of the points that count, that smooths a histogram."""


def profiles_figure(result: StudyResult) -> Figure:
    """Draw how probable each value of each parameter is, given the target's scores, over the box that was searched."""
    figure, panels = style.panel_grid(len(result.study.settings.space.intervals), 1.3, 0.45)
    for place, axes in enumerate(panels):
        _draw_profile(axes, result, place)
    for axes in panels[::2]:
        axes.set_ylabel("probability", fontsize=8)
    style.legend_below(figure, *panels)
    return figure


def _draw_profile(axes: Axes, result: StudyResult, place: int) -> None:
    box, learnt = result.study.settings.space.intervals[place], result.knowledge
    low, high = learnt.intervals[box.name]
    for ends in ((box.low, low), (high, box.high)):
        axes.axvspan(*ends, color=style.LIGHT_GREY, linewidth=0, label="excluded (95 %)")
    values, density = density_of(result, place)
    axes.fill_between(values, density, color=style.BLUE, alpha=0.35, linewidth=0)
    axes.plot(values, density, color=style.BLUE, linewidth=1.2)
    axes.axvline(result.best.trial.theta[box.name], color=style.VERMILLION, linewidth=1.2, label="answer")
    if result.truth is not None and box.name in result.truth:
        style.mark_truth(axes, result.truth[box.name])
    left = span((low, high))
    axes.set_title(f"unidentified: {left}" if box.name in learnt.unidentified else f"{left} remain", fontsize=7)
    axes.set_xlim(box.low, box.high)
    axes.set_ylim(0.0, 1.08 * density.max())
    axes.xaxis.set_major_locator(MaxNLocator(3))
    axes.set_yticks([])
    style.dress(axes, with_unit(box.name, result.study.family.parameters[box.name].unit))


def density_of(result: StudyResult, place: int) -> tuple[Floats, Floats]:
    """Values of a parameter, and the density there: a smoothed histogram of the posterior's points.

    The density is per unit of the parameter; it is 0 where the posterior has no points at all.
    """
    box, posterior = result.study.settings.space.intervals[place], result.knowledge.posterior
    values = result.knowledge.values[:, place]
    heights, edges = np.histogram(values, bins=BINS, weights=posterior.weights, density=True)
    # The more points count, the less is smoothed.
    deviation = np.sqrt(posterior.weights @ (values - posterior.weights @ values) ** 2)
    reach = float(SMOOTH_PROFILE * deviation * (posterior.weights**2).sum() ** 0.2)
    # Mirrored at its ends: at an end of the box nothing leaks out of it.
    smooth = gaussian_filter1d(heights, reach / (edges[1] - edges[0]), mode="reflect")
    centres = 0.5 * (edges[1:] + edges[:-1])
    places = np.concatenate([[box.low, edges[0]], centres, [edges[-1], box.high]])
    return places, np.concatenate([[0.0, smooth[0]], smooth, [smooth[-1], 0.0]])


PANEL = 0.92
"""Width in inches of a pair's panel, at least."""
CELLS, SMOOTH_SHADOW, EDGE, RIM = (6, 30), 1.0, 0.2, 0.2
"""The region's shadow: fewest and most cells across it, how many it is smoothed over, the level at which its edge is
drawn, and how much of its width is left free round it."""
WIDEST = 18
"""Characters of a parameter's name that fit beside a panel; a longer one is broken."""
REGION = "95 % region"
MARKS = {"answer": (style.VERMILLION, "o", 8.0, "none"), "truth": ("black", "v", 4.5, "black")}
"""Colour, marker, size and filling."""


def evaluations_figure(result: StudyResult) -> Figure:
    """Draw where the trials went, a panel a pair, on the 95 % region's shadow; of one parameter its scores."""
    count = len(result.study.settings.space.intervals)
    cells = max(1, count - 1)
    columns = max(2, cells)
    width = max(style.COLUMN, PANEL * columns + 0.5)
    figure = Figure(figsize=(width, 0.9 * width * cells / columns + 0.25), layout="constrained")
    grid = figure.add_gridspec(cells, columns)
    scores = _scores(result)
    norm = Normalize(min(scores), max(scores))
    pairs = [(column, row) for row in range(1, count) for column in range(row)]
    for column, row in pairs:
        _pair(figure.add_subplot(grid[row - 1, column]), result, (column, row), norm)
    if not pairs:
        _single(figure.add_subplot(grid[0, 0]), result, norm)
    floor = ""
    if result.study.objective == PRPV and result.floor.value is not None:
        floor = f"\n{style.floor_name(result.floor)} {result.floor.value:.1f}"
    # The colours of the objective and what the marks are stand in the corner that the pairs leave free.
    panels, key = figure.axes[: len(pairs) or 1], figure.add_subplot(grid[0, 1:])
    key.set_axis_off()
    place = key.inset_axes((0.15, 0.8, 0.8, 0.08))
    bar = figure.colorbar(ScalarMappable(norm, style.SHADES), cax=place, orientation="horizontal")
    bar.ax.set_title(f"{_label(result)}{floor}", fontsize=7)
    bar.ax.tick_params(labelsize=7)
    named = style.named_handles(panels)
    look: dict[str, Any] = {"loc": "upper center", "fontsize": 7, "frameon": False}
    key.legend(list(named.values()), list(named), bbox_to_anchor=(0.55, 0.62), **look)
    return figure


def _single(axes: Axes, result: StudyResult, norm: Normalize) -> None:
    """The objective over the range of a single parameter, on its 95 % interval."""
    objective, (box,) = result.study.objective, result.study.settings.space.intervals
    look: dict[str, Any] = {"color": style.LIGHT_BLUE, "alpha": 0.35, "linewidth": 0, "label": REGION}
    axes.axvspan(*result.knowledge.intervals[box.name], **look)
    points = np.array([[trial.theta[box.name], objective.sign * (trial.score or 0.0)] for trial in result.trials])
    _scatter_trials(axes, result, points, norm)
    _mark(axes, [result.best.trial.theta[box.name], result.value_of(result.best.trial) or 0.0], "answer")
    if objective == PRPV and result.truth is not None and box.name in result.truth:
        _mark(axes, [result.truth[box.name], 0.0], "truth")
    axes.set_xlim(box.low, box.high)
    style.dress(axes, with_unit(box.name, result.study.family.parameters[box.name].unit), _label(result))


def _pair(axes: Axes, result: StudyResult, places: tuple[int, int], norm: Normalize) -> None:
    """The shadow of the region, the trials on it, then the answer and the truth; limits of the box."""
    intervals = result.study.settings.space.intervals
    _shadow(axes, result, places)
    points = np.array([[trial.theta[intervals[place].name] for place in places] for trial in result.trials])
    _scatter_trials(axes, result, points, norm)
    _mark(axes, [result.best.trial.theta[intervals[place].name] for place in places], "answer")
    if result.truth is not None and {intervals[place].name for place in places} <= set(result.truth):
        _mark(axes, [result.truth[intervals[place].name] for place in places], "truth")
    across, up = (intervals[place] for place in places)
    for *both, correlation in result.knowledge.trades:
        if set(both) == {across.name, up.name}:
            axes.set_title(f"trade off: {fixed(correlation, 1)}", fontsize=7, pad=2)
    axes.set_xlim(across.low, across.high)
    axes.set_ylim(up.low, up.high)
    # Names and figures only at the left and the bottom; three figures a side, which is what fits
    units = result.study.family.parameters
    style.dress(axes)
    axes.xaxis.set_major_locator(MaxNLocator(2))
    axes.yaxis.set_major_locator(MaxNLocator(3))
    if places[1] == len(intervals) - 1:
        axes.set_xlabel(fill(with_unit(across.name, units[across.name].unit), WIDEST), fontsize=7)
    else:
        axes.set_xticklabels([])
    if places[0] == 0:
        axes.set_ylabel(fill(with_unit(up.name, units[up.name].unit), WIDEST), fontsize=7)
    else:
        axes.set_yticklabels([])


def _scatter_trials(axes: Axes, result: StudyResult, points: Floats, norm: Normalize) -> None:
    scored = np.array([trial.score is not None for trial in result.trials])
    (across, up), scores = points[scored].T, _scores(result)
    axes.scatter(across, up, c=scores, cmap=style.SHADES, norm=norm, s=14, linewidths=0, clip_on=False, zorder=2)
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
    """Draw where the 95 % region lies, whatever the other parameters are."""
    intervals, learnt = result.study.settings.space.intervals, result.knowledge
    inside = learnt.values[learnt.posterior.inside][:, places]
    low, high = inside.min(axis=0), inside.max(axis=0)
    ends = np.transpose([(intervals[place].low, intervals[place].high) for place in places])
    rim = RIM * (high - low) + 0.01 * (ends[1] - ends[0])
    low, high = np.maximum(ends[0], low - rim), np.minimum(ends[1], high + rim)
    cells = int(np.clip(1.5 * np.sqrt(len(inside)), *CELLS))
    edges = [np.linspace(low[side], high[side], cells + 1) for side in (0, 1)]
    counts, _, _ = np.histogram2d(inside[:, 0], inside[:, 1], bins=edges)
    smooth = np.pad(gaussian_filter(np.minimum(counts, 1.0), SMOOTH_SHADOW, mode="nearest"), 1, mode="edge")
    smooth /= smooth.max()
    across, up = (np.concatenate([e[:1], 0.5 * (e[1:] + e[:-1]), e[-1:]]) for e in edges)
    axes.contourf(across, up, smooth.T, levels=[EDGE, 2.0], colors=[style.LIGHT_BLUE], alpha=0.35, zorder=0)
    axes.fill_between([], [], color=style.LIGHT_BLUE, alpha=0.35, linewidth=0, label=REGION)


def importance_figure(result: StudyResult) -> Figure:
    """Draw each parameter's share in the objective's variance over the box with its 95 % interval, largest first."""
    ordered = sorted(result.importances, key=lambda one: one.share)
    figure, axes = style.one_panel(1.1 + 0.25 * len(ordered))
    places = np.arange(len(ordered))
    shares, alone = (np.array([getattr(one, name) for one in ordered]) for name in ("share", "alone"))
    reach = np.abs(np.array([one.interval for one in ordered]).T - shares)
    axes.errorbar(shares, places, xerr=reach, fmt="none", ecolor=style.BLUE, lw=1.0, capsize=2, label="95 % interval")
    axes.plot(shares, places, "o", color=style.BLUE, markersize=5, label="alone or with others")
    axes.plot(alone, places, "|", color="black", markersize=5, markeredgewidth=1.4, label="alone")
    axes.set_yticks(places, [plain(one.name) for one in ordered])
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(-0.6, len(ordered) - 0.4)
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    style.dress(axes, f"share in the variance of {result.study.objective.label} over the box")
    style.legend_below(figure, axes)
    return figure


def study_figures(result: StudyResult) -> dict[str, Figure]:
    """Convergence, profiles, evaluations and importance, by name; without trials only what needs none."""
    drawn = {"convergence": convergence_figure, "profiles": profiles_figure}
    drawn |= {"evaluations": evaluations_figure, "importance": importance_figure}
    return {name: draw(result) for name, draw in drawn.items() if result.trials or name in ("profiles", "importance")}
