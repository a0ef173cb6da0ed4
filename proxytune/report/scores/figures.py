"""The figures of `score`: proxy against target per metric, and which pairs of agents the proxy flips."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from proxytune.report.style import BLUE, LIGHT_GREY, ORANGE, VERMILLION, dress
from proxytune.scores import Array, ScoreTable
from proxytune.usefulness import Assessment, Comparison, Prpv

PANEL = 3.4
NEAR = 0.035
"""Agents nearer than this fraction of the axes share one label."""
FLIP_COLOURS = {"same": LIGHT_GREY, "lost": BLUE, "invented": ORANGE, "reversed": VERMILLION}


def scatter(assessment: Assessment) -> Figure:
    """Draw each agent's mean score in the proxy against that on the target, one panel per metric.

    Error bars are standard errors over episodes; on the dashed line, proxy and target agree.
    """
    metrics = assessment.inputs.metrics
    figure = Figure(figsize=(PANEL * len(metrics), PANEL), layout="constrained")
    for column, axes in enumerate(figure.subplots(1, len(metrics), squeeze=False)[0]):
        _scatter_panel(axes, assessment.inputs, column)
        r = assessment.srcc.value[metrics[column].name]
        axes.set_title("SRCC undefined" if r is None else f"SRCC {r:.2f}".replace("-", "−"), fontsize=9)
    return figure


def flipped_pairs(prpv: Prpv) -> Figure:
    """Draw which pairs of agents the proxy ranks unlike the target, agents in the target's order, best first."""
    order = _target_order(prpv.inputs)
    place = {agent: row for row, agent in enumerate(order)}
    kinds = list(FLIP_COLOURS)
    cells = np.full((len(order), len(order)), np.nan)
    cells[np.tril_indices(len(order), -1)] = kinds.index("same")
    for pair in prpv.pairs:
        high, low = sorted((place[pair.better], place[pair.worse]))
        cells[low, high] = kinds.index(pair.flip)
    side = max(PANEL, 0.19 * len(order) + 1.2)
    figure = Figure(figsize=(side, side), layout="constrained")
    axes = figure.subplots()
    colours = ListedColormap(list(FLIP_COLOURS.values()))
    axes.pcolormesh(cells, cmap=colours, vmin=-0.5, vmax=len(kinds) - 0.5, edgecolor="white", linewidth=1.0)
    _name_agents(axes, order)
    axes.set_title(f"PRPV {prpv.value} of at most {prpv.range[1]}", fontsize=9)
    axes.legend(handles=_legend(prpv), loc="upper right", fontsize=7, frameon=False)
    return figure


def _scatter_panel(axes: Axes, inputs: Comparison, column: int) -> None:
    proxy, target = (means[:, column] for means in inputs.means)
    errors = (_standard_errors(inputs.target)[:, column], _standard_errors(inputs.proxy)[:, column])
    axes.errorbar(target, proxy, xerr=errors[0], yerr=errors[1], fmt="none", ecolor="0.7", elinewidth=0.8, zorder=1)
    axes.plot(target, proxy, "o", color=BLUE, markersize=4, zorder=2)
    axes.margins(0.1)
    limits = axes.axis()
    axes.axline((0, 0), slope=1, color="0.6", linewidth=0.8, linestyle="--", zorder=0)
    axes.axis(limits)
    name = inputs.metrics[column].name
    axes.set_xlabel(f"{name} on the target", fontsize=8)
    axes.set_ylabel(f"{name} in the proxy", fontsize=8)
    dress(axes)
    _label_agents(axes, inputs.agents, target, proxy)


def _standard_errors(table: ScoreTable) -> Array:
    """Standard error of each agent's mean, shape (agents, metrics); zero for a single episode."""
    squares = np.nansum((table.values - table.means[:, None, :]) ** 2, axis=1)
    counts = table.counts[:, None]
    return np.asarray(np.sqrt(squares / np.maximum(counts - 1, 1) / counts), dtype=np.float64)


def _label_agents(axes: Axes, agents: tuple[str, ...], x: Array, y: Array) -> None:
    """Name the points, those that lie together in one label."""
    spans = np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())
    places = np.column_stack([x / spans[0], y / spans[1]])
    left = list(range(len(agents)))
    while left:
        near = [i for i in left if np.hypot(*(places[i] - places[left[0]])) < NEAR]
        text = ", ".join(agents[i] for i in near[:3]) + (f", {len(near) - 3} more" if len(near) > 3 else "")
        right = places[near[0], 0] * spans[0] > np.mean(axes.get_xlim())
        axes.annotate(
            text,
            (x[near[0]], y[near[0]]),
            xytext=(-4 if right else 4, 3),
            textcoords="offset points",
            ha="right" if right else "left",
            fontsize=6,
        )
        left = [i for i in left if i not in near]


def _target_order(inputs: Comparison) -> list[str]:
    """Agents by their mean rank over the metrics on the target, best first."""
    merits = [metric.merits(inputs.target.means[:, column])[0] for column, metric in enumerate(inputs.metrics)]
    ranks = np.mean([(merit[:, None] < merit).sum(axis=1) for merit in merits], axis=0)
    return [inputs.agents[row] for row in np.argsort(ranks, kind="stable")]


def _name_agents(axes: Axes, order: list[str]) -> None:
    ticks = np.arange(len(order)) + 0.5
    axes.set_xticks(ticks[:-1], order[:-1], rotation=90, fontsize=6)
    axes.set_yticks(ticks[1:], order[1:], fontsize=6)
    axes.invert_yaxis()
    axes.set_aspect("equal")
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_xlabel("agent (best on the target first)", fontsize=8)
    axes.set_ylabel("agent", fontsize=8)


def _legend(prpv: Prpv) -> list[Patch]:
    agents = len(prpv.inputs.agents)
    counts = {kind: sum(pair.flip == kind for pair in prpv.pairs) for kind in FLIP_COLOURS}
    counts["same"] = agents * (agents - 1) // 2 - len(prpv.pairs)
    return [Patch(color=colour, label=f"{kind}: {counts[kind]}") for kind, colour in FLIP_COLOURS.items()]
