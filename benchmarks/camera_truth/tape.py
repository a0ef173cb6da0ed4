"""The lines of a map as hands lay them: every tile's beside their place, askew, of other widths and dashes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.driving import Road
from proxytune.driving.lane import find_nearest, lay_out, way_round
from proxytune.driving.road import Straight, length, tightened

Values = NDArray[np.float64]

LEFT, YELLOW, RIGHT = range(3)
"""The lines, as one sees them who drives counter-clockwise."""

MOST_DASHES = 40
DASH_PER_GAP = 2.0


@dataclass(frozen=True)
class Tape:
    """What is wrong with the lines, tile by tile."""

    shift: Values  # to the right of where the map has them (3, tiles) [m]
    askew: Values  # growth of that along the tile (3, tiles)
    wider: Values  # what their widths have in excess (3, tiles) [m]
    dash_shift: Values  # of every dash along the line (tiles, MOST_DASHES) [m]
    dash_longer: Values  # its length over nominal, less 1 (tiles, MOST_DASHES)


def straight_tape(road: Road) -> Tape:
    """Lines where the map has them."""
    lines, dashes = np.zeros((3, len(road.segments))), np.zeros((len(road.segments), MOST_DASHES))
    return Tape(lines, lines, lines, dashes, dashes)


def lay_tape(road: Road, tape_m: float, random: np.random.Generator) -> Tape:
    """Lines laid by hand: shifts normal to 1 cm of tolerance, beyond that uniform; a sixth of them 1° askew."""
    tiles = len(road.segments)
    shift = random.normal(0.0, tape_m, (3, tiles))
    if tape_m > 0.01:
        shift = random.uniform(-tape_m, tape_m, (3, tiles))
    askew = np.where(random.random((3, tiles)) < 1 / 6, np.radians(1.0), np.radians(0.2))
    return Tape(
        shift,
        askew * random.choice((-1.0, 1.0), (3, tiles)),
        random.normal(0.0, 0.002, (3, tiles)),
        random.normal(0.0, 0.004, (tiles, MOST_DASHES)),
        random.normal(0.0, 0.1, (tiles, MOST_DASHES)).clip(-0.3, 0.3),
    )


def line_distances(road: Road, tape: Tape, positions: Values) -> tuple[Values, Values, NDArray[np.intp]]:
    """Signed distances to white and to yellow paint at positions (…, 2), inside negative [m], and their tiles."""
    stretches = [tightened(segment, road.paint.bend_radius) for segment in road.segments]
    layout = lay_out(road.begin, tuple(part for stretch in stretches for part in stretch))
    near = find_nearest(layout, positions)
    right = layout.side[near.section] * near.outside
    along = way_round(layout, near.section, near.straight, near.turned, np.zeros(()))
    sizes = np.array([length(stretch) for stretch in stretches])
    ends = np.cumsum(sizes)
    tile = np.clip(np.searchsorted(ends, along, side="right"), 0, len(ends) - 1)
    past = along - (ends - sizes)[tile]

    def aside(line: int, place: float, width: float) -> Values:
        middle = place + tape.shift[line, tile] + tape.askew[line, tile] * (past - sizes[tile] / 2.0)
        return np.abs(right - middle) - (width + tape.wider[line, tile]) / 2.0

    edge = (road.width - road.paint.white_width) / 2.0
    white = np.minimum(*(aside(line, side * edge, road.paint.white_width) for line, side in ((LEFT, -1), (RIGHT, 1))))
    dash = _from_dash(road, tape, tile, past, sizes)
    return white, np.maximum(aside(YELLOW, 0.0, road.paint.yellow_width), dash), tile


def _from_dash(road: Road, tape: Tape, tile: NDArray[np.intp], past: Values, sizes: Values) -> Values:
    """Signed distance along the line from the dash that is nearest where all are in their places [m]."""
    wanted = [road.paint.straight_dash if isinstance(s, Straight) else road.paint.bend_dash for s in road.segments]
    dashes = np.maximum(1, np.rint((sizes / wanted * DASH_PER_GAP - 1.0) / (DASH_PER_GAP + 1.0)))[tile]
    gap = sizes[tile] / (dashes * (DASH_PER_GAP + 1.0) + 1.0)
    period, half = gap * (DASH_PER_GAP + 1.0), gap * DASH_PER_GAP / 2.0
    number = np.clip(np.rint((past - gap - half) / period), 0, dashes - 1).astype(int)
    middle = gap + half + number * period + tape.dash_shift[tile, number]
    return np.abs(past - middle) - half * (1.0 + tape.dash_longer[tile, number])
