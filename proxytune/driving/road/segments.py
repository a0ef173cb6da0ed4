"""What a road consists of: straights and arcs, one after the other, counter-clockwise round the map."""

import math
from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Straight:
    """A straight stretch of the road's centre line.

    Attributes:
        length: Its length [m].
    """

    length: float


@dataclass(frozen=True)
class Arc:
    """A bend of the road's centre line.

    Attributes:
        radius: Of the centre line [m].
        turn_deg: How far the road turns [deg], to the left positive, 90 at most.
    """

    radius: float
    turn_deg: float


Segment = Straight | Arc


@dataclass(frozen=True)
class Section:
    """A straight with the bend that ends it; either may have no length.

    Attributes:
        straight: Length of the straight [m].
        radius: Of the bend [m].
        turn: Of the bend [rad], to the left positive.
    """

    straight: float
    radius: float
    turn: float


def sections(segments: tuple[Segment, ...]) -> Iterator[Section]:
    """The same road by sections; straights after the last arc are a section without a bend."""
    lengths: list[float] = []
    for segment in segments:
        if isinstance(segment, Straight):
            lengths.append(segment.length)
        else:
            yield Section(math.fsum(lengths), segment.radius, math.radians(segment.turn_deg))
            lengths = []
    if lengths:
        yield Section(math.fsum(lengths), 0.0, 0.0)


def repeats_of(lap: tuple[Section, ...]) -> int:
    """How many times a lap repeats its first sections: 4 on a square loop, 1 where it never does."""
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
    return math.fsum(s.length if isinstance(s, Straight) else _arc_length(s) for s in segments)


def _arc_length(arc: Arc) -> float:
    return arc.radius * math.radians(abs(arc.turn_deg))
