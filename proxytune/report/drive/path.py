"""A robot's way on the map: its path with the direction, where it starts and where it ends."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from proxytune.report.drive.scene import CASING, COLOURS, HALO
from proxytune.study.side_by_side import SideBySide

ARROWS, LEAST_M = 6, 0.5
"""About so many arrows on a path, and at least so far apart [m]."""

NEAR_M = 0.15
"""Ends as near as this are written above and below each other [m]."""

WIDTHS = {"proxy": 1.0, "target": 2.2}
"""The target is drawn wider and below, so that both are seen where they agree."""


def draw_paths(axes: Axes, pair: SideBySide) -> None:
    """Draw every side's path, the common start, and what each end is."""
    for side in reversed(pair.sides):
        _draw_path(axes, pair.sides[side].places, side)
    draw_start(axes, pair.proxy.places)
    ends = {side: episode.places[-1] for side, episode in pair.sides.items()}
    meet = len(ends) > 1 and np.hypot(*np.subtract(*ends.values())) < NEAR_M
    for side, end in ends.items():
        look: dict[str, Any] = {
            "color": COLOURS[side],
            "markeredgecolor": "white",
            "markeredgewidth": 0.7,
            "clip_on": False,
        }
        axes.plot(*end, "s", markersize=4.5, **look)
        _write(axes, end, f"{side} ends", COLOURS[side], away=meet and side == "target")


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
    axes.plot(*places[0], "o", color="white", markersize=6, markeredgecolor="black", markeredgewidth=1.0)
    _write(axes, places[0], "start", "black")


def _write(axes: Axes, place: NDArray[np.float64], text: str, colour: str, *, away: bool = False) -> None:
    """Write beside a place, towards the middle of the map, or above and below the other way round."""
    middle = np.mean([axes.get_xlim(), axes.get_ylim()], axis=1)
    right, above = (1 if place[0] < middle[0] else -1), (1 if (place[1] < middle[1]) != away else -1)
    axes.annotate(
        text,
        (float(place[0]), float(place[1])),
        xytext=(5 * right, 4 * above),
        textcoords="offset points",
        ha="left" if right > 0 else "right",
        va="bottom" if above > 0 else "top",
        color=colour,
        fontsize=7,
        path_effects=HALO,
        annotation_clip=False,
    )
