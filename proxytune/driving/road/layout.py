"""A road's sections laid out on the map as arrays: where each lies, and what lies before it.

The straight and the bend of a section share a pivot, the centre of the bend. Beside the straight the centre line is the
bend's radius away from the line through the pivot, round the bend from the pivot itself.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from proxytune.driving.road.segments import Section, Segment, repeats_of, sections

Values = NDArray[np.float64]
Begin = tuple[float, float, float]

PICOMETRE = 12
"""Decimals to which a layout is rounded [m]: figures that are written in decimals stay what was written."""


class Layout(NamedTuple):
    """The sections of a road in their order, one in each entry of the arrays.

    Attributes:
        normal: Direction away from the pivot along the straight, from 0 to 2π [rad].
        side: 1 where the bend is to the left, −1 where it is to the right.
        radius: Of the bend [m], 0 where there is none.
        turn: Of the bend, positive to either side [rad].
        pivot: How far the pivot lies from the origin in the direction of `normal` [m].
        first: How far the straight's beginning lies from the origin in the straight's direction [m].
        last: How far its end does [m].
        straights: Length of the straights of earlier sections [m].
        turned: Turn of those earlier bends that are as this section's [rad]: as one product, their length rounds once.
        other_arcs: Length of the other earlier bends [m].
        other_turns: Their signed turn [rad].
        across: Unit vectors of `normal`, (sections, 2).
        along: Unit vectors of the straights' directions, (sections, 2).
        origin: Point of the map that repeats of the road turn about, x and y [m].
        repeats: How many times the road repeats its first sections to close, 1 where it does not.
    """

    normal: Values
    side: Values
    radius: Values
    turn: Values
    pivot: Values
    first: Values
    last: Values
    straights: Values
    turned: Values
    other_arcs: Values
    other_turns: Values
    across: Values
    along: Values
    origin: Values
    repeats: int


@functools.lru_cache
def lay_out(begin: Begin, segments: tuple[Segment, ...]) -> Layout:
    """Lay a closed road's segments out.

    Args:
        begin: Where the first segment begins: x [m], y [m], heading [deg].
        segments: Of the whole lap.
    """
    lap = tuple(sections(segments))
    repeats = repeats_of(lap)
    starts = corners(begin, segments)[:-1]
    origin = np.round(starts[:: len(lap) // repeats].mean(axis=0), PICOMETRE)
    rows = [(*_place(begin, lap, number, starts[number] - origin), *_before(lap, number)) for number in range(len(lap))]
    figures = np.array(rows).T
    across, side = unit(figures[0]), figures[1]
    along = side[:, None] * np.stack((-across[:, 1], across[:, 0]), axis=-1)
    return Layout._make((*figures, across, along, origin, repeats))


def corners(begin: Begin, segments: tuple[Segment, ...]) -> Values:
    """Where each section begins and the last one ends, (sections + 1, 2) [m]."""
    lap, places = tuple(sections(segments)), [np.array(begin[:2])]
    for number, section in enumerate(lap):
        here = math.radians(begin[2]) + _turn(lap[:number])
        left = math.copysign(section.radius, section.turn)
        bend = left * (unit(here + math.pi / 2.0) - unit(here + section.turn + math.pi / 2.0))
        places.append(places[-1] + section.straight * unit(here) + bend)
    return np.array(places)


def unit(angle: ArrayLike) -> Values:
    """Unit vectors (…, 2) in these directions [rad]; those along an axis are exact."""
    return np.round(np.stack((np.cos(angle), np.sin(angle)), axis=-1), 15) + 0.0


def _place(begin: Begin, lap: tuple[Section, ...], number: int, start: Values) -> tuple[float, ...]:
    """The fields from `normal` to `last` of a section that starts there, as seen from the origin [m]."""
    section = lap[number]
    side = math.copysign(1.0, section.turn)
    normal = (math.radians(begin[2]) - side * math.pi / 2.0 + _turn(lap[:number])) % (2.0 * math.pi)
    across = unit(normal)
    pivot = round(float(start @ across) - section.radius, PICOMETRE)
    first = round(float(start @ (-across[1], across[0])) * side, PICOMETRE)
    last = round(first + section.straight, PICOMETRE)
    return normal, side, section.radius, abs(section.turn), pivot, first, last


def _before(lap: tuple[Section, ...], number: int) -> tuple[float, ...]:
    """The fields from `straights` on of a section."""
    earlier, bend = lap[:number], (lap[number].radius, lap[number].turn > 0.0)
    others = [section for section in earlier if (section.radius, section.turn > 0.0) != bend]
    alike = [section for section in earlier if (section.radius, section.turn > 0.0) == bend]
    arcs = math.fsum(section.radius * abs(section.turn) for section in others)
    return math.fsum(section.straight for section in earlier), abs(_turn(alike)), arcs, _turn(others)


def _turn(part: tuple[Section, ...] | list[Section]) -> float:
    return math.fsum(section.turn for section in part)
