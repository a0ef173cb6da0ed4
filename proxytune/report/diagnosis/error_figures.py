"""Figures of how far predictions stray from what was measured: by length, over time, over the floor."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import Collection, LineCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from scipy.stats import binned_statistic_2d

from proxytune.diagnosis import Diagnosis, Drives, Floats, Whole, cut, pose_errors
from proxytune.report import figure_style as style
from proxytune.report.wording import plain

DECLARED_MODEL = "declared model"
LONGEST = 45
"""Characters of added effects that are named one by one."""


def extended_name(diagnosis: Diagnosis) -> str:
    """The extended model's name in a legend."""
    return with_effects([effect.effect for effect in diagnosis.effects])


def with_effects(effects: Sequence[str]) -> str:
    """The name of a model with these effects added."""
    names = ", ".join(map(plain, effects))
    return f"with {names}" if len(names) < LONGEST else f"with {len(effects)} effects added"


def error_figure(diagnosis: Diagnosis) -> Figure:
    """Draw errors of position and heading by horizon with 95 % intervals, on logarithmic axes, over the noise floor."""
    figure, ((place, heading),) = style.grid_of(2.6, 1, 2)
    errors, spots = diagnosis.errors, np.arange(len(diagnosis.errors))
    positions = [[error.before for error in errors], [error.after for error in errors]]
    headings = [[error.heading_before for error in errors], [error.heading_after for error in errors]]
    brackets = [(1e3 * error.floor.lower, 1e3 * error.floor.upper) for error in errors]
    level = [(np.degrees(error.heading_floor),) * 2 for error in errors]
    models = [(DECLARED_MODEL, style.VERMILLION, "o", -0.1), (extended_name(diagnosis), style.BLUE, "s", 0.1)]
    for axes, factor, both, floors in ((place, 1e3, positions, brackets), (heading, 180.0 / np.pi, headings, level)):
        for rms_errors, model in zip(both, models[: 2 if diagnosis.effects else 1], strict=False):
            name, colour, marker, shift = model
            values = factor * np.array([one.value for one in rms_errors])
            ends = factor * np.array([one.interval for one in rms_errors])
            ends = np.where(np.isfinite(ends).all(axis=1, keepdims=True), ends, values[:, None])
            arms = np.maximum(0.0, np.stack((values - ends[:, 0], ends[:, 1] - values)))
            axes.errorbar(spots + shift, values, arms, fmt=marker, color=colour, ms=4, capsize=2, lw=1.0, label=name)
        # A bar from the lower to the upper end, a line at the lower.
        lower, heights = [low for low, _ in floors], [high - low for low, high in floors]
        axes.bar(spots, heights, 0.5, lower, color=style.GREEN, alpha=0.2, zorder=0)
        name = "noise floor: poses alone, to upper end"
        axes.hlines(lower, spots - 0.25, spots + 0.25, color=style.GREEN, lw=1.4, label=name)
        # Small errors are seen beside large ones, and the floor off the axis' end.
        axes.use_sticky_edges = False
        axes.margins(y=0.08)
        axes.set_yscale("log", nonpositive="clip")
        style.write_plain(axes.yaxis)
        axes.set_xticks(range(len(errors)), [f"{error.horizon_s:g}" for error in errors])
        axes.set_xlim(-0.5, len(errors) - 0.5)
        style.dress(axes, "prediction length [s]")
    place.set_ylabel("position error, RMS [mm]", fontsize=8)
    heading.set_ylabel("heading error, RMS [deg]", fontsize=8)
    style.legend_below(figure, place)
    return figure


HORIZON_S = 2.0
"""Length of the windows [s], where drives last so long; else the nearest at which an error is told."""
FEW_WINDOWS = 3
"""With fewer windows at a time than this, each episode has a line of its own."""
TIMES = 60
"""No more times than this along a curve of medians."""
SHORT_TIMES = 10
"""Times within episodes that are hardly longer than a window."""
MANY_WINDOWS = 400
"""More windows than this would hide each other on a map: the floor is cut into squares."""
WIDE = 1.6
"""Floors longer in x than so many times their length in y are drawn above each other."""
TITLE = 26
"""Characters in a line above a map."""
TALLEST = 3.0
"""Height of a map at most [inch]."""
TINIEST_MM = 1e-3
"""Distances below this are drawn as this."""
BEFORE_END = 4
"""The direction at the end of a path is that of so many poses."""
SQUARES = 60
"""So many squares along the longer side of the floor."""


class Strayed(NamedTuple):
    """Distances of predicted poses (M,) from the measured ones, and their root mean square over each window (W,) [mm].

    Each pose is in a window of so many seconds, and ends an increment (M,).
    """

    horizon_s: float
    window: Whole
    increment: Whole
    distance: Floats
    rms: Floats


def strayed(diagnosis: Diagnosis) -> dict[str, Strayed]:
    """Distances of models' predictions on the tested drives, by name in a legend; one model if nothing is added."""
    tested, found = diagnosis.parts.tested, diagnosis.found
    models = {DECLARED_MODEL: found.declared.theta}
    if diagnosis.effects:
        models[extended_name(diagnosis)] = found.model.theta
    horizon = min((error.horizon_s for error in diagnosis.errors), key=lambda length: abs(length - HORIZON_S))
    windows = cut(tested, horizon)
    both = {}
    for name, theta in models.items():
        distance = 1e3 * pose_errors(tested, dict(theta), windows)[:, 0]
        rms = np.sqrt(np.bincount(windows.window, distance**2) / np.bincount(windows.window))
        both[name] = Strayed(horizon, windows.window, windows.increment, distance, rms)
    return both


def residual_over_time(drives: Drives, both: Mapping[str, Strayed]) -> Figure:
    """Median and band where there are enough windows at a time, else a line per episode."""
    figure, axes = style.one_panel(2.4)
    for (name, one), colour, width in zip(both.items(), (style.VERMILLION, style.BLUE), (2.0, 1.2), strict=False):
        for number, (times, distance) in enumerate(_lines(axes, drives, one, colour)):
            axes.plot(times, distance, color=colour, lw=width, label=name if number == 0 else None)
    axes.set_ylim(bottom=0.0)
    # Why the axis does not begin at the start, where no drive is measured in the first quarter of the time.
    begins_late = drives.first.min() > 0.25 * drives.last.max()
    late = "\nlater part of each drive: the first was fitted" if begins_late else ""
    style.dress(axes, f"time in the episode [s]{late}", f"distance to prediction\nin {one.horizon_s:g}-s windows [mm]")
    style.legend_below(figure, axes)
    return figure


def _lines(axes: Axes, drives: Drives, strayed: Strayed, colour: str) -> list[tuple[Floats, Floats]]:
    """Times [s] and distances [mm]: the median after its band is drawn, or those of each episode.

    They are of windows, or of poses where episodes last hardly longer than a window.
    """
    times, distance = drives.last[strayed.increment] / drives.tick_hz, strayed.distance
    episode = drives.episode[strayed.increment]
    if times.max() >= 2.0 * strayed.horizon_s:
        first = np.flatnonzero(np.diff(strayed.window, prepend=-1))
        begins, ends = drives.first[strayed.increment][first] / drives.tick_hz, np.maximum.reduceat(times, first)
        times, distance, episode = (begins + ends) / 2.0, strayed.rms, episode[first]
    # Steps of a window's length, longer where that were too many, shorter where all is within two windows
    span = float(np.ptp(times))
    step = max(strayed.horizon_s, span / TIMES) if span > 2.0 * strayed.horizon_s else max(span / SHORT_TIMES, 1e-3)
    edges = np.arange(times.min() - step / 2.0, times.max() + step, step)
    place = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, len(edges) - 2)
    if np.median(np.bincount(place)) < FEW_WINDOWS:
        return [(times[episode == own], distance[episode == own]) for own in np.unique(episode)]
    taken = np.unique(place)
    low, middle, high = np.transpose([np.quantile(distance[place == one], (0.1, 0.5, 0.9)) for one in taken])
    centres = ((edges[:-1] + edges[1:]) / 2.0)[taken]
    axes.fill_between(centres, low, high, color=colour, alpha=0.18, linewidth=0)
    if not axes.get_legend_handles_labels()[1]:
        axes.fill_between([], [], color=style.LIGHT_GREY, linewidth=0, label="10 to 90 % round the median")
    return [(centres, middle)]


def residual_map(drives: Drives, both: Mapping[str, Strayed]) -> Figure:
    """The measured paths in the colours of the distance, or its mean by place where too many paths would overlap."""
    before = next(iter(both.values()))
    extent = np.ptp(drives.poses[before.increment, 1, :2], axis=0)
    # Maps stand above each other, where the floor is long, or side by side.
    across = 1 if len(both) > 1 and extent[0] > WIDE * extent[1] else len(both)
    tall = float(np.clip(extent[1] / max(extent[0], 1e-9), 0.4, 1.6)) * (style.COLUMN - 0.5) / across
    down = len(both) // across
    figure, grid = style.grid_of(min(tall, TALLEST) * down + 1.2, down, across, sharex=True, sharey=True)
    panels = list(grid.ravel())
    style.label_sides(grid, "x [m]", "y [m]")
    # From the smallest distances of any model to the largest of all, but for a few; at least a factor of ten
    low, high = np.quantile(np.concatenate([one.rms for one in both.values()]), (0.02, 0.98))
    high = max(float(high), TINIEST_MM)
    scale = LogNorm(max(min(float(low), high / 10.0), high / 1000.0), high)
    for axes, (name, one) in zip(panels, both.items(), strict=True):
        colours = (_paths if len(one.rms) <= MANY_WINDOWS else _floor)(axes, drives, one, scale)
        axes.set_title(textwrap.fill(name, TITLE), fontsize=7)
        axes.set_aspect("equal")
        style.dress(axes)
    bar = figure.colorbar(colours, ax=list(panels), location="bottom", extend="both", aspect=30)
    style.write_plain(bar.ax.xaxis)
    bar.set_label(f"distance to prediction in {before.horizon_s:g}-s windows [mm]", fontsize=8)
    bar.ax.tick_params(labelsize=7)
    return figure


def _paths(axes: Axes, drives: Drives, strayed: Strayed, scale: LogNorm) -> LineCollection:
    rows = np.split(strayed.increment, np.flatnonzero(np.diff(strayed.window)) + 1)
    lines = [np.concatenate((drives.poses[own[:1], 0, :2], drives.poses[own, 1, :2])) for own in rows]
    paths = LineCollection(lines, array=strayed.rms, cmap=style.SHADES, norm=scale, linewidths=1.2, capstyle="round")
    axes.add_collection(paths)
    axes.autoscale_view()
    # A small arrow at the end of every path that leads somewhere
    last = np.array([line[-1] for line in lines])
    along = np.array([line[-1] - line[max(0, len(line) - BEFORE_END)] for line in lines])
    length = np.hypot(*along.T)
    if length.max() > 0.0:
        ahead = along / np.where(length > 0.0, length, 1.0)[:, None]
        axes.quiver(
            *last.T, *ahead.T, pivot="mid", angles="xy", scale=40.0, width=0.004,
            headwidth=9.0, headlength=9.0, headaxislength=8.0, minlength=0.0, color="0.25", zorder=3,
        )  # fmt: skip
    return paths


def _floor(axes: Axes, drives: Drives, strayed: Strayed, scale: LogNorm) -> Collection:
    """The mean over squares of the floor."""
    places = drives.poses[strayed.increment, 1, :2]
    side = float(np.ptp(places, axis=0).max()) / SQUARES
    edges = [np.arange(along.min(), along.max() + 2.0 * side, side) for along in places.T]
    x, y = places.T
    mean = binned_statistic_2d(x, y, strayed.rms[strayed.window], bins=edges).statistic
    return axes.pcolormesh(*edges, mean.T, cmap=style.SHADES, norm=scale, rasterized=True)
