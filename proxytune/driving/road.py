"""A map as its file states it: the road's segments, its lanes and markings, and where robots are put down.

The road's centre line is straights and arcs, one after the other, counter-clockwise round the map; lengths are in
metres from the map's corner. Names and fields of `Road` and its parts count in a family's identity.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Straight:
    """A straight stretch of the road's centre line, of this length [m]."""

    length: float


@dataclass(frozen=True)
class Arc:
    """A bend of the centre line, of this radius [m], that turns so far [deg], to the left positive, 90 at most."""

    radius: float
    turn_deg: float


Segment = Straight | Arc


@dataclass(frozen=True)
class RoadSection:
    """A straight [m] with the bend that ends it, radius [m] and turn [rad], left positive; either may be missing."""

    straight: float
    radius: float
    turn: float


def road_sections(segments: tuple[Segment, ...]) -> Iterator[RoadSection]:
    """The same road by sections; straights after the last arc are a section without a bend."""
    lengths: list[float] = []
    for segment in segments:
        if isinstance(segment, Straight):
            lengths.append(segment.length)
        else:
            yield RoadSection(math.fsum(lengths), segment.radius, math.radians(segment.turn_deg))
            lengths = []
    if lengths:
        yield RoadSection(math.fsum(lengths), 0.0, 0.0)


def repeats_of(lap: tuple[RoadSection, ...]) -> int:
    """Number of times that a lap repeats its first sections: 4 on a square loop, 1 where it never does."""
    count = len(lap)
    return next(n for n in range(count, 0, -1) if count % n == 0 and lap[: count // n] * n == lap)


def tightened(segment: Segment, radius: float | None) -> tuple[Segment, ...]:
    """A bend of a smaller radius [m] with the straights that lead to it and away; a straight is left as it is."""
    if radius is None or isinstance(segment, Straight):
        return (segment,)
    lead = Straight((segment.radius - radius) * math.tan(math.radians(abs(segment.turn_deg)) / 2.0))
    return lead, Arc(radius, segment.turn_deg), lead


def length(segments: tuple[Segment, ...]) -> float:
    """Length of the centre line [m]."""
    return math.fsum(
        part.length if isinstance(part, Straight) else part.radius * math.radians(abs(part.turn_deg))
        for part in segments
    )


@dataclass(frozen=True)
class Paint:
    """Markings of a road."""

    white_width: float  # width of the solid white edge lines [m]
    yellow_width: float  # width of the dashed yellow centre line [m]
    bend_radius: float | None  # of the yellow line in bends [m], tighter than the lanes as scored; None where it is not
    straight_dash: float  # about how long a yellow dash on a straight is [m]
    bend_dash: float  # about how long one in a bend is [m]
    tape_m: float = field(default=0.005, repr=False)  # deviation of where lines lie [m]; no episode depends on it


@dataclass(frozen=True)
class Road:
    """A map with one closed road of two lanes, right-hand traffic, asphalt all over."""

    name: str  # what `[domain] map` calls it
    description: str  # what it is, in one line
    size: tuple[float, float]  # of the map along x and y [m]; its bottom-left corner is the origin
    begin: tuple[float, float, float]  # where the first segment begins: x [m], y [m], heading [deg]
    segments: tuple[Segment, ...]  # the road's centre line, counter-clockwise round what it encloses
    width: float  # between the outer edges of the white lines [m]
    lane_offset: float  # distance of a lane's centre line from the road's [m]
    lane_width: float  # width of a lane [m]
    paint: Paint  # how it is marked
    starts: tuple[tuple[float, float, float], ...]  # starting poses (x [m], y [m], heading [deg])
