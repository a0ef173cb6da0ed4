"""From a log's frames to views: what a diagnosis of the camera goes by.

`find_edges` finds edges of white and yellow markings to a fraction of a pixel; `track_frames` gives the poses at which
pictures were taken, smoothed by parabolas where the robot moves; `Optics` is the robot's camera as values in θ, for
pictures of the log's own size; `Tape` orders the errors with which the map's lines may lie. `gather_views` reads a log
and puts all of it together.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, gaussian_filter, map_coordinates
from scipy.signal import savgol_coeffs, savgol_filter

from proxytune.arrays import Flags, Floats
from proxytune.diagnosis.answer import RULES
from proxytune.driving import LINES, CameraFigures, Markings, Road, Robot, mounted_camera, read_map, shipped_map
from proxytune.effects import Stage, effect_of, effects_from
from proxytune.errors import LogError
from proxytune.logs import Frames, Log, read_pictures

SMOOTHING_PX = 1.0
"""Standard deviation of the Gaussian whose slope is the gradient [pixel]."""
LEAST_SLOPE = 0.15
"""A weaker gradient of whiteness or yellowness, from 0 to 1, is none of a marking [1/pixel]."""
YELLOW = 0.55
"""How far a yellow marking's blue lies below its red and green, as a share of the range from the floor to white."""
SKY = 40
"""A pixel whose blue is so much above its red [grey levels] is sky; so are those within SKY_MARGIN pixels."""
SKY_MARGIN = 3

BORDER = 2
"""Edges nearer to the picture's border are left out [pixel]."""


class Edges(NamedTuple):
    """Points of markings' edges, n of them."""

    frame: NDArray[np.intp]  # number of the picture (n,)
    white: Flags  # whether the marking is white, else yellow (n,)
    column: Floats  # place from the picture's left edge (n,) [pixel]
    row: Floats  # place from its upper edge (n,) [pixel]
    normal: Floats  # unit vector to the right and down from the floor into the marking (n, 2)

    def only(self, chosen: NDArray[Any]) -> "Edges":
        """The points that are chosen, by a mask or their numbers."""
        return Edges._make(field[chosen] for field in self)


def find_edges(pictures: NDArray[np.uint8]) -> Edges:
    """Find the edges of markings in pictures (N, rows, columns, 3), red, green, blue; sorted by picture."""
    maps = [_colour_maps(picture) for picture in pictures]
    parts = [_edges_of(number, white, pair[not white]) for number, pair in enumerate(maps) for white in (True, False)]
    return Edges._make(np.concatenate(field) for field in zip(*parts, strict=True))


def _colour_maps(picture: NDArray[np.uint8]) -> tuple[Floats, Floats]:
    """Whiteness and yellowness of each pixel, from 0 to 1; NaN where there is sky."""
    colours = picture.astype(np.float32)
    red, green, blue = colours[..., 0], colours[..., 1], colours[..., 2]
    sky = binary_dilation(blue > red + SKY, iterations=SKY_MARGIN)
    least = colours.min(axis=-1)
    ground = np.ones_like(sky) if sky.all() else ~sky
    dark = float(np.median(colours[ground].mean(axis=-1)))
    span = max(float(np.percentile(least[ground], 99.0)) - dark, 1.0)
    # No upper end: where a bright marking is clipped, its edges move outwards
    white = np.maximum((least - dark) / span, 0.0)
    yellow = np.maximum((np.minimum(red, green) - blue) / (YELLOW * span), 0.0)
    return np.where(sky, np.nan, white), np.where(sky, np.nan, yellow)


def _edges_of(number: int, white: bool, share: Floats) -> Edges:
    known = np.isfinite(share)
    filled = np.where(known, share, 0.0)
    down = gaussian_filter(filled, SMOOTHING_PX, order=(1, 0), mode="nearest")
    right = gaussian_filter(filled, SMOOTHING_PX, order=(0, 1), mode="nearest")
    slope = np.hypot(down, right)
    known &= ~binary_dilation(~known, iterations=SKY_MARGIN) if not known.all() else known
    inner = np.zeros_like(known)
    inner[BORDER:-BORDER, BORDER:-BORDER] = True
    row, column = np.nonzero((slope >= LEAST_SLOPE) & known & inner)
    here = slope[row, column]
    step_down, step_right = down[row, column] / here, right[row, column] / here
    ahead, behind = (
        map_coordinates(slope, (row + way * step_down, column + way * step_right), order=1) for way in (1.0, -1.0)
    )
    bend = 2.0 * here - ahead - behind
    top = (here >= ahead) & (here > behind) & (bend > 1e-9)
    shift = ((ahead - behind) / np.where(top, 2.0 * bend, 1.0))[top]
    column, row, step_right, step_down = column[top], row[top], step_right[top], step_down[top]
    place = column + 0.5 + shift * step_right, row + 0.5 + shift * step_down
    normal = np.stack((step_right, step_down), axis=-1).astype(float)
    return Edges(np.full(len(row), number), np.full(len(row), white), *place, normal)


WINDOW_S = 0.5
"""Poses are smoothed by parabolas over windows so long, which tell the speed too."""
ORDER = 2

LONGEST_GAP_S = 0.25
"""Frames within a longer gap between poses are left out."""
APART_S = 10.0
"""How far apart drives are put on the common axis of times, so that none reaches into the next."""


@dataclass(frozen=True)
class Tracks:
    """The poses of N frames, and those shortly before and after, on an axis of time where drives follow each other."""

    times: Floats  # (K,) [s]
    poses: Floats  # (K, 3), unwrapped [m, rad]
    rates: Floats  # of the poses, 0 where pictures were taken standing still
    instants: Floats  # when each frame was taken (N,) [s]
    begins: Floats  # when each frame's drive begins (N,) [s]
    share: float  # of scatter that smoothing leaves

    def at(self, late_s: float) -> tuple[Floats, Floats]:
        """Poses and rates (N, 3) so long before each frame's instant."""
        when = np.maximum(self.instants - late_s, self.begins)
        series = (self.poses.T, self.rates.T)
        poses, rates = (np.stack([np.interp(when, self.times, one) for one in each], axis=-1) for each in series)
        return poses, rates

    @property
    def moving(self) -> bool:
        """Tell whether any picture was taken in motion."""
        return bool(np.any(self.rates))


def track_frames(log: Log, frames: Frames) -> tuple[Tracks, NDArray[np.intp]]:
    """The tracks of a log's frames, and the numbers of those frames whose pose is known; refused if there is none."""
    still = log.rate_hz == 0.0
    parts, offset, instants, begins = [], 0.0, np.full(len(frames.times), np.nan), np.zeros(len(frames.times))
    for number, episode in enumerate(log.episodes):
        own = np.flatnonzero(frames.drives == number)
        known = np.asarray(np.isfinite(episode.poses).all(axis=1))
        # A drive shorter than the window tells no speed
        if not known.any() or (not still and len(episode.times) < _samples(log.rate_hz)):
            continue
        shift = offset - episode.times[0]
        near = own[_within_poses(frames.times[own], episode.times[known], still)]
        instants[near], begins[own] = frames.times[near] + shift, episode.times[known][0] + shift
        poses = episode.poses[known]
        rates = np.zeros_like(poses)
        if not still:
            window, columns = _samples(log.rate_hz), poses.T
            filled = np.stack([np.interp(episode.times, episode.times[known], one) for one in columns], axis=-1)
            poses = savgol_filter(filled, window, ORDER, axis=0)[known]
            rates = savgol_filter(filled, window, ORDER, deriv=1, delta=1.0 / log.rate_hz, axis=0)[known]
        parts.append((episode.times[known] + shift, poses, rates))
        offset += float(episode.times[-1] - episode.times[0]) + APART_S
    kept = np.flatnonzero(np.isfinite(instants))
    if not len(kept):
        raise LogError(f"{log.name}: no frame has a pose near its time; check that times are on the poses' clock")
    times, poses, rates = (np.concatenate(column) for column in zip(*parts, strict=True))
    share = 1.0 if still else float(np.sqrt((savgol_coeffs(_samples(log.poses_hz), ORDER) ** 2).sum()))
    return Tracks(times, poses, rates, instants[kept], begins[kept], share), kept


def _samples(rate_hz: float) -> int:
    """Samples of a window, an odd number that a parabola leaves something over from."""
    return max(2 * round(WINDOW_S * rate_hz / 2.0) + 1, ORDER + 3)


def _within_poses(times: Floats, known: Floats, still: bool) -> Flags:
    place = np.searchsorted(known, times)
    before, after = (known[np.clip(one, 0, len(known) - 1)] for one in (place - 1, place))
    inside = (times >= known[0]) & (times <= known[-1])
    exact = np.isclose(after, times, atol=1e-6)
    return np.asarray(exact if still else inside & (exact | (after - before <= LONGEST_GAP_S)))


LATENCY = "camera_latency"
READOUT = "rolling_shutter"
MOVING = (LATENCY, READOUT)
"""Effects that show where a marking lies in the picture only while the robot moves, by their names in θ."""
DISTORTION = "lens_distortion"

SPREAD = 0.4
"""Standard deviation that is expected of a parameter, as a share of the way to the farther end of its range: it decides
what views cannot."""
STEP = 1e-4
"""How far a parameter is moved for a derivative, as a share of its range."""


@dataclass(frozen=True)
class Optics:
    """A robot's camera whose figures are set by θ, and the size of its pictures [pixel]."""

    robot: Robot
    rows: int
    columns: int

    def figures(self, theta: Mapping[str, float]) -> CameraFigures:
        """The camera with these values; whatever θ says of anything else is left alone."""
        own = {name: value for name, value in theta.items() if name in self.mounting}
        effects = effects_from(own, self.robot.figures, self.robot.catalogue)
        return replace(mounted_camera(self.robot, effects), rows=self.rows, columns=self.columns)

    @cached_property
    def mounting(self) -> tuple[str, ...]:
        """The names in θ of what places the camera and shapes its lens, a user's own effects included."""
        catalogue = self.robot.catalogue
        effects = [name for name in catalogue.names if catalogue.effect(name).stage is Stage.CAMERA]
        return tuple(name for effect in effects for name in catalogue.theta_names(effect))

    def neutral(self, name: str) -> float:
        """The value at which a parameter changes nothing."""
        return self.robot.catalogue.parameters[name].neutral_value(self.robot.figures)

    def spread(self, name: str) -> float:
        """Standard deviation that is expected of a parameter about its neutral value."""
        parameter, neutral = self.robot.catalogue.parameters[name], self.neutral(name)
        return SPREAD * max(parameter.high - neutral, neutral - parameter.low)

    def step(self, name: str, value: float) -> float:
        """Step of a parameter from a value for a derivative, away from the end of its range."""
        parameter = self.robot.catalogue.parameters[name]
        step = STEP * (parameter.high - parameter.low)
        return step if value + step <= parameter.high else -step

    def clipped(self, name: str, value: float) -> float:
        """The nearest value within the parameter's bounds."""
        return self.robot.catalogue.parameters[name].clipped(value)

    def at_end(self, name: str, value: float) -> bool:
        """Tell whether a value lies at an end of its parameter's range that is not neutral."""
        parameter = self.robot.catalogue.parameters[name]
        return RULES.at_end(value, (parameter.low, parameter.high), self.neutral(name))


def effects_of(names: Iterable[str]) -> tuple[str, ...]:
    """The effects that parameters belong to, each once."""
    return tuple(dict.fromkeys(map(effect_of, names)))


LEAST_SCATTER = (0.0005, np.radians(0.1))
"""No tracker is trusted beyond this: place [m] and heading [rad]."""
LEAST_TAPE_M = 0.0001
"""No map is laid more exactly [m]."""
MAP_SCATTER = np.array((0.03, 0.03, np.radians(1.0)))
"""How far the whole map may lie off, as standard deviations of x, y [m] and heading [rad]."""
TILTED = 3
"""So many of LINES may lie askew; the ends of dashes cannot."""


@dataclass(frozen=True)
class Views:
    """N pictures with n edge points, sorted by picture, and the scatter of what places them: standard deviations."""

    edges: Edges
    tracks: Tracks
    markings: Markings
    optics: Optics
    position_m: float  # of a tracked place after smoothing [m]
    heading_rad: float  # of a tracked heading after smoothing [rad]
    tape_m: float  # of where a line lies from where the map has it [m]

    @property
    def count(self) -> int:
        """The number of pictures."""
        return len(self.tracks.instants)

    @property
    def pose_scatter(self) -> Floats:
        """Standard deviations of x, y [m] and heading [rad] (3,)."""
        place, turn = max(self.position_m, LEAST_SCATTER[0]), max(self.heading_rad, LEAST_SCATTER[1])
        return np.array((place, place, turn))

    @property
    def tape(self) -> "Tape":
        """The order of the tape's errors."""
        return Tape(self.markings.stretches)

    @property
    def tape_scatter(self) -> Floats:
        """Standard deviations of the tape's errors, in the order of `Tape` [m]."""
        return np.full(self.tape.size, max(self.tape_m, LEAST_TAPE_M))


@dataclass(frozen=True)
class Tape:
    """The order of the tape's errors in one row of numbers, by the road's stretches."""

    stretches: int

    @property
    def size(self) -> int:
        """The number of errors: a shift per line and stretch, a tilt, and three widths."""
        return self.stretches * (len(LINES) + TILTED) + 3

    def shift(self, stretch: NDArray[np.intp], line: NDArray[np.intp]) -> NDArray[np.intp]:
        """Place of how far a line lies to the right, or its dashes ahead [m]."""
        return stretch * len(LINES) + line

    def tilt(self, stretch: NDArray[np.intp], line: NDArray[np.intp]) -> NDArray[np.intp]:
        """Place of how much farther right it lies at the stretch's end than in its middle [m]."""
        return self.stretches * len(LINES) + stretch * TILTED + np.minimum(line, TILTED - 1)

    def width(self, white: Flags, line: NDArray[np.intp]) -> NDArray[np.intp]:
        """Place of how much wider white lines, wider yellow lines or longer dashes are [m]."""
        kind = np.where(white, 0, np.where(line == len(LINES) - 1, 2, 1))
        return self.stretches * (len(LINES) + TILTED) + kind


MOST_FRAMES = 240
"""Of a longer log so many frames are used, evenly spread: more do not tell the camera better."""
EVERY = 2
"""Every second edge point is enough: neighbours are not independent."""
ASSUMED_M, ASSUMED_DEG = 0.005, 1.0
"""Scatter of a tracker that says nothing of it, to begin with."""
COLOURED = 40
"""Two colours that are brighter than the third by so much make a pixel yellow, or cyan [grey level]."""
LEAST_COLOURED, FAR_MORE = 0.001, 3.0
"""Blue comes first in pictures of which a larger share is cyan, so many times as much as yellow."""
SWAPPED = "the pictures have blue first; they were taken as blue, green, red: save them as red, green, blue"
GREY = "beware: the pictures are grey, so that yellow markings are hardly seen; colour pictures tell more"

FEWEST_POINTS = 30
FEWEST_FRAMES = 20
"""A camera cannot be told from fewer frames that show so many edge points."""


@dataclass(frozen=True)
class Gathered:
    """Everything that a log shows of its camera: its frames of these numbers (N,), and what is to be said of them."""

    views: Views
    numbers: NDArray[np.intp]
    pictures: NDArray[np.uint8]
    frames: Frames
    grey: bool  # whether no picture has any colour
    notes: tuple[str, ...]


def gather_views(log: Log, frames: Frames, robot: Robot) -> Gathered:
    """Read a log's frames and find what they show; refused if too few show markings."""
    robot.camera_figures()  # Refuses a robot without a camera before anything is read
    road = read_road(frames.road)
    tracks, numbers = track_frames(log, frames)
    known = len(numbers)
    used = np.unique(np.linspace(0, known - 1, min(known, MOST_FRAMES)).round().astype(np.intp))
    tracks = replace(tracks, instants=tracks.instants[used], begins=tracks.begins[used])
    numbers = numbers[used]
    pictures, swapped = in_rgb(read_pictures(frames, numbers.tolist()))
    edges = find_edges(pictures)
    showing = int((np.bincount(edges.frame, minlength=len(numbers)) >= FEWEST_POINTS).sum())
    if showing < FEWEST_FRAMES:
        problem = f"{showing} of {len(numbers)} frames show markings; the camera needs {FEWEST_FRAMES}"
        few = len(numbers) < FEWEST_FRAMES
        remedy = "take more that show them" if few else "drive nearer to the lines, or check the map"
        raise LogError(f"{log.name}: frames: {problem}: {remedy}")
    edges = edges.only(np.arange(len(edges.row)) % EVERY == 0)
    optics = Optics(robot, *pictures.shape[1:3])
    position_m = tracks.share * (ASSUMED_M if frames.position_m is None else frames.position_m)
    heading_rad = tracks.share * np.radians(ASSUMED_DEG if frames.heading_deg is None else frames.heading_deg)
    views = Views(edges, tracks, Markings(road), optics, position_m, float(heading_rad), road.paint.tape_m)
    count, every = len(numbers), len(frames.paths)
    notes = [f"{every - known} of {every} frames have no pose at their time and are left out"] if known < every else []
    notes += [f"{count} of {known} frames are used, evenly spread: more tell no more"] if count < known else []
    grey = bool((pictures == pictures[..., :1]).all())
    notes += [SWAPPED] if swapped else [GREY] if grey else []
    return Gathered(views, numbers, pictures, frames, grey, tuple(notes))


def read_road(name: str) -> Road:
    """The map that frames show: one of the package's, or a file; refused if there is none, or it cannot be read."""
    return read_map(Path(name)) if name.endswith(".toml") else shipped_map(name)


def in_rgb(pictures: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], bool]:
    """Pictures (N, rows, columns, 3) with red first, and whether blue was: lanes have yellow lines and no blue ones."""
    near = pictures[:, pictures.shape[1] // 2 :].astype(np.int16)
    red, green, blue = near[..., 0], near[..., 1], near[..., 2]
    yellow, cyan = ((np.minimum(green, one) - other > COLOURED).mean() for one, other in ((red, blue), (blue, red)))
    swapped = bool(cyan > LEAST_COLOURED and cyan > FAR_MORE * yellow)
    return (np.ascontiguousarray(pictures[..., ::-1]) if swapped else pictures), swapped
