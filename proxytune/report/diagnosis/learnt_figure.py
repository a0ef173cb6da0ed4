"""The learnt curves: what they add to the motion, over the signal that each depends on."""

from collections.abc import Sequence
from math import ceil
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.diagnosis import Learning
from proxytune.effects import GROUPS, HEADING, LEVEL, Curve, Learnt, learnt_effect
from proxytune.report.style import BLUE, COLUMN, GREY, dress, plain

SHOWN_AS = {
    "m/s": (1e3, "mm/s"),
    "rad/s": (180.0 / np.pi, "deg/s"),
    "rad/m": (180.0 / np.pi, "deg/m"),
}
"""How weights are told, by their unit: a factor and its unit; shares in per cent."""

FADING = {
    "transients": "time constant",
    "load": "time constant",
    "reversal": "fading over",
    "start": "fading over",
    "ringing": "frequency",
    "play": "half the play",
}
"""Groups whose weights are points, each of something that fades, and what their knots are."""

PAIRS = "speed_and_turn"

COLUMNS = 2

WIDEST, HIGHEST = 24, 18
"""Characters in a line below a panel, and beside it."""


def learnt_figure(learning: Learning) -> Figure | None:
    """A panel for each learnt curve, two in a row, largest share first; nothing where none is used."""
    effect = learnt_effect(learning.theta)
    if effect is None:
        return None
    order = list(learning.discrepancy.share)
    members = {curve.group for curve in effect.curves} - {LEVEL}
    groups = sorted(members, key=lambda group: order.index(GROUPS[group].title))
    by_group = [[curve for curve in effect.curves if curve.group == group] for group in groups]
    curves = [one for row in by_group for one in (_courses(row) if row[0].group == HEADING else row)]
    rows, across = ceil(len(curves) / COLUMNS), min(COLUMNS, len(curves))
    figure = Figure(figsize=(COLUMN, 1.65 * rows + 0.25), layout="constrained")
    for place, curve in enumerate(curves):
        _draw(figure.add_subplot(rows, across, place + 1), effect, curve)
    figure.suptitle("learnt from drives, not physics: what is added", fontsize=8)
    return figure


def _courses(curves: Sequence[Curve]) -> list[Curve]:
    """Harmonics of the heading as curves over it, one for each direction."""
    around = np.linspace(0.0, 360.0, 73)
    courses = []
    for to in dict.fromkeys(curve.channel.split("_")[0] for curve in curves):
        total = np.zeros(len(around))
        for curve in curves:
            if curve.channel.startswith(to):
                wave = np.cos if curve.channel.endswith("cos") else np.sin
                total += wave(np.radians(around)[:, None] * np.asarray(curve.knots)) @ np.asarray(curve.weights)
        courses.append(Curve(HEADING, to, tuple(around.tolist()), tuple(total.tolist())))
    return courses


def _draw(axes: Axes, effect: Learnt, curve: Curve) -> None:
    group = GROUPS[curve.group]
    unit = group.channels[curve.channel if curve.group != HEADING else f"{curve.channel}_cos"].unit
    factor, label_unit = SHOWN_AS.get(unit, (100.0, f"% {unit}"))
    label = fill(f"{plain(curve.channel)} [{label_unit}]", HIGHEST)
    if curve.group == PAIRS:
        _surface(axes, curve, factor, label)
    else:
        _line(axes, curve, factor)
        of = f"{group.title}, {FADING[curve.group]}" if curve.group in FADING else group.title
        axes.set_xlabel(fill(f"{of} [{'deg' if curve.group == HEADING else group.unit}]", WIDEST), fontsize=7)
        axes.set_ylabel(label, fontsize=8)
        axes.axhline(0.0, color=GREY, lw=0.6)
    if curve.group == "turn_rate":
        axes.axvspan(*effect.seen.yaw, color=GREY, alpha=0.12, lw=0)
    dress(axes)


def _line(axes: Axes, curve: Curve, factor: float) -> None:
    """A curve through its knots, and through 0 at 0; what fades is points."""
    knots, weights = np.array(curve.knots), factor * np.array(curve.weights)
    if curve.group in FADING:
        axes.set_xscale("log")
        axes.set_xticks(knots, [f"{knot:g}" for knot in knots])
        axes.set_xticks([], minor=True)
        axes.vlines(knots, 0.0, weights, color=BLUE, lw=1.0)
        axes.plot(knots, weights, "o", color=BLUE, ms=4)
        return
    if curve.group != HEADING:
        order = np.argsort(np.append(knots, 0.0))
        knots, weights = np.append(knots, 0.0)[order], np.append(weights, 0.0)[order]
    axes.plot(knots, weights, "-" if curve.group == HEADING else ".-", color=BLUE, lw=1.3, ms=5)


def _surface(axes: Axes, curve: Curve, factor: float, label: str) -> None:
    """Colours over speed and yaw rate."""
    places, weights = np.array(curve.knots), factor * np.array(curve.weights)
    speeds, turns = (np.unique(np.append(axis, 0.0)) for axis in places.T)
    values = np.zeros((len(turns), len(speeds)))
    values[np.searchsorted(turns, places[:, 1]), np.searchsorted(speeds, places[:, 0])] = weights
    most = float(np.abs(values).max()) or 1.0
    mesh = axes.pcolormesh(speeds, turns, values, shading="gouraud", cmap="RdBu_r", vmin=-most, vmax=most)
    axes.set_xlabel("forward speed [m/s]", fontsize=8)
    axes.set_ylabel("yaw rate [rad/s]", fontsize=8)
    bar = axes.figure.colorbar(mesh, ax=axes)
    bar.set_label(label, fontsize=8)
    bar.ax.tick_params(labelsize=7)
