"""Where the robot of a blind set was: 120 places at random, or smooth weaving drives of a Duckiebot."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from proxytune.driving import Road, lane_length, lane_point

Values = NDArray[np.float64]

FRAMES, DRIVES = 120, 4
FINE_HZ, ROWS_HZ = 200, 20
FULL_SPEED, BASELINE, LAG_S, DELAY_S = 0.6, 0.16, 0.20, 0.15
MARGIN_S = 0.5
"""A drive goes on so long before its first frame and after its last, so that exposures lie within it."""

LEAD_S = 0.25
"""A drive begins on its way: so long before, the robot is where it should be."""


@dataclass(frozen=True)
class Drive:
    """One drive."""

    frames: Values  # times of its frames (n,) [s]
    duties: Values  # left and right at 20 Hz, each held until the next (m, 2)
    poses: Values  # true ones, FINE_HZ a second, from time 0 on (k, 3)

    @property
    def rows(self) -> Values:
        """The true poses (m, 3) at 20 Hz."""
        return self.poses[:: FINE_HZ // ROWS_HZ][: len(self.duties)]

    def at(self, times: Values) -> Values:
        """The true poses (…, 3) at any times within the drive."""
        clock = np.arange(len(self.poses)) / FINE_HZ
        return np.stack([np.interp(times, clock, column) for column in self.poses.T], axis=-1)


def places(road: Road, random: np.random.Generator) -> Values:
    """Poses (FRAMES, 3) over both lanes, up to 0.1 m aside and 20° askew, either way round."""
    outer = random.random(FRAMES) < 0.5
    along = random.random(FRAMES) * lane_length(road, outer)
    aside, askew = random.uniform(-0.1, 0.1, FRAMES), np.radians(random.uniform(-20.0, 20.0, FRAMES))
    points, heading = _lane(road, outer, along)
    points = points + aside[:, None] * np.stack((-np.sin(heading), np.cos(heading)), axis=-1)
    return np.column_stack((points, heading + askew))


def drives(road: Road, random: np.random.Generator) -> tuple[Drive, ...]:
    """Drives with FRAMES frames in all, every second one in the outer lane."""
    rate_hz = random.uniform(2.0, 4.0)
    return tuple(_drive(road, outer=number % 2 == 0, rate_hz=rate_hz, random=random) for number in range(DRIVES))


def _lane(road: Road, outer: NDArray[np.bool_] | bool, along: Values) -> tuple[Values, Values]:
    """Points of a lane (…, 2) [m] and its direction there [rad]."""
    step = 0.002
    points = lane_point(road, outer, along)
    ahead = lane_point(road, outer, along + step) - lane_point(road, outer, along - step)
    return points, np.arctan2(ahead[..., 1], ahead[..., 0])


def _drive(road: Road, *, outer: bool, rate_hz: float, random: np.random.Generator) -> Drive:
    count = FRAMES // DRIVES
    frames = MARGIN_S + (np.arange(count) + random.uniform(-0.15, 0.15, count)) / rate_hz + 0.2
    rows = int(np.ceil((frames[-1] + MARGIN_S) * ROWS_HZ)) + 1
    wanted = _weaving(road, outer, rows / ROWS_HZ + LEAD_S, random)
    wheels = _wheels(wanted)
    duties, held = _duties(wheels)
    before = round(LEAD_S * ROWS_HZ)
    poses = _driven(wanted[0], wheels[0], held)[round(LEAD_S * FINE_HZ) :]
    return Drive(frames, duties[before : before + rows], poses)


def _weaving(road: Road, outer: bool, seconds: float, random: np.random.Generator) -> Values:
    """Poses at FINE_HZ of a path beside the lane's middle, now to one side, now to the other."""
    clock = np.arange(int((seconds + DELAY_S) * FINE_HZ) + FINE_HZ) / FINE_HZ
    low, high = (0.15, 0.45) if outer else (0.15, 0.30)  # the inner lane's bends are too tight for more
    middle, swing = (low + high) / 2.0, (high - low) / 2.0 * random.uniform(0.5, 1.0)
    speed = middle + swing * np.sin(2.0 * np.pi * clock / random.uniform(4.0, 9.0) + random.uniform(0.0, 6.28))
    along = random.random() * float(lane_length(road, outer)) + np.cumsum(speed) / FINE_HZ
    points, heading = _lane(road, outer, along)
    aside = random.uniform(0.02, 0.06) * np.sin(
        2.0 * np.pi * along / random.uniform(0.7, 1.4) + random.uniform(0.0, 6.28)
    )
    points = points + aside[:, None] * np.stack((-np.sin(heading), np.cos(heading)), axis=-1)
    points = gaussian_filter1d(points, 0.15 * FINE_HZ, axis=0, mode="nearest")[FINE_HZ // 2 :]
    velocity = np.gradient(points, axis=0) * FINE_HZ
    return np.column_stack((points, np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))))


def _wheels(poses: Values) -> Values:
    """Speeds of the wheels (k, 2) that go that way, as shares of full speed."""
    velocity = np.gradient(poses, axis=0) * FINE_HZ
    forward, turn = np.hypot(velocity[:, 0], velocity[:, 1]), velocity[:, 2] * BASELINE / 2.0
    return np.column_stack((forward - turn, forward + turn)) / FULL_SPEED


def _duties(wheels: Values) -> tuple[Values, Values]:
    """What a Duckiebot with motors that lag and commands that arrive late must be told for these speeds of its wheels.

    Returns:
        Duties at 20 Hz as they are sent (m, 2), and at FINE_HZ as they arrive (k, 2).
    """
    wanted = np.clip(wheels + LAG_S * np.gradient(wheels, axis=0) * FINE_HZ, -1.0, 1.0)
    late, each = round(DELAY_S * FINE_HZ), FINE_HZ // ROWS_HZ
    duties = wanted[late + each // 2 :: each]
    return duties, np.concatenate((wanted[:late], np.repeat(duties, each, axis=0)))[: len(wheels)]


def _driven(begin: Values, wheels: Values, held: Values) -> Values:
    """Poses at FINE_HZ of a robot that begins with this pose and speeds, and at which these duties (k, 2) arrive."""
    speeds = np.empty_like(held)
    for number, duty in enumerate(held):
        speeds[number] = wheels
        wheels = wheels + (duty - wheels) * (1.0 - np.exp(-1.0 / (FINE_HZ * LAG_S)))
    forward, turn = speeds.mean(axis=1) * FULL_SPEED, (speeds[:, 1] - speeds[:, 0]) * FULL_SPEED / BASELINE
    heading = begin[2] + (np.cumsum(turn) - turn) / FINE_HZ
    middle = heading + turn / FINE_HZ / 2.0
    steps = np.column_stack((np.cos(middle), np.sin(middle))) * forward[:, None] / FINE_HZ
    return np.column_stack((begin[:2] + np.cumsum(steps, axis=0) - steps, heading))
