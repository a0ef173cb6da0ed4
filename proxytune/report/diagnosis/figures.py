"""The figures of a diagnosis: what the declared model leaves over, why, and what the added effects are worth."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.diagnosis.horizon.windows import Rmse
from proxytune.diagnosis.horizon_error import HorizonError
from proxytune.diagnosis.naming.findings import TriedEffect
from proxytune.diagnosis.result import Diagnosis
from proxytune.diagnosis.rules import RULES
from proxytune.report.diagnosis.effect_figure import effect_curve
from proxytune.report.diagnosis.learnt_figure import learnt_figure
from proxytune.report.diagnosis.model_names import BEFORE, after
from proxytune.report.diagnosis.residual_figure import residual_map, residual_over_time, strayed
from proxytune.report.style import BLUE, GREEN, GREY, LIGHT_BLUE, PURPLE, VERMILLION, dress, legend_below, plain

SHOWN = 15
"""So many candidates are ranked."""

JUDGES = 6
"""So many signals are ranked beneath them."""

LEAST_GAIN = RULES.least_gain_nats

LINEAR = 20.0
"""Evidence of no more than so many thresholds is drawn on a linear axis."""


class _Role(NamedTuple):
    """What a dot of the ranking stands for."""

    name: str
    edge: str
    face: str


ADOPTED = _Role("adopted", BLUE, BLUE)
RIVAL = _Role("rival of an adopted effect", LIGHT_BLUE, LIGHT_BLUE)
OTHER = _Role("other named effect", GREY, GREY)
CHANCE = _Role(f"named effect, p > {RULES.p_value:g}", GREY, "white")
SIGNAL = _Role("free curve over this signal", PURPLE, PURPLE)


def diagnosis_figures(diagnosis: Diagnosis) -> Mapping[str, Figure]:
    """Draw everything that a diagnosis has to show, by the name of the figure.

    What has nothing to show is left out: the curve of an effect where none was added and no signal explains anything,
    the learnt curves where none are used.
    """
    both = strayed(diagnosis)
    figures = {
        "residual_over_time": residual_over_time(diagnosis.parts.tested, both),
        "residual_map": residual_map(diagnosis.parts.tested, both),
        "ranking": _ranking(diagnosis),
        "effect_curve": effect_curve(diagnosis),
        "learnt": learnt_figure(diagnosis.learning),
        "error": _errors(diagnosis),
    }
    return {name: figure for name, figure in figures.items() if figure is not None}


def _ranking(diagnosis: Diagnosis) -> Figure | None:
    """Named effects above, signals that any curve may be drawn over beneath, on one axis of evidence."""
    tried, judges = diagnosis.found.tried[:SHOWN], diagnosis.found.curves[:JUDGES]
    if not tried or not judges:
        return None
    figure = Figure(figsize=(5.2, 1.2 + 0.16 * (len(tried) + len(judges))), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(len(tried) + 0.5, len(judges) + 0.5))
    named = [(plain(one.effect) + (f" ({one.form})" if one.form else ""), one.gain) for one in tried]
    _dots(upper, named, [_role(diagnosis, one) for one in tried])
    _dots(lower, [(curve.group.name, curve.gain) for curve in judges], [SIGNAL] * len(judges))
    _scale(lower, [*(one.gain for one in tried), *(curve.gain for curve in judges)])
    for axes in (upper, lower):
        axes.axvline(LEAST_GAIN, color="0.45", lw=1.0, ls=":", label=f"least evidence to be added, {LEAST_GAIN:g} nats")
    lower.set_xlabel("evidence: log-likelihood gained on drives left out [nats]", fontsize=8)
    legend_below(figure, upper, lower)
    return figure


def _scale(axes: Axes, gains: Sequence[float]) -> None:
    """A linear axis for evidence of one size, a logarithmic one where sizes differ by orders."""
    low, high = min(0.0, *gains), max(2.0 * LEAST_GAIN, *gains)
    if high > LINEAR * LEAST_GAIN:
        axes.set_xscale("symlog", linthresh=2.0 * LEAST_GAIN, linscale=0.5)
        axes.set_xlim(1.3 * low, 1.5 * high)
    else:
        axes.set_xlim(low - 0.03 * (high - low), high + 0.03 * (high - low))


def _role(diagnosis: Diagnosis, tried: TriedEffect) -> _Role:
    adopted = diagnosis.found.adopted
    if any((one.effect, one.form) == (tried.effect, tried.form) for one in adopted):
        return ADOPTED
    if any(rival.effect == tried.effect for one in adopted for rival in one.rivals):
        return RIVAL
    return OTHER if tried.p_value <= RULES.p_value else CHANCE


def _dots(axes: Axes, ranked: Sequence[tuple[str, float]], roles: Sequence[_Role]) -> None:
    for place, ((_, gain), role) in enumerate(zip(ranked, roles, strict=True)):
        axes.plot([0.0, gain], [place, place], "-", color=role.edge, lw=0.9, alpha=0.6)
        axes.plot([gain], [place], "o", color=role.edge, mfc=role.face, ms=4, label=role.name)
    axes.set_yticks(range(len(ranked)), [name for name, _ in ranked])
    axes.set_ylim(len(ranked) - 0.4, -0.6)
    dress(axes)


def _errors(diagnosis: Diagnosis) -> Figure:
    """Position and heading by horizon, before and after, with the error that noise alone makes."""
    figure = Figure(figsize=(5.2, 2.7), layout="constrained")
    place, heading = figure.subplots(1, 2)
    errors = diagnosis.errors
    floors = [(_bracket(error), (np.degrees(error.heading_floor),) * 2) for error in errors]
    pairs = [(BEFORE, VERMILLION, "o", -0.08), (after(diagnosis), BLUE, "s", 0.08)]
    for axes, factor, heads, column in ((place, 1e3, False, 0), (heading, 180.0 / np.pi, True, 1)):
        for number, (name, colour, marker, shift) in enumerate(pairs[: 2 if diagnosis.effects else 1]):
            rms_errors = [_before_and_after(error, heads)[number] for error in errors]
            _estimates(axes, rms_errors, factor, (colour, marker, name, shift))
        spots = range(len(errors))
        _draw_floor(axes, [floor[column] for floor in floors])
        axes.set_xticks(spots, [f"{error.horizon_s:g}" for error in errors])
        axes.set_xlim(-0.5, len(errors) - 0.5)
        axes.set_xlabel("length of the prediction [s]", fontsize=8)
        axes.set_ylim(bottom=0.0)
        dress(axes)
    place.set_ylabel("error of position, RMS [mm]", fontsize=8)
    heading.set_ylabel("error of heading, RMS [deg]", fontsize=8)
    legend_below(figure, place)
    return figure


def _bracket(error: HorizonError) -> tuple[float, float]:
    """The noise floor of position, lower and upper end [mm]."""
    return 1e3 * error.floor.lower, 1e3 * error.floor.upper


def _draw_floor(axes: Axes, brackets: Sequence[tuple[float, float]]) -> None:
    """A bar from the lower to the upper end, a line at the lower."""
    spots, lower = np.arange(len(brackets)), [low for low, _ in brackets]
    axes.bar(spots, [high - low for low, high in brackets], 0.5, lower, color=GREEN, alpha=0.2, zorder=0)
    axes.hlines(lower, spots - 0.25, spots + 0.25, color=GREEN, lw=1.4, label="noise floor: poses alone, to upper end")


def _before_and_after(error: HorizonError, heads: bool) -> tuple[Rmse, Rmse]:
    return (error.heading_before, error.heading_after) if heads else (error.before, error.after)


def _estimates(axes: Axes, rms_errors: Sequence[Rmse], factor: float, style: tuple[str, str, str, float]) -> None:
    """Values with their intervals, where those are finite."""
    colour, marker, name, shift = style
    values = factor * np.array([one.value for one in rms_errors])
    ends = factor * np.array([one.interval for one in rms_errors])
    whole = np.isfinite(ends).all(axis=1, keepdims=True)
    ends = np.where(whole, ends, values[:, None])
    arms = np.maximum(0.0, np.stack((values - ends[:, 0], ends[:, 1] - values)))
    axes.errorbar(
        np.arange(len(rms_errors)) + shift,
        values,
        yerr=arms,
        fmt=marker,
        color=colour,
        ms=4,
        capsize=2,
        lw=1.0,
        label=name,
    )
