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

from proxytune.driving.optics import SKY, CameraFigures, Renderer, floor_hits, ground_points
from proxytune.driving.road_picture import Floor
from proxytune.driving.texels import AT_ONCE, TexelTable, fastest
from proxytune.effects import Chain, FilterContext, Signal


class GroundPlaneCamera:
    """The default camera: the robot drives flat, so where each pixel looks in its frame is known beforehand.

    A pixel looks up one point in that of several blurred copies of the floor's picture whose blur is as wide as what
    the pixel covers there; without that, small pictures of a sharp floor alias.

    Attributes:
        shape: Of its pictures: rows, columns, 3.
    """

    def __init__(self, figures: CameraFigures, floor: Floor) -> None:
        """Find for every pixel its point on the floor and its copy of the floor's picture."""
        self._sky, table = _tabulate(figures, floor)
        self._tables = {self._sky: table}
        self._sky_levels = np.array(SKY * (figures.rows * figures.columns), dtype=np.uint8)
        self._origin = np.float32(floor.origin)
        self.shape = (figures.rows, figures.columns, 3)

    def render(self, poses: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
        """Render what it sees from poses (n, 3) of x [m], y [m], heading [rad]: (n, rows, columns, 3) RGB."""
        pictures = np.empty((len(poses), *self.shape), dtype=np.uint8)
        for first in range(0, len(poses), AT_ONCE):
            here = slice(first, first + AT_ONCE)
            self.develop(self.glimpse(poses[here])[:, None], _ALONE, pictures[here])
        return pictures

    def glimpse(self, poses: NDArray[np.floating[Any]], first: int = 0) -> NDArray[np.uint8]:
        """The levels (n, levels) that make a picture from poses (n, 3): of pixels from one on, but for the sky's."""
        first = max(first, self._sky)
        if first not in self._tables:
            self._tables[first] = self._tables[self._sky].without(first - self._sky)
        places = np.empty((len(poses), 6), dtype=np.float32)
        places[:, 0] = places[:, 3] = np.cos(poses[:, 2])
        places[:, 1] = sin = np.sin(poses[:, 2])
        places[:, 2] = -sin
        places[:, 4:] = poses[:, :2]
        places[:, 4:] -= self._origin
        return fastest(len(poses)).look_up(self._tables[first], places).view(np.uint8)

    def develop(self, glimpses: NDArray[np.uint8], weights: Signal, pictures: NDArray[Any]) -> None:
        """Write weighted means of glimpses (n, times, levels) as pictures (n, rows, columns, 3), rounded if bytes.

        What they do not show is sky.
        """
        levels = pictures.reshape(len(pictures), -1)
        first = levels.shape[1] - glimpses.shape[2] // 4 * 3
        levels[:, :first] = self._sky_levels[:first]
        fastest(0).average(glimpses, weights, levels)


_ALONE = np.ones(1, dtype=np.float32)


def _develop(glimpses: NDArray[np.uint8], weights: Signal, pictures: NDArray[Any]) -> None:
    """Do the same for glimpses that are pictures themselves, (n, times, rows, columns, 3)."""
    for glimpse, picture in zip(glimpses, pictures, strict=True):
        mean = weights @ glimpse.reshape(len(weights), -1).astype(np.float32)
        picture[...] = (np.rint(mean) if pictures.dtype == np.uint8 else mean).reshape(picture.shape)


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


def _ticks(context: FilterContext) -> int:
    """How many there are from one picture to the next."""
    return round(context.rate_hz / context.nominal["camera_rate"])


class _Averaged:
    """Film on which a picture is a weighted mean of what the camera saw at the last ticks, which is all that blur does.

    Attributes:
        partial: Whether it can show parts, and the same picture again.
    """

    def __init__(self, camera: Renderer, weights: Signal, contexts: Sequence[FilterContext], level: Any) -> None:
        self._glimpse = getattr(camera, "glimpse", lambda poses, first: camera.render(poses))
        self._develop = getattr(camera, "develop", _develop)
        self.partial = len(weights) <= _ticks(contexts[0])
        self._shape = getattr(camera, "shape", None) or camera.render(contexts[0].rest[None]).shape[1:]
        self._weights, self._level = weights, level
        self._poses = np.repeat(np.stack([context.rest for context in contexts])[:, None], len(weights), axis=1)
        self._glimpses: dict[int, NDArray[np.uint8]] = {}
        self._new = len(weights)

    def see(self, poses: Signal) -> None:
        """Let in the poses (robots, ticks, 3) since the picture before; the last are kept, as many as are averaged."""
        self._new = min(self._new + poses.shape[1], len(self._weights))
        if poses.shape[1] < len(self._weights):
            poses = np.concatenate((self._poses, poses), axis=1)
        self._poses = poses[:, -len(self._weights) :]

    def expose(self, robots: Sequence[int], first: int) -> NDArray[Any]:
        """The newest pictures (n, rows, columns, 3) of the robots left, right from the first pixel on, not rounded.

        What is known from the pictures before is not looked up.
        """
        new, kept, pixel = self._new, self._glimpses, first
        pictures, self._glimpses = np.empty((len(robots), *self._shape), dtype=self._level), {}
        if not self.partial:
            self._new = 0
        for first in range(0, len(robots), AT_ONCE):
            here = list(robots[first : first + AT_ONCE])
            seen = self._glimpse(self._poses[here, -new:].reshape(-1, 3), pixel)
            seen = seen.reshape(len(here), new, *seen.shape[1:])
            if new < len(self._weights):
                seen = np.concatenate((np.stack([kept[robot][new:] for robot in here]), seen), axis=1)
            if not self.partial:
                self._glimpses.update(zip(here, seen, strict=True))
            self._develop(seen, self._weights, pictures[first : first + AT_ONCE])
        return pictures


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
        """The last of all pictures since."""
        mixed: list[Signal] = []
        for poses in self._waiting:
            pictures = self._camera.render(poses[list(robots)].reshape(-1, 3))
            signals, mixed = pictures.reshape(len(robots), poses.shape[1], -1).astype(np.float32), []
            for robot, signal in zip(robots, signals, strict=True):
                made, self._memories[robot] = self._effects.apply(signal, self._memories[robot])
                mixed.append(made[-1].reshape(pictures.shape[1:]))
        self._waiting = []
        return np.stack(mixed)


class Views:
    """What the cameras of robots that drive side by side show through the image effects, at the camera's rate.

    Pictures that nobody asks for are not drawn.

    Attributes:
        changed: Whether the last poses brought new pictures; so they do to all robots or to none.
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
        self._film: _Mixed | _Averaged = (
            _Mixed(camera, mixing, developed) if weights is None else _Averaged(camera, weights, contexts, level)
        )
        self._memories = [self._alone.begin(one) for one in developed]
        self._every = _ticks(contexts[0])
        self._under_way = list(range(len(contexts)))
        self._waiting, self._unseen = rests[:, None], 0
        self._shown: NDArray[np.uint8] | None = None
        self._shows: list[int] = []
        self._first = sys.maxsize if self._film.partial and not self._alone.effects else 0
        self._let_in(1)
        self.changed = True

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

    def pictures(self, robots: Sequence[int], first: int = 0) -> NDArray[np.uint8]:
        """The newest pictures (n, rows, columns, 3) of some robots under way, right from the first pixel on."""
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
            signals, developed = shown.reshape(len(shown), 1, -1).astype(np.float32), []
            for robot, signal in zip(self._under_way, signals, strict=True):
                memory = self._alone.skip(self._memories[robot], self._unseen - 1)
                made, self._memories[robot] = self._alone.apply(signal, memory)
                developed.append(made.reshape(shown.shape[1:]))
            shown = np.stack(developed)
        self._unseen = 0
        if shown.dtype != np.uint8:
            shown = np.minimum(np.maximum(np.rint(shown), 0), 255).astype(np.uint8)
        return np.asarray(shown)
