"""What a diagnosis of the camera goes by: edges of markings, where the robot was, and the map."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.measured.edges import Edges
from proxytune.diagnosis.camera.measured.tracks import Tracks
from proxytune.diagnosis.camera.model.optics import Optics
from proxytune.driving.road.markings import LINES, Markings

Floats = NDArray[np.float64]

LEAST_SCATTER = (0.0005, np.radians(0.1))
"""No tracker is trusted beyond this: place [m] and heading [rad]."""

LEAST_TAPE_M = 0.0001
"""No map is laid more exactly [m]."""

MAP_SCATTER = np.array((0.03, 0.03, np.radians(1.0)))
"""How far the whole map may lie off, as standard deviations of x, y [m] and heading [rad]."""

TILTED = 3
"""So many of LINES may lie askew; the ends of dashes cannot."""


@dataclass(frozen=True)
class Views:
    """N pictures with n edge points.

    Attributes:
        edges: Edge points, sorted by picture.
        tracks: Where the robot was.
        markings: Of the map.
        optics: Of the camera.
        position_m: Standard deviation of a tracked place after smoothing [m].
        heading_rad: Standard deviation of a tracked heading after smoothing [rad].
        tape_m: Standard deviation of where a line lies from where the map has it [m].
    """

    edges: Edges
    tracks: Tracks
    markings: Markings
    optics: Optics
    position_m: float
    heading_rad: float
    tape_m: float

    @property
    def count(self) -> int:
        """How many pictures there are."""
        return len(self.tracks.instants)

    @property
    def pose_scatter(self) -> Floats:
        """Standard deviations of x, y [m] and heading [rad] (3,)."""
        place, turn = max(self.position_m, LEAST_SCATTER[0]), max(self.heading_rad, LEAST_SCATTER[1])
        return np.array((place, place, turn))

    @property
    def tape_scatter(self) -> Floats:
        """Standard deviations of the tape's errors, in the order of `Tape` [m]."""
        return np.full(Tape(self.markings.stretches).size, max(self.tape_m, LEAST_TAPE_M))

    def with_scatter(self, position_m: float, heading_rad: float) -> "Views":
        """The same views with another scatter of poses."""
        return replace(self, position_m=position_m, heading_rad=heading_rad)


@dataclass(frozen=True)
class Tape:
    """Where the errors of the tape stand in one row of numbers.

    Attributes:
        stretches: Of the road.
    """

    stretches: int

    @property
    def size(self) -> int:
        """How many errors there are: a shift per line and stretch, a tilt, and three widths."""
        return self.stretches * (len(LINES) + TILTED) + 3

    def shift(self, stretch: NDArray[np.intp], line: NDArray[np.intp]) -> NDArray[np.intp]:
        """Place of how far a line lies to the right, or its dashes ahead [m]."""
        return stretch * len(LINES) + line

    def tilt(self, stretch: NDArray[np.intp], line: NDArray[np.intp]) -> NDArray[np.intp]:
        """Place of how much farther right it lies at the stretch's end than in its middle [m]."""
        return self.stretches * len(LINES) + stretch * TILTED + np.minimum(line, TILTED - 1)

    def width(self, white: NDArray[np.bool_], line: NDArray[np.intp]) -> NDArray[np.intp]:
        """Place of how much wider white lines, wider yellow lines or longer dashes are [m]."""
        kind = np.where(white, 0, np.where(line == len(LINES) - 1, 2, 1))
        return self.stretches * (len(LINES) + TILTED) + kind
