"""Still picture of an episode, its scores in proxy and target, and when the two part."""

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure, SubFigure

from proxytune.report import figure_style as style
from proxytune.report.drive.scene import COLOURS, draw_map, draw_parting, draw_paths, map_aspect
from proxytune.report.text import WholeWords, table_text
from proxytune.report.view import Table, columns_of
from proxytune.report.wording import plain, short, with_unit
from proxytune.study import APART_M, SideBySide


def episode_document(pair: SideBySide, study_seed: int) -> dict[str, Any]:
    """Scores as plain numbers.

    Args:
        pair: The episode.
        study_seed: From which its own is derived, as study.toml and `--seed` have it.
    """
    return {
        "agent": pair.episode.agent,
        "start": pair.episode.start,
        "seed": study_seed,
        "theta": dict(pair.episode.theta),
        "proxy": {"metrics": dict(pair.proxy.metrics)},
        "target": None if pair.target is None else {"metrics": dict(pair.target.metrics)},
        "parted_s": pair.parted_s,
    }


def episode_text(pair: SideBySide, first: Sequence[str]) -> WholeWords:
    """A row for each metric, those that the study compares first."""
    names = [*first, *(name for name in pair.proxy.metrics if name not in first)]
    rows = tuple(
        (
            with_unit(name, pair.units[name]),
            *(short(side.metrics[name]) if name in side.metrics else "" for side in pair.sides.values()),
        )
        for name in names
    )
    return table_text(Table("", columns_of(("metric",), list(pair.sides)), rows))


def say_parting(pair: SideBySide) -> str:
    """Say when proxy and target part; empty where that cannot be told."""
    if pair.target is None:
        return ""
    if not (pair.proxy.has_places and pair.target.has_places):
        return "The domain family keeps no places (x, y): where proxy and target part cannot be told."
    if pair.parted_s is None:
        return f"Their places stay within {100.0 * APART_M:g} cm of each other while both drive."
    return f"Their places are first more than {100.0 * APART_M:g} cm apart at {pair.parted_s:.1f} s."


CHANNEL_INCH, PICTURES_INCH, LINE_INCH = 0.62, 0.62, 0.13
"""Heights of a channel of commands, of a row of pictures, and of a line of text."""
INSTANTS = 4
"""Number of pictures shown of each camera."""


def episode_figure(pair: SideBySide, metrics: Sequence[str]) -> Figure:
    """Draw an episode for one column of a paper.

    Args:
        pair: The episode; places are known of every side.
        metrics: Those that stand above the map.
    """
    aspect = map_aspect(pair.road, [episode.places for episode in pair.sides.values()])
    parts: list[tuple[float, Callable[[SubFigure], None]]] = [
        (0.85 * style.COLUMN * aspect + 0.35 + 2 * LINE_INCH, functools.partial(_draw_map, pair, metrics))
    ]
    if channels := pair.proxy.channels:
        parts.append((CHANNEL_INCH * len(channels) + 0.3, functools.partial(_draw_commands, pair)))
    if filmed := sum(episode.pictures is not None for episode in pair.sides.values()):
        parts.append((PICTURES_INCH * filmed + 0.2, functools.partial(_draw_pictures, pair)))
    heights = [inches for inches, _ in parts]
    figure = Figure(figsize=(style.COLUMN, sum(heights)), layout="constrained")
    panels = figure.subfigures(len(parts), 1, height_ratios=heights, squeeze=False)[:, 0]
    for panel, (_, draw) in zip(panels, parts, strict=True):
        draw(panel)
    return figure


def _draw_map(pair: SideBySide, metrics: Sequence[str], figure: SubFigure) -> None:
    axes = figure.subplots()
    draw_map(axes, pair.road, [episode.places for episode in pair.sides.values()])
    draw_paths(axes, pair)
    draw_parting(axes, pair)
    for line, (side, episode) in enumerate(reversed(pair.sides.items())):
        values = [f"{plain(name)} {short(episode.metrics[name])} {pair.units[name]}".strip() for name in metrics]
        axes.annotate(
            f"{side}: {', '.join(values)}",
            (0.0, 1.0), xytext=(0, 6 + 9 * line), xycoords="axes fraction", textcoords="offset points",
            color=COLOURS[side], fontsize=7,
        )  # fmt: skip


def _draw_commands(pair: SideBySide, figure: SubFigure) -> None:
    """One panel a channel, every side in it; commands are held until the next one."""
    channels = pair.proxy.channels
    panels = figure.subplots(len(channels), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, channel in zip(panels, channels, strict=True):
        for side, episode in reversed(pair.sides.items()):
            width = 1.6 if side == "target" else 0.8
            axes.step(
                episode.commands["time"], episode.commands[channel], where="post", color=COLOURS[side], linewidth=width
            )
        axes.axhline(0.0, color=style.LIGHT_GREY, linewidth=0.6, zorder=0)
        if pair.parted_s is not None:
            axes.axvline(pair.parted_s, color="black", linewidth=0.8, linestyle=":")
        axes.set_ylabel(f"{plain(channel)}\n[{pair.command_unit}]" if pair.command_unit else plain(channel), fontsize=7)
        axes.margins(x=0.01)
        style.dress(axes)
    if pair.parted_s is not None:
        panels[0].annotate(
            f"{100 * APART_M:g} cm apart at {pair.parted_s:.1f} s (ring on the map)",
            (pair.parted_s, 1.0), xytext=(0, 2), xycoords=("data", "axes fraction"), textcoords="offset points",
            ha="left" if pair.parted_s < pair.proxy.seconds / 2.0 else "right", fontsize=7,
        )  # fmt: skip
    panels[-1].set_xlabel("time [s]", fontsize=7)


def _draw_pictures(pair: SideBySide, figure: SubFigure) -> None:
    """A row of pictures a side, at instants that every side has reached."""
    filmed = {side: episode for side, episode in pair.sides.items() if episode.pictures is not None}
    end = min(float(episode.commands["time"][-1]) for episode in filmed.values())
    panels = figure.subplots(len(filmed), INSTANTS, squeeze=False)
    instants = np.linspace(0.0, end, INSTANTS)
    for row, (side, episode) in zip(panels, filmed.items(), strict=True):
        assert episode.pictures is not None
        for axes, instant in zip(row, instants, strict=True):
            style.show_photo(axes, episode.pictures[np.argmin(np.abs(episode.commands["time"] - instant))])
            axes.set(xticks=[], yticks=[])
            axes.spines[:].set_edgecolor(style.GREY)
        row[0].set_ylabel(side, color=COLOURS[side], fontsize=7)
    for axes, instant in zip(panels[0], instants, strict=True):
        axes.set_title(f"{instant:.1f} s", fontsize=7, pad=2)
