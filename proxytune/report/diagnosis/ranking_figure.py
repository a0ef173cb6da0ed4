"""The evidence for effects: those added, others that were tried, and free curves over signals."""

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from proxytune.diagnosis import RULES, Findings, TriedEffect
from proxytune.report.style import BLUE, COLUMN, GREY, LIGHT_BLUE, PURPLE, dress, legend_below, plain

SHOWN = 12
"""So many effects are ranked that were not added."""

JUDGES = 5
"""So many signals are ranked beneath them."""

LEAST_GAIN = RULES.least_gain_nats

LINEAR = 20.0
"""Evidence of no more than so many thresholds is drawn on a linear axis."""

ROW, ELSE = 0.145, 0.95
"""Height of a row, and of all else [inch]."""


class _Role(NamedTuple):
    """What a dot stands for."""

    name: str
    edge: str
    face: str


class _Row(NamedTuple):
    """A name, its evidence [nats], and what its dot stands for."""

    name: str
    gain: float
    role: _Role


ADDED = _Role("added", BLUE, BLUE)
RIVAL = _Role("fits as well as one added", LIGHT_BLUE, LIGHT_BLUE)
OTHER = _Role("not added", GREY, GREY)
CHANCE = _Role(f"not added, p > {RULES.p_value:g}", GREY, "white")
SIGNAL = _Role("free curve", PURPLE, PURPLE)


def ranking_figure(found: Findings) -> Figure | None:
    """Draw effects in the order in which they were added, others tried, and signals under any curve, on one axis.

    The evidence of those added is that when they were added; of the others, alone, in the first round. Nothing is
    drawn where nothing was tried.
    """
    parts = {"added, in this order": _added(found), "tried alone": _tried(found), "any curve over": _signals(found)}
    if not parts["tried alone"] or not parts["any curve over"]:
        return None
    parts = {title: rows for title, rows in parts.items() if rows}
    heights = [len(rows) + 1.2 for rows in parts.values()]
    figure = Figure(figsize=(COLUMN, ELSE + ROW * sum(heights)), layout="constrained")
    panels = figure.subplots(len(parts), 1, sharex=True, height_ratios=heights)
    for axes, (title, rows) in zip(panels, parts.items(), strict=True):
        _dots(axes, rows)
        axes.axvline(LEAST_GAIN, color="0.45", lw=1.0, ls=":", label=f"least to be added: {LEAST_GAIN:g} nats")
        axes.set_title(title, fontsize=7, loc="left", pad=2)
    _scale(panels[-1], [row.gain for rows in parts.values() for row in rows])
    panels[-1].set_xlabel("evidence on drives left out [nats]", fontsize=8, loc="right")
    legend_below(figure, *panels, without=[ADDED.name, SIGNAL.name])
    return figure


def _added(found: Findings) -> list[_Row]:
    return [_Row(_name(one.effect, one.form), one.gain, ADDED) for one in found.adopted]


def _tried(found: Findings) -> list[_Row]:
    added = {(one.effect, one.form) for one in found.adopted}
    others = [one for one in found.tried if (one.effect, one.form) not in added]
    return [_Row(_name(one.effect, one.form), one.gain, _role(found, one)) for one in others[:SHOWN]]


def _signals(found: Findings) -> list[_Row]:
    return [_Row(curve.group.name, curve.gain, SIGNAL) for curve in found.curves[:JUDGES]]


def _name(effect: str, form: str) -> str:
    return plain(effect) + (f" ({form})" if form else "")


def _role(found: Findings, tried: TriedEffect) -> _Role:
    if any(rival.effect == tried.effect for one in found.adopted for rival in one.rivals):
        return RIVAL
    return OTHER if tried.p_value <= RULES.p_value else CHANCE


def _scale(axes: Axes, gains: Sequence[float]) -> None:
    """A linear axis for evidence of one size, a logarithmic one with plain numbers where sizes differ by orders."""
    low, high = min(0.0, *gains), max(2.0 * LEAST_GAIN, *gains)
    if high <= LINEAR * LEAST_GAIN:
        axes.set_xlim(low - 0.03 * (high - low), high + 0.03 * (high - low))
        return
    axes.set_xscale("symlog", linthresh=2.0 * LEAST_GAIN, linscale=0.5)
    axes.set_xlim(1.3 * low, 1.5 * high)
    axes.set_xticks([0.0, *(10.0**power for power in range(2, 9) if 10.0**power <= 1.5 * high)])
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}".replace(",", "\u2009")))


def _dots(axes: Axes, rows: Sequence[_Row]) -> None:
    for place, (_, gain, role) in enumerate(rows):
        axes.plot([0.0, gain], [place, place], "-", color=role.edge, lw=0.9, alpha=0.6)
        axes.plot([gain], [place], "o", color=role.edge, mfc=role.face, ms=4, label=role.name)
    axes.set_yticks(range(len(rows)), [row.name for row in rows])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    dress(axes)
    axes.tick_params(axis="y", labelsize=6.5)
