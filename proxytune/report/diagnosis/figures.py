"""Figures of a diagnosis of motion: all of them, the evidence for each effect, and what was learnt."""

from collections.abc import Mapping, Sequence
from math import ceil
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from proxytune.diagnosis import Diagnosis, Findings, Learning, Rules
from proxytune.effects import GROUPS, HEADING, LEVEL, OF_PLACE, PLACE, Learnt, LearntCurve, learnt_effect
from proxytune.files import package_table
from proxytune.report import figure_style as style
from proxytune.report.diagnosis.effect_figure import effect_curve
from proxytune.report.diagnosis.error_figures import error_figure, residual_map, residual_over_time, strayed
from proxytune.report.wording import plain


def motion_figures(diagnosis: Diagnosis) -> Mapping[str, Figure]:
    """Draw everything that a diagnosis has to show, by the name of the figure; what has nothing to show is left out."""
    both = strayed(diagnosis)
    figures = {
        "residual_over_time": residual_over_time(diagnosis.parts.tested, both),
        "residual_map": residual_map(diagnosis.parts.tested, both),
        "ranking": ranking_figure(diagnosis.found, diagnosis.rules),
        "effect_curve": effect_curve(diagnosis),
        "learnt": learnt_figure(diagnosis.learning),
        "error": error_figure(diagnosis),
    }
    return {name: figure for name, figure in figures.items() if figure is not None}


SHOWN = 12
"""So many effects are ranked that were not added."""
JUDGES = 5
"""So many signals are ranked beneath them."""
LINEAR = 20.0
"""Evidence of no more than so many thresholds is drawn on a linear axis."""
ROW, ELSE = 0.145, 0.95
"""Height of a row, and of all else [inch]."""
ADDED = style.Role("added", style.BLUE)
RIVAL = style.Role("fits as well as one added", style.LIGHT_BLUE)
OTHER = style.Role("not added", style.GREY)
SIGNAL = style.Role("free curve", style.PURPLE)


def ranking_figure(found: Findings, rules: Rules) -> Figure | None:
    """Draw effects in the order in which they were added, others tried, and signals under any curve, on one axis.

    The evidence of those added is that when they were added; of the others, alone, in the first round. Nothing is
    drawn where nothing was tried.
    """
    chance, least = style.Role(f"not added, p > {rules.p_value:g}", style.GREY, "white"), rules.least_gain_nats
    rivals = {rival.effect for one in found.adopted for rival in one.rivals}
    forms = {(one.effect, one.form) for one in found.adopted}
    others = [one for one in found.tried if (one.effect, one.form) not in forms][:SHOWN]
    added = [(_name(one.effect, one.form), one.gain, ADDED) for one in found.adopted]
    roles = [RIVAL if one.effect in rivals else OTHER if one.p_value <= rules.p_value else chance for one in others]
    tried = [(_name(one.effect, one.form), one.gain, role) for one, role in zip(others, roles, strict=True)]
    signals: list[tuple[str, float, style.Role]] = [
        (curve.group.name, curve.gain, SIGNAL) for curve in found.curves[:JUDGES]
    ]
    if not tried or not signals:
        return None
    parts = {"added, in this order": added} if added else {}
    parts |= {"tried alone": tried, "any curve over": signals}
    heights = [len(rows) + 1.2 for rows in parts.values()]
    figure, grid = style.grid_of(ELSE + ROW * sum(heights), len(parts), 1, sharex=True, height_ratios=heights)
    panels = list(grid.flat)
    for axes, (title, rows) in zip(panels, parts.items(), strict=True):
        style.draw_ranked(axes, rows)
        axes.axvline(least, color="0.45", lw=1.0, ls=":", label=f"least to be added: {least:g} nats")
        axes.set_title(title, fontsize=7, loc="left", pad=2)
    _scale(panels[-1], [gain for rows in parts.values() for _, gain, _ in rows], least)
    panels[-1].set_xlabel("evidence on drives left out [nats]", fontsize=8, loc="right")
    style.legend_below(figure, *panels, without=[ADDED.name, SIGNAL.name])
    return figure


def _name(effect: str, form: str) -> str:
    return plain(effect) + (f" ({form})" if form else "")


def _scale(axes: Axes, gains: Sequence[float], least: float) -> None:
    """A linear axis for evidence of one size, a logarithmic one with plain numbers where sizes differ by orders."""
    low, high = min(0.0, *gains), max(2.0 * least, *gains)
    if high <= LINEAR * least:
        axes.set_xlim(low - 0.03 * (high - low), high + 0.03 * (high - low))
        return
    axes.set_xscale("symlog", linthresh=2.0 * least, linscale=0.5)
    axes.set_xlim(1.3 * low, 1.5 * high)
    axes.set_xticks([0.0, *(10.0**power for power in range(2, 9) if 10.0**power <= 1.5 * high)])
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}".replace(",", "\u2009")))


SHOWN_AS = {"m/s": (1e3, "mm/s"), "rad/s": (180.0 / np.pi, "deg/s"), "rad/m": (180.0 / np.pi, "deg/m")}
"""Units in which weights are told, by their own: a factor and its unit; shares in per cent."""
_WORDS = package_table("report/templates/learnt.toml")
FADING: Mapping[str, str] = _WORDS["fading"]
"""Groups whose weights are points, each of something that fades or ends, and what their knots are."""
PAIRS: Mapping[str, tuple[str, str]] = _WORDS["pairs"]
"""Groups over two signals, and what their axes are called."""
WIDEST, HIGHEST = 20, 18
"""Characters in a line below a panel, and beside it."""
MOST_TICKS = 5


def learnt_figure(learning: Learning) -> Figure | None:
    """A panel for each learnt curve, two in a row, largest share first; nothing where none is used."""
    if (effect := learnt_effect(learning.theta)) is None:
        return None
    order = list(learning.discrepancy.share)
    members = {curve.group for curve in effect.curves} - {LEVEL}
    groups = sorted(members, key=lambda group: order.index(GROUPS[group].title))
    by_group = [[curve for curve in effect.curves if curve.group == group] for group in groups]
    curves = [one for row in by_group for one in (_courses(row) if row[0].group == HEADING else row)]
    figure, panels = style.panel_grid(len(curves), 1.65, 0.25)
    for axes, curve in zip(panels, curves, strict=True):
        _draw_learnt(axes, effect, curve)
    figure.suptitle("learnt from drives, not physics: what is added", fontsize=8)
    return figure


def _courses(curves: Sequence[LearntCurve]) -> list[LearntCurve]:
    """Harmonics of the heading as curves over it, one for each direction."""
    around = np.linspace(0.0, 360.0, 73)
    courses = []
    for to in dict.fromkeys(curve.channel.split("_")[0] for curve in curves):
        total = np.zeros(len(around))
        for curve in curves:
            if curve.channel.startswith(to):
                wave = np.cos if curve.channel.endswith("cos") else np.sin
                total += wave(np.radians(around)[:, None] * np.asarray(curve.knots)) @ np.asarray(curve.weights)
        courses.append(LearntCurve(HEADING, to, tuple(around.tolist()), tuple(total.tolist())))
    return courses


def _draw_learnt(axes: Axes, effect: Learnt, curve: LearntCurve) -> None:
    group = GROUPS[curve.group]
    unit = group.channels[curve.channel if curve.group != HEADING else f"{curve.channel}_cos"].unit
    factor, label_unit = SHOWN_AS.get(unit, (100.0, f"% {unit}"))
    label = fill(f"{plain(curve.channel)} [{label_unit}]", HIGHEST)
    if curve.group in PAIRS:
        _surface(axes, curve, factor, label)
    else:
        _line(axes, curve, factor)
        of = f"{group.title}, {FADING[curve.group]}" if curve.group in FADING else group.title
        axes.set_xlabel(fill(f"{of} [{'deg' if curve.group == HEADING else group.unit}]", WIDEST), fontsize=7)
        axes.set_ylabel(label, fontsize=8)
        axes.axhline(0.0, color=style.GREY, lw=0.6)
    if curve.group == "turn_rate":
        axes.axvspan(*effect.seen.yaw, color=style.GREY, alpha=0.12, lw=0)
    style.dress(axes)


def _line(axes: Axes, curve: LearntCurve, factor: float) -> None:
    """A curve through its knots, and through 0 at 0 but over places; what fades is points."""
    knots, weights = np.array(curve.knots), factor * np.array(curve.weights)
    if curve.group in FADING:
        axes.set_xscale("log")
        shown = knots[:: ceil(len(knots) / MOST_TICKS)]
        axes.set_xticks(shown, [f"{knot:g}" for knot in shown])
        axes.set_xticks([], minor=True)
        axes.vlines(knots, 0.0, weights, color=style.BLUE, lw=1.0)
        axes.plot(knots, weights, "o", color=style.BLUE, ms=4)
        return
    if curve.group not in (HEADING, *OF_PLACE):
        order = np.argsort(np.append(knots, 0.0))
        knots, weights = np.append(knots, 0.0)[order], np.append(weights, 0.0)[order]
    axes.plot(knots, weights, "-" if curve.group == HEADING else ".-", color=style.BLUE, lw=1.3, ms=5)


def _surface(axes: Axes, curve: LearntCurve, factor: float, label: str) -> None:
    """Colours over two signals."""
    places, weights = np.array(curve.knots), factor * np.array(curve.weights)
    zero = [0.0] if curve.group != PLACE else []
    across, up = (np.unique(np.append(axis, zero)) for axis in places.T)
    values = np.zeros((len(up), len(across)))
    values[np.searchsorted(up, places[:, 1]), np.searchsorted(across, places[:, 0])] = weights
    most = float(np.abs(values).max()) or 1.0
    mesh = axes.pcolormesh(across, up, values, shading="gouraud", cmap="RdBu_r", vmin=-most, vmax=most)
    axes.set_xlabel(PAIRS[curve.group][0], fontsize=8)
    axes.set_ylabel(PAIRS[curve.group][1], fontsize=8)
    bar = axes.figure.colorbar(mesh, ax=axes)
    bar.set_label(label, fontsize=8)
    bar.ax.tick_params(labelsize=7)
