"""From a picture to where the lane lies: colour segmentation and projection by the nominal camera."""

import functools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.agents.agent import Picture
from proxytune.driving.cameras import CameraFigures, ground_points
from proxytune.driving.robot import Robot

Pixels = NDArray[np.intp]


class Lane(NamedTuple):
    """A straight line through the lane's centre in the robot's frame: left(x) = offset + slope · x.

    Attributes:
        offset: How far to the left of the axle's middle the lane's centre lies [m].
        slope: Tangent of the lane's direction, positive to the left.
        pixels: How many pixels say so.
    """

    offset: float
    slope: float
    pixels: int


@dataclass(frozen=True)
class Eye:
    """The part of the picture that the nominal camera takes for nearby floor.

    Attributes:
        first_row: The rows from here on are looked at.
        ahead: How far ahead of the axle each of their pixels lies [m], NaN beyond `reach`.
        left: How far to the left [m].
        near: Whether it lies within `reach`.
    """

    first_row: int
    ahead: NDArray[np.float64]
    left: NDArray[np.float64]
    near: NDArray[np.bool_]


@functools.lru_cache
def _eye(figures: CameraFigures, reach_m: float) -> Eye:
    ground = ground_points(figures)
    near = ground[..., 0] <= reach_m
    first_row = int(np.argmax(near.any(axis=1)))
    floor = np.where(near[..., None], ground, np.nan)[first_row:].reshape(-1, 2)
    ahead, left = np.ascontiguousarray(floor.T)
    return Eye(first_row, ahead, left, near[first_row:].ravel())


def open_eye(robot: Robot, *, reach_m: float = 0.7) -> Eye:
    """The eye of an agent on this robot, looking no further ahead than `reach_m`."""
    return _eye(robot.camera_figures(), reach_m)


def yellow_pixels(picture: Picture, eye: Eye, *, contrast: float = 60.0) -> Pixels:
    """Pixels of the dashed centre line: red and green brighter than blue by `contrast` (of 255)."""
    looked = picture[eye.first_row :].reshape(-1, 3)
    blue = looked[:, 2].astype(np.int16)
    yellow = np.minimum(looked[:, 0], looked[:, 1]) - blue > contrast
    return (yellow & eye.near).nonzero()[0]


def white_pixels(picture: Picture, eye: Eye, *, brightness: float = 150.0) -> Pixels:
    """Pixels of the solid edge lines: every colour brighter than `brightness` (of 255)."""
    looked = picture[eye.first_row :].reshape(-1, 3)
    darkest = np.minimum(np.minimum(looked[:, 0], looked[:, 1]), looked[:, 2])
    return ((darkest > brightness) & eye.near).nonzero()[0]


def fit_lane(eye: Eye, *, yellow: Pixels, white: Pixels, half_lane_m: float) -> Lane | None:
    """Least squares through the lane's centre: right of the yellow line, left of the white one.

    White pixels to the left of the yellow ones belong to the other lane's edge and are left out.

    Returns:
        The lane, or None where fewer than six pixels are left to fit.
    """
    left_of_robot = eye.left.take(yellow)
    divide = left_of_robot.sum() / yellow.size if yellow.size else half_lane_m
    white = white[eye.left.take(white) < divide]
    count = yellow.size + white.size
    if count < 6:
        return None
    ahead = eye.ahead.take(np.concatenate((yellow, white)))
    left = np.concatenate((left_of_robot - half_lane_m, eye.left.take(white) + half_lane_m))
    mean_ahead, mean_left = float(ahead.sum()) / count, float(left.sum()) / count
    centred = ahead - mean_ahead
    # a ridge keeps a handful of pixels at one distance from spinning the line round
    slope = float((centred * left).sum()) / (float((centred * centred).sum()) + 0.005 * count)
    return Lane(mean_left - slope * mean_ahead, slope, count)
