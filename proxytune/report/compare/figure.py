"""The figure of a comparison: how fast each engine gets near the optimum."""

from collections.abc import Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import is_color_like
from matplotlib.figure import Figure

from proxytune.comparison.runs import Run
from proxytune.comparison.summary import median_curve
from proxytune.errors import InputError
from proxytune.report.figure_style import (
    BLUE,
    COLUMN,
    GREEN,
    LIGHT_BLUE,
    ORANGE,
    PURPLE,
    VERMILLION,
    LineName,
    dress,
    name_lines,
)
from proxytune.search import ENGINES, Look, engine_of

LINES = {"solid": "-", "dashed": (0, (4, 1.5)), "dotted": (0, (1, 1)), "dashdot": (0, (5, 1, 1, 1))}
PALETTE = tuple(
    Look(colour, line)
    for line in ("solid", "dashed", "dotted", "dashdot")
    for colour in (GREEN, PURPLE, LIGHT_BLUE, BLUE, VERMILLION, ORANGE)
)
"""For engines that do not say how they would like to be drawn, in this order."""
HEIGHT = 3.0
"""Of the figure [inch]."""

FLOOR, SHARED = "noise floor", "← shared design"

BEYOND = 0.8
"""So much of an evaluation is drawn after the last, so that one sees where it ended."""


def compare_figure(engines: Sequence[Sequence[Run]], tolerance: float) -> Figure:
    """Draw the median over seeds of the lowest regret so far, one line per engine, named where it ends.

    The first engine has its 95 % band. Up to the vertical line all engines share the design; below the dashed line a θ
    cannot be told from the optimum.
    """
    figure = Figure(figsize=(COLUMN, HEIGHT), layout="constrained")
    axes = figure.subplots()
    key, names = engines[0][0].key, [runs[0].key.engine for runs in engines]
    looks = looks_of(names)
    for number, runs in enumerate(engines):
        _curve(axes, runs, looks[names[number]], banded=number == 0)
    axes.axvline(key.initial + 0.5, color="0.6", linewidth=0.8)
    axes.axhline(tolerance, color="0.3", linewidth=0.8, linestyle="--", label=FLOOR)
    axes.set_xlabel("evaluations", fontsize=8)
    axes.set_ylabel("lowest regret so far [ordered pairs]", fontsize=8)
    axes.set_xlim(1, key.budget + BEYOND)
    axes.set_ylim(*_range(engines, tolerance))
    dress(axes)
    axes.annotate(
        SHARED, (key.initial + 0.5, 1.0), (0, 2), xycoords=("data", "axes fraction"),
        textcoords="offset points", fontsize=7, color="0.3", ha="left",
    )  # fmt: skip
    ends = [float(median_curve(runs)[0][-1]) for runs in engines]
    named = [LineName(name, look.colour, end) for (name, look), end in zip(looks.items(), ends, strict=True)]
    name_lines(axes, [*named, LineName(FLOOR, "0.3", tolerance)])
    return figure


def looks_of(names: Sequence[str]) -> dict[str, Look]:
    """How each engine is drawn: as it would like to be, else by the next of the palette that no engine asked for."""
    wished = {name: look for name in names if (look := _wish(name))}
    asked_for = {*wished.values(), *(engine.look for engine in ENGINES)}
    free = cycle([look for look in PALETTE if look not in asked_for] or PALETTE)
    return {name: wished.get(name) or next(free) for name in names}


def _wish(name: str) -> Look | None:
    """How an engine would like to be drawn, if that can be drawn; runs outlast engines, so it may be unknown."""
    try:
        look = engine_of(name).look
    except InputError:
        return None
    return look if look and look.line in LINES and is_color_like(look.colour) else None


def _curve(axes: Axes, runs: Sequence[Run], look: Look, *, banded: bool) -> None:
    colour, line = look.colour, LINES[look.line]
    middle, low, high = median_curve(runs)
    places = np.append(np.arange(1, len(middle) + 1), len(middle) + BEYOND)
    middle, low, high = (np.append(curve, curve[-1]) for curve in (middle, low, high))
    if banded:
        axes.fill_between(places, low, high, step="post", color=colour, alpha=0.15, linewidth=0)
    label = f"{runs[0].key.engine} ({len(runs)} seeds)"
    axes.step(places, middle, where="post", color=colour, linestyle=line, lw=1.3, label=label)


def _range(engines: Sequence[Sequence[Run]], tolerance: float) -> tuple[float, float]:
    """From below the lowest median, the floor and 0 to above the highest median that is finite."""
    medians = np.concatenate([median_curve(runs)[0] for runs in engines])
    finite = medians[np.isfinite(medians)]
    low, high = min(0.0, tolerance, *finite), max(1.0, tolerance, *finite)
    return low - 0.04 * (high - low) if low < 0.0 else 0.0, high + 0.04 * (high - low)
