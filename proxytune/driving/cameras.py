"""What the robot's camera shows of a flat floor, and the newest picture at the camera's rate.

The floor is flat, so where each pixel looks in the robot's frame is known beforehand: a picture is one look-up a pixel.
`Views` are the cameras of robots with their image effects while they drive.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from proxytune.arrays import SmallBuffers
from proxytune.driving.optics import SKY, CameraFigures, Renderer, floor_hits, ground_points
from proxytune.driving.road_picture import Floor
from proxytune.effects import Chain, FilterContext, Signal

Level = TypeVar("Level", np.uint8, np.float32)

AT_ONCE = 8
"""So many pictures are looked up at once: what is worked on stays in the processor's cache."""


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
        return self.picture(self.glimpse(poses))

    def glimpse(self, poses: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
        """The levels (n, levels) that make a picture from poses (n, 3): of pixels that are not always sky."""
        cos, sin, turned = np.cos(poses[:, 2]), np.sin(poses[:, 2]), np.empty((3, 2, len(poses), 1), dtype=np.float32)
        turned[0, 0, :, 0] = turned[1, 1, :, 0] = cos
        turned[0, 1, :, 0], turned[1, 0, :, 0] = sin, -sin
        turned[2, ..., 0] = poses[:, :2].T
        turned[2] -= self._origin
        return _look_up(self._table, turned).view(np.uint8)

    def picture(self, levels: NDArray[Level]) -> NDArray[Level]:
        """The pictures (n, rows, columns, 3) of glimpses, or of means over glimpses, (n, levels)."""
        pixels = levels.reshape(len(levels), -1, 4)
        pictures = np.empty((len(levels), self._sky + pixels.shape[1], 3), dtype=levels.dtype)
        pictures.reshape(len(levels), -1)[:, : 3 * self._sky] = self._sky_levels
        for colour in range(3):  # four times as fast as one copy of [..., :3]
            pictures[:, self._sky :, colour] = pixels[..., colour]
        return pictures.reshape(-1, *self._shape)


class _TexelTable(NamedTuple):
    """For each of a camera's pixels, a point in the robot's frame and a square of texels that shows it.

    Attributes:
        plane: The point and 1, in texels a metre, (3, pixels): x ahead, y to the left, 1.
        begin: The first column and row of the pixel's square, 0, (pixels,).
        last: The last column and row of the pixel's square, (pixels,).
        first: Index of the first texel of that square, (pixels,).
        side: Texels along its side, (pixels,).
        texels: All squares one after another, (texels,): red, green, blue and a spare byte in one number each.
    """

    plane: NDArray[np.float32]
    begin: NDArray[np.float32]
    last: NDArray[np.float32]
    first: NDArray[np.int32]
    side: NDArray[np.int32]
    texels: NDArray[np.uint32]


def _look_up(table: _TexelTable, turned: NDArray[np.float32]) -> NDArray[np.uint32]:
    """The texels (n, pixels) that pixels show; what is beyond the floor shows its edge.

    Args:
        table: Of the camera.
        turned: Robots' frames in that of the floor's picture, (3, 2, n, 1): x and y of what is ahead, of what is to the
            left, and of the robot's place from the corner of the picture [m].
    """
    texels = np.empty((turned.shape[2], len(table.last)), dtype=np.uint32)
    with SmallBuffers():
        for first in range(0, len(texels), AT_ONCE):
            ahead, left, place = turned[:, :, first : first + AT_ONCE]
            # Not a matrix product: BLAS rounds differently from processor to processor, and so would the pictures
            where = ahead * table.plane[0]
            part = left * table.plane[1]
            where += part
            where += np.multiply(place, table.plane[2], out=part)
            # Both at once, np.clip, takes twice as long, and so does a number instead of an array
            np.maximum(where, table.begin, out=where)
            np.minimum(where, table.last, out=where)
            column, row = where.astype(np.int32)
            row *= table.side
            row += column
            row += table.first
            table.texels.take(row, mode="wrap", out=texels[first : first + AT_ONCE])
    return texels


def _tabulate(figures: CameraFigures, floor: Floor) -> tuple[int, _TexelTable]:
    """Number of pixels that are sky before the first that sees floor, and a table of where the others look."""
    copies, points = _copies(floor), ground_points(figures).reshape(-1, 2)
    on_floor = np.isfinite(points[:, 0])
    sky = int(np.argmax(on_floor)) if on_floor.any() else len(on_floor)
    points, on_floor = points[sky:], on_floor[sky:]
    copy = np.where(on_floor, _blur_octaves(figures, floor).ravel()[sky:], 0)
    scale = copies.per_metre[copy]
    plane = np.stack((points[:, 0] * scale, points[:, 1] * scale, scale))
    # Those above the horizon stay at the last texel, the sky
    return sky, _TexelTable(
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


class _Film(Protocol):
    """Film: makes pictures of what cameras see."""

    def see(self, poses: Signal) -> None:
        """Let in the poses (robots, ticks, 3) since the picture before."""
        ...

    def expose(self, robots: Sequence[int]) -> NDArray[Any]:
        """The newest pictures (n, rows, columns, 3) of the robots that are left, not yet rounded."""
        ...


class _Averaged:
    """Each picture is a weighted mean of what the camera saw at the last ticks, which is all that blur does."""

    def __init__(self, camera: Renderer, weights: Signal, rests: Signal) -> None:
        self._glimpse = getattr(camera, "glimpse", camera.render)
        self._picture = getattr(camera, "picture", np.asarray)
        self._weights = weights
        self._poses = np.repeat(rests[:, None], len(weights), axis=1)
        self._glimpses: dict[int, NDArray[np.uint8]] = {}
        self._new = len(weights)

    def see(self, poses: Signal) -> None:
        """Keep the last poses, as many as are averaged."""
        self._poses = np.concatenate((self._poses, poses), axis=1)[:, -len(self._weights) :]
        self._new = min(self._new + poses.shape[1], len(self._weights))

    def expose(self, robots: Sequence[int]) -> NDArray[Any]:
        """The means of what these robots' cameras saw; what is known from the pictures before is not looked up."""
        new, self._new = self._new, 0
        latest = self._glimpse(self._poses[list(robots), -new:].reshape(-1, 3))
        if len(self._weights) == 1:
            return np.asarray(self._picture(latest))
        means = np.empty((len(robots), *latest.shape[1:]), dtype=np.float32)
        exact = np.empty((len(self._weights), means[0].size), dtype=np.float32)
        for number, robot in enumerate(robots):
            seen = latest[number * new : (number + 1) * new]
            if new < len(self._weights):
                seen = np.concatenate((self._glimpses[robot][new:], seen))
            self._glimpses[robot] = seen
            exact[...] = seen.reshape(exact.shape)
            means[number] = (self._weights @ exact).reshape(means.shape[1:])
        return np.asarray(self._picture(means))


class _Mixed:
    """Effects mix each picture with those before it, one after another."""

    def __init__(self, camera: Renderer, effects: Chain, contexts: Sequence[FilterContext]) -> None:
        self._camera, self._effects = camera, effects
        self._memories = [effects.begin(context) for context in contexts]
        self._waiting: list[Signal] = []

    def see(self, poses: Signal) -> None:
        """Remember what is to be mixed."""
        self._waiting.append(poses)

    def expose(self, robots: Sequence[int]) -> NDArray[Any]:
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
        rests = np.stack([one.rest for one in contexts])
        if image.effects:
            stills = camera.render(rests).reshape(len(rests), -1)
            contexts = [replace(one, rest=still) for one, still in zip(contexts, stills, strict=True)]
        mixing, self._alone = image.parted()
        weights = mixing.mean_weights(contexts[0].rate_hz)
        self._film: _Film = _Mixed(camera, mixing, contexts) if weights is None else _Averaged(camera, weights, rests)
        self._memories = [self._alone.begin(one) for one in contexts]
        self._every = round(contexts[0].rate_hz / contexts[0].nominal["camera_rate"])
        self._under_way = list(range(len(contexts)))
        self._waiting, self._unseen = rests[:, None], 0
        self._shown: NDArray[np.uint8] | None = None
        self._shows: list[int] = []
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

    def pictures(self, robots: Sequence[int]) -> NDArray[np.uint8]:
        """The newest pictures (n, rows, columns, 3) of some robots under way."""
        if self._shown is None:
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
        shown = self._film.expose(self._under_way)
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
