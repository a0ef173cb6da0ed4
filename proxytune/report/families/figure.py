"""The figure of several families: fresh PRPV, PLV and seconds per episode, a row per family."""

from collections.abc import Mapping
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, NullFormatter

from proxytune.learning import Estimate
from proxytune.report.style import BLUE, COLUMN, VERMILLION, dress, legend_below
from proxytune.study import Choice, ComparedFamilies
from proxytune.usefulness import Assessment

BEST, ALIKE, WORSE = "best", "cannot be told from it", "worse"
LOOKS = {BEST: ("o", BLUE, BLUE), ALIKE: ("o", BLUE, "white"), WORSE: ("s", VERMILLION, VERMILLION)}
"""Marker, colour of its edge and of its face: told apart without colours too."""
LONGEST = 16
"""Characters of a name in one line."""


class Panel(NamedTuple):
    """One of the figure's panels.

    Attributes:
        title: What its axis says.
        values: Of each family the value and the ends of its interval; None where an end or all of it is not known.
        choice: Which is best.
        ratios: Whether ratios count, not differences.
    """

    title: str
    values: Mapping[str, tuple[float, float | None, float | None] | None]
    choice: Choice
    ratios: bool = False


def families_figure(compared: ComparedFamilies) -> Figure:
    """Draw each family's fresh PRPV, PLV where there is [teaching], and seconds per episode, with 95 % intervals."""
    panels, names = _panels(compared), [one.name for one in compared.families]
    figure = Figure(figsize=(COLUMN, 1.0 + 0.24 * len(names)), layout="constrained")
    drawn = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for axes, panel in zip(drawn, panels, strict=True):
        _draw(axes, panel, names)
    drawn[0].set_yticks(range(len(names)), [_short(name) for name in names])
    drawn[0].set_ylim(len(names) - 0.5, -0.5)
    shown = {_standing(panel, name) for panel in panels for name in names if panel.values.get(name)}
    for label, (marker, edge, face) in LOOKS.items():
        if label in shown:
            drawn[0].plot([], [], marker, color=edge, markerfacecolor=face, markersize=4.5, label=label)
    legend_below(figure, *drawn)
    return figure


def _panels(compared: ComparedFamilies) -> list[Panel]:
    prpv = {one.name: _of_assessment(one.fresh) for one in compared.families}
    plv = {name: _of_estimate(one.plv) for name, one in compared.lessons.items()}
    taught = [Panel("PLV\n[samples saved]", plv, compared.teaches)] if compared.lessons else []
    costs = Panel("time per\nepisode [s]", dict(compared.seconds_per_episode()), compared.cheapest, ratios=True)
    return [Panel("fresh PRPV\n[ordered pairs]", prpv, compared.predicts), *taught, costs]


def _draw(axes: Axes, panel: Panel, names: list[str]) -> None:
    for place, name in enumerate(names):
        value = panel.values.get(name)
        if value is None:
            axes.annotate(
                "not known", (0.5, place), xycoords=("axes fraction", "data"), fontsize=6.5, ha="center", va="center",
                color="0.3",
            )  # fmt: skip
            continue
        middle, low, high = value
        marker, edge, face = LOOKS[_standing(panel, name)]
        ends = [middle if end is None else end for end in (low, high)]
        axes.plot(ends, [place, place], color=edge, linewidth=1.2)
        axes.plot([middle], [place], marker, color=edge, markerfacecolor=face, markersize=4.5)
    axes.set_xlabel(panel.title, fontsize=8)
    dress(axes)
    axes.margins(x=0.15)
    if panel.ratios:
        axes.set_xscale("log")
        # Exponents would be smaller than can be read.
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
        return
    axes.xaxis.set_major_locator(MaxNLocator(3))
    if not any(_below(one) for one in panel.values.values()):
        axes.set_xlim(left=0.0)


def _standing(panel: Panel, name: str) -> str:
    """How a family stands in a panel."""
    return BEST if name == panel.choice.best else ALIKE if name in panel.choice.alike else WORSE


def _short(name: str) -> str:
    return name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…"


def _below(value: tuple[float, float | None, float | None] | None) -> bool:
    """Whether any of it is below 0."""
    return value is not None and any(one is not None and one < 0.0 for one in value)


def _of_assessment(fresh: Assessment | None) -> tuple[float, float | None, float | None] | None:
    return None if fresh is None else (fresh.prpv.value, fresh.prpv_interval.low, fresh.prpv_interval.high)


def _of_estimate(plv: Estimate | None) -> tuple[float, float | None, float | None] | None:
    return None if plv is None or plv.value is None else (plv.value, plv.low, plv.high)
