"""The floor of a map as a picture seen from above, drawn from the map's road."""

import functools
import math
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.road.centre_line import find_nearest, way_round
from proxytune.driving.road.layout import lay_out
from proxytune.driving.road.maps import Paint, Road
from proxytune.driving.road.segments import Segment, Straight, length, tightened

PIXELS_PER_METRE = 400
"""2.5 mm a pixel: a twentieth of a white line, finer than what 64 × 48 pixels see at the robot's wheels."""

MARGIN = 64
"""Fewest pixels of OFF_MAP on every side; the picture's side is a whole multiple of it."""

COLOURS = MappingProxyType(
    {
        "off_map": (21, 21, 21),
        "asphalt": (59, 56, 50),
        "white": (203, 200, 198),
        "yellow": (195, 184, 60),
    }
)
"""Red, green, blue, 0 to 255: means over the frames of gym-duckietown's photographed tiles."""

STRIP = 8
"""Rows that are drawn at once, to stay small in memory; divides MARGIN."""

DASH_PER_GAP = 2.0
"""Length of a yellow dash over the length of a gap."""

Metres = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Floor:
    """A floor seen from above.

    Attributes:
        pixels: Shape (side, side, 3), uint8; rows go up with y, columns with x.
        pixels_per_metre: Resolution.
        origin: Where the corner of the first pixel lies, both in x and in y [m].
    """

    pixels: NDArray[np.uint8]
    pixels_per_metre: float
    origin: float


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
    paint = functools.partial(_paint, road, painted(road))
    strips = [paint(np.stack(np.meshgrid(places, rows), axis=-1)) for rows in places.reshape(-1, STRIP)]
    return Floor(np.concatenate(strips), PIXELS_PER_METRE, origin)


def painted(road: Road) -> list[tuple[Segment, ...]]:
    """What is painted for each segment of the road, its bends as tight as the paint's."""
    return [tightened(segment, road.paint.bend_radius) for segment in road.segments]


def _paint(road: Road, stretches: list[tuple[Segment, ...]], positions: Metres) -> NDArray[np.uint8]:
    """The colours (rows, columns, 3) of positions (rows, columns, 2) [m]."""
    picture = np.tile(np.array(COLOURS["off_map"], dtype=float), (*positions.shape[:-1], 1))
    for colour, distance in _shapes(road, stretches, positions).items():
        cover = np.clip(0.5 - distance * PIXELS_PER_METRE, 0.0, 1.0)[..., None]
        picture += cover * (np.array(COLOURS[colour]) - picture)
    return np.asarray(np.rint(picture), dtype=np.uint8)


def _shapes(road: Road, stretches: list[tuple[Segment, ...]], positions: Metres) -> dict[str, Metres]:
    """Signed distance from what is painted in each colour, inside negative [m], the lowest layer first."""
    layout = lay_out(road.begin, tuple(part for stretch in stretches for part in stretch))
    near = find_nearest(layout, positions)
    aside, half = np.abs(near.outside), np.array(road.size) / 2.0
    along = way_round(layout, near.section, near.straight, near.turned, np.zeros(()))
    middle = (road.width - road.paint.white_width) / 2.0
    return {
        "asphalt": (np.abs(positions - half) - half).max(axis=-1),
        "white": np.abs(aside - middle) - road.paint.white_width / 2.0,
        "yellow": np.maximum(aside - road.paint.yellow_width / 2.0, _dash_distance(road, stretches, along)),
    }


def _dash_distance(road: Road, stretches: list[tuple[Segment, ...]], along: Metres) -> Metres:
    """Signed distance along the centre line from the nearest dash [m]."""
    sizes = np.array([length(stretch) for stretch in stretches])
    dashes = np.array(
        [dashes_on(road.paint, segment, size) for segment, size in zip(road.segments, sizes, strict=True)]
    )
    ends = np.cumsum(sizes)
    stretch = np.clip(np.searchsorted(ends, along, side="right"), 0, len(ends) - 1)
    return _from_dash(along - (ends - sizes)[stretch], sizes[stretch], dashes[stretch])


def dashes_on(paint: Paint, segment: Segment, size: float) -> int:
    """How many dashes are painted on a segment whose centre line is painted so long [m]."""
    dash = paint.straight_dash if isinstance(segment, Straight) else paint.bend_dash
    return max(1, round((size / dash * DASH_PER_GAP - 1.0) / (DASH_PER_GAP + 1.0)))


def _from_dash(along: Metres, size: Metres, dashes: NDArray[np.int_]) -> Metres:
    """Signed distance from the nearest of the dashes that share a stretch's length evenly, a gap at either end."""
    gap = size / (dashes * (DASH_PER_GAP + 1.0) + 1.0)
    period = gap * (DASH_PER_GAP + 1.0)
    first = gap + gap * DASH_PER_GAP / 2.0
    nearest = np.clip(np.rint((along - first) / period), 0, dashes - 1)
    return np.abs(along - first - nearest * period) - gap * DASH_PER_GAP / 2.0
