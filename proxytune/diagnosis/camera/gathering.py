"""From a log's frames to views: pictures read, edges found, poses smoothed, the map laid out."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.measured.edges import find_edges
from proxytune.diagnosis.camera.measured.tracks import track_frames
from proxytune.diagnosis.camera.model.optics import Optics
from proxytune.diagnosis.camera.model.views import Views
from proxytune.driving.road.maps import Road
from proxytune.driving.road.markings import Markings
from proxytune.driving.road.reading import read_map, shipped_map
from proxytune.driving.robot import Robot
from proxytune.errors import LogError
from proxytune.logs import Frames, Log
from proxytune.logs.pictures import read_pictures

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

FEWEST_POINTS = 30
FEWEST_FRAMES = 20
"""A camera cannot be told from fewer frames that show so many edge points."""


@dataclass(frozen=True)
class Gathered:
    """What a log shows of its camera.

    Attributes:
        views: Edges, poses and map.
        numbers: Which of the log's frames they are (N,).
        pictures: These frames (N, rows, columns, 3).
        frames: All frames of the log.
        notes: What is to be said of them, a line each.
    """

    views: Views
    numbers: NDArray[np.intp]
    pictures: NDArray[np.uint8]
    frames: Frames
    notes: tuple[str, ...]


def gather_views(log: Log, frames: Frames, robot: Robot) -> Gathered:
    """Read a log's frames and find what they show.

    Raises:
        LogError: If too few show markings.
        SettingsError: If the robot has no camera, or the map cannot be read.
    """
    robot.camera_figures()  # Refuses a robot without a camera before anything is read
    road = read_road(frames.road)
    tracks, numbers = track_frames(log, frames)
    used = _spread(len(numbers), MOST_FRAMES)
    tracks, numbers = tracks.only(used), numbers[used]
    pictures, swapped = in_rgb(read_pictures(frames, numbers.tolist()))
    edges = find_edges(pictures)
    _check_markings(log, np.bincount(edges.frame, minlength=len(numbers)))
    edges = edges.only(np.arange(len(edges.row)) % EVERY == 0)
    optics = Optics(robot, *pictures.shape[1:3])
    position_m = tracks.share * _stated(frames.position_m, ASSUMED_M)
    heading_rad = tracks.share * np.radians(_stated(frames.heading_deg, ASSUMED_DEG))
    views = Views(edges, tracks, Markings(road), optics, position_m, float(heading_rad), road.paint.tape_m)
    notes = (*_note_used(numbers, frames), *((SWAPPED,) if swapped else ()))
    return Gathered(views, numbers, pictures, frames, notes)


def read_road(name: str) -> Road:
    """The map that frames show: one of the package's, or a file.

    Raises:
        SettingsError: If there is none, or it cannot be read.
    """
    return read_map(Path(name)) if name.endswith(".toml") else shipped_map(name)


def in_rgb(pictures: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], bool]:
    """Pictures (N, rows, columns, 3) with red first, and whether blue was: lanes have yellow lines and no blue ones."""
    near = pictures[:, pictures.shape[1] // 2 :].astype(np.int16)
    red, green, blue = near[..., 0], near[..., 1], near[..., 2]
    yellow, cyan = ((np.minimum(green, one) - other > COLOURED).mean() for one, other in ((red, blue), (blue, red)))
    swapped = bool(cyan > LEAST_COLOURED and cyan > FAR_MORE * yellow)
    return (np.ascontiguousarray(pictures[..., ::-1]) if swapped else pictures), swapped


def _note_used(numbers: NDArray[np.intp], frames: Frames) -> tuple[str, ...]:
    """What is said where not all frames are used."""
    used, every = len(numbers), len(frames.paths)
    return (f"{used} of {every} frames are used, evenly spread: more tell no more",) if used < every else ()


def _stated(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value


def _spread(count: int, most: int) -> NDArray[np.intp]:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


def _check_markings(log: Log, counts: NDArray[np.intp]) -> None:
    showing = int((counts >= FEWEST_POINTS).sum())
    if showing < FEWEST_FRAMES:
        problem = f"{showing} of {len(counts)} frames show markings; the camera needs {FEWEST_FRAMES}"
        raise LogError(f"{log.name}: frames: {problem}: drive nearer to the lines, or check the map")
