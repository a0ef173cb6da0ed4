"""The figure of a learning experiment: score on the target against the number of target samples."""

from math import ceil
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.arrays import Floats
from proxytune.learning import LEVELS, NONE, Estimate, places
from proxytune.report.style import BLUE, COLUMN, GREY, dress, legend_below
from proxytune.teaching import Experiment, TeacherResult, teaching_settings

COLUMNS = 2


class _Look(NamedTuple):
    label: str
    colour: str
    style: str
    mark: str


WITHOUT, WITH = _Look("without a proxy", GREY, "--", "x"), _Look("with the proxy", BLUE, "-", "o")


def teach_figure(experiment: Experiment) -> Figure:
    """Draw the learning curve with each proxy against that without one, a panel each, with 95 % bands.

    Above the dotted line a learner counts as converged; the bar on it says how many samples that takes.
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
    for name, look, height in ((NONE, WITHOUT, -1.2), (lesson.name, WITH, 1.2)):
        _curve(axes, experiment, name, look)
        if lesson.worth is not None:
            needed = lesson.worth.without if name == NONE else lesson.worth.needed
            _bar(axes, experiment, needed, look, height)
    axes.axhline(experiment.when.threshold, color="0.3", linewidth=0.8, linestyle=":", label="converged")
    grid = teaching_settings(experiment.settings).target_samples
    shown = [grid[place] for place in sorted({0, 1, (len(grid) + 1) // 2, len(grid) - 1})]
    axes.set_xticks(_places(experiment, np.array(shown, dtype=float)), [f"{count:g}" for count in shown])
    axes.set_title(lesson.name, fontsize=8)
    dress(axes)


def _places(experiment: Experiment, counts: Floats) -> Floats:
    """Where counts stand on the axis: as doublings, none at 0."""
    return places(counts, experiment.needs.draws.first)


def _curve(axes: Axes, experiment: Experiment, name: str, look: _Look) -> None:
    draws, curve = experiment.needs.draws, experiment.needs.curves[name]
    at, scores = _places(experiment, draws.counts), draws.scores[name]
    low, high = np.quantile(scores, LEVELS, axis=0)
    axes.fill_between(at, low, high, color=look.colour, alpha=0.18, linewidth=0)
    axes.plot(at, scores.mean(axis=0), look.style, color=look.colour, linewidth=1.2, label=look.label)
    examined = curve.examined
    places_ = _places(experiment, np.array(curve.counts, dtype=float))[examined[:, 1]]
    axes.plot(places_, curve.scores[tuple(examined.T)], look.mark, color=look.colour, markersize=2, alpha=0.35)


def _bar(axes: Axes, experiment: Experiment, needed: Estimate, look: _Look, height: float) -> None:
    """The interval of the samples needed, a little off the line of convergence so that two bars stay apart."""
    if needed.low is None:
        return
    ends = np.array([needed.low, experiment.needs.last if needed.high is None else needed.high])
    axes.hlines(experiment.when.threshold + height, *_places(experiment, ends), color=look.colour, linewidth=2.5)
