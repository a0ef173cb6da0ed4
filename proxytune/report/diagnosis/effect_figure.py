"""Figure of the first effect that was added, or of the signal that no named effect accounts for."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.diagnosis import (
    RANDOM_EFFECTS,
    AdoptedEffect,
    Diagnosis,
    Drives,
    Floats,
    SignalCurve,
    disturbed_increments,
    drawn_wheel_speeds,
    increments,
    refit_beside_curve,
    wheel_speeds,
)
from proxytune.effects import Catalogue, Means, Panel, WheelCurve, track_of
from proxytune.files import package_table
from proxytune.report import figure_style as style
from proxytune.report.diagnosis.error_figures import DECLARED_MODEL, extended_name
from proxytune.space import Theta

HELD_S = 5.0
"""A command is held so long before the wheel speed counts as steady."""
COMMANDS = 201
"""So many commands along a curve of steady speeds."""
STEP_S, STEPS_S = 1.5, 3.0
"""A step response is followed so long before the command is reversed, and altogether."""
DRAWS = 40
"""Step responses that are drawn of a random effect."""


def effect_curve(diagnosis: Diagnosis) -> Figure | None:
    """Draw the first effect that was added, or the signal that explains more than any; nothing if there is neither.

    Points are means of what was measured on the drives that were fitted, beyond what the declared model says.
    """
    found = diagnosis.found
    if not found.adopted:
        best = next(iter(found.unnamed_curves), None)
        return None if best is None else means_figure(diagnosis, best, CUE_PANELS[best.group.name])
    kind = _curve_kind(found.adopted[0], diagnosis.robot.catalogue)
    if isinstance(kind, Means):
        return means_figure(diagnosis, _curve(found.curves, kind.cue), kind.panels)
    if kind is not WheelCurve.STEADY:
        return _steps_figure(diagnosis)
    return _wheels_figure(diagnosis) if diagnosis.robot.drive == "differential" else _car_figure(diagnosis)


def _curve_kind(effect: AdoptedEffect, catalogue: Catalogue) -> WheelCurve | Means:
    trace = catalogue.effect(effect.effect).trace
    return trace.shown_in(effect.form) if trace else WheelCurve.STEP


def _curve(curves: Sequence[SignalCurve], name: str) -> SignalCurve | None:
    return next((curve for curve in curves if curve.group.name == name), None)


def _shown(diagnosis: Diagnosis) -> tuple[int, float, str]:
    """The part that the first effect that was added bends: its column, what 1 stands for there, an axis' label."""
    first, figures = diagnosis.found.adopted[0], diagnosis.robot.figures
    if diagnosis.robot.drive == "differential":
        column = int(first.form.startswith("right"))
        return column, figures["full_speed"], f"speed of the {('left', 'right')[column]} wheel [m/s]"
    if first.effect.startswith("steering_"):
        return 1, figures["wheel_angle"], "angle of the wheels [deg]"
    return 0, figures["full_speed"], "speed [m/s]"


def _car_figure(diagnosis: Diagnosis) -> Figure:
    """A car's steady speed against throttle, or its wheels' angle against steering."""
    found, drives, (column, full, label) = diagnosis.found, diagnosis.found.declared.drives, _shown(diagnosis)
    (figure, axes), given = style.one_panel(2.4), drives.duties[..., column]
    commands = np.linspace(float(given.min()), float(given.max()), COMMANDS)
    pairs = np.stack([commands * (side == column) for side in (0, 1)], axis=-1)
    models = {DECLARED_MODEL: found.declared.theta, extended_name(diagnosis): found.model.theta}
    _draw_steady(axes, commands, {n: full * _steady(drives, t, pairs)[:, column] for n, t in models.items()})
    style.dress(axes, ("throttle", "steering [full lock]")[column], label)
    style.legend_below(figure, axes)
    return figure


def _wheels_figure(diagnosis: Diagnosis) -> Figure:
    """Steady wheel speed against command above, what is added to the declared model beneath."""
    drives = diagnosis.found.declared.drives
    figure, panels = style.grid_of(3.4, 2, 2, sharex="col", sharey="row")
    rates = rates_of(diagnosis, _curve(diagnosis.found.curves, "wheel command"))
    commands = np.linspace(float(drives.duties.min()), float(drives.duties.max()), COMMANDS)
    models = _steady_models(diagnosis, commands)
    for column, side in enumerate(("left", "right")):
        _draw_steady(panels[0, column], commands, {name: steady[:, column] for name, steady in models.items()})
        place = np.interp(rates.declared[side], models[DECLARED_MODEL][:, column], commands)
        draw_means(panels[1, column], rates, place, CUE_PANELS["wheel command"][column])
        panels[0, column].set_title(f"{side} wheel", fontsize=8)
        panels[1, column].set_xlabel("command [duty]", fontsize=8)
    for row, label in enumerate(("steady speed [m/s]", "speed − declared\n[mm/s]")):
        panels[row, 0].set_ylabel(label, fontsize=8)
        panels[row, 1].set_ylabel("")
    style.legend_below(figure, *panels.ravel())
    return figure


def _steady_models(diagnosis: Diagnosis, commands: Floats) -> dict[str, Floats]:
    """Steady wheel speeds (commands, 2) [m/s] of every model, by name: declared, extended, with the flexible curve."""
    found, drives = diagnosis.found, diagnosis.found.declared.drives
    full, pairs = drives.robot.figures["full_speed"], np.stack((commands, commands), axis=-1)
    before = full * _steady(drives, found.declared.theta, pairs)
    models = {DECLARED_MODEL: before, extended_name(diagnosis): full * _steady(drives, found.model.theta, pairs)}
    curve = _curve(found.curves, "wheel command")
    if curve is not None and curve.gain > 0.0:
        extra = [np.interp(before[:, side], *_flexible(diagnosis, curve, side)) for side in (0, 1)]
        models[ANY] = full * _steady(drives, refit_beside_curve(found.declared, curve), pairs) + np.stack(extra, axis=1)
    return models


def _draw_steady(axes: Axes, commands: Floats, models: Mapping[str, Floats]) -> None:
    for name, speeds in models.items():
        line, colour = {DECLARED_MODEL: ("-", style.VERMILLION), ANY: ("--", style.PURPLE)}.get(name, ("-", style.BLUE))
        axes.plot(commands, speeds, line, color=colour, lw=1.3, label=name)
    style.dress(axes)


def _steady(drives: Drives, theta: Theta, commands: Floats) -> Floats:
    """Wheel speeds, of a car speed and angle (n, 2), as fractions of full that commands (n, 2) come to from rest."""
    duties = np.broadcast_to(commands[:, None], (len(commands), round(HELD_S * drives.tick_hz), 2))
    return wheel_speeds(_driven(drives, duties), theta)[:, -1]


def _driven(drives: Drives, duties: Floats) -> Drives:
    """The same robot from rest under other commands (E, T, 2), nothing being measured."""
    still, unmeasured = np.zeros((len(duties), 2)), drives.only(np.zeros(len(drives.episode), dtype=bool))
    return replace(unmeasured, duties=duties, rest=still, headings=np.zeros(duties.shape[:2]), wheels=None)


def _flexible(diagnosis: Diagnosis, curve: SignalCurve, column: int) -> tuple[Floats, Floats]:
    """The flexible wheel curve: speeds of the declared model in order and what is added to them, both [m/s]."""
    drives, figures = diagnosis.found.declared.drives, diagnosis.robot.figures
    speeds = wheel_speeds(drives, diagnosis.found.declared.theta)[..., column].ravel() * figures["full_speed"]
    twists = curve.group.twists @ curve.weights
    side = (-1.0, 1.0)[column] * track_of(figures) / 2.0
    speeds, where = np.unique(speeds, return_index=True)
    return speeds, (twists[..., 0] + side * twists[..., 2]).ravel()[where]


def _steps_figure(diagnosis: Diagnosis) -> Figure:
    """Wheel speed after a step of the command and, for backlash, after its reversal."""
    found, drives = diagnosis.found, diagnosis.found.declared.drives
    figure, axes = style.one_panel(2.4)
    reverses = any(_curve_kind(one, diagnosis.robot.catalogue) is WheelCurve.REVERSAL for one in found.adopted)
    lasts = STEPS_S if reverses else STEP_S
    times = np.arange(round(lasts * drives.tick_hz)) / drives.tick_hz
    size = min(0.5, float(np.abs(drives.duties).max()))
    duties = np.repeat(np.where(times < STEP_S, size, -size)[None, :, None], 2, axis=2)
    column, full, label = _shown(diagnosis)
    # An area, which no line on its edge can hide.
    axes.fill_between(times, duties[0, :, 0] * full, color=style.LIGHT_GREY, linewidth=0, zorder=0, label="command")
    models = ((found.declared, style.VERMILLION, DECLARED_MODEL), (found.model, style.BLUE, extended_name(diagnosis)))
    for fitted, colour, name in models:
        driven = _driven(drives, duties)
        if any(fitted.theta.get(one, 0.0) > 0.0 for one in RANDOM_EFFECTS):
            speeds = np.stack([drawn_wheel_speeds(driven, fitted.theta, seed)[0] for seed in range(DRAWS)])
        else:
            speeds = wheel_speeds(driven, fitted.theta)
        draws = full * speeds[..., column]
        if len(draws) > 1:
            axes.plot(times, draws.T, color=colour, lw=0.4, alpha=0.4)
            name += " (thin: single draws)"
        axes.plot(times, np.median(draws, axis=0), color=colour, lw=1.4, label=name)
    style.dress(axes, "time since the command [s]", label)
    style.legend_below(figure, axes)
    return figure


BINS = 20
"""Values of the signal, equally often driven, over which means are taken."""
MEASURED, ANY = "measured", "free curve"
DEGREES = 180.0 / np.pi
_TABLES = package_table("report/templates/panels.toml")
CUE_PANELS: Mapping[str, tuple[Panel, ...]] = {
    group: tuple(Panel(*panel) for panel in panels) for group, panels in _TABLES["panels"].items()
}
"""Panels drawn for a signal group."""
NAMES: Mapping[str, str] = _TABLES["motions"]


class Rates(NamedTuple):
    """Motion per second between the measured poses, by channel, each (N,)."""

    declared: Mapping[str, Floats]
    added: Mapping[str, Mapping[str, Floats]]


def rates_of(diagnosis: Diagnosis, curve: SignalCurve | None) -> Rates:
    """Motion as the declared model has it, and what is added to it by measurement, by effects, by a flexible curve."""
    found, drives = diagnosis.found, diagnosis.found.declared.drives
    declared = increments(drives, found.declared.theta)
    added = {MEASURED: drives.measured - declared}
    if found.adopted:
        added[extended_name(diagnosis)] = increments(drives, found.model.theta) - declared
    if curve is not None and curve.gain > 0.0:
        free = curve.group.twists @ curve.weights
        added[ANY] = disturbed_increments(drives, refit_beside_curve(found.declared, curve), free) - declared
    return Rates(_channels(drives, declared), {name: _channels(drives, moved) for name, moved in added.items()})


def _channels(drives: Drives, moved: Floats) -> dict[str, Floats]:
    forward, sideways, turn = (moved / ((drives.last - drives.first) / drives.tick_hz)[:, None]).T
    side = turn * track_of(drives.robot.figures) / 2.0
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
    figure, all_axes = style.panel_grid(len(panels), 1.7, 0.6)
    rates = rates_of(diagnosis, curve)
    for axes, panel in zip(all_axes, panels, strict=True):
        draw_means(axes, rates, _signal(diagnosis.found.declared.drives, rates, curve, panel), panel)
        axes.set_xlabel(panel.label, fontsize=8)
    style.legend_below(figure, *all_axes)
    return figure


def draw_means(axes: Axes, rates: Rates, signal: Floats, panel: Panel) -> None:
    """Draw means of what is added over a signal of the increments (N,)."""
    factor, unit = (1.0, "%") if panel.share else (DEGREES, "deg/s") if panel.motion == "turn" else (1e3, "mm/s")
    axes.axhline(0.0, color=style.VERMILLION, lw=1.0, label=DECLARED_MODEL)
    for name, added in rates.added.items():
        places, values = _means(signal, added[panel.motion], rates.declared[panel.motion] if panel.share else None)
        looks = {MEASURED: ("o", style.GREY, 3.0, 1), ANY: ("--", style.PURPLE, 0.0, 3)}
        line, colour, size, order = looks.get(name, ("-", style.BLUE, 0.0, 2))
        axes.plot(places, factor * values, line, color=colour, ms=size, lw=1.4, zorder=order, label=name)
    # A free curve may leave what was measured, where it says nothing
    seen = np.concatenate([line.get_ydata() for line in axes.lines if line.get_label() != ANY])
    room = 0.15 * (np.ptp(seen) or 1.0)
    axes.set_ylim(seen.min() - room, seen.max() + room)
    style.dress(axes, up=f"{NAMES[panel.motion]}\n− declared [{unit}]")
