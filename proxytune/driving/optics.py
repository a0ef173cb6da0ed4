"""How a camera is made and mounted, and where its pixels look."""

import math
from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from proxytune.effects import CHANNELS, Stage
from proxytune.errors import SettingsError

CAMERA_CHANNELS = CHANNELS[Stage.CAMERA]
"""The figures that camera effects act on, in the order of their signal."""
SKY = (115, 209, 255)
"""What a pixel above the horizon shows: gym-duckietown's sky, red, green, blue."""


@dataclass(frozen=True)
class CameraFigures:
    """Figures of how a camera is made and mounted; a SettingsError if no camera can have these."""

    columns: int  # width of a picture [pixel]
    rows: int  # height of a picture [pixel]
    forward_m: float  # how far the lens is ahead of the axle [m]
    pitch_deg: float  # how far it looks down [deg]
    roll_deg: float  # how far it is tilted clockwise in the driver's view [deg]
    yaw_deg: float  # how far it looks to the left [deg]
    height_m: float  # height of the lens above the floor [m]
    field_of_view_deg: float  # vertical field of view of the lens without distortion [deg]
    k1: float  # radial distortion, plumb-bob model; below zero is a barrel
    centre_right: float = 0.0  # how far right of the picture's middle the lens' axis is, as a share of its height
    centre_down: float = 0.0  # how far below the middle it does, in the same way
    aspect: float = 1.0  # horizontal focal length over the vertical one; above 1 things look wider than they are

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not math.isfinite(value):
                raise SettingsError(f"camera: {name} must be finite, got {value}")
        if self.columns < 1 or self.rows < 1:
            raise SettingsError(f"camera: a picture needs a column and a row, got {self.columns} × {self.rows}")
        if self.height_m <= 0.0:
            raise SettingsError(f"camera: height_m must be above 0 m, got {self.height_m}")
        if self.aspect <= 0.0:
            raise SettingsError(f"camera: aspect must be above 0, got {self.aspect}")
        if not 0.0 < self.field_of_view_deg < 180.0:
            raise SettingsError(f"camera: field_of_view_deg must be between 0° and 180°, got {self.field_of_view_deg}")

    @property
    def focal(self) -> float:
        """The vertical focal length [pixel]."""
        return self.rows / 2.0 / math.tan(math.radians(self.field_of_view_deg) / 2.0)

    def channels(self) -> NDArray[np.float64]:
        """The figures that camera effects act on, in the order of CAMERA_CHANNELS."""
        return np.array([getattr(self, name) for name in CAMERA_CHANNELS], dtype=float)

    def with_channels(self, values: ArrayLike) -> Self:
        """The same camera with these values of CAMERA_CHANNELS."""
        return replace(self, **dict(zip(CAMERA_CHANNELS, np.asarray(values, dtype=float).tolist(), strict=True)))


class Renderer(Protocol):
    """A camera on a robot."""

    def render(self, poses: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
        """Render what it sees from poses (n, 3) of x [m], y [m], heading [rad]: (n, rows, columns, 3) RGB."""


def parted(pictures: NDArray[Any]) -> NDArray[Any]:
    """Pictures (n, rows, columns, 3) as planes of red, green and blue, (n, 3, rows, columns), without a copy."""
    return pictures.transpose(0, 3, 1, 2)


def joined(planes: NDArray[Any]) -> NDArray[Any]:
    """Planes of red, green and blue (n, 3, rows, columns) as pictures (n, rows, columns, 3)."""
    pictures = np.empty((len(planes), *planes.shape[2:], 3), dtype=planes.dtype)
    for colour in range(3):  # four times as fast as one copy
        pictures[..., colour] = planes[:, colour]
    return pictures


def ground_points(figures: CameraFigures) -> NDArray[np.float64]:
    """Points of the floor at which each pixel's middle looks, in the robot's frame.

    Returns:
        Shape (rows, columns, 2): x ahead of the axle and y to the left [m]; NaN at and above the horizon.
    """
    return floor_hits(figures, 0.0, 0.0)


def floor_hits(figures: CameraFigures, right: float, down: float) -> NDArray[np.float64]:
    """Points where the rays through the pixels' middles, shifted by a part of a pixel, meet the floor."""
    columns, rows = np.meshgrid(np.arange(figures.columns), np.arange(figures.rows))
    return floor_points(figures, columns + 0.5 + right, rows + 0.5 + down)


def floor_points(figures: CameraFigures, columns: NDArray[Any], rows: NDArray[Any]) -> NDArray[np.float64]:
    """Points of the floor (…, 2) at which any places (…) in the picture look, from its left and upper edge [pixel].

    The first pixel's middle is at 0.5. Points are x ahead of the axle and y to the left [m]; NaN at and above the
    horizon.
    """
    rays = lens_rays(figures, columns, rows)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(rays[..., 2] < 0.0, figures.height_m / -rays[..., 2], np.nan)
    hits: NDArray[np.float64] = rays[..., :2] * reach[..., None] + (figures.forward_m, 0.0)
    return hits


def lens_rays(figures: CameraFigures, columns: NDArray[Any], rows: NDArray[Any]) -> NDArray[np.float64]:
    """Directions (…, 3) in the robot's frame, forward, left, up, of the rays through points of the picture [pixel]."""
    focal = figures.focal
    u = (columns - figures.columns / 2.0 - figures.centre_right * figures.rows) / focal / figures.aspect
    v = (rows - figures.rows / 2.0 - figures.centre_down * figures.rows) / focal
    # Plumb-bob r' = r (1 + k1 r²) solved for r to second order in k1: exact inverses end where r' has its maximum,
    # inside the picture for k1 < -0.2, but real lenses go on (their k2 > 0), and so does the series, always upwards.
    bend = figures.k1 * (u * u + v * v)
    stretch = 1.0 - bend + 3.0 * bend * bend
    rays = np.stack((np.ones_like(u), -u * stretch, -v * stretch), axis=-1)
    return rays @ orientation(figures).T


def orientation(figures: CameraFigures) -> NDArray[np.float64]:
    """Rotation (3, 3) from the camera's frame to the robot's, both forward, left, up."""
    return rotation(*(math.radians(angle) for angle in (figures.roll_deg, figures.pitch_deg, figures.yaw_deg)))


def rotation(roll: float, pitch: float, yaw: float) -> NDArray[np.float64]:
    """Rotation (3, 3) by roll, then pitch, then yaw [rad]."""
    about_x = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    about_y = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    about_z = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)
