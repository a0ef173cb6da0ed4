"""The floor of a map as a picture seen from above, drawn from the map's figures."""

import functools
import math
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.road.maps import LoopMap

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
def draw_floor(road: LoopMap) -> Floor:
    """Draw a loop road: asphalt with white edge lines and a dashed yellow centre line, OFF_MAP around it.

    Every edge is anti-aliased over one pixel. The same figures give the same bytes.
    """
    side = MARGIN * math.ceil(road.side * PIXELS_PER_METRE / MARGIN + 2.0)
    origin = (road.side - side / PIXELS_PER_METRE) / 2.0
    off_middle = np.abs(origin + (np.arange(side) + 0.5) / PIXELS_PER_METRE - road.side / 2.0)
    x, y = np.meshgrid(off_middle, off_middle)
    picture = np.tile(np.array(COLOURS["off_map"], dtype=float), (side, side, 1))
    for colour, distance in _shapes(road, np.maximum(x, y), np.minimum(x, y)).items():
        cover = np.clip(0.5 - distance * PIXELS_PER_METRE, 0.0, 1.0)[..., None]
        picture += cover * (np.array(COLOURS[colour]) - picture)
    return Floor(np.rint(picture).astype(np.uint8), PIXELS_PER_METRE, origin)


def _shapes(road: LoopMap, far: Metres, near: Metres) -> dict[str, Metres]:
    """Signed distance from what is painted in each colour, inside negative [m], the lowest layer first.

    All eight octants look alike: `far` and `near` are the larger and the smaller of |x| and |y| from the map's middle.
    """
    off_centre = _centre_line_distance(road, far, near)
    beside_yellow = np.abs(off_centre) - road.yellow_width / 2.0
    return {
        "asphalt": far - road.side / 2.0,
        "white": _white_distance(road, off_centre),
        "yellow": np.maximum(beside_yellow, _dash_distance(road, far, near)),
    }


def _centre_line_distance(road: LoopMap, far: Metres, near: Metres) -> Metres:
    """Signed distance from the road's centre line, a square with rounded corners; outside positive [m]."""
    straight = (road.tiles - 1) * road.tile / 2.0 - road.corner_radius
    past_far, past_near = far - straight, near - straight
    outside = np.hypot(np.maximum(past_far, 0.0), np.maximum(past_near, 0.0))
    return outside + np.minimum(np.maximum(past_far, past_near), 0.0) - road.corner_radius


def _white_distance(road: LoopMap, off_centre: Metres) -> Metres:
    """Signed distance from the edge lines, whose outer edges are the road's, half a tile from its centre line."""
    middle = road.tile / 2.0 - road.white_width / 2.0
    return np.abs(np.abs(off_centre) - middle) - road.white_width / 2.0


def _dash_distance(road: LoopMap, far: Metres, near: Metres) -> Metres:
    """Signed distance along the centre line from the nearest dash [m]."""
    corner = (road.tiles - 2) * road.tile / 2.0
    lead = road.tile / 2.0 - road.corner_radius
    beyond = near - corner
    bend = lead + road.corner_radius * np.arctan2(beyond - lead, far - corner - lead)
    in_corner = np.where(beyond < lead, beyond, bend)
    corner_length = 2.0 * lead + road.corner_radius * np.pi / 2.0
    on_straight = _from_dash(road, np.mod(near + corner, road.tile), road.tile, road.straight_dashes)
    return np.where(beyond < 0.0, on_straight, _from_dash(road, in_corner, corner_length, road.corner_dashes))


def _from_dash(road: LoopMap, along: Metres, length: float, dashes: int) -> Metres:
    """Signed distance from the nearest of the dashes that share a tile's length evenly, a gap at either end."""
    gap = length / (dashes * (road.dash_per_gap + 1.0) + 1.0)
    period = gap * (road.dash_per_gap + 1.0)
    first = gap + gap * road.dash_per_gap / 2.0
    nearest = np.clip(np.rint((along - first) / period), 0, dashes - 1)
    return np.abs(along - first - nearest * period) - gap * road.dash_per_gap / 2.0
