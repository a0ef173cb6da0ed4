"""What the robot's camera shows of a flat floor, and the newest picture at the camera's rate.

The floor is flat, so where each pixel looks in the robot's frame is known beforehand: a picture is one look-up a pixel.
`Views` are the cameras of robots with their image effects while they drive.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from proxytune.driving.agent import Picture
from proxytune.driving.optics import SKY, CameraFigures, Renderer, floor_hits, ground_points
from proxytune.driving.road_picture import Floor
from proxytune.driving.texels import TexelTable, fastest, keep_colours
from proxytune.effects import Chain, FilterContext, Signal


class GroundPlaneCamera:
    """The default camera: the robot drives flat, so where each pixel looks in its frame is known beforehand.

    A pixel looks up one point in that of several blurred copies of the floor's picture whose blur is as wide as what
    the pixel covers there; without that, small pictures of a sharp floor alias.
    """

    def __init__(self, figures: CameraFigures, floor: Floor) -> None:
        """Find for every pixel its point on the floor and its copy of the floor's picture."""
        self._sky, self._table = _tabulate(figures, floor)
        self._sky_levels = np.array(SKY * self._sky, dtype=np.uint8)
        self._origin = np.float32(floor.origin)
        self._shape = (figures.rows, figures.columns, 3)

    def render(self, poses: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
        """Render what it sees from poses (n, 3) of x [m], y [m], heading [rad]: (n, rows, columns, 3) RGB."""
        pictures = self._sky_only(len(poses))
        texels = self.glimpse(poses).view(np.uint8).reshape(len(poses), -1, 4)
        keep_colours(texels, pictures[:, self._sky :])
        shown: NDArray[np.uint8] = pictures.reshape(-1, *self._shape)
        return shown

    def glimpse(self, poses: NDArray[np.floating[Any]]) -> NDArray[np.uint32]:
        """The texels (n, pixels) that its pixels show from poses (n, 3), but for those that are always sky."""
        places = np.empty((len(poses), 4), dtype=np.float32)
        places[:, 0], places[:, 1] = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        places[:, 2:] = poses[:, :2]
        places[:, 2:] -= self._origin
        return fastest().look_up(self._table, places)

    def mean(self, glimpses: NDArray[np.uint32], weights: NDArray[np.float32]) -> NDArray[np.uint8]:
        """The weighted mean of glimpses (n, pixels) as a picture (rows, columns, 3); weights are as `Blur` has them."""
        picture = self._sky_only(1)[0]
        fastest().average(glimpses, weights, picture[self._sky :])
        shown: NDArray[np.uint8] = picture.reshape(self._shape)
        return shown

    def _sky_only(self, count: int) -> NDArray[np.uint8]:
        """Pictures (count, pixels, 3) in which only the pixels that are always sky have been drawn."""
        pictures = np.empty((count, self._sky + len(self._table.last), 3), dtype=np.uint8)
        pictures.reshape(count, -1)[:, : 3 * self._sky] = self._sky_levels
        return pictures


def _tabulate(figures: CameraFigures, floor: Floor) -> tuple[int, TexelTable]:
    """Number of pixels that are sky before the first that sees floor, and a table of where the others look."""
    copies, points = _copies(floor), ground_points(figures).reshape(-1, 2)
    on_floor = np.isfinite(points[:, 0])
    sky = int(np.argmax(on_floor)) if on_floor.any() else len(on_floor)
    points, on_floor = points[sky:], on_floor[sky:]
    copy = np.where(on_floor, _blur_octaves(figures, floor).ravel()[sky:], 0)
    scale = copies.per_metre[copy]
    plane = np.stack((points[:, 0] * scale, points[:, 1] * scale, scale))
    # Those above the horizon stay at the last texel, the sky
    return sky, TexelTable(
        plane=np.where(on_floor, plane, 0.0).astype(np.float32),
        last=np.where(on_floor, copies.sides[copy] - 1, 0).astype(np.float32),
        first=np.where(on_floor, copies.firsts[copy], copies.texels.size - 1).astype(np.int32),
        side=copies.sides[copy].astype(np.int32),
        texels=copies.texels,
    )


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
    """Copy that each pixel (rows, columns) looks up: blurred over half the diagonal of what the pixel covers."""
    across = floor_hits(figures, 0.5, 0.0) - floor_hits(figures, -0.5, 0.0)
    along = floor_hits(figures, 0.0, 0.5) - floor_hits(figures, 0.0, -0.5)
    width = np.sqrt((across**2 + along**2).sum(axis=-1)) / 2.0 * floor.pixels_per_metre
    octaves: NDArray[np.int64] = np.rint(np.clip(np.log2(np.nan_to_num(width, nan=np.inf)), 0, OCTAVES)).astype(int)
    return octaves


class _Film(Protocol):
    """Film: makes pictures of what the camera sees."""

    def expose(self, poses: Signal) -> Picture:
        """The picture after the poses (ticks, 3) since the one before."""
        ...


class _Averaged:
    """Each picture is a weighted mean of what the camera saw at the last ticks, which is all that blur does."""

    def __init__(self, camera: Renderer, weights: Signal, start: Signal) -> None:
        self._glimpse = getattr(camera, "glimpse", camera.render)
        self._mean = getattr(camera, "mean", mean_picture)
        self._weights = weights
        self._glimpses = np.repeat(self._glimpse(start[None]), len(weights), axis=0)

    def expose(self, poses: Signal) -> Picture:
        """The picture after some more poses; of more than are averaged the last ones are rendered."""
        latest = self._glimpse(poses[-len(self._weights) :])
        kept = self._glimpses[len(latest) :]
        self._glimpses = np.concatenate((kept, latest)) if len(kept) else latest
        return np.asarray(self._mean(self._glimpses, self._weights))


class _Developed:
    """Image effects are done to every picture, one after another."""

    def __init__(self, camera: Renderer, effects: Chain, context: FilterContext) -> None:
        self._camera, self._effects = camera, effects
        still = camera.render(context.rest[None]).reshape(-1)
        self._memory = effects.begin(replace(context, rest=still))

    def expose(self, poses: Signal) -> Picture:
        """The picture after some more poses."""
        pictures = self._camera.render(poses)
        signal = pictures.reshape(len(pictures), -1).astype(np.float32)
        developed, self._memory = self._effects.apply(signal, self._memory)
        levels = np.minimum(np.maximum(np.rint(developed[-1]), 0), 255)
        return np.asarray(levels.astype(np.uint8).reshape(pictures.shape[1:]))


class Views:
    """What the cameras of robots that drive side by side show through the image effects, at the camera's rate.

    Attributes:
        changed: Whether the last poses brought new pictures; so they do to all robots or to none.
    """

    def __init__(self, camera: Renderer, image: Chain, contexts: Sequence[FilterContext]) -> None:
        """Take the first pictures; each context is that of poses, its rest where that robot stood before them, (3,)."""
        weights = image.mean_weights(contexts[0].rate_hz)
        self._films: list[_Film] = [
            _Developed(camera, image, one) if weights is None else _Averaged(camera, weights, one.rest)
            for one in contexts
        ]
        self._every = round(contexts[0].rate_hz / contexts[0].nominal["camera_rate"])
        self._waiting = np.empty((len(contexts), 0, 3))
        self._pictures = [film.expose(one.rest[None]) for film, one in zip(self._films, contexts, strict=True)]
        self.changed = True

    def pass_by(self, poses: Signal, robots: Sequence[int]) -> None:
        """Let some robots see their poses (robots, ticks, 3) of the next ticks; the others have left."""
        rows = np.zeros((len(self._films), *poses.shape[1:]))
        rows[list(robots)] = poses
        self._waiting = np.concatenate((self._waiting, rows), axis=1)
        self.changed = self._waiting.shape[1] >= self._every
        while self._waiting.shape[1] >= self._every:
            seen, self._waiting = self._waiting[:, : self._every], self._waiting[:, self._every :]
            for robot in robots:
                self._pictures[robot] = self._films[robot].expose(seen[robot])

    def pictures(self, robots: Sequence[int]) -> NDArray[np.uint8]:
        """The newest pictures (n, rows, columns, 3) of some robots."""
        return np.stack([self._pictures[robot] for robot in robots])


def mean_picture(pictures: NDArray[np.uint8], weights: Signal) -> Picture:
    """The weighted mean of pictures (n, rows, columns, 3) as a picture."""
    mean = weights @ pictures.reshape(len(pictures), -1).astype(np.float32)
    return np.asarray(np.rint(mean).astype(np.uint8).reshape(pictures.shape[1:]))
