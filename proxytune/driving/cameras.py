"""What the robot's camera shows of a flat floor, and the newest picture at the camera's rate.

The floor is flat, so where each pixel looks in the robot's frame is known beforehand: a picture is one look-up a pixel.
`Views` are the cameras of robots with their image effects while they drive.
"""

import functools
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from proxytune.driving.loops import TexelTable, fastest
from proxytune.driving.optics import SKY, CameraFigures, Renderer, floor_hits, ground_points, joined, parted
from proxytune.driving.road_picture import Floor
from proxytune.effects import Chain, FilterContext, Signal


class GroundPlaneCamera:
    """The default camera: the robot drives flat, so where each pixel looks in its frame is known beforehand.

    A pixel looks up one point in that of several blurred copies of the floor's picture whose blur is as wide as what
    the pixel covers there; without that, small pictures of a sharp floor alias. Its pictures have a `shape`.
    """

    def __init__(self, figures: CameraFigures, floor: Floor) -> None:
        """Find for every pixel its point on the floor and its copy of the floor's picture."""
        self._sky, table = _tabulate(figures, floor)
        self._tables = {self._sky: table}
        self._sky_levels = np.array(SKY, dtype=np.uint8)[:, None]
        self._origin = np.float32(floor.origin)
        self.shape = (figures.rows, figures.columns, 3)

    def render(self, poses: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
        """Render what it sees from poses (n, 3) of x [m], y [m], heading [rad]: (n, rows, columns, 3) RGB."""
        return joined(self.expose(poses[:, None], _ALONE))

    def expose(
        self, poses: NDArray[np.floating[Any]], weights: Signal, first: int = 0, level: Any = np.uint8
    ) -> NDArray[Any]:
        """Weighted means (n, 3, rows, columns) of what it sees from poses at several times (n, times, 3).

        Pixels before the first may be anything; `level` is the kind of levels, 0 to 255, of which bytes are rounded.
        """
        on_floor = max(first, self._sky)
        if on_floor not in self._tables:
            self._tables[on_floor] = self._tables[self._sky].without(on_floor - self._sky)
        places = np.empty((*poses.shape[:2], 6), dtype=np.float32)
        places[..., 0] = places[..., 3] = np.cos(poses[..., 2])
        places[..., 1] = sin = np.sin(poses[..., 2])
        places[..., 2] = -sin
        places[..., 4:] = poses[..., :2]
        places[..., 4:] -= self._origin
        planes = np.empty((len(poses), 3, self.shape[0] * self.shape[1]), dtype=level)
        planes[..., first:on_floor] = self._sky_levels
        places = places.reshape(-1, 6)
        fastest(len(places)).expose(self._tables[on_floor], places, weights, planes)
        return planes.reshape(len(poses), 3, *self.shape[:2])


_ALONE = np.ones(1, dtype=np.float32)


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
        begin=np.zeros(len(points), dtype=np.float32),
        last=np.where(on_floor, copies.sides[copy] - 1, 0).astype(np.float32),
        first=np.where(on_floor, copies.firsts[copy], copies.texels.size - 1).astype(np.int32),
        side=copies.sides[copy].astype(np.int32),
        texels=copies.texels,
    )


@dataclass(frozen=True)
class _Copies:
    """Copies of a floor's picture, each blurred over twice the width of the one before, in one row of texels."""

    texels: NDArray[np.uint32]  # red, green, blue and a spare byte in one number each; the last is the sky
    firsts: NDArray[np.int64]  # index of each copy's first texel
    sides: NDArray[np.int64]  # texels along a side of each copy
    per_metre: NDArray[np.float64]  # texels per metre of each copy


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


class _Exposed:
    """Film on which a picture is a weighted mean of what was seen at the last ticks, which is all that blur does."""

    partial = True  # it can show parts, and the same picture again

    def __init__(self, camera: Any, weights: Signal, contexts: Sequence[FilterContext], level: Any) -> None:
        self._camera, self._weights, self._level = camera, weights, level
        self._poses = np.repeat(np.stack([context.rest for context in contexts])[:, None], len(weights), axis=1)

    def see(self, poses: Signal) -> None:
        """Let in the poses (robots, ticks, 3) since the picture before; the last are kept, as many as are averaged."""
        if poses.shape[1] < len(self._weights):
            poses = np.concatenate((self._poses, poses), axis=1)
        self._poses = poses[:, -len(self._weights) :]

    def expose(self, robots: Sequence[int], first: int) -> NDArray[Any]:
        """The newest pictures (n, 3, rows, columns) of robots, right from the first pixel on."""
        return np.asarray(self._camera.expose(self._poses[list(robots)], self._weights, first, self._level))


class _Averaged(_Exposed):
    """The same of a camera that can only render, which it does once for each pose."""

    partial = False

    def __init__(self, camera: Renderer, weights: Signal, contexts: Sequence[FilterContext], level: Any) -> None:
        super().__init__(camera, weights, contexts, level)
        self._rendered: dict[int, NDArray[np.uint8]] = {}
        self._new = len(weights)

    def see(self, poses: Signal) -> None:
        """Let in the poses (robots, ticks, 3) since the picture before."""
        super().see(poses)
        self._new = min(self._new + poses.shape[1], len(self._weights))

    def expose(self, robots: Sequence[int], first: int) -> NDArray[Any]:
        """The newest pictures (n, 3, rows, columns) of robots."""
        new, self._new, exposed = self._new, 0, []
        for robot in robots:
            rendered = self._camera.render(self._poses[robot, len(self._weights) - new :])
            if new < len(self._weights):
                rendered = np.concatenate((self._rendered[robot][new:], rendered))
            self._rendered[robot] = rendered
            mean = np.tensordot(self._weights, rendered.astype(np.float32), 1)
            exposed.append(np.rint(mean).astype(np.uint8) if self._level == np.uint8 else mean)
        return parted(np.stack(exposed))


class _Mixed:
    """Film on which effects mix each picture with those before it, one after another."""

    partial = False

    def __init__(self, camera: Renderer, effects: Chain, contexts: Sequence[FilterContext]) -> None:
        self._camera, self._effects = camera, effects
        self._memories = [effects.begin(context) for context in contexts]
        self._waiting: list[Signal] = []

    def see(self, poses: Signal) -> None:
        """Remember what is to be mixed."""
        self._waiting.append(poses)

    def expose(self, robots: Sequence[int], first: int) -> NDArray[Any]:
        """The last of all pictures (n, 3, rows, columns) since."""
        mixed: list[Signal] = []
        for poses in self._waiting:
            pictures = self._camera.render(poses[list(robots)].reshape(-1, 3))
            signals, mixed = pictures.reshape(len(robots), poses.shape[1], -1).astype(np.float32), []
            for robot, signal in zip(robots, signals, strict=True):
                made, self._memories[robot] = self._effects.apply(signal, self._memories[robot])
                mixed.append(made[-1].reshape(pictures.shape[1:]))
        self._waiting = []
        return parted(np.stack(mixed))


class Views:
    """What the cameras of robots that drive side by side show through the image effects, at the camera's rate.

    Pictures that nobody asks for are not drawn.
    """

    def __init__(self, camera: Renderer, image: Chain, contexts: Sequence[FilterContext]) -> None:
        """Open the shutters; each context is that of poses, its rest where that robot stood before them, (3,)."""
        rests, developed = np.stack([one.rest for one in contexts]), contexts
        if image.effects:
            stills = camera.render(rests).reshape(len(rests), -1)
            developed = [replace(one, rest=still) for one, still in zip(contexts, stills, strict=True)]
        mixing, self._alone = image.parted()
        weights = mixing.mean_weights(contexts[0].rate_hz)
        level = np.float32 if self._alone.effects else np.uint8
        self._film: _Mixed | _Exposed
        if weights is None:
            self._film = _Mixed(camera, mixing, developed)
        elif isinstance(camera, GroundPlaneCamera):
            self._film = _Exposed(camera, weights, contexts, level)
        else:
            self._film = _Averaged(camera, weights, contexts, level)
        self._memories = [self._alone.begin(one) for one in developed]
        self._every = round(contexts[0].rate_hz / contexts[0].nominal["camera_rate"])  # ticks from picture to picture
        self._under_way = list(range(len(contexts)))
        self._waiting, self._unseen = rests[:, None], 0
        self._shown: NDArray[np.uint8] | None = None
        self._shows: list[int] = []
        self._first = sys.maxsize if self._film.partial and not self._alone.effects else 0
        self._let_in(1)
        self.changed = True  # whether the last poses brought new pictures; so they do to all robots or to none

    def pass_by(self, poses: Signal, robots: Sequence[int]) -> None:
        """Let robots under way see their poses (robots, ticks, 3) of the next ticks; the others have left for good."""
        rows = poses
        if len(robots) < len(self._waiting):
            rows = np.zeros((len(self._waiting), *poses.shape[1:]))
            rows[list(robots)] = poses
        self._under_way = list(robots)
        self._waiting = np.concatenate((self._waiting, rows), axis=1)
        self.changed = self._waiting.shape[1] >= self._every
        while self._waiting.shape[1] >= self._every:
            self._let_in(self._every)

    def planes(self, robots: Sequence[int], first: int = 0) -> NDArray[np.uint8]:
        """The newest pictures (n, 3, rows, columns) of some robots under way, right from the first pixel on."""
        if self._shown is None or first < self._first:
            # From then on: whoever looks at this part of a picture looks at that of the next
            self._first = min(self._first, first)
            self._shown, self._shows = self._draw(), self._under_way
        if list(robots) == self._shows:
            return self._shown
        return self._shown[[self._shows.index(robot) for robot in robots]]

    def _let_in(self, ticks: int) -> None:
        """Let the film see the first ticks of those that wait; a new picture is due."""
        seen, self._waiting = self._waiting[:, :ticks], self._waiting[:, ticks:]
        self._film.see(seen)
        self._unseen += ticks
        self._shown = None

    def _draw(self) -> NDArray[np.uint8]:
        shown = self._film.expose(self._under_way, self._first)
        if self._alone.effects:
            pictures, developed = joined(shown), []
            signals = pictures.reshape(len(shown), 1, -1).astype(np.float32)
            for robot, signal in zip(self._under_way, signals, strict=True):
                memory = self._alone.skip(self._memories[robot], self._unseen - 1)
                made, self._memories[robot] = self._alone.apply(signal, memory)
                developed.append(made.reshape(pictures.shape[1:]))
            shown = parted(np.stack(developed))
        self._unseen = 0
        if shown.dtype != np.uint8:
            shown = np.minimum(np.maximum(np.rint(shown), 0), 255).astype(np.uint8)
        return np.asarray(shown)
