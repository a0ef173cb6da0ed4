"""The scene through any lens: the reference renderer's sharp picture, and where in it each ray of the lens goes.

The renderer draws an undistorted picture from the middle of a frame's exposure. As the floor is flat, what a pixel saw
a little earlier or later lies in the same picture, at the place that the robot's motion in between gives.
"""

from typing import Self
from unittest import mock

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from camera_truth.lens import rays
from camera_truth.room import Room
from camera_truth.sight import COLUMNS, ROWS, Sight
from proxytune.driving import CameraFigures, bullet as renderer
from proxytune.driving.road_picture import Floor

Values = NDArray[np.float64]

PER_PIXEL = 2
"""Rays along a side of a pixel, averaged."""

DENSEST, MOST_PIXELS = 4.0, 320_000
"""Rendered pixels along a side of a picture's pixel, and in all: drawing 300 000 takes 0.07 s."""

REACH = 0.03
"""How much more than the rays' own slopes the rendered picture holds, for what moves during an exposure."""

LEVEL = 1e-4
"""Rays less steep than this do not meet the floor."""


class Pinhole:
    """A camera with its lens over a floor; close it, or use it in a `with`."""

    def __init__(self, sight: Sight, floor: Floor, room: Room, *, moves: bool) -> None:
        """Find every ray, and draw a picture that holds them all."""
        self._sight, self._room = sight, room
        columns, rows = ((np.arange(size * PER_PIXEL) + 0.5) / PER_PIXEL for size in (COLUMNS, ROWS))
        self._rays = rays(sight, *np.meshgrid(columns, rows))
        self._meets = self._rays[..., 2] > LEVEL
        slopes = np.abs(self._slopes(self._rays[self._meets])).max(axis=0)
        wide, high = slopes * (1.5 if moves else 1.0) + REACH
        focal = sight.focal_px * min(DENSEST, np.sqrt(MOST_PIXELS / (4.0 * wide * high)) / sight.focal_px)
        self._width, self._height = (int(2.0 * focal * size) for size in (wide, high))
        self._focal = self._height / 2.0 / high
        pinhole = CameraFigures(
            columns=self._width,
            rows=self._height,
            forward_m=sight.camera_forward,
            pitch_deg=sight.camera_pitch,
            roll_deg=0.0,
            yaw_deg=sight.camera_yaw,
            height_m=sight.camera_height,
            field_of_view_deg=2.0 * float(np.degrees(np.arctan(high))),
            k1=0.0,
        )
        self._camera = renderer.BulletCamera(pinhole, floor)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *problem: object) -> None:
        self._camera.close()

    def expose(self, middle: Values, poses: Values, weights: Values) -> Values:
        """A picture (ROWS, COLUMNS, 3), grey levels.

        Args:
            middle: The pose x [m], y [m], heading [rad] that is rendered.
            poses: The poses (k, 3) during the exposure.
            weights: Of each pose in each row of the picture (k, ROWS).
        """
        with mock.patch.object(renderer, "OVERSAMPLING", 1):
            drawn = self._camera.render(middle[None])[0].astype(np.float32)
        picture = np.zeros((ROWS, COLUMNS, 3))
        for pose, weight in zip(poses, weights, strict=True):
            rows = np.flatnonzero(weight)
            picture[rows] += weight[rows, None, None] * self._look(drawn, middle, pose, rows)
        return picture

    def _look(self, drawn: NDArray[np.float32], middle: Values, pose: Values, rows: NDArray[np.intp]) -> Values:
        """What these rows show from another pose than the one that was drawn."""
        fine = slice(rows[0] * PER_PIXEL, (rows[-1] + 1) * PER_PIXEL)
        directions, meets = self._rays[fine], self._meets[fine]
        seen = np.empty((*meets.shape, 3), dtype=np.float32)
        seen[~meets] = self._room.seen(directions[~meets], float(pose[2]))
        slopes = self._slopes(self._from_middle(directions[meets], middle, pose))
        column = slopes[:, 0] * self._focal + self._width / 2.0 - 0.5
        # The row above the floor's end is the renderer's sky
        end = self._height / 2.0 - self._focal * np.tan(np.radians(self._sight.camera_pitch))
        row = np.maximum(slopes[:, 1] * self._focal + self._height / 2.0 - 0.5, end + 1.0)
        for colour in range(3):
            seen[meets, colour] = map_coordinates(drawn[..., colour], (row, column), order=1, mode="nearest")
        averaged = seen.reshape(-1, PER_PIXEL, COLUMNS, PER_PIXEL, 3).mean(axis=(1, 3))
        return np.asarray(averaged[rows - rows[0]])

    def _from_middle(self, directions: Values, middle: Values, pose: Values) -> Values:
        """Directions from the lens at `middle` to where these from the lens at `pose` meet the floor."""
        cos, sin = np.cos(middle[2]), np.sin(middle[2])
        dx, dy = pose[:2] - middle[:2]
        turn = pose[2] - middle[2]
        x = directions[:, 0] * np.cos(turn) - directions[:, 1] * np.sin(turn)
        y = directions[:, 0] * np.sin(turn) + directions[:, 1] * np.cos(turn)
        forward = self._sight.camera_forward
        lens = (cos * dx + sin * dy + forward * (np.cos(turn) - 1.0), cos * dy - sin * dx + forward * np.sin(turn))
        nearer = directions[:, 2] / self._sight.camera_height
        return np.stack((x + nearer * lens[0], y + nearer * lens[1], directions[:, 2]), axis=-1)

    def _slopes(self, directions: Values) -> Values:
        """Slopes (…, 2) to the right and down of directions in the robot's frame, in the renderer's picture."""
        pitch, yaw = np.radians((self._sight.camera_pitch, self._sight.camera_yaw))
        x, y, down = np.moveaxis(directions, -1, 0)
        ahead, left = x * np.cos(yaw) + y * np.sin(yaw), y * np.cos(yaw) - x * np.sin(yaw)
        forward = np.maximum(ahead * np.cos(pitch) + down * np.sin(pitch), 1e-6)
        return np.stack((-left / forward, (down * np.cos(pitch) - ahead * np.sin(pitch)) / forward), axis=-1)
