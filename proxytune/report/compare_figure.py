"""The figure of a comparison: how fast each engine gets near the optimum."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.report.style import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION, dress
from proxytune.search.comparison import Run
from proxytune.search.summary import median_curve

COLOURS = {
    "gp": BLUE,
    "composite": VERMILLION,
    "random": GREY,
    "sobol": ORANGE,
    "tpe": GREEN,
    "skopt": PURPLE,
}
STYLES = {
    "gp": "-",
    "composite": (0, (7, 1.5)),
    "random": ":",
    "sobol": "-.",
    "tpe": "--",
    "skopt": (0, (5, 1, 1, 1, 1, 1)),
}


def compare_figure(engines: Sequence[Sequence[Run]], tolerance: float) -> Figure:
    """Draw the median over seeds of the lowest regret so far, one line per engine with its 95 % band.

    Up to the vertical line all engines share the design; below the dashed line a θ cannot be told from the optimum.
    """
    figure = Figure(figsize=(5.2, 3.4), layout="constrained")
    axes = figure.subplots()
    for runs in engines:
        _curve(axes, runs)
    key = engines[0][0].key
    axes.axvline(key.initial + 0.5, color="0.6", linewidth=0.8)
    axes.axhline(tolerance, color="0.3", linewidth=0.8, linestyle="--", label="noise floor")
    axes.set_xlabel("evaluations", fontsize=8)
    axes.set_ylabel("lowest regret so far [ordered pairs]", fontsize=8)
    axes.set_xlim(1, key.budget)
    axes.set_ylim(bottom=0)
    dress(axes)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=7, frameon=False)
    return figure


def _curve(axes: Axes, runs: Sequence[Run]) -> None:
    engine = runs[0].key.engine
    middle, low, high = median_curve(runs)
    places = np.arange(1, len(middle) + 1)
    axes.fill_between(places, low, high, step="post", color=COLOURS[engine], alpha=0.15, linewidth=0)
    label = f"{engine} ({len(runs)} seeds)"
    axes.step(places, middle, where="post", color=COLOURS[engine], linestyle=STYLES[engine], lw=1.5, label=label)
