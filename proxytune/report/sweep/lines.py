"""What the figures of a sweep share: lines with bands, the noise floor and chance, held and true values, the key."""

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes

from proxytune.report.style import BLUE, GREEN, dress, floor_name, with_unit
from proxytune.space import Theta
from proxytune.sweep import Curve, Series
from proxytune.usefulness import Assessment, Measure

HELD, TRUTH, INTERVAL = "held value", "truth", "95 % interval"
WIDEST = 20
"""Characters of a name that fit into the key."""


def draw_series(axes: Axes, series: Series, colour: str, marker: str, label: str) -> None:
    """A line through the scores, with its band of 95 % intervals."""
    known = [(one.value, one.score) for one in series.estimates if one.score is not None]
    banded = [(one.value, *one.interval) for one in series.estimates if one.interval]
    if banded:
        places, lows, highs = np.array(banded).T
        axes.fill_between(places, lows, highs, color=colour, alpha=0.18, linewidth=0)
    values, scores = [value for value, _ in known], [score for _, score in known]
    axes.plot(values, scores, marker=marker, color=colour, ms=3, lw=1.2, label=label)


def draw_prpv(axes: Axes, points: Sequence[tuple[float, Assessment]]) -> None:
    """PRPV over the values of a parameter, with its band, the noise floor and chance."""
    values = [value for value, _ in points]
    found = [assessment for _, assessment in points]
    if not found:
        return
    draw_levels(axes, found)
    inner = [assessment.prpv_interval for assessment in found]
    if all(one.low is not None for one in inner):
        lows, highs = [one.low or 0.0 for one in inner], [one.high or 0.0 for one in inner]
        axes.fill_between(values, lows, highs, color=BLUE, alpha=0.18, linewidth=0, label=INTERVAL)
    scores = [assessment.prpv.value for assessment in found]
    axes.plot(values, scores, "o-", color=BLUE, markersize=3, linewidth=1.2, label="PRPV")


def draw_ppv(axes: Axes, points: Sequence[tuple[float, Assessment]]) -> None:
    """PPV over the values of a parameter, with its band."""
    known = [(value, found.ppv.value) for value, found in points if found.ppv.value is not None]
    banded = [(value, *found.intervals.ppv) for value, found in points if found.intervals and found.intervals.ppv]
    if banded:
        values, lows, highs = np.array(banded).T
        axes.fill_between(values, lows, highs, color=BLUE, alpha=0.18, linewidth=0)
    axes.plot([value for value, _ in known], [score for _, score in known], "o-", color=BLUE, ms=3, lw=1.2)


def draw_levels(axes: Axes, found: Sequence[Assessment]) -> None:
    """The noise floor by its kind, and chance: its mean, since it varies a little with the proxy's own order."""
    floor = found[0].noise_floor
    if floor.value is not None and floor.low is not None and floor.high is not None:
        axes.axhspan(floor.low, floor.high, color=GREEN, alpha=0.15, linewidth=0)
        axes.axhline(floor.value, color=GREEN, linewidth=1.0, linestyle="--", label=floor_name(floor))
    chance = float(np.mean([assessment.chance.mean for assessment in found]))
    axes.axhline(chance, color="0.45", linewidth=1.0, linestyle=":", label="chance")


def mark_values(axes: Axes, curve: Curve, truth: Theta | None) -> None:
    """A line where the parameter is held when others are swept, a triangle at the top at the target's own value."""
    if curve.parameter in curve.base:
        axes.axvline(curve.base[curve.parameter], color="0.35", linewidth=0.9, linestyle=(0, (5, 2)), label=HELD)
    if truth is not None and curve.parameter in truth:
        at_top = axes.get_xaxis_transform()
        (mark,) = axes.plot(truth[curve.parameter], 1.0, "v", color="black", transform=at_top, label=TRUTH)
        mark.set(markersize=5, clip_on=False, zorder=4)
    dress(axes)


def explain(axes: Axes, *panels: Axes) -> None:
    """Fill an empty panel with the key of others: each name once, the measure itself left to its axis."""
    axes.set_axis_off()
    named = {label: handle for one in panels for handle, label in zip(*one.get_legend_handles_labels(), strict=True)}
    named.pop("PRPV", None)
    names = [fill(name, WIDEST) for name in named]
    axes.legend(list(named.values()), names, loc="center", fontsize=7, frameon=False)


def axis_of(measure: Measure) -> str:
    """What an axis calls a measure."""
    return with_unit(measure.name, measure.unit)


def label_of(curve: Curve) -> str:
    """What an axis calls the parameter of a curve."""
    return curve.label.replace("_", " ")
