"""The figure of a learning experiment: score on the target against the number of target samples."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from proxytune.learning.plv import Curve
from proxytune.learning.settings import NONE
from proxytune.report.style import BLUE, GREEN, GREY, LIGHT_BLUE, ORANGE, PURPLE, VERMILLION, dress, legend_below
from proxytune.teaching.experiment import Experiment

LOOKS = (
    (BLUE, "-", "o"),
    (ORANGE, "--", "s"),
    (GREEN, "-.", "^"),
    (PURPLE, (0, (5, 1, 1, 1, 1, 1)), "D"),
    (VERMILLION, (0, (7, 1.5)), "v"),
    (LIGHT_BLUE, (0, (2, 1)), "P"),
)
"""Colour, line and mark of each proxy, in turn."""

RESAMPLES = 1000
LEVELS = (2.5, 97.5)


def teach_figure(experiment: Experiment) -> Figure:
    """Draw the mean learning curve with and without each proxy, with the 95 % band over seeds.

    Above the dashed line a learner counts as converged; 0 target samples are the zero-shot score.
    """
    figure = Figure(figsize=(5.2, 3.6), layout="constrained")
    axes = figure.subplots()
    _curve(axes, experiment.without, NONE, ("black", ":", "x"))
    for lesson, look in zip(experiment.teachers, LOOKS * len(experiment.teachers), strict=False):
        _curve(axes, lesson.curve, lesson.name, look)
    axes.axhline(experiment.when.threshold, color=GREY, linewidth=0.8, linestyle="--", label="converged")
    smallest = experiment.without.counts[1]
    axes.set_xscale("symlog", linthresh=smallest, linscale=0.5)
    axes.xaxis.set_major_locator(FixedLocator(experiment.without.counts))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlim(left=-0.15 * smallest)
    axes.set_xlabel("target samples", fontsize=8)
    axes.set_ylabel("score in the target [s]", fontsize=8)
    dress(axes)
    legend_below(figure, axes)
    return figure


def _curve(axes: Axes, curve: Curve, name: str, look: tuple[object, object, str]) -> None:
    colour, style, mark = look
    rows = np.random.default_rng(0).integers(0, len(curve.scores), (RESAMPLES, len(curve.scores)))
    low, high = np.percentile(curve.scores[rows].mean(axis=1), LEVELS, axis=0)
    axes.fill_between(curve.counts, low, high, color=colour, alpha=0.15, linewidth=0)
    (line,) = axes.plot(curve.counts, curve.mean, marker=mark, markersize=3.5, linewidth=1.4, label=name)
    line.set(color=colour, linestyle=style)
