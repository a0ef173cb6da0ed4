"""What a study has learnt of its parameters: the profile of each, and where the trials went."""

from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from proxytune.report.style import BLUE, GREEN, ORANGE, VERMILLION, dress
from proxytune.search.profile import LEVEL, Profile
from proxytune.study.result import StudyResult

PANEL = (2.6, 2.1)
MOST_COLUMNS = 4
COLOURS = "viridis"


def profiles_figure(result: StudyResult) -> Figure:
    """Draw PRPV along each parameter as the surrogate has it.

    Solid: the others at their best (the profile), with the band within which the lowest fresh score may lie, whatever
    the others. Dashed: averaged over the others (partial dependence), with the band of its mean. Shaded: values not
    worse than the best, as far as is known; that is where the solid line's band reaches down to it.
    """
    columns = min(MOST_COLUMNS, len(result.profiles))
    rows = ceil(len(result.profiles) / columns)
    figure = Figure(figsize=(max(3.6, PANEL[0] * columns), PANEL[1] * rows + 0.5), layout="constrained")
    panels = figure.subplots(rows, columns, sharey=True, squeeze=False)
    for axes, profile in zip(panels.ravel(), result.profiles, strict=False):
        _profile(axes, profile, result)
    for axes in panels.ravel()[len(result.profiles) :]:
        axes.set_visible(False)
    for axes in panels[:, 0]:
        axes.set_ylabel("PRPV [ordered pairs]", fontsize=8)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(4, columns), fontsize=7, frameon=False)
    return figure


def _profile(axes: Axes, profile: Profile, result: StudyResult) -> None:
    low, high = profile.interval
    axes.axvspan(low, high, color=GREEN, alpha=0.12, linewidth=0, label="not worse")
    reach = LEVEL * profile.average_deviation
    for middle, band, colour, style, label in (
        (profile.average, (profile.average - reach, profile.average + reach), ORANGE, "--", "others averaged"),
        (profile.lowest, (profile.low, profile.high), BLUE, "-", "others at their best"),
    ):
        axes.fill_between(profile.values, *band, color=colour, alpha=0.18, linewidth=0)
        axes.plot(profile.values, middle, style, color=colour, linewidth=1.4, label=label)
    axes.plot(profile.best, profile.incumbent, "o", color=VERMILLION, markersize=5, label="best θ")
    axes.set_xlabel(_named(profile.name, result), fontsize=8)
    axes.set_title("unidentified" if profile.unidentified else "", fontsize=8, color="0.35")
    axes.set_xlim(profile.values[0], profile.values[-1])
    dress(axes)


def evaluations_figure(result: StudyResult) -> Figure:
    """Draw where the trials went: each pair of parameters below the diagonal, each parameter's histogram on it.

    The darker a point, the lower its PRPV, or its estimate where a trial was cut off; crosses are trials that failed;
    the ring is the best θ.
    """
    intervals = result.study.settings.space.intervals
    count = len(intervals)
    side = max(3.4, 1.5 * count + 0.7)
    figure = Figure(figsize=(side, side * 0.9), layout="constrained")
    panels = figure.subplots(count, count, squeeze=False)
    scores = [trial.score for trial in result.trials if trial.score is not None]
    norm = Normalize(min(scores), max(scores))
    for row in range(count):
        for column in range(count):
            axes = panels[row, column]
            axes.set_visible(column <= row)
            if column == row:
                _histogram(axes, result, row)
            elif column < row:
                _pair(axes, result, (column, row), norm)
            _dress(axes, result, (column, row))
    bar = figure.colorbar(ScalarMappable(norm, COLOURS), ax=panels, shrink=0.5, pad=0.02)
    bar.set_label("PRPV [ordered pairs]", fontsize=8)
    bar.ax.tick_params(labelsize=7)
    return figure


def _histogram(axes: Axes, result: StudyResult, place: int) -> None:
    interval = result.study.settings.space.intervals[place]
    values = [trial.theta[interval.name] for trial in result.trials]
    axes.hist(values, bins=10, range=(interval.low, interval.high), color="0.75")
    axes.axvline(result.best.trial.theta[interval.name], color=VERMILLION, linewidth=1.0)


def _pair(axes: Axes, result: StudyResult, places: tuple[int, int], norm: Normalize) -> None:
    names = [result.study.settings.space.names[place] for place in places]
    points = np.array([[trial.theta[name] for name in names] for trial in result.trials])
    scored = np.array([trial.score is not None for trial in result.trials])
    scores = [trial.score for trial in result.trials if trial.score is not None]
    across, up = points[scored].T
    axes.scatter(across, up, c=scores, cmap=COLOURS, norm=norm, s=14, linewidths=0, clip_on=False)
    across, up = points[~scored].T
    axes.scatter(across, up, marker="x", color=VERMILLION, s=12, linewidths=0.8, clip_on=False)
    best = [result.best.trial.theta[name] for name in names]
    axes.plot(*best, "o", color=VERMILLION, fillstyle="none", markersize=8, clip_on=False)


def _dress(axes: Axes, result: StudyResult, places: tuple[int, int]) -> None:
    """Limits of the box; names only at the left and the bottom."""
    intervals = result.study.settings.space.intervals
    across, up = (intervals[place] for place in places)
    axes.set_xlim(across.low, across.high)
    dress(axes)
    axes.tick_params(labelsize=6)
    if places[0] != places[1]:
        axes.set_ylim(up.low, up.high)
    else:
        axes.set_yticks([])
    if places[1] == len(intervals) - 1:
        axes.set_xlabel(_named(across.name, result), fontsize=8)
    else:
        axes.set_xticklabels([])
    if places[0] == 0 and places[1] > 0:
        axes.set_ylabel(_named(up.name, result), fontsize=8)
    elif places[0] != places[1]:
        axes.set_yticklabels([])


def _named(name: str, result: StudyResult) -> str:
    unit = result.study.family.parameters[name].unit
    return f"{name.replace('_', ' ')} [{unit}]" if unit else name.replace("_", " ")
