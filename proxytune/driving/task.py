"""The lane-following task: where an episode starts, and what a drive is worth.

An episode ends when the axle's middle leaves the map, when the robot hits something, or when its time is over. The
lane of a pose is the one whose direction agrees with its heading (right-hand traffic); a robot is in it
while it is at most half a lane width from its centre line. So whoever drives the wrong way is in neither lane.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.road.lane import LanePose, lane_length, lane_pose
from proxytune.driving.road.maps import Road
from proxytune.errors import EpisodeError
from proxytune.seeds import placement_generator

Values = NDArray[np.float64]

METRICS: Mapping[str, str] = MappingProxyType(
    {
        "distance": "m",
        "survival_time": "s",
        "time_out_of_lane": "s",
        "deviation": "m",
        "early_distance": "m",
        "early_offset": "m",
        "speed": "m/s",
    }
)
"""What an episode yields, with units."""

EARLY_S = 5.0
"""What the first so many seconds show, no crash has cut off yet: of all that is measured it says most of θ."""


def start_pose(
    road: Road, index: int, *, seed: int, position_noise_m: float, heading_noise_deg: float
) -> tuple[float, float, float]:
    """Put the robot down at one of the map's starts, as exactly as a hand does.

    Args:
        road: The map.
        index: Which start.
        seed: Seed of the episode; the same seed and index give the same pose.
        position_noise_m: Standard deviation of x and of y [m].
        heading_noise_deg: Standard deviation of the heading [deg].

    Returns:
        x [m], y [m], heading [rad].
    """
    x, y, heading_deg = road.starts[index]
    noise = placement_generator(seed, index).standard_normal(3)
    heading = math.radians(heading_deg + heading_noise_deg * float(noise[2]))
    return x + position_noise_m * float(noise[0]), y + position_noise_m * float(noise[1]), heading


def score_trajectory(road: Road, poses: Values, *, tick_s: float, seconds: float) -> dict[str, float]:
    """Score a drive by the task's metrics.

    - distance [m]: net way along the lane's centre line in its direction, counted while in the lane; a step against it
      is negative. A step from one lane to the other counts nothing, one across a lane's edge counts half.
    - survival_time [s]: from the first pose to the first one off the map, or the last one; at most `seconds`.
    - time_out_of_lane [s]: time until then that was not spent in the lane.
    - deviation [m]: mean over that time of the distance from the lane's centre line, in the lane or out of it.
    - early_distance [m]: distance within the first 5 s.
    - early_offset [m]: mean over the first 5 s of how far left of the lane's centre line the robot is.
    - speed [m/s]: mean speed over ground, in the lane or out of it.

    Distances and times of a drive's parts, the pose at the cut in both, add up to the whole drive's.

    Args:
        road: The map.
        poses: x [m], y [m], heading [rad] at a constant rate, shape (samples, 3); the last one is where the robot hit
            something, if it did.
        tick_s: Time between two poses [s].
        seconds: When time is over [s].

    Raises:
        EpisodeError: If a pose is not finite.
    """
    driven = _driven(road, poses, tick_s=tick_s, seconds=seconds)
    pose = lane_pose(road, driven[:, :2], driven[:, 2])
    aside = np.abs(pose.deviation)
    in_lane = _over_steps((aside <= road.lane_width / 2.0).astype(float))
    along, early = in_lane * _steps_along(road, pose), round(EARLY_S / tick_s)
    way = np.hypot(*np.diff(driven[:, :2], axis=0).T)
    return {
        "distance": float(np.sum(along)),
        "survival_time": tick_s * len(in_lane),
        "time_out_of_lane": tick_s * float(np.sum(1.0 - in_lane)),
        "deviation": _mean_over_steps(aside),
        "early_distance": float(np.sum(along[:early])),
        "early_offset": _mean_over_steps(pose.deviation[: early + 1]),
        "speed": float(np.mean(way)) / tick_s if len(way) else 0.0,
    }


def driving_score(road: Road, poses: Values, *, wheel_distance: float, tick_s: float, seconds: float) -> float:
    """Score a drive as the paper's learning experiment does: seconds driven, less those with a wheel out of the lane.

    Each second with one wheel outside the lane takes one off, each with both wheels two, so 60 s are worth −60 to 60.
    It ends where the robot leaves the map. Standing still in the lane counts as driving, as it does in the paper.

    Args:
        road: The map.
        poses: x [m], y [m], heading [rad] at a constant rate, shape (samples, 3).
        wheel_distance: Distance between the wheels [m].
        tick_s: Time between two poses [s].
        seconds: When time is over [s].

    Raises:
        EpisodeError: If a pose is not finite.
    """
    driven = _driven(road, poses, tick_s=tick_s, seconds=seconds)
    headings = driven[:, 2]
    aside = wheel_distance / 2.0 * np.stack((-np.sin(headings), np.cos(headings)), axis=-1)
    wheels = np.stack((driven[:, :2] + aside, driven[:, :2] - aside))
    out = np.abs(lane_pose(road, wheels, np.stack((headings, headings))).deviation) > road.lane_width / 2.0
    return tick_s * float(np.sum(1.0 - _over_steps(out.sum(axis=0).astype(float))))


def _driven(road: Road, poses: Values, *, tick_s: float, seconds: float) -> Values:
    """The poses until time is over or the first one is off the map, that one included."""
    in_time = poses[: math.floor(seconds / tick_s + 1e-9) + 1]  # 1e-9: a whole number of ticks may divide to just less
    off = np.any((in_time[:, :2] < 0.0) | (in_time[:, :2] > road.size), axis=1)
    driven = in_time[: int(np.argmax(off)) + 1] if off.any() else in_time
    if not np.isfinite(driven).all():
        step = int(np.argmin(np.isfinite(driven).all(axis=1)))
        raise EpisodeError(f"the pose is not finite at {step * tick_s:.2f} s; the plant cannot follow these commands")
    return driven


def _steps_along(road: Road, pose: LanePose) -> Values:
    """Way along the lane from each pose to the next [m], the short way round the loop."""
    lap = lane_length(road, pose.counter_clockwise[:-1])
    way = np.mod(np.diff(pose.along) + lap / 2.0, lap) - lap / 2.0
    return np.where(pose.counter_clockwise[1:] == pose.counter_clockwise[:-1], way, 0.0)


def _mean_over_steps(values: Values) -> float:
    """Mean over time of what was sampled at the steps' ends; of a single sample that itself."""
    return float(np.mean(_over_steps(values) if len(values) > 1 else values))


def _over_steps(values: Values) -> Values:
    """Mean over each step of what was sampled at its two ends."""
    return (values[:-1] + values[1:]) / 2.0
