"""PRPV of the tuned proxy before and after, against its noise floor."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.closing.comparison import Compared, Level
from proxytune.report.style import BLUE, COLUMN, GREY, LIGHT_GREY, VERMILLION, dress

HALF = 0.3
"""Half the width of a floor's bar."""


def prpv_figure(rows: Sequence[Compared]) -> Figure:
    """A panel per set of agents: PRPV before and after with 95 % intervals, over the bracket of the noise floor."""
    figure = Figure(figsize=(COLUMN, 0.62 * COLUMN), layout="constrained")
    panels = figure.subplots(1, len(rows), squeeze=False)[0]
    for axes, row in zip(panels, rows, strict=True):
        _panel(axes, row)
    panels[0].set_ylabel("PRPV (lower is better)", fontsize=8)
    floor = rows[0].before.floor_ends
    if floor:
        panels[0].annotate("noise floor", (-0.55, floor[1]), fontsize=6.5, color="0.3", va="bottom")
    return figure


def _panel(axes: Axes, row: Compared) -> None:
    dress(axes)
    for place, (level, colour) in enumerate(((row.before, VERMILLION), (row.after, BLUE))):
        if level is not None:
            _level(axes, place, level, colour)
    axes.set_xlim(-0.6, 1.6)
    axes.set_xticks([0, 1], ["before", "after"], fontsize=7)
    axes.set_ylim(bottom=0.0)
    axes.set_title("held-out agents" if row.key == "held_out" else "tuned agents", fontsize=8)


def _level(axes: Axes, place: int, level: Level, colour: str) -> None:
    low, high = level.floor_ends or (0.0, 0.0)
    axes.fill_between([place - HALF, place + HALF], low, high, color=LIGHT_GREY, lw=0)
    if level.floor is not None:
        axes.plot([place - HALF, place + HALF], [level.floor] * 2, color=GREY, lw=1.0)
    below, above = level.interval or (level.value, level.value)
    spread = [[max(0.0, level.value - below)], [max(0.0, above - level.value)]]
    axes.errorbar(place, level.value, yerr=spread, fmt="o", ms=5, color=colour, capsize=3, lw=1.2)
    axes.annotate(f"{level.value:.3g}", (place + 0.1, level.value), fontsize=8, color=colour, va="center")
