"""What the robot's camera sees of a flat floor: each pixel is one look-up of the floor's picture."""

import functools
import math
from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter

from proxytune.driving.road.texture import Floor
from proxytune.effects import CHANNELS, Stage
from proxytune.errors import SettingsError

CAMERA_CHANNELS = CHANNELS[Stage.CAMERA]
"""The figures that camera effects act on, in the order of their signal."""

SKY = (115, 209, 255)
"""What a pixel above the horizon shows: gym-duckietown's sky, red, green, blue."""


@dataclass(frozen=True)
class CameraFigures:
    """How a camera is made and mounted.

    Attributes:
        columns: Width of a picture [pixel].
        rows: Height of a picture [pixel].
        forward_m: How far the lens is ahead of the axle [m].
        pitch_deg: How far it looks down [deg].
        roll_deg: How far it is tilted clockwise in the driver's view [deg].
        yaw_deg: How far it looks to the left [deg].
        height_m: Height of the lens above the floor [m].
        field_of_view_deg: Vertical field of view of the lens without distortion [deg].
        k1: Radial distortion, plumb-bob model; below zero is a barrel.
        centre_right: How far right of the picture's middle the lens' axis meets it, as a share of the picture's height.
        centre_down: How far below the middle it does, in the same way.
        aspect: Horizontal focal length over the vertical one; above 1 things look wider than they are.

    Raises:
        SettingsError: If no camera can have these figures.
    """

    columns: int
    rows: int
    forward_m: float
    pitch_deg: float
    roll_deg: float
    yaw_deg: float
    height_m: float
    field_of_view_deg: float
    k1: float
    centre_right: float = 0.0
    centre_down: float = 0.0
    aspect: float = 1.0

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

    def channels(self) -> NDArray[np.float64]:
        """The figures that camera effects act on, in the order of CAMERA_CHANNELS."""
        return np.array([getattr(self, name) for name in CAMERA_CHANNELS], dtype=float)

    def with_channels(self, values: ArrayLike) -> Self:
        """The same camera with these values of CAMERA_CHANNELS."""
        return replace(self, **dict(zip(CAMERA_CHANNELS, np.asarray(values, dtype=float).tolist(), strict=True)))


class Camera(Protocol):
    """A camera on a robot."""

    def render(self, poses: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
        """What it sees from poses (n, 3) of x [m], y [m], heading [rad]: (n, rows, columns, 3) RGB."""
        ...


def ground_points(figures: CameraFigures) -> NDArray[np.float64]:
    """Where on the floor each pixel's middle looks, in the robot's frame.

    Returns:
        Shape (rows, columns, 2): x ahead of the axle and y to the left [m]; NaN at and above the horizon.
    """
    return _floor_hits(figures, 0.0, 0.0)


def _floor_hits(figures: CameraFigures, right: float, down: float) -> NDArray[np.float64]:
    """Where the rays through the pixels' middles, shifted by a part of a pixel, meet the floor."""
    columns, rows = np.meshgrid(np.arange(figures.columns), np.arange(figures.rows))
    return floor_points(figures, columns + 0.5 + right, rows + 0.5 + down)


def floor_points(figures: CameraFigures, columns: NDArray[Any], rows: NDArray[Any]) -> NDArray[np.float64]:
    """Where on the floor any points of the picture look, in the robot's frame.

    Args:
        figures: Of the camera.
        columns: Places (…) from the picture's left edge [pixel]; the first pixel's middle is at 0.5.
        rows: Places (…) from its upper edge [pixel].

    Returns:
        Shape (…, 2): x ahead of the axle and y to the left [m]; NaN at and above the horizon.
    """
    rays = lens_rays(figures, columns, rows)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(rays[..., 2] < 0.0, figures.height_m / -rays[..., 2], np.nan)
    hits: NDArray[np.float64] = rays[..., :2] * reach[..., None] + (figures.forward_m, 0.0)
    return hits


def lens_rays(figures: CameraFigures, columns: NDArray[Any], rows: NDArray[Any]) -> NDArray[np.float64]:
    """Directions (…, 3) in the robot's frame, forward, left, up, of the rays through points of the picture [pixel]."""
    focal = figures.rows / 2.0 / math.tan(math.radians(figures.field_of_view_deg) / 2.0)
    u = (columns - figures.columns / 2.0 - figures.centre_right * figures.rows) / focal / figures.aspect
    v = (rows - figures.rows / 2.0 - figures.centre_down * figures.rows) / focal
    # Plumb-bob r' = r (1 + k1 r²) solved for r to second order in k1: exact inverses end where r' has its maximum,
    # inside the picture for k1 < -0.2, but real lenses go on (their k2 > 0), and so does the series, always upwards.
    bend = figures.k1 * (u * u + v * v)
    stretch = 1.0 - bend + 3.0 * bend * bend
    rays = np.stack((np.ones_like(u), -u * stretch, -v * stretch), axis=-1)
    return rays @ orientation(figures).T


def orientation(figures: CameraFigures) -> NDArray[np.float64]:
    """Rotation (3, 3) from the camera's frame to the robot's, both forward, left, up: roll, then pitch, then yaw."""
    roll, pitch, yaw = (math.radians(angle) for angle in (figures.roll_deg, figures.pitch_deg, figures.yaw_deg))
    about_x = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    about_y = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    about_z = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    rotation: NDArray[np.float64] = about_z @ about_y @ about_x
    return rotation


class GroundPlaneCamera:
    """The default camera: the robot drives flat, so where each pixel looks in its frame is known beforehand.

    A pixel looks up one point in that of several blurred copies of the floor's picture whose blur is as wide as what
    the pixel covers there; without that, small pictures of a sharp floor alias.
    """

    def __init__(self, figures: CameraFigures, floor: Floor) -> None:
        """Find for every pixel its point on the floor and its copy of the floor's picture."""
        copies = _copies(floor)
        points = ground_points(figures).reshape(-1, 2)
        on_floor = np.isfinite(points[:, 0])
        copy = np.where(on_floor, _blur_octaves(figures, floor).ravel(), 0)
        scale = copies.per_metre[copy]
        plane = np.stack((points[:, 0] * scale, points[:, 1] * scale, scale))
        # Pixels above the horizon stay at the last texel, the sky
        self._plane = np.where(on_floor, plane, 0.0).astype(np.float32)
        self._origin = np.float32(floor.origin)
        self._last = np.where(on_floor, copies.sides[copy] - 1, 0).astype(np.float32)
        self._first = np.where(on_floor, copies.firsts[copy], copies.texels.size - 1).astype(np.int32)
        self._side = copies.sides[copy].astype(np.int32)
        self._texels = copies.texels
        self._shape = (figures.rows, figures.columns)
        self._keep_from(int(np.argmax(on_floor)) if on_floor.any() else len(on_floor))

    def render(self, poses: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
        """What it sees from poses (n, 3) of x [m], y [m], heading [rad]: (n, rows, columns, 3) RGB."""
        column, row = self._look(poses)
        row *= self._side
        row += column
        row += self._first
        texels = self._texels.take(row, mode="clip").view(np.uint8).reshape(*row.shape, 4)
        pictures = np.empty((len(poses), self._shape[0] * self._shape[1], 3), dtype=np.uint8)
        pictures.reshape(len(poses), -1)[:, : self._sky.size] = self._sky
        for colour in range(3):  # four times as fast as one copy of [..., :3]
            pictures[:, self._sky.size // 3 :, colour] = texels[..., colour]
        return pictures.reshape(len(poses), *self._shape, 3)

    def _keep_from(self, pixel: int) -> None:
        """Look up only the pixels from this one on: all before it are sky."""
        self._sky = np.array(SKY * pixel, dtype=np.uint8)
        self._plane, self._last = np.ascontiguousarray(self._plane[:, pixel:]), self._last[pixel:]
        self._first, self._side = self._first[pixel:], self._side[pixel:]

    def _look(self, poses: NDArray[np.floating[Any]]) -> NDArray[np.int32]:
        """Column and row (2, n, pixels) of each pixel's texel in its copy."""
        cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        ahead, left = np.array((cos, sin), dtype=np.float32), np.array((-sin, cos), dtype=np.float32)
        place = poses[:, :2].T.astype(np.float32) - self._origin
        # Not a matrix product: BLAS rounds differently from processor to processor, and so would the pictures
        where: NDArray[np.float32] = ahead[..., None] * self._plane[0]
        where += left[..., None] * self._plane[1]
        where += place[..., None] * self._plane[2]
        # Both at once, np.clip, takes twice as long
        np.maximum(where, 0.0, out=where)
        np.minimum(where, self._last, out=where)
        return where.astype(np.int32)


@dataclass(frozen=True)
class _Copies:
    """Copies of a floor's picture, each blurred over twice the width of the one before, in one row of texels.

    Attributes:
        texels: Red, green, blue and a spare byte in one number each; the last is the sky.
        firsts: Index of each copy's first texel.
        sides: Texels along a side of each copy.
        per_metre: Texels per metre of each copy.
    """

    texels: NDArray[np.uint32]
    firsts: NDArray[np.int64]
    sides: NDArray[np.int64]
    per_metre: NDArray[np.float64]


OCTAVES = 6
"""How often the width of the blur doubles: 64 pixels of the floor's picture are a quarter of a tile."""

FINENESS = 4
"""Texels across the width of a copy's blur: with one, a look-up is off by half of what the pixel covers."""


@functools.lru_cache
def _copies(floor: Floor) -> _Copies:
    picture, copies = floor.pixels.astype(np.float32), [floor.pixels]
    for octave in range(1, OCTAVES + 1):
        if 2**octave > FINENESS:
            picture = picture.reshape(len(picture) // 2, 2, -1, 2, 3).mean(axis=(1, 3))
        # A Gaussian of 0.4 widths is nearest to the mean over a box, measured on pictures of 64 × 48
        sigma = 0.4 * min(2**octave, FINENESS)
        copies.append(np.rint(gaussian_filter(picture, (sigma, sigma, 0.0), mode="nearest")).astype(np.uint8))
    colours = np.concatenate([*(copy.reshape(-1, 3) for copy in copies), np.array([SKY], dtype=np.uint8)])
    padded = np.concatenate((colours, np.zeros((len(colours), 1), dtype=np.uint8)), axis=1)
    sides = np.array([len(copy) for copy in copies])
    per_metre = floor.pixels_per_metre * sides / sides[0]
    return _Copies(padded.view(np.uint32).ravel(), np.cumsum(sides**2) - sides**2, sides, per_metre)


def _blur_octaves(figures: CameraFigures, floor: Floor) -> NDArray[np.int64]:
    """Which copy each pixel (rows, columns) looks up: blurred over half the diagonal of what the pixel covers."""
    across = _floor_hits(figures, 0.5, 0.0) - _floor_hits(figures, -0.5, 0.0)
    along = _floor_hits(figures, 0.0, 0.5) - _floor_hits(figures, 0.0, -0.5)
    width = np.sqrt((across**2 + along**2).sum(axis=-1)) / 2.0 * floor.pixels_per_metre
    octaves: NDArray[np.int64] = np.rint(np.clip(np.log2(np.nan_to_num(width, nan=np.inf)), 0, OCTAVES)).astype(int)
    return octaves
