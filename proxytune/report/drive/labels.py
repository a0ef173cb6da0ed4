"""Where words stand on a map, so that they hide neither each other, nor marks, nor paths."""

import numpy as np
from numpy.typing import NDArray

SIZE = np.array((0.24, 0.06))
"""Width and height that a label takes, as shares of the map's width."""

GAP = 0.02
"""Between a mark and its label, likewise."""

CORNERS = np.array(((1, 1), (-1, 1), (1, -1), (-1, -1)))
"""To the right or left of its mark, and above or below."""

OUTSIDE, HIDES = 1000, 100
"""What it costs to leave the map, and to hide a mark or another label, in points of a path that are hidden."""

Places = NDArray[np.float64]


def corners_of(marks: Places, paths: Places, low: Places, high: Places) -> list[tuple[int, int]]:
    """The corner of each mark at which its label stands, the first of those that hide least.

    Args:
        marks: What has a label, (marks, 2), in the map's unit.
        paths: Points of what is not to be hidden if that can be avoided, (points, 2).
        low: The map's lower left corner (2,).
        high: Its upper right corner (2,).

    Returns:
        For each mark 1 or −1 for right or left, and for above or below.
    """
    width = high[0] - low[0]
    half = SIZE * width / 2.0
    chosen: list[tuple[int, int]] = []
    labels: list[Places] = []
    for mark in marks:
        centres = mark + CORNERS * (half + GAP * width)
        costs = [_cost(centre, half, (marks, np.array(labels), paths), (low, high)) for centre in centres]
        best = int(np.argmin(costs))
        labels.append(centres[best])
        chosen.append((int(CORNERS[best, 0]), int(CORNERS[best, 1])))
    return chosen


def _cost(centre: Places, half: Places, others: tuple[Places, Places, Places], box: tuple[Places, Places]) -> int:
    marks, labels, paths = others
    outside = bool((centre - half < box[0]).any() or (centre + half > box[1]).any())
    hidden = _within(marks, centre, half) + _within(labels, centre, 2.0 * half)
    return OUTSIDE * outside + HIDES * hidden + _within(paths, centre, half)


def _within(places: Places, centre: Places, half: Places) -> int:
    return int((np.abs(places - centre) < half).all(axis=-1).sum()) if len(places) else 0
