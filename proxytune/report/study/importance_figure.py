"""The importance figure: how much of PRPV over the search box each parameter accounts for."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from proxytune.report.style import BLUE, COLUMN, LIGHT_BLUE, dress, legend_below, plain
from proxytune.study.result import StudyResult


def importance_figure(result: StudyResult) -> Figure:
    """Draw each parameter's share in PRPV's variance over the box, most important first, with its 95 % interval.

    The whole bar is what it takes part in, alone or together with others; its dark part is what it does alone.
    """
    ordered = sorted(result.importances, key=lambda one: one.share)
    figure = Figure(figsize=(COLUMN, 1.1 + 0.25 * len(ordered)), layout="constrained")
    axes = figure.subplots()
    places = np.arange(len(ordered))
    shares, alone = (np.array([getattr(one, name) for one in ordered]) for name in ("share", "alone"))
    ends = np.array([one.interval for one in ordered]).T
    axes.barh(places, shares, height=0.6, color=LIGHT_BLUE, label="alone or with others")
    axes.barh(places, alone, height=0.6, color=BLUE, label="alone")
    reach = np.abs(ends - shares)
    axes.errorbar(shares, places, xerr=reach, fmt="none", ecolor="0.2", lw=1.0, capsize=2, label="95 % interval")
    axes.set_yticks(places, [plain(one.name) for one in ordered])
    axes.set_xlim(0.0, 1.0)
    axes.xaxis.set_major_formatter(PercentFormatter(1.0))
    axes.set_xlabel("share in the variance of PRPV over the box", fontsize=8)
    dress(axes)
    legend_below(figure, axes)
    return figure
