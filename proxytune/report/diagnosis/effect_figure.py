"""The figure of the first effect that was added, or of the signal that no named effect accounts for."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

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
    drawn_wheel_speeds,
    wheel_speeds,
)
from proxytune.effects import Catalogue, Means, WheelCurve
from proxytune.report.diagnosis.means import ANY, GROUPS, draw_means, means_figure, rates_of, retuned
from proxytune.report.diagnosis.model_names import BEFORE, after
from proxytune.report.style import BLUE, COLUMN, LIGHT_GREY, PURPLE, VERMILLION, dress, legend_below
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
        return None if best is None else means_figure(diagnosis, best, GROUPS[best.group.name])
    first = found.adopted[0]
    kind = _curve_kind(first, diagnosis.robot.catalogue)
    if isinstance(kind, Means):
        return means_figure(diagnosis, _curve(found.curves, kind.cue), kind.panels)
    return _wheels_figure(diagnosis) if kind is WheelCurve.STEADY else _steps_figure(diagnosis)


def _curve_kind(effect: AdoptedEffect, catalogue: Catalogue) -> WheelCurve | Means:
    trace = catalogue.effect(effect.effect).trace
    return trace.shown_in(effect.form) if trace else WheelCurve.STEP


def _curve(curves: Sequence[SignalCurve], name: str) -> SignalCurve | None:
    return next((curve for curve in curves if curve.group.name == name), None)


def _wheels_figure(diagnosis: Diagnosis) -> Figure:
    """Steady wheel speed against command above, what is added to the declared model beneath."""
    drives = diagnosis.found.declared.drives
    figure = Figure(figsize=(COLUMN, 3.4), layout="constrained")
    panels = figure.subplots(2, 2, sharex="col", sharey="row")
    rates = rates_of(diagnosis, _curve(diagnosis.found.curves, "wheel command"))
    commands = np.linspace(float(drives.duties.min()), float(drives.duties.max()), COMMANDS)
    models = _steady_models(diagnosis, commands)
    for column, side in enumerate(("left", "right")):
        _draw_steady(panels[0, column], commands, {name: steady[:, column] for name, steady in models.items()})
        place = np.interp(rates.declared[side], models[BEFORE][:, column], commands)
        draw_means(panels[1, column], rates, place, GROUPS["wheel command"][column])
        panels[0, column].set_title(f"{side} wheel", fontsize=8)
        panels[1, column].set_xlabel("command [duty]", fontsize=8)
    for row, label in enumerate(("steady speed [m/s]", "speed − declared\n[mm/s]")):
        panels[row, 0].set_ylabel(label, fontsize=8)
        panels[row, 1].set_ylabel("")
    legend_below(figure, *panels.ravel())
    return figure


def _steady_models(diagnosis: Diagnosis, commands: Floats) -> dict[str, Floats]:
    """Steady wheel speeds (commands, 2) [m/s] of every model, by name: declared, extended, with the flexible curve."""
    found, drives = diagnosis.found, diagnosis.found.declared.drives
    before = _steady(drives, found.declared.theta, commands)
    models = {BEFORE: before, after(diagnosis): _steady(drives, found.model.theta, commands)}
    curve = _curve(found.curves, "wheel command")
    if curve is not None and curve.gain > 0.0:
        extra = [np.interp(before[:, side], *_flexible(diagnosis, curve, side)) for side in (0, 1)]
        models[ANY] = _steady(drives, retuned(found.declared, curve), commands) + np.stack(extra, axis=1)
    return models


def _draw_steady(axes: Axes, commands: Floats, models: Mapping[str, Floats]) -> None:
    for name, speeds in models.items():
        style, colour = {BEFORE: ("-", VERMILLION), ANY: ("--", PURPLE)}.get(name, ("-", BLUE))
        axes.plot(commands, speeds, style, color=colour, lw=1.3, label=name)
    dress(axes)


def _steady(drives: Drives, theta: Theta, commands: Floats) -> Floats:
    """Wheel speeds (commands, 2) [m/s] that a model comes to from rest when both wheels get the same command."""
    ticks = round(HELD_S * drives.tick_hz)
    duties = np.broadcast_to(commands[:, None, None], (len(commands), ticks, 2))
    return wheel_speeds(_driven(drives, duties), theta)[:, -1] * drives.robot.figures["full_speed"]


def _driven(drives: Drives, duties: Floats) -> Drives:
    """The same robot from rest under other commands (E, T, 2), nothing being measured."""
    still, unmeasured = np.zeros((len(duties), 2)), drives.only(np.zeros(len(drives.episode), dtype=bool))
    return replace(unmeasured, duties=duties, rest=still, headings=np.zeros(duties.shape[:2]), wheels=None)


def _flexible(diagnosis: Diagnosis, curve: SignalCurve, column: int) -> tuple[Floats, Floats]:
    """The flexible wheel curve: speeds of the declared model in order and what is added to them, both [m/s]."""
    drives, figures = diagnosis.found.declared.drives, diagnosis.robot.figures
    speeds = wheel_speeds(drives, diagnosis.found.declared.theta)[..., column].ravel() * figures["full_speed"]
    twists = curve.group.twists @ curve.weights
    side = (-1.0, 1.0)[column] * figures["effective_baseline"] / 2.0
    speeds, where = np.unique(speeds, return_index=True)
    return speeds, (twists[..., 0] + side * twists[..., 2]).ravel()[where]


def _steps_figure(diagnosis: Diagnosis) -> Figure:
    """Wheel speed after a step of the command and, for backlash, after its reversal."""
    found, drives = diagnosis.found, diagnosis.found.declared.drives
    figure = Figure(figsize=(COLUMN, 2.4), layout="constrained")
    axes = figure.subplots()
    catalogue = diagnosis.robot.catalogue
    reverses = any(_curve_kind(one, catalogue) is WheelCurve.REVERSAL for one in found.adopted)
    lasts = STEPS_S if reverses else STEP_S
    times = np.arange(round(lasts * drives.tick_hz)) / drives.tick_hz
    size = min(0.5, float(np.abs(drives.duties).max()))
    duties = np.repeat(np.where(times < STEP_S, size, -size)[None, :, None], 2, axis=2)
    column = int(found.adopted[0].form.startswith("right"))
    full = drives.robot.figures["full_speed"]
    # An area, which no line on its edge can hide.
    axes.fill_between(times, duties[0, :, 0] * full, color=LIGHT_GREY, linewidth=0, zorder=0, label="command")
    for fitted, colour, name in ((found.declared, VERMILLION, BEFORE), (found.model, BLUE, after(diagnosis))):
        draws = full * _responses(_driven(drives, duties), fitted.theta)[..., column]
        _draw_responses(axes, times, draws, colour, name)
    axes.set_xlabel("time since the command [s]", fontsize=8)
    axes.set_ylabel(f"speed of the {('left', 'right')[column]} wheel [m/s]", fontsize=8)
    dress(axes)
    legend_below(figure, axes)
    return figure


def _draw_responses(axes: Axes, times: Floats, draws: Floats, colour: str, name: str) -> None:
    """The median, and single draws where there are several."""
    if len(draws) > 1:
        axes.plot(times, draws.T, color=colour, lw=0.4, alpha=0.4)
        name += " (thin: single draws)"
    axes.plot(times, np.median(draws, axis=0), color=colour, lw=1.4, label=name)


def _responses(drives: Drives, theta: Theta) -> Floats:
    """Wheel speeds (draws, T, 2) as fractions of full speed: one draw unless the model has a random effect."""
    if not any(theta.get(name, 0.0) > 0.0 for name in RANDOM_EFFECTS):
        return wheel_speeds(drives, theta)
    return np.stack([drawn_wheel_speeds(drives, theta, seed)[0] for seed in range(DRAWS)])
