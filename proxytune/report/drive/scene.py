"""The map from above, and how proxy and target are told apart on it."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import Stroke, withStroke
from numpy.typing import NDArray

from proxytune.driving import Road, draw_floor
from proxytune.report.style import BLUE, VERMILLION, dress

COLOURS: Mapping[str, str] = MappingProxyType({"proxy": BLUE, "target": VERMILLION})

PALER = 0.6
"""The floor is drawn this much nearer to white, so that paths stand out."""

MARGIN_M = 0.2
"""Round paths that no map bounds."""

CASING = (Stroke(linewidth=2.6, foreground="white"), withStroke(linewidth=0.0))
"""A white edge round thin lines."""

HALO = (withStroke(linewidth=2.0, foreground="white"),)
"""A white edge round letters."""


def draw_map(axes: Axes, road: Road | None, paths: Iterable[NDArray[np.float64]]) -> None:
    """Draw the floor that the camera sees, from above, with axes in metres; without a road only the axes.

    Args:
        axes: Where.
        road: The map, if there is one.
        paths: All that is going to be drawn on it, each (times, 2): x, y [m].
    """
    if road is not None:
        _draw_floor(axes, road)
    else:
        low, high = _bounds(paths)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_aspect("equal")
    dress(axes)
    axes.set_xlabel("x [m]", fontsize=7)
    axes.set_ylabel("y [m]", fontsize=7)


def map_aspect(road: Road | None, paths: Iterable[NDArray[np.float64]]) -> float:
    """Height of the map over its width."""
    width, height = road.size if road is not None else np.subtract(*_bounds(paths)[::-1])
    return float(np.clip(height / width, 0.4, 2.0))


def _draw_floor(axes: Axes, road: Road) -> None:
    floor = draw_floor(road)
    end = floor.origin + len(floor.pixels) / floor.pixels_per_metre
    # Every other pixel shows the markings as well, at a quarter of the work
    paler = (255.0 - (255.0 - floor.pixels[::2, ::2]) * (1.0 - PALER)).astype(np.uint8)
    axes.imshow(paler, extent=(floor.origin, end, floor.origin, end), origin="lower", interpolation="antialiased")
    axes.set(xlim=(0.0, road.size[0]), ylim=(0.0, road.size[1]))


def _bounds(paths: Iterable[NDArray[np.float64]]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    places = np.concatenate(list(paths))
    return places.min(axis=0) - MARGIN_M, places.max(axis=0) + MARGIN_M
