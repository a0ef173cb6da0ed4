"""The figure of a study of learning value: PLV of every proxy tried."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from proxytune.report.line_names import LineName, name_lines
from proxytune.report.style import BLUE, COLUMN, VERMILLION, dress, legend_below
from proxytune.teaching import PlvStudy, plv_or_worst

HIGHEST = LineName("highest\nso far", VERMILLION, 0.0)


def plv_figure(study: PlvStudy) -> Figure:
    """Draw PLV with its 95 % interval trial by trial, and the highest so far; crosses did not converge."""
    figure = Figure(figsize=(COLUMN, 2.7), layout="constrained")
    axes = figure.subplots()
    grid = study.without.counts[-1]
    for trial in study.trials:
        figures = trial.worth.plv
        if figures.value is None:
            axes.plot(trial.number, 0.0, "x", color="black", markersize=5, label="not converged")
            continue
        low, high = (end if end is not None else far for end, far in ((figures.low, -grid), (figures.high, grid)))
        axes.plot((trial.number, trial.number), (low, high), color=BLUE, linewidth=1.0, alpha=0.6)
        axes.plot(trial.number, figures.value, "o", color=BLUE, markersize=4, label="PLV")
    values = np.array([plv_or_worst(trial) for trial in study.trials])
    numbers = np.arange(1, len(values) + 1)
    highest = np.maximum.accumulate(values)
    reached = np.isfinite(highest)
    axes.step(numbers[reached], highest[reached], where="post", color=VERMILLION, linewidth=1.5, label=HIGHEST.words)
    axes.axhline(0.0, color="0.6", linewidth=0.8)
    axes.set_xlabel("trial", fontsize=8)
    axes.set_ylabel("PLV [target samples saved]", fontsize=8)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    dress(axes)
    if reached.any():
        name_lines(axes, [HIGHEST._replace(end=float(highest[-1]))])
    legend_below(figure, axes, without=[HIGHEST.words])
    return figure
