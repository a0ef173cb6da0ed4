"""The figure of a sweep: usefulness along each parameter, with the target's noise floor."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.study.sweep import Curve
from proxytune.usefulness import Assessment

BLUE, GREEN = "#0072B2", "#009E73"  # Okabe and Ito, safe for the colour-blind
PANEL = (2.6, 2.0)


def sweep_figure(curves: Sequence[Curve]) -> Figure:
    """Draw PRPV above PPV, one column per parameter, bootstrap intervals as bands; lower is better in both.

    A dashed line with its band is the target's noise floor, a dotted one chance; a thin vertical line is where the
    parameter itself is held when others are swept.
    """
    width, height = PANEL
    figure = Figure(figsize=(max(3.4, width * len(curves) + 0.4), 2 * height + 0.5), layout="constrained")
    panels = figure.subplots(2, len(curves), sharex="col", sharey="row", squeeze=False)
    for column, curve in enumerate(curves):
        upper, lower = panels[:, column]
        points = [(point.value, point.assessment) for point in curve.points if point.assessment is not None]
        _prpv(upper, points)
        _ppv(lower, points)
        lower.set_xlabel(f"{curve.parameter} [{curve.unit}]" if curve.unit else curve.parameter, fontsize=8)
        for axes in (upper, lower):
            _dress(axes, curve)
    # Only now: a limit set earlier would hide what later columns of the shared axis hold.
    for axes in panels[:, 0]:
        axes.set_ylim(bottom=-0.03 * axes.get_ylim()[1])
    panels[0, 0].set_ylabel("PRPV [ordered pairs]", fontsize=8)
    panels[1, 0].set_ylabel("PPV", fontsize=8)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=7, frameon=False)
    return figure


def _prpv(axes: Axes, points: Sequence[tuple[float, Assessment]]) -> None:
    values = [value for value, _ in points]
    found = [assessment for _, assessment in points]
    if not found:
        return
    _levels(axes, found)
    inner = [assessment.prpv_interval for assessment in found]
    if all(one.low is not None for one in inner):
        lows, highs = [one.low or 0.0 for one in inner], [one.high or 0.0 for one in inner]
        axes.fill_between(values, lows, highs, color=BLUE, alpha=0.18, linewidth=0, label="95 % interval")
    scores = [assessment.prpv.value for assessment in found]
    axes.plot(values, scores, "o-", color=BLUE, markersize=3, linewidth=1.2, label="PRPV")


def _ppv(axes: Axes, points: Sequence[tuple[float, Assessment]]) -> None:
    known = [(value, found.ppv.value) for value, found in points if found.ppv.value is not None]
    banded = [(value, *found.intervals.ppv) for value, found in points if found.intervals and found.intervals.ppv]
    if banded:
        values, lows, highs = np.array(banded).T
        axes.fill_between(values, lows, highs, color=BLUE, alpha=0.18, linewidth=0)
    axes.plot([value for value, _ in known], [score for _, score in known], "o-", color=BLUE, ms=3, lw=1.2)


def _levels(axes: Axes, found: Sequence[Assessment]) -> None:
    """The target's noise floor, and chance: its mean, since it varies a little with the proxy's own order."""
    floor = found[0].noise_floor
    if floor.value is not None and floor.low is not None and floor.high is not None:
        axes.axhspan(floor.low, floor.high, color=GREEN, alpha=0.15, linewidth=0)
        axes.axhline(floor.value, color=GREEN, linewidth=1.0, linestyle="--", label="noise floor")
    chance = float(np.mean([assessment.chance.mean for assessment in found]))
    axes.axhline(chance, color="0.45", linewidth=1.0, linestyle=":", label="chance")


def _dress(axes: Axes, curve: Curve) -> None:
    if curve.parameter in curve.base:
        axes.axvline(curve.base[curve.parameter], color="0.6", linewidth=0.8)
    axes.tick_params(labelsize=7)
    axes.spines[["top", "right"]].set_visible(False)
