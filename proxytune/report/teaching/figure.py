"""The figure of a learning experiment: score on the target against the number of target samples."""

from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.learning.plv import Curve
from proxytune.report.style import BLUE, COLUMN, GREY, dress, legend_below
from proxytune.teaching.experiment import Experiment, TeacherResult

COLUMNS = 2
GAP = 1.5
"""How far the zero-shot score stands from the first number of samples, which are one apart: it is no doubling."""
RESAMPLES = 1000
LEVELS = (2.5, 97.5)


def teach_figure(experiment: Experiment) -> Figure:
    """Draw the mean learning curve with each proxy against that without one, a panel each, with 95 % bands over seeds.

    Above the dashed line a learner counts as converged; the point at 0 target samples is the zero-shot score.
    """
    lessons = experiment.teachers
    columns = min(COLUMNS, len(lessons))
    rows = ceil(len(lessons) / columns)
    figure = Figure(figsize=(COLUMN, 1.25 * rows + 0.6), layout="constrained")
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for axes, lesson in zip(panels, lessons, strict=False):
        _panel(axes, experiment, lesson)
    for axes in panels[len(lessons) :]:
        axes.set_visible(False)
    for axes in panels[max(0, len(lessons) - columns) : len(lessons)]:
        # Also where the panel below, which would have them, is empty.
        axes.tick_params(labelbottom=True)
        axes.set_xlabel("target samples", fontsize=8)
    for axes in panels[: len(lessons) : columns]:
        axes.set_ylabel("score [s]", fontsize=8)
    legend_below(figure, *panels[: len(lessons)])
    return figure


def _panel(axes: Axes, experiment: Experiment, lesson: TeacherResult) -> None:
    _curve(axes, experiment.without, "without a proxy", (GREY, "--", "x"))
    _curve(axes, lesson.curve, "with the proxy", (BLUE, "-", "o"))
    axes.axhline(experiment.when.threshold, color="0.3", linewidth=0.8, linestyle=":", label="converged")
    counts = experiment.without.counts
    shown = range(len(counts)) if len(counts) <= 4 else sorted({0, 1, (len(counts) + 1) // 2, len(counts) - 1})
    places = places_of(experiment.without)
    axes.set_xticks([places[place] for place in shown], [f"{counts[place]:g}" for place in shown])
    axes.set_title(lesson.name, fontsize=8)
    dress(axes)
    # The axis is broken there: 0 is no halving of the first number.
    axes.text(GAP / 2, 0.0, "//", transform=axes.get_xaxis_transform(), fontsize=7, ha="center", va="center", zorder=5)


def places_of(curve: Curve) -> list[float]:
    """Where each count stands on the axis: side by side, the zero-shot score apart."""
    return [0.0, *(GAP + place for place in range(len(curve.counts) - 1))]


def _curve(axes: Axes, curve: Curve, name: str, look: tuple[str, str, str]) -> None:
    colour, style, mark = look
    rows = np.random.default_rng(0).integers(0, len(curve.scores), (RESAMPLES, len(curve.scores)))
    low, high = np.percentile(curve.scores[rows].mean(axis=1), LEVELS, axis=0)
    places = np.array(places_of(curve))
    axes.fill_between(places[1:], low[1:], high[1:], color=colour, alpha=0.18, linewidth=0)
    axes.plot(places[1:], curve.mean[1:], style, color=colour, marker=mark, markersize=3, linewidth=1.2, label=name)
    if np.isfinite(curve.mean[0]):
        axes.vlines(places[0], low[0], high[0], color=colour, alpha=0.35, linewidth=2.5)
        axes.plot(places[:1], curve.mean[:1], mark, color=colour, markersize=3)
