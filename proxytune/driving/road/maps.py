"""A map: the road's segments, its lanes and markings, and where robots are put down; in metres from its corner."""

from dataclasses import dataclass, field

from proxytune.driving.road.segments import Segment


@dataclass(frozen=True)
class Paint:
    """How a road is marked.

    Attributes:
        white_width: Width of the solid white edge lines [m].
        yellow_width: Width of the dashed yellow centre line [m].
        bend_radius: Radius of the yellow line in bends [m], which may be tighter than the road's; None where it is
            not. The lanes as they are scored follow the road's own radius.
        straight_dash: About how long a yellow dash on a straight is [m].
        bend_dash: About how long one in a bend is [m].
        tape_m: Standard deviation of where a line lies from where the map has it [m]; no episode depends on it.
    """

    white_width: float
    yellow_width: float
    bend_radius: float | None
    straight_dash: float
    bend_dash: float
    tape_m: float = field(default=0.005, repr=False)


@dataclass(frozen=True)
class Road:
    """A map with one closed road of two lanes, right-hand traffic, asphalt all over.

    Attributes:
        name: What `[domain] map` calls it.
        description: What it is, in one line.
        size: Of the map along x and y [m]; its bottom-left corner is the origin.
        begin: Where the first segment begins: x [m], y [m], heading [deg].
        segments: The road's centre line, counter-clockwise round what it encloses.
        width: Between the outer edges of the white lines [m].
        lane_offset: Distance of a lane's centre line from the road's [m].
        lane_width: Width of a lane [m].
        paint: How it is marked.
        starts: Starting poses (x [m], y [m], heading [deg]).
    """

    name: str
    description: str
    size: tuple[float, float]
    begin: tuple[float, float, float]
    segments: tuple[Segment, ...]
    width: float
    lane_offset: float
    lane_width: float
    paint: Paint
    starts: tuple[tuple[float, float, float], ...]
