"""Still picture of an episode, the map that a movie has too, the scores in proxy and target, and when the two part."""

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.patheffects import Stroke, withStroke

from proxytune.arrays import Floats
from proxytune.driving import draw_floor
from proxytune.report import figure_style as style
from proxytune.report.text import WholeWords, table_text
from proxytune.report.view import Table, columns_of
from proxytune.report.wording import plain, short, with_unit
from proxytune.study import APART_M, SideBySide


def episode_document(pair: SideBySide, study_seed: int) -> dict[str, Any]:
    """Scores as plain numbers, and the seed that the episode's own is derived from, as study.toml and `--seed` say."""
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
    rows = []
    for name in names:
        scores = (short(side.metrics[name]) if name in side.metrics else "" for side in pair.sides.values())
        rows.append((with_unit(name, pair.units[name]), *scores))
    return table_text(Table("", columns_of(("metric",), list(pair.sides)), tuple(rows)))


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
    """Draw an episode, of which places are known on every side, with these metrics above the map."""
    width, height = pair.road.size if pair.road is not None else np.subtract(*_bounds(pair)[::-1])
    aspect = float(np.clip(height / width, 0.4, 2.0))
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
    draw_map(axes, pair)
    draw_paths(axes, pair)
    if pair.parted_s is not None:
        place = pair.proxy.places[np.searchsorted(pair.proxy.poses["time"], pair.parted_s)]
        axes.plot(*place, "o", color="black", markersize=9, fillstyle="none", markeredgewidth=0.9)
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
            axes.step(episode.commands["time"], episode.commands[channel], where="post", color=COLOURS[side], lw=width)
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


COLOURS: Mapping[str, str] = {"proxy": style.BLUE, "target": style.VERMILLION}
PALER = 0.6
"""The floor is drawn this much nearer to white, so that paths stand out."""
MARGIN_M = 0.2
"""Round paths that no map bounds."""
CASING = (Stroke(linewidth=2.6, foreground="white"), withStroke(linewidth=0.0))
"""A white edge round thin lines."""
HALO = (withStroke(linewidth=2.0, foreground="white"),)
"""A white edge round letters."""


def draw_map(axes: Axes, pair: SideBySide) -> None:
    """Draw the floor that the camera sees, from above; without a road only axes round the paths."""
    if (road := pair.road) is not None:
        floor = draw_floor(road)
        end = floor.origin + len(floor.pixels) / floor.pixels_per_metre
        # Every other pixel shows the markings as well, at a quarter of the work
        paler = (255.0 - (255.0 - floor.pixels[::2, ::2]) * (1.0 - PALER)).astype(np.uint8)
        box = (floor.origin, end, floor.origin, end)
        style.show_photo(axes, paler, extent=box, origin="lower", interpolation="antialiased")
        axes.set(xlim=(0.0, road.size[0]), ylim=(0.0, road.size[1]))
    else:
        low, high = _bounds(pair)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_aspect("equal")
    style.dress(axes)
    axes.set_xlabel("x [m]", fontsize=7)
    axes.set_ylabel("y [m]", fontsize=7)


def _bounds(pair: SideBySide) -> tuple[Floats, Floats]:
    places = np.concatenate([episode.places for episode in pair.sides.values()])
    return places.min(axis=0) - MARGIN_M, places.max(axis=0) + MARGIN_M


ARROWS, LEAST_M = 6, 0.5
"""About so many arrows on a path, and at least so far apart [m]."""
EVERY = 6
"""One point in so many of a path is looked at when words are placed."""
WIDTHS = {"proxy": 1.0, "target": 2.2}
"""The target is drawn wider and below, so that both are seen where they agree."""


def draw_paths(axes: Axes, pair: SideBySide) -> None:
    """Draw every side's path, the common start, and where each ends."""
    for side, episode in reversed(pair.sides.items()):
        places = episode.places
        (line,) = axes.plot(*places.T, color=COLOURS[side], linewidth=WIDTHS[side], solid_capstyle="round")
        if side == "target":
            line.set_path_effects(list(CASING))
        for row in arrow_rows(places):
            # Along the path, not along the heading: a robot may drive backwards
            step = places[row] - places[row - 1]
            turned = float(np.degrees(np.arctan2(step[1], step[0]))) - 90.0
            axes.plot(*places[row], marker=(3, 0, turned), color=COLOURS[side], ms=5.5, mec="white", mew=0.5)
    draw_start(axes, pair.proxy.places)
    edge: dict[str, Any] = {"markeredgecolor": "white", "markeredgewidth": 0.7, "clip_on": False, "zorder": 4}
    marks = {"start": ("black", pair.proxy.places[0])}
    ends = {side: episode.places[-1] for side, episode in pair.sides.items()}
    for side, end in ends.items():
        axes.plot(*end, "s", color=COLOURS[side], markersize=4.5, **edge)
    together = len(ends) > 1 and np.ptp(list(ends.values()), axis=0).max() < APART_M
    apart = {f"{side} ends": (COLOURS[side], end) for side, end in ends.items()}
    marks |= {"both end": ("black", ends["proxy"])} if together else apart
    paths = np.concatenate([episode.places[::EVERY] for episode in pair.sides.values()])
    low, high = np.transpose([axes.get_xlim(), axes.get_ylim()])
    corners = corners_of(np.array([place for _, place in marks.values()]), paths, low, high)
    for (text, (colour, place)), (right, up) in zip(marks.items(), corners, strict=True):
        look: dict[str, Any] = {"color": colour, "fontsize": 7, "path_effects": HALO, "annotation_clip": False}
        look |= {"ha": "left" if right > 0 else "right", "va": "bottom" if up > 0 else "top"}
        spot, shift = (float(place[0]), float(place[1])), (5 * right, 4 * up)
        axes.annotate(text, spot, xytext=shift, textcoords="offset points", **look)


def arrow_rows(places: Floats) -> list[int]:
    """Rows of a path (times, 2) at which an arrow shows the direction: evenly spaced along it, none at its ends."""
    driven = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(places, axis=0).T))))
    apart = max(LEAST_M, driven[-1] / (ARROWS + 1))
    return [int(row) for row in np.searchsorted(driven, np.arange(apart / 2.0, driven[-1], apart))]


def draw_start(axes: Axes, places: Floats) -> None:
    """Mark where a path (times, 2) starts."""
    axes.plot(*places[0], "o", color="white", markersize=6, markeredgecolor="black", markeredgewidth=1.0, zorder=4)


SIZE = np.array((0.24, 0.06))
"""Width and height that a label takes, as shares of the map's width."""
GAP = 0.02
"""Between a mark and its label, likewise."""
CORNERS = np.array(((1, 1), (-1, 1), (1, -1), (-1, -1)))
"""To the right or left of its mark, and above or below."""
OUTSIDE, HIDES = 1000, 100
"""Costs of leaving the map, and of hiding a mark or another label, in points of a path that are hidden."""


def corners_of(marks: Floats, paths: Floats, low: Floats, high: Floats) -> list[tuple[int, int]]:
    """The corner of each mark (marks, 2) at which its label stands, the first of those that hide least of the paths.

    It is 1 or −1 for right or left, and for above or below. The map reaches from its corner `low` to `high` (2,).
    """
    width = high[0] - low[0]
    half = SIZE * width / 2.0
    chosen: list[tuple[int, int]] = []
    labels: list[Floats] = []
    for mark in marks:
        centres = mark + CORNERS * (half + GAP * width)
        outside = ((centres - half < low) | (centres + half > high)).any(axis=1)
        hidden = [_within(marks, at, half) + _within(np.array(labels), at, 2.0 * half) for at in centres]
        on_paths = [_within(paths, at, half) for at in centres]
        best = int(np.argmin(OUTSIDE * outside + HIDES * np.array(hidden) + on_paths))
        labels.append(centres[best])
        chosen.append((int(CORNERS[best, 0]), int(CORNERS[best, 1])))
    return chosen


def _within(places: Floats, centre: Floats, half: Floats) -> int:
    return int((np.abs(places - centre) < half).all(axis=-1).sum()) if len(places) else 0
