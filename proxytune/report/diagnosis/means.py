"""What is added to the declared model's motion, as means over a signal: measured, by effects, by any curve."""

from collections.abc import Mapping
from math import ceil
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.diagnosis import (
    HUBER,
    Diagnosis,
    Drives,
    Fit,
    Floats,
    SignalCurve,
    disturbed_increments,
    increments,
    span,
    theta_at,
)
from proxytune.effects import TURN, Panel
from proxytune.report.diagnosis.model_names import BEFORE, after
from proxytune.report.style import BLUE, COLUMN, GREY, PURPLE, VERMILLION, dress, legend_below
from proxytune.space import Theta

BINS = 20
"""Values of the signal, equally often driven, over which means are taken."""

COLUMNS = 2

MEASURED, ANY = "measured", "free curve"

DEGREES = 180.0 / np.pi


GROUPS: Mapping[str, tuple[Panel, ...]] = {
    "wheel command": (
        Panel("left", "speed of the left wheel [m/s]", "left"),
        Panel("right", "speed of the right wheel [m/s]", "right"),
    ),
    "difference of the wheel commands": tuple(
        Panel("", "right less left command [duty]", m) for m in ("forward", "turn")
    ),
    "command transients": tuple(
        Panel("", "left command less its slow average [duty]", motion) for motion in ("left", "forward")
    ),
    "distance since reversal": (Panel("", "way since the left wheel reversed [m]", "left", True),),
    "time in the episode": tuple(Panel("", "time in the episode [s]", side, True) for side in ("left", "right")),
    "cumulated use": tuple(Panel("", "use so far [s at full duty]", m, True) for m in ("forward", "turn")),
    "turn rate": (Panel("turn", TURN, "forward", True), Panel("turn", TURN, "turn")),
    "heading": tuple(Panel("heading", "heading [deg]", motion) for motion in ("forward", "turn")),
    "position": (
        Panel("x", "x [m]", "forward", True),
        Panel("y", "y [m]", "forward", True),
        Panel("x", "x [m]", "turn"),
    ),
    "left wheel angle": (Panel("", "angle of the left wheel [rad]", "left", True),),
    "right wheel angle": (Panel("", "angle of the right wheel [rad]", "right", True),),
    "direction of travel": tuple(Panel("", "direction of travel", m, True) for m in ("forward", "turn")),
}
"""What is drawn for a signal group."""

NAMES = {
    "forward": "forward speed",
    "sideways": "speed to the left",
    "turn": "turn rate",
    "left": "left wheel speed",
    "right": "right wheel speed",
}


class Rates(NamedTuple):
    """Motion per second between the measured poses, by channel, each (N,)."""

    declared: Mapping[str, Floats]
    added: Mapping[str, Mapping[str, Floats]]


def rates_of(diagnosis: Diagnosis, curve: SignalCurve | None) -> Rates:
    """What the declared model says, and what is added to it by measurement, by effects, by the flexible curve."""
    found, drives = diagnosis.found, diagnosis.found.declared.drives
    declared = increments(drives, found.declared.theta)
    added = {MEASURED: drives.measured - declared}
    if found.adopted:
        added[after(diagnosis)] = increments(drives, found.model.theta) - declared
    if curve is not None and curve.gain > 0.0:
        free = curve.group.twists @ curve.weights
        added[ANY] = disturbed_increments(drives, retuned(found.declared, curve), free) - declared
    return Rates(_channels(drives, declared), {name: _channels(drives, moved) for name, moved in added.items()})


def retuned(declared: Fit, curve: SignalCurve) -> Theta:
    """The declared parameters as they are fitted together with a flexible curve: one step of least squares."""
    drives, theta = declared.drives, declared.theta
    if not declared.free:
        return theta
    moved = disturbed_increments(drives, theta, curve.group.twists @ curve.weights) - increments(drives, theta)
    left = declared.innovations - declared.whiten.whiten(moved)
    inner = np.abs(left) < HUBER
    step = -np.linalg.lstsq(declared.slopes[inner], left[inner], rcond=None)[0]
    low, high = np.array([span(coordinate, drives.robot) for coordinate in declared.free]).T
    here = np.array([theta[coordinate[0]] for coordinate in declared.free])
    return theta_at(theta, declared.free, np.clip(here + step * (high - low), low, high))


def _channels(drives: Drives, moved: Floats) -> dict[str, Floats]:
    forward, sideways, turn = (moved / ((drives.last - drives.first) / drives.tick_hz)[:, None]).T
    side = turn * drives.robot.figures["effective_baseline"] / 2.0
    return {"forward": forward, "sideways": sideways, "turn": turn, "left": forward - side, "right": forward + side}


def _signal(drives: Drives, rates: Rates, curve: SignalCurve | None, panel: Panel) -> Floats:
    """The signal of a panel at each increment (N,)."""
    declared = rates.declared
    direct = {
        "x": drives.poses[:, 0, 0],
        "y": drives.poses[:, 0, 1],
        "heading": np.degrees(np.mod(drives.poses[:, 0, 2], 2.0 * np.pi)),
        "turn": np.degrees(declared["turn"]),
        "left angle": np.mod(drives.angles[drives.episode, drives.first, 0], 2.0 * np.pi),
        "right angle": np.mod(drives.angles[drives.episode, drives.first, 1], 2.0 * np.pi),
        "bend": declared["forward"] * declared["turn"],
    }
    if panel.signal:
        return np.asarray(direct.get(panel.signal, declared.get(panel.signal)))
    assert curve is not None
    return np.asarray(curve.group.signal[drives.episode, (drives.first + drives.last) // 2])


def _means(signal: Floats, added: Floats, share_of: Floats | None) -> tuple[Floats, Floats]:
    """Mean of what is added, or its share of a motion [%], over equally filled bins of the signal."""
    edges = np.unique(np.quantile(signal, np.linspace(0.0, 1.0, BINS + 1)))
    place = np.clip(np.searchsorted(edges, signal, side="right") - 1, 0, max(0, len(edges) - 2))
    weight = np.ones_like(signal) if share_of is None else share_of
    count, total, size = (np.bincount(place, w) for w in (np.ones_like(signal), weight * added, weight**2))
    kept = size > 1e-9 * size.max()
    value = (total[kept] / size[kept]) * (1.0 if share_of is None else 100.0)
    return np.bincount(place, signal)[kept] / count[kept], value


def means_figure(diagnosis: Diagnosis, curve: SignalCurve | None, panels: tuple[Panel, ...]) -> Figure:
    """Draw panels, two in a row; the curve is the flexible one, where there is one."""
    rows = ceil(len(panels) / COLUMNS)
    figure = Figure(figsize=(COLUMN, 1.7 * rows + 0.6), layout="constrained")
    rates, across = rates_of(diagnosis, curve), min(COLUMNS, len(panels))
    all_axes = [figure.add_subplot(rows, across, number + 1) for number in range(len(panels))]
    for axes, panel in zip(all_axes, panels, strict=True):
        signal = _signal(diagnosis.found.declared.drives, rates, curve, panel)
        draw_means(axes, rates, signal, panel)
        axes.set_xlabel(panel.label, fontsize=8)
    legend_below(figure, *all_axes)
    return figure


def draw_means(axes: Axes, rates: Rates, signal: Floats, panel: Panel) -> None:
    """Draw means of what is added over a signal of the increments (N,)."""
    factor, unit = (1.0, "%") if panel.share else (DEGREES, "deg/s") if panel.motion == "turn" else (1e3, "mm/s")
    axes.axhline(0.0, color=VERMILLION, lw=1.0, label=BEFORE)
    for name, added in rates.added.items():
        places, values = _means(signal, added[panel.motion], rates.declared[panel.motion] if panel.share else None)
        style = {MEASURED: ("o", GREY, 3.0, 1), ANY: ("--", PURPLE, 0.0, 3)}.get(name, ("-", BLUE, 0.0, 2))
        axes.plot(places, factor * values, style[0], color=style[1], ms=style[2], lw=1.4, zorder=style[3], label=name)
    axes.set_ylabel(f"{NAMES[panel.motion]}\n− declared [{unit}]", fontsize=8)
    dress(axes)
