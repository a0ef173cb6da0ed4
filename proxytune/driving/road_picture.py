"""The floor of a map as a picture seen from above, and where the markings on it lie.

The picture is drawn from signed distances to what is painted. `Markings` gives such distances with their slopes, and
says which line of which stretch is nearest.
"""

import functools
import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Floats
from proxytune.driving.lane import NearestPoints, find_nearest, lay_out, unit, way_round
from proxytune.driving.road import Paint, Road, Segment, Straight, length, tightened

PIXELS_PER_METRE = 400
"""2.5 mm a pixel: a twentieth of a white line, finer than what 64 × 48 pixels see at the robot's wheels."""
MARGIN = 64
"""Fewest pixels of OFF_MAP on every side; the picture's side is a whole multiple of it."""
COLOURS = MappingProxyType(
    {"off_map": (21, 21, 21), "asphalt": (59, 56, 50), "white": (203, 200, 198), "yellow": (195, 184, 60)}
)
"""Red, green, blue, 0 to 255: means over the frames of gym-duckietown's photographed tiles."""
STRIP = 8
"""Rows that are drawn at once, to stay small in memory; divides MARGIN."""
DASH_PER_GAP = 2.0
"""Length of a yellow dash over the length of a gap."""


@dataclass(frozen=True, eq=False)
class Floor:
    """A floor seen from above."""

    pixels: NDArray[np.uint8]  # shape (side, side, 3), uint8; rows go up with y, columns with x
    pixels_per_metre: float  # resolution
    origin: float  # where the corner of the first pixel lies, both in x and in y [m]


@functools.lru_cache
def draw_floor(road: Road) -> Floor:
    """Draw a map: asphalt with the road's white edge lines and dashed yellow centre line, OFF_MAP around it.

    Every edge is anti-aliased over one pixel. The same figures give the same bytes. The picture of a map that is not
    square is, with OFF_MAP beside the map.
    """
    longest = max(road.size)
    side = MARGIN * math.ceil(longest * PIXELS_PER_METRE / MARGIN + 2.0)
    origin = (longest - side / PIXELS_PER_METRE) / 2.0
    places = origin + (np.arange(side) + 0.5) / PIXELS_PER_METRE
    paint = functools.partial(_paint, Markings(road))
    strips = [paint(np.stack(np.meshgrid(places, rows), axis=-1)) for rows in places.reshape(-1, STRIP)]
    return Floor(np.concatenate(strips), PIXELS_PER_METRE, origin)


def painted(road: Road) -> list[tuple[Segment, ...]]:
    """Segments as painted for each one of the road, its bends as tight as the paint's."""
    return [tightened(segment, road.paint.bend_radius) for segment in road.segments]


def _paint(markings: "Markings", positions: Floats) -> NDArray[np.uint8]:
    """The colours (rows, columns, 3) of positions (rows, columns, 2) [m]."""
    picture = np.tile(np.array(COLOURS["off_map"], dtype=float), (*positions.shape[:-1], 1))
    for colour, distance in markings.shapes(positions).items():
        cover = np.clip(0.5 - distance * PIXELS_PER_METRE, 0.0, 1.0)[..., None]
        picture += cover * (np.array(COLOURS[colour]) - picture)
    return np.asarray(np.rint(picture), dtype=np.uint8)


def dashes_on(paint: Paint, segment: Segment, size: float) -> int:
    """Number of dashes on a segment whose centre line is painted so long [m]."""
    dash = paint.straight_dash if isinstance(segment, Straight) else paint.bend_dash
    return max(1, round((size / dash * DASH_PER_GAP - 1.0) / (DASH_PER_GAP + 1.0)))


LINES = ("left white line", "right white line", "yellow line", "yellow dashes")
"""The lines of a stretch, as a robot sees them that drives counter-clockwise round the map."""


class Marks(NamedTuple):
    """The nearest marking to each of n places."""

    distance: Floats  # signed, from its edge, inside negative (n,) [m]; from a dash's end along the painted centre line
    slope: Floats  # unit vector in which the distance grows (n, 2)
    stretch: NDArray[np.intp]  # which of the road's segments it is on (n,)
    line: NDArray[np.intp]  # which of LINES it is (n,); the ends of dashes are the last
    side: Floats  # 1 where the nearest edge goes away as the marking moves right, or on, −1 where it comes (n,)
    share: Floats  # how much of the stretch lies behind, from 0 to 1 (n,)


class Markings:
    """The markings of a road."""

    def __init__(self, road: Road) -> None:
        """Lay them out."""
        stretches = painted(road)
        self.road = road
        self.stretches = len(stretches)
        self._layout = lay_out(road.begin, tuple(part for stretch in stretches for part in stretch))
        self._sizes = np.array([length(stretch) for stretch in stretches])
        self._ends, pairs = np.cumsum(self._sizes), zip(road.segments, self._sizes, strict=True)
        self._dashes = np.array([dashes_on(road.paint, segment, float(size)) for segment, size in pairs])
        # The dashes share a stretch's length evenly, a gap at either end
        self._gap = self._sizes / (self._dashes * (DASH_PER_GAP + 1.0) + 1.0)

    def shapes(self, places: Floats) -> dict[str, Floats]:
        """Signed distances (…) of places (…, 2) from what is painted by colours [m], the lowest layer first."""
        paint, half = self.road.paint, np.array(self.road.size) / 2.0
        near, along, stretch = self._find(places)
        aside, gap = np.abs(near.outside), self._gap[stretch]
        within, first = along - (self._ends - self._sizes)[stretch], gap + gap * DASH_PER_GAP / 2.0
        period = gap * (DASH_PER_GAP + 1.0)
        nearest = np.clip(np.rint((within - first) / period), 0, self._dashes[stretch] - 1)
        from_dash = np.abs(within - first - nearest * period) - gap * DASH_PER_GAP / 2.0
        return {
            "asphalt": (np.abs(places - half) - half).max(axis=-1),
            "white": np.abs(aside - (self.road.width - paint.white_width) / 2.0) - paint.white_width / 2.0,
            "yellow": np.maximum(aside - paint.yellow_width / 2.0, from_dash),
        }

    def white(self, places: Floats) -> Marks:
        """The nearest white line to places (n, 2) [m]."""
        right, outward, _, stretch, share = self._along(places)
        middle = (self.road.width - self.road.paint.white_width) / 2.0
        way = np.where(right >= 0.0, 1.0, -1.0)
        off = right - way * middle
        beyond = np.where(off >= 0.0, 1.0, -1.0)
        distance = np.abs(off) - self.road.paint.white_width / 2.0
        return Marks(distance, beyond[:, None] * outward, stretch, (way > 0).astype(int), -beyond, share)

    def yellow(self, places: Floats) -> Marks:
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

    def _find(self, places: Floats) -> tuple[NearestPoints, Floats, NDArray[np.intp]]:
        """The nearest points of the centre line, how far round they are, and on which stretch."""
        near = find_nearest(self._layout, places)
        along = way_round(self._layout, near.section, near.straight, near.turned, np.zeros(()))
        return near, along, np.clip(np.searchsorted(self._ends, along, side="right"), 0, self.stretches - 1)

    def _along(self, places: Floats) -> tuple[Floats, Floats, Floats, NDArray[np.intp], Floats]:
        """Distance right of the centre line, the unit vector to the right, how far round, stretch and share of it."""
        near, along, stretch = self._find(places)
        side = self._layout.side[near.section]
        share = (along - (self._ends - self._sizes)[stretch]) / self._sizes[stretch]
        return side * near.outside, side[:, None] * unit(near.normal), along, stretch, np.clip(share, 0.0, 1.0)
