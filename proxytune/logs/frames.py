"""A log's camera: what log.toml states of it, where and when each picture was taken, and the pictures, made small."""

import re
import struct
import zlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from PIL import ExifTags, Image, ImageOps

from proxytune.arrays import Floats, Whole
from proxytune.errors import LogError
from proxytune.logs.log import Frames, LogEpisode
from proxytune.logs.rows import Rows, check_known_episodes, read_rows
from proxytune.logs.times import places_on_grid
from proxytune.settings import Section
from proxytune.unpacking import ARRAYS_MB, check_unpacked, open_picture

KEYS = ("frames", "poses", "exposure", "rectified", "shutter", "readout_s")
LISTED = "frames.csv"
PATTERN = re.compile(r"[^%]*%(0[1-9])?d[^%]*\.(png|jpe?g)", re.IGNORECASE)
PLAIN_NAME = re.compile(r"\w[\w-]*")
MOST_FRAMES = 2**53
"""Whole numbers up to here are exact as read."""
StatedCamera = tuple[str, bool, Frames]
"""The camera of log.toml: where its pictures lie, as "frames/%06d.png", whether [camera] says so, and no frames yet.

A key of the top level may name pictures that were not passed on.
"""
Instants = tuple[Whole, Whole, Floats]
"""Numbers of pictures, the drive of each, and its time [s] on the poses' clock, all (N,)."""


def read_camera(settings: Section) -> StatedCamera | None:
    """Read what log.toml states of its pictures; None where it states nothing."""
    if not {"camera", "frames"} & set(settings.keys()):
        return None
    table = settings.section("camera")
    if "frames" in settings and "frames" in table:
        raise settings.error("frames", "is stated in [camera] too; take this one out")
    if "map" in table:
        raise table.error("map", "belongs above the line [camera]; move it there")
    table.only(KEYS)
    section = settings if "frames" in settings else table
    pattern = section.text("frames")
    if not PATTERN.fullmatch(pattern):
        rule = "must have the picture's number once, as %d or %06d, and end in .png, .jpg or .jpeg"
        raise section.error("frames", f"{rule}, got '{pattern}'")
    poses = table.section("poses")
    poses.only(("position_m", "heading_deg"))
    road = _road(settings)
    position_m, heading_deg = _figure(poses, "position_m", 10.0), _figure(poses, "heading_deg", 180.0)
    rectified, readout_s = table.flag("rectified", False), _figure(table, "readout_s", 1.0)
    shutter = table.text("shutter", choices=("rolling", "global")) if "shutter" in table else "rolling"
    if shutter == "global" and readout_s:
        raise table.error("readout_s", "a global shutter exposes all rows at once; take one of the two out")
    stated = Frames(
        paths=(),
        drives=np.empty(0, dtype=np.int64),
        times=np.empty(0),
        road=road,
        position_m=position_m,
        heading_deg=heading_deg,
        rectified=rectified,
        readout_s=0.0 if shutter == "global" else readout_s,
        fixed_exposure=table.text("exposure", "auto", choices=("auto", "fixed")) == "fixed",
    )
    return pattern, "frames" in table, stated


def _road(settings: Section) -> str:
    """The map's name or the path of its file; whoever draws the map knows which names there are."""
    if "map" not in settings:
        problem = "is missing; frames show a map: add its name or that of a map file beside log.toml (above [camera])"
        raise settings.error("map", problem)
    name = settings.text("map")
    path = settings.file("map")
    if name.endswith(".toml") and not path.is_file():
        raise settings.error("map", f"no such file: {name}; add it beside log.toml")
    if not (name.endswith(".toml") or PLAIN_NAME.fullmatch(name)):
        raise settings.error("map", f"must be the name of a map, or of a file that ends in .toml, got '{name}'")
    return str(path.resolve()) if name.endswith(".toml") else name


def _figure(section: Section, key: str, high: float) -> float | None:
    return section.number(key, low=0.0, high=high) if key in section else None


def read_frames(
    camera: StatedCamera, folder: Path, samples: Rows, rate_hz: float, episodes: Sequence[LogEpisode]
) -> Frames | None:
    """Find every picture, those left out that were taken before or after the poses of their drive.

    Without frames.csv there is one for each row of samples.csv, by its number from 0; those without a pose are left
    out. None of the pictures need be there where only the key of the top level names them: the log then has none.
    """
    listed = (folder / LISTED).exists()
    taken = _read_instants(folder / LISTED, samples, episodes) if listed else _per_row(samples, rate_hz, episodes)
    (numbers, drives, times), (pattern, own_table, stated) = taken, camera
    paths = tuple(folder / (pattern % number) for number in numbers.tolist())
    missing = [path for path in paths if not path.is_file()]
    if len(missing) == len(paths) and not (own_table or listed):
        return None
    if missing:
        counts = f"no such picture, {len(missing)} of {len(paths)} are missing"
        raise LogError(f"{missing[0]}: {counts}; add them, or name those that there are in {LISTED}")
    return replace(stated, paths=paths, drives=drives, times=times)


def _per_row(samples: Rows, rate_hz: float, episodes: Sequence[LogEpisode]) -> Instants:
    """One picture at each row that has a pose."""
    measured = np.flatnonzero(np.isfinite(samples.values["x"]))
    if not len(measured):
        raise LogError(f"{samples.path}: no row has a pose; frames need the poses from which they were taken")
    times = samples.values["time"][measured]
    if rate_hz:
        places, _ = places_on_grid(samples, rate_hz)
        times = np.concatenate([episode.times for episode in episodes])[places[measured]]
    return measured, samples.episode[measured], times


def _read_instants(path: Path, samples: Rows, episodes: Sequence[LogEpisode]) -> Instants:
    """The rows of frames.csv that lie within the poses of their drive."""
    rows = read_rows(path, ("frame",), "frames")
    check_known_episodes(rows, samples.names)
    numbers = rows.values["frame"]
    wrong = (numbers != np.rint(numbers)) | (numbers < 0) | (numbers > MOST_FRAMES)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise rows.error(row, "frame", f"must be a whole number from 0 on, got {numbers[row]:.12g}")
    again = pd.Series(numbers).duplicated().to_numpy()
    if again.any():
        row = int(np.argmax(again))
        problem = f"{numbers[row]:.0f} comes twice; number the pictures through all episodes"
        raise rows.error(row, "frame", problem)
    order = {name: number for number, name in enumerate(samples.names)}
    drives = np.array([order[name] for name in rows.names])[rows.episode]
    times, spans = rows.values["time"], np.full((len(episodes), 2), np.nan)
    for span, episode in zip(spans, episodes, strict=True):
        measured, _ = episode.measured_poses
        if len(measured):
            span[:] = measured[0], measured[-1]
    begins, ends = spans[drives].T
    within = (times >= begins - 1e-9) & (times <= ends + 1e-9)
    if not within.any():
        name, begin, end = samples.names[drives[0]], begins[0], ends[0]
        poses = f"its poses between {begin:.12g} and {end:.12g} s" if np.isfinite(begin) else "it has no pose"
        problem = f"no frame lies within its episode's poses: the first of '{name}' is at {times[0]:.12g} s, {poses}"
        raise rows.error(0, "time", f"{problem}; write both in seconds of one clock")
    return numbers.astype(np.int64)[within], drives[within], times[within]


Pictures = NDArray[np.uint8]
BROKEN = (OSError, SyntaxError, ValueError, TypeError, EOFError, struct.error, zlib.error, Image.DecompressionBombError)
"""What Pillow raises at files that are cut off or damaged; of their EXIF TypeError."""
UPRIGHT = 1
"""The EXIF orientation of a picture that is to be shown as it is stored."""


def read_pictures(frames: Frames, numbers: Sequence[int], columns: int = 160) -> Pictures:
    """Read n of a log's pictures by their places in `frames`: red, green and blue (n, rows, columns, 3), 0 to 255.

    Wider ones are averaged down to so many columns. A LogError if a file cannot be read, or is of another size than the
    first; an InputError if they would take more memory than is allowed.
    """
    pictures, first = np.empty((0, 0, 0, 3), dtype=np.uint8), (0, 0)
    for place, number in enumerate(numbers):
        path = frames.paths[number]
        picture, size = _read_picture(path, columns)
        if place == 0:
            check_unpacked(f"{path.parent}: {len(numbers)} pictures", picture.nbytes * len(numbers), ARRAYS_MB)
            pictures, first = np.empty((len(numbers), *picture.shape), dtype=np.uint8), size
        if size != first:
            sizes = f"is {size[0]} × {size[1]}, but {frames.paths[numbers[0]].name} is {first[0]} × {first[1]}"
            raise LogError(f"{path}: {sizes}; give all pictures one size")
        pictures[place] = picture
    return pictures


def _read_picture(path: Path, columns: int) -> tuple[Pictures, tuple[int, int]]:
    """A picture averaged down, and its whole width and height; turned as its file says that it is to be shown."""
    try:
        with open_picture(path, path, ("PNG", "JPEG")) as image:
            turned = _orientation(image)
            lies = turned in (5, 6, 7, 8)
            size = image.size[::-1] if lies else image.size
            if image.mode.startswith(("I", "F")):
                raise LogError(f"{path}: has more than 8 bits a pixel; save it with 8 bits for each colour")
            (width, height), wanted = size, size
            if width > columns:
                wanted = columns, max(1, round(height * columns / width))
            # Half of what a JPEG averages is left to the box
            image.draft(None, (2 * wanted[lies], 2 * wanted[not lies]))
            if turned != UPRIGHT:
                ImageOps.exif_transpose(image, in_place=True)
            whole = image.convert("RGB")
    except FileNotFoundError:
        raise LogError(f"{path}: no such file; add the picture") from None
    except BROKEN:
        raise LogError(f"{path}: is not a whole PNG or JPEG picture; save it again or leave its frame out") from None
    small = whole if whole.size == wanted else whole.resize(wanted, Image.Resampling.BOX)
    return np.asarray(small), size


def _orientation(image: Image.Image) -> int:
    """A picture's EXIF orientation; upright where its EXIF is damaged, which the picture itself need not be."""
    try:
        return int(image.getexif().get(ExifTags.Base.Orientation, UPRIGHT))
    except BROKEN:
        return UPRIGHT
