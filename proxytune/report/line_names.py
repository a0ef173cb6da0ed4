"""Names of lines beside their right ends, so that no legend has to be searched."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

ONE_LINE = 0.05
"""How far apart names of one line are at least, as a share of the panel's height; two lines take more."""


class LineName(NamedTuple):
    """The name of a line, its colour, and the value at which the line ends."""

    text: str
    colour: str
    end: float

    @property
    def words(self) -> str:
        """The name on one line."""
        return self.text.replace("\n", " ")


def name_lines(axes: Axes, names: Sequence[LineName], apart: float = ONE_LINE) -> None:
    """Write names right of a panel whose limits are final, moved apart where lines end together."""
    bottom, top = axes.get_ylim()
    places = spread([(min(max(name.end, bottom), top) - bottom) / (top - bottom) for name in names], apart)
    for name, place in zip(names, places, strict=True):
        axes.text(
            1.02, place, name.text, transform=axes.transAxes, fontsize=7, color=name.colour, va="center", ha="left"
        )


def spread(places: Sequence[float], apart: float) -> list[float]:
    """Places moved as little as it takes to be so far apart, in the same order, from 0 to 1 where they fit there."""
    order = sorted(range(len(places)), key=lambda row: places[row])
    moved = np.array([places[row] for row in order])
    steps = apart * np.arange(len(moved))
    # Least squares with the order kept: pools of places that touch share their mean.
    pools: list[list[float]] = []
    for value in moved - steps:
        pools.append([float(value)])
        while len(pools) > 1 and np.mean(pools[-2]) > np.mean(pools[-1]):
            last = pools.pop()
            pools[-1] += last
    most = max(0.0, 1.0 - apart * (len(moved) - 1))
    found = np.concatenate([np.full(len(pool), np.clip(np.mean(pool), 0.0, most)) for pool in pools]) + steps
    return [float(found[order.index(row)]) for row in range(len(places))]
