"""What stands above the horizon: gym-duckietown's sky, or the walls of a room."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.optics import SKY

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Room:
    """A panorama that is far away."""

    colour: Values  # its mean colour
    swing: Values  # how much brighter and darker it gets round the horizon, by harmonic (n,) as a share
    phase: Values  # where, by harmonic (n,) [rad]
    climb: float  # how much brighter it gets with every radian upwards, as a share

    def seen(self, directions: Values, heading: float) -> Values:
        """Colours (…, 3) in directions (…, 3) of a robot with this heading [rad]."""
        x, y, down = np.moveaxis(directions, -1, 0)
        azimuth = np.arctan2(y, x) + heading
        turns = np.arange(1, len(self.swing) + 1) * azimuth[..., None] + self.phase
        bright = 1.0 + np.sin(turns) @ self.swing + self.climb * np.arctan2(-down, np.hypot(x, y))
        return np.clip(self.colour * bright[..., None], 0.0, 255.0)


def sky() -> Room:
    """One colour."""
    return Room(np.array(SKY, dtype=float), np.zeros(0), np.zeros(0), 0.0)


def walls(random: np.random.Generator) -> Room:
    """Plain walls, grey to beige, brighter towards the windows."""
    colour = random.uniform(70.0, 170.0) * np.array((1.0, random.uniform(0.92, 1.0), random.uniform(0.8, 1.0)))
    harmonics = np.arange(1, 9)
    return Room(
        colour, random.normal(0.0, 0.15, 8) / harmonics, random.uniform(0.0, 6.28, 8), random.uniform(-0.2, 0.4)
    )
