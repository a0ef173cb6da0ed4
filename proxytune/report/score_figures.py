"""Figures of `score`: proxy against target per metric, and which pairs of agents the proxy flips."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from scipy.stats import rankdata

from proxytune.arrays import Floats
from proxytune.report import figure_style as style
from proxytune.report.wording import plain
from proxytune.scores import ScoreTable
from proxytune.usefulness import Assessment, Comparison, Prpv

PANEL = 2.2
"""Height of a metric's panel, where names do not need more [inch]."""
MOST = 28
"""Agents that can be named at 85 mm. Of more, the decision names those of least regret, the scatter those whose rank in
the proxy is farthest from that on the target, and pairs are drawn over ranks on the target."""
LINE = 0.1
"""Height of a name [inch]."""
LONGEST = 24
"""Characters of a name; of a longer one its end is shown, which tells agents of one module apart."""
FLIP_COLOURS = {"same": style.LIGHT_GREY, "lost": style.BLUE, "invented": style.ORANGE, "reversed": style.VERMILLION}


def scatter_figure(assessment: Assessment) -> Figure:
    """Draw each agent's mean score in the proxy against that on the target, one panel per metric."""
    metrics, agents = assessment.inputs.metrics, assessment.inputs.agents
    height = max(PANEL, LINE * min(MOST, len(agents)) + 0.6)
    figure, panels = style.grid_of(height * len(metrics), len(metrics), 1)
    for column, axes in enumerate(panels.flat):
        proxy, target = (means[:, column] for means in assessment.inputs.means)
        up, across = (_standard_errors(one)[:, column] for one in (assessment.inputs.proxy, assessment.inputs.target))
        axes.errorbar(target, proxy, xerr=across, yerr=up, fmt="none", ecolor=style.GREY, lw=0.8, zorder=1)
        axes.plot(target, proxy, "o", color=style.BLUE, markersize=4, zorder=2)
        axes.margins(0.1)
        limits = axes.axis()
        axes.axline((0, 0), slope=1, color=style.GREY, linewidth=0.8, linestyle="--", zorder=0)
        axes.axis(limits)
        name = plain(metrics[column].name)
        style.dress(axes, f"{name} on the target", f"{name} in the proxy")
        _name_points(axes, assessment.inputs, column, LINE / (height - 0.6))
        r = assessment.srcc.value[metrics[column].name]
        axes.set_title("SRCC undefined" if r is None else f"SRCC {r:.2f}".replace("-", "−"), fontsize=8)
    return figure


def flipped_pairs_figure(prpv: Prpv) -> Figure:
    """Draw which pairs of agents the proxy ranks unlike the target, agents in the target's order, best first."""
    metrics, means = prpv.inputs.metrics, prpv.inputs.target.means
    merits = [metric.merits(means[:, column])[0] for column, metric in enumerate(metrics)]
    ranks = np.mean([(merit[:, None] < merit).sum(axis=1) for merit in merits], axis=0)
    order = [prpv.inputs.agents[row] for row in np.argsort(ranks, kind="stable")]
    place = {agent: row for row, agent in enumerate(order)}
    kinds = list(FLIP_COLOURS)
    cells = np.full((len(order), len(order)), np.nan)
    cells[np.tril_indices(len(order), -1)] = kinds.index("same")
    for pair in prpv.pairs:
        high, low = sorted((place[pair.better], place[pair.worse]))
        cells[low, high] = kinds.index(pair.flip)
    figure, axes = style.one_panel(style.COLUMN)
    colours, ends = ListedColormap(list(FLIP_COLOURS.values())), (-0.5, len(FLIP_COLOURS) - 0.5)
    if len(order) <= MOST:
        axes.pcolormesh(cells, cmap=colours, vmin=ends[0], vmax=ends[1], edgecolor="white", linewidth=0.8)
        ticks, names = np.arange(len(order)) + 0.5, [short_name(agent) for agent in order]
        axes.set_xticks(ticks[:-1], names[:-1], rotation=90, fontsize=7)
        axes.set_yticks(ticks[1:], names[1:], fontsize=7)
    else:  # Colours are mixed where squares are smaller than a pixel: none is lost.
        axes.imshow(
            cells, cmap=colours, vmin=ends[0], vmax=ends[1], extent=(0, len(cells), 0, len(cells)), origin="lower",
            interpolation="antialiased", interpolation_stage="rgba",
        )  # fmt: skip
    axes.invert_yaxis()
    axes.set_aspect("equal")
    axes.tick_params(length=0, labelsize=7)
    axes.spines[:].set_visible(False)
    axes.set_xlabel("agent (best on the target first)", fontsize=8)
    axes.set_ylabel("agent", fontsize=8)
    axes.set_title(f"PRPV {prpv.value} of at most {prpv.range[1]}", fontsize=8)
    counts = {kind: sum(pair.flip == kind for pair in prpv.pairs) for kind in FLIP_COLOURS}
    counts["same"] = len(order) * (len(order) - 1) // 2 - len(prpv.pairs)
    patches = [Patch(color=colour, label=f"{kind}: {counts[kind]}") for kind, colour in FLIP_COLOURS.items()]
    axes.legend(handles=patches, loc="upper right", fontsize=7, frameon=False)
    return figure


def _standard_errors(table: ScoreTable) -> Floats:
    """Standard error of each agent's mean, shape (agents, metrics); zero for a single episode."""
    squares = np.nansum((table.values - table.means[:, None, :]) ** 2, axis=1)
    counts = table.counts[:, None]
    return np.asarray(np.sqrt(squares / np.maximum(counts - 1, 1) / counts), dtype=np.float64)


def _name_points(axes: Axes, inputs: Comparison, column: int, apart: float) -> None:
    """Name points right of the panel, each with a thin line to its point."""
    proxy, target = (means[:, column] for means in inputs.means)
    # Of many agents, those whose ranks in proxy and target differ most.
    moved = np.abs(rankdata(proxy) - rankdata(target))
    shown = [int(row) for row in np.argsort(-moved, kind="stable")[:MOST]]
    bottom, top = axes.get_ylim()
    # Points of one score in the proxy: those farther right on top, so that their lines cross less.
    shown = sorted(shown, key=lambda row: (proxy[row], target[row]))
    look = {"arrowstyle": "-", "lw": 0.4, "color": style.LIGHT_BLUE, "shrinkA": 0, "shrinkB": 2, "relpos": (0, 0.5)}
    places = style.spread_places([(proxy[row] - bottom) / (top - bottom) for row in shown], apart)
    for row, place in zip(shown, places, strict=True):
        axes.annotate(
            short_name(inputs.agents[row]), (target[row], proxy[row]), (1.04, place), textcoords="axes fraction",
            ha="left", va="center", fontsize=7, annotation_clip=False, arrowprops=look,
        )  # fmt: skip


def short_name(agent: str) -> str:
    """An agent's name, of a long one its end."""
    return agent if len(agent) <= LONGEST else f"…{agent[1 - LONGEST :]}"
