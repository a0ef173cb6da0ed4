"""A robot's way on the map: its path with the direction, where it starts and where it ends."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from proxytune.report.drive.labels import corners_of
from proxytune.report.drive.scene import CASING, COLOURS, HALO
from proxytune.study import SideBySide

ARROWS, LEAST_M = 6, 0.5
"""About so many arrows on a path, and at least so far apart [m]."""

EVERY = 6
"""Of so many points of a path one is looked at when words are placed."""

WIDTHS = {"proxy": 1.0, "target": 2.2}
"""The target is drawn wider and below, so that both are seen where they agree."""


def draw_paths(axes: Axes, pair: SideBySide) -> None:
    """Draw every side's path, the common start, and where each ends."""
    for side in reversed(pair.sides):
        _draw_path(axes, pair.sides[side].places, side)
    draw_start(axes, pair.proxy.places)
    edge: dict[str, Any] = {"markeredgecolor": "white", "markeredgewidth": 0.7, "clip_on": False, "zorder": 4}
    marks = {"start": ("black", pair.proxy.places[0])}
    for side, episode in pair.sides.items():
        marks[f"{side} ends"] = (COLOURS[side], episode.places[-1])
        axes.plot(*episode.places[-1], "s", color=COLOURS[side], markersize=4.5, **edge)
    paths = np.concatenate([episode.places[::EVERY] for episode in pair.sides.values()])
    low, high = np.transpose([axes.get_xlim(), axes.get_ylim()])
    corners = corners_of(np.array([place for _, place in marks.values()]), paths, low, high)
    for (text, (colour, place)), corner in zip(marks.items(), corners, strict=True):
        _write(axes, place, text, colour, corner)


def draw_parting(axes: Axes, pair: SideBySide) -> None:
    """Ring the place at which proxy and target are first APART_M apart."""
    if pair.parted_s is not None:
        place = pair.proxy.places[np.searchsorted(pair.proxy.poses["time"], pair.parted_s)]
        axes.plot(*place, "o", color="black", markersize=9, fillstyle="none", markeredgewidth=0.9)


def _draw_path(axes: Axes, places: NDArray[np.float64], side: str) -> None:
    (line,) = axes.plot(*places.T, color=COLOURS[side], linewidth=WIDTHS[side], solid_capstyle="round")
    if side == "target":
        line.set_path_effects(list(CASING))
    for row in arrow_rows(places):
        # Along the path, not along the heading: a robot may drive backwards
        step = places[row] - places[row - 1]
        axes.plot(
            *places[row],
            marker=(3, 0, np.degrees(np.arctan2(step[1], step[0])) - 90.0),
            color=COLOURS[side],
            markersize=5.5,
            markeredgecolor="white",
            markeredgewidth=0.5,
        )


def arrow_rows(places: NDArray[np.float64]) -> list[int]:
    """Rows of a path (times, 2) at which an arrow shows the direction: evenly spaced along it, none at its ends."""
    driven = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(places, axis=0).T))))
    apart = max(LEAST_M, driven[-1] / (ARROWS + 1))
    wanted = np.arange(apart / 2.0, driven[-1], apart)
    return [int(row) for row in np.searchsorted(driven, wanted)]


def draw_start(axes: Axes, places: NDArray[np.float64]) -> None:
    """Mark where a path (times, 2) starts."""
    edge: dict[str, Any] = {"markeredgecolor": "black", "markeredgewidth": 1.0, "zorder": 4}
    axes.plot(*places[0], "o", color="white", markersize=6, **edge)


def _write(axes: Axes, place: NDArray[np.float64], text: str, colour: str, corner: tuple[int, int]) -> None:
    axes.annotate(
        text,
        (float(place[0]), float(place[1])),
        xytext=(5 * corner[0], 4 * corner[1]),
        textcoords="offset points",
        ha="left" if corner[0] > 0 else "right",
        va="bottom" if corner[1] > 0 else "top",
        color=colour,
        fontsize=7,
        path_effects=HALO,
        annotation_clip=False,
    )
