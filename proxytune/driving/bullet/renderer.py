"""The reference camera: PyBullet's own renderer looking at the floor's picture."""

import struct
import tempfile
import weakref
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import pybullet
from numpy.typing import NDArray

from proxytune.driving.cameras import SKY, CameraFigures, orientation
from proxytune.driving.road.texture import Floor
from proxytune.errors import SettingsError

OVERSAMPLING = 4
"""Rendered pixels along a side of a pixel, averaged: the renderer itself does nothing against aliasing."""

NEAR, FAR, HORIZON = 0.01, 100.0, 50.0
"""What the renderer draws, and how far the floor goes on around the map [m]: at 50 m it ends 0.1° below the horizon."""


class BulletCamera:
    """The same picture as GroundPlaneCamera's, in a PyBullet world of its own that ends with the camera."""

    def __init__(self, figures: CameraFigures, floor: Floor) -> None:
        """Lay the floor.

        Raises:
            SettingsError: If the lens distorts, which this renderer cannot draw.
        """
        if figures.k1 != 0.0:
            raise SettingsError(
                f'camera: "renderer" draws no lens distortion, got k1 = {figures.k1:g}; use camera = "ground_plane"'
            )
        self._figures = figures
        self._world: int = pybullet.connect(pybullet.DIRECT)
        self._end = weakref.finalize(self, pybullet.disconnect, self._world)
        _lay(floor, self._world)

    def render(self, poses: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
        """What it sees from poses (n, 3) of x [m], y [m], heading [rad]: (n, rows, columns, 3) RGB."""
        figures = self._figures
        pictures = np.empty((len(poses), figures.rows, figures.columns, 3), dtype=np.uint8)
        for picture, pose in zip(pictures, poses, strict=True):
            fine = self._shoot(pose).reshape(figures.rows, OVERSAMPLING, figures.columns, OVERSAMPLING, 3)
            picture[:] = np.rint(fine.mean(axis=(1, 3)))
        return pictures

    def close(self) -> None:
        """End the camera's PyBullet world; once is enough, twice does no harm."""
        self._end()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _shoot(self, pose: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
        figures = self._figures
        width, height = figures.columns * OVERSAMPLING, figures.rows * OVERSAMPLING
        _, _, colours, _, bodies = pybullet.getCameraImage(
            width,
            height,
            _view(figures, pose),
            _projection(figures.field_of_view_deg, width, height),
            shadow=0,
            lightAmbientCoeff=1.0,
            lightDiffuseCoeff=0.0,
            lightSpecularCoeff=0.0,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._world,
        )
        picture = np.reshape(np.asarray(colours, dtype=np.uint8), (height, width, 4))[..., :3].copy()
        picture[np.reshape(bodies, (height, width)) < 0] = SKY
        return picture


def _projection(field_of_view_deg: float, width: int, height: int) -> list[float]:
    """OpenGL's projection matrix of the lens."""
    matrix = list(pybullet.computeProjectionMatrixFOV(field_of_view_deg, width / height, NEAR, FAR))
    # The renderer looks through the lower left corner of a pixel instead of its middle
    matrix[8] += 1.0 / width
    matrix[9] += 1.0 / height
    return matrix


def _view(figures: CameraFigures, pose: NDArray[np.floating[Any]]) -> tuple[float, ...]:
    """OpenGL's view matrix of the camera on a robot at this pose."""
    x, y, heading = (float(value) for value in pose)
    cos, sin = np.cos(heading), np.sin(heading)
    eye = np.array([x + cos * figures.forward_m, y + sin * figures.forward_m, figures.height_m])
    axes = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ orientation(figures)
    return tuple(pybullet.computeViewMatrix(eye, eye + axes[:, 0], axes[:, 2]))


def _lay(floor: Floor, world: int) -> None:
    """Nine rectangles with the floor's picture on the middle one and its edge drawn out over the others."""
    size = floor.pixels.shape[0]
    texel, far = 0.5 / size, size / floor.pixels_per_metre
    inset = 0.5 / floor.pixels_per_metre
    places = floor.origin + np.array([-HORIZON, inset, far - inset, far + HORIZON])
    textures = np.array([texel, texel, 1.0 - texel, 1.0 - texel])
    corners = [4 * row + column for row in range(3) for column in range(3)]
    triangles = [corner + step for corner in corners for step in (0, 1, 5, 0, 5, 4)]
    shape = pybullet.createVisualShape(
        pybullet.GEOM_MESH,
        vertices=[[x, y, 0.0] for y in places for x in places],
        uvs=[[u, v] for v in textures for u in textures],
        normals=[[0.0, 0.0, 1.0]] * 16,
        indices=triangles,
        physicsClientId=world,
    )
    body = pybullet.createMultiBody(0, -1, shape, physicsClientId=world)
    with tempfile.TemporaryDirectory() as folder:
        texture = pybullet.loadTexture(str(_write_targa(floor, Path(folder))), physicsClientId=world)
    pybullet.changeVisualShape(body, -1, textureUniqueId=texture, rgbaColor=(1, 1, 1, 1), physicsClientId=world)


def _write_targa(floor: Floor, folder: Path) -> Path:
    """The floor's picture as an uncompressed TGA, whose rows go up and whose pixels are blue, green, red."""
    path, side = folder / "floor.tga", floor.pixels.shape[0]
    header = struct.pack("<BBBHHBHHHHBB", 0, 0, 2, 0, 0, 0, 0, 0, side, side, 24, 0)
    path.write_bytes(header + floor.pixels[..., ::-1].tobytes())
    return path
