"""Where a road's markings lie: signed distances with their slopes, and which line of which stretch is nearest."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.road.centre_line import find_nearest, way_round
from proxytune.driving.road.layout import Layout, lay_out, unit
from proxytune.driving.road.maps import Road
from proxytune.driving.road.segments import length
from proxytune.driving.road.texture import DASH_PER_GAP, dashes_on, painted

Metres = NDArray[np.float64]

LINES = ("left white line", "right white line", "yellow line", "yellow dashes")
"""The lines of a stretch, as a robot sees them that drives counter-clockwise round the map."""


class Marks(NamedTuple):
    """The nearest marking to each of n places.

    Attributes:
        distance: Signed distance from its edge, inside negative (n,) [m]; from a dash's end along the centre line, as
            it is painted.
        slope: Unit vector in which the distance grows (n, 2).
        stretch: Which of the road's segments it is on (n,).
        line: Which of LINES it is (n,); the ends of dashes are the last.
        side: Whether the nearest edge moves away (1) or closer (−1) as the marking moves right, or on, seen by a robot
            that drives counter-clockwise (n,).
        share: How much of the stretch lies behind, from 0 to 1 (n,).
    """

    distance: Metres
    slope: Metres
    stretch: NDArray[np.intp]
    line: NDArray[np.intp]
    side: Metres
    share: Metres


class Markings:
    """The markings of a road."""

    def __init__(self, road: Road) -> None:
        """Lay them out."""
        stretches = painted(road)
        self.road = road
        self.stretches = len(stretches)
        self._layout: Layout = lay_out(road.begin, tuple(part for stretch in stretches for part in stretch))
        self._sizes = np.array([length(stretch) for stretch in stretches])
        self._ends = np.cumsum(self._sizes)
        pairs = zip(road.segments, self._sizes, strict=True)
        dashes = np.array([dashes_on(road.paint, segment, float(size)) for segment, size in pairs])
        self._dashes, self._gap = dashes, self._sizes / (dashes * (DASH_PER_GAP + 1.0) + 1.0)

    def white(self, places: Metres) -> Marks:
        """The nearest white line to places (n, 2) [m]."""
        right, outward, _, stretch, share = self._along(places)
        middle = (self.road.width - self.road.paint.white_width) / 2.0
        way = np.where(right >= 0.0, 1.0, -1.0)
        off = right - way * middle
        beyond = np.where(off >= 0.0, 1.0, -1.0)
        distance = np.abs(off) - self.road.paint.white_width / 2.0
        return Marks(distance, beyond[:, None] * outward, stretch, (way > 0).astype(int), -beyond, share)

    def yellow(self, places: Metres) -> Marks:
        """The nearest yellow dash to places (n, 2) [m]."""
        right, outward, along, stretch, share = self._along(places)
        aside = np.abs(right) - self.road.paint.yellow_width / 2.0
        gap = self._gap[stretch]
        period, half = gap * (DASH_PER_GAP + 1.0), gap * DASH_PER_GAP / 2.0
        within = along - (self._ends - self._sizes)[stretch] - gap - half
        off = within - np.clip(np.rint(within / period), 0, self._dashes[stretch] - 1) * period
        end = np.abs(off) - half > aside
        onward = np.stack((-outward[:, 1], outward[:, 0]), axis=-1)
        beyond = np.where(np.where(end, off, right) >= 0.0, 1.0, -1.0)
        slope = beyond[:, None] * np.where(end[:, None], onward, outward)
        distance = np.where(end, np.abs(off) - half, aside)
        return Marks(distance, slope, stretch, np.where(end, 3, 2), -beyond, share)

    def _along(self, places: Metres) -> tuple[Metres, Metres, Metres, NDArray[np.intp], Metres]:
        """How far right of the centre line, the unit vector to the right, how far round, stretch and share of it."""
        near = find_nearest(self._layout, places)
        side = self._layout.side[near.section]
        along = way_round(self._layout, near.section, near.straight, near.turned, np.zeros(()))
        stretch = np.clip(np.searchsorted(self._ends, along, side="right"), 0, self.stretches - 1)
        share = (along - (self._ends - self._sizes)[stretch]) / self._sizes[stretch]
        return side * near.outside, side[:, None] * unit(near.normal), along, stretch, np.clip(share, 0.0, 1.0)
