"""The lane-following task: where an episode starts, when it is over, and what a trajectory is worth."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from proxytune.driving.lane import LanePosition, Numbers, lane_position
from proxytune.driving.maps import LoopMap

METRICS: Mapping[str, str] = MappingProxyType(
    {"distance": "m", "survival_time": "s", "time_out_of_lane": "s", "deviation": "m"}
)
"""The task's metrics with their units."""


def start_pose(
    road: LoopMap, index: int, *, seed: int, position_noise_m: float, heading_noise_deg: float
) -> Numbers:
    """A start of the map, put down as well as a person can: (3,) x [m], y [m], heading [rad].

    Args:
        road: The map.
        index: Which of its starts.
        seed: Together with the index it determines the noise.
        position_noise_m: Standard deviation of x and of y [m].
        heading_noise_deg: Standard deviation of the heading [deg].
    """
    x, y, heading = road.starts[index]
    noise = np.random.default_rng((seed, index)).normal(size=3)
    spread = np.array((position_noise_m, position_noise_m, np.radians(heading_noise_deg)))
    return np.array((x, y, np.radians(heading))) + spread * noise


def off_map(road: LoopMap, x: float, y: float) -> bool:
    """Whether the middle of the axle at x, y [m] has left the map."""
    return not (0.0 <= x <= road.side and 0.0 <= y <= road.side)


def score_trajectory(road: LoopMap, poses: Numbers, *, tick_s: float, seconds: float) -> Mapping[str, float]:
    """What a trajectory is worth.

    - distance: Progress along the lane in its direction [m], steps against it negative, counted while the robot is
      in the lane that its heading belongs to (within half a lane's width of its centre line).
    - survival_time: Until it leaves the map or the episode ends [s], at most `seconds`.
    - time_out_of_lane: Time spent further than half a lane's width from that centre line [s].
    - deviation: Mean distance from that centre line [m].

    Args:
        road: The map.
        poses: Start, then the pose after every tick, (ticks + 1, 3): x [m], y [m], heading [rad].
        tick_s: Length of a tick [s].
        seconds: Longest time an episode takes [s].
    """
    gone = ~((poses[:, :2] >= 0.0) & (poses[:, :2] <= road.side)).all(axis=1)
    ticks = int(np.argmax(gone)) if gone.any() else len(poses) - 1
    lane = lane_position(road, poses[: ticks + 1])
    inside = np.abs(lane.deviation) <= road.lane_width / 2.0
    return {
        "distance": float(_progress(lane, inside).sum()),
        "survival_time": min(ticks * tick_s, seconds),
        "time_out_of_lane": float((~inside[1:]).sum() * tick_s),
        "deviation": float(np.abs(lane.deviation).mean()),
    }


def _progress(lane: LanePosition, inside: np.ndarray) -> Numbers:
    """Progress of each step [m]: none across a change of lane or outside of it."""
    step = np.diff(lane.along)
    lap = lane.lap[1:]
    step = np.remainder(step + lap / 2.0, lap) - lap / 2.0
    same = (lane.outer[1:] == lane.outer[:-1]) & inside[1:] & inside[:-1]
    return np.where(same, step, 0.0)
