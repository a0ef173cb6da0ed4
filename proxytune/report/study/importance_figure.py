"""The importance figure: how much of PRPV over the search box each parameter accounts for."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from proxytune.report.style import BLUE, COLUMN, dress, legend_below, plain
from proxytune.study import StudyResult


def importance_figure(result: StudyResult) -> Figure:
    """Draw each parameter's share in PRPV's variance over the box, most important first, with its 95 % interval.

    The dot is what it takes part in, alone or together with others; the stroke is what it does alone.
    """
    ordered = sorted(result.importances, key=lambda one: one.share)
    figure = Figure(figsize=(COLUMN, 1.1 + 0.25 * len(ordered)), layout="constrained")
    axes = figure.subplots()
    places = np.arange(len(ordered))
    shares, alone = (np.array([getattr(one, name) for one in ordered]) for name in ("share", "alone"))
    reach = np.abs(np.array([one.interval for one in ordered]).T - shares)
    axes.errorbar(shares, places, xerr=reach, fmt="none", ecolor=BLUE, lw=1.0, capsize=2, label="95 % interval")
    axes.plot(shares, places, "o", color=BLUE, markersize=5, label="alone or with others")
    axes.plot(alone, places, "|", color="black", markersize=9, markeredgewidth=1.4, label="alone")
    axes.set_yticks(places, [plain(one.name) for one in ordered])
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(-0.6, len(ordered) - 0.4)
    axes.xaxis.set_major_formatter(PercentFormatter(1.0))
    axes.set_xlabel("share in the variance of PRPV over the box", fontsize=8)
    dress(axes)
    legend_below(figure, axes)
    return figure
