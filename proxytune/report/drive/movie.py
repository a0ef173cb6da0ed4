"""Episodes as files, by what the file is called: a PNG, a GIF by Pillow, an MP4 by ffmpeg."""

import contextlib
import importlib
import logging
import shutil
import subprocess
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from proxytune.errors import InputError, RunError
from proxytune.files import check_place
from proxytune.report.drive.animation import FRAME_HZ, Animation
from proxytune.report.drive.figure import episode_figure
from proxytune.report.writing import save_figure, write_whole
from proxytune.running import Bars, Watcher
from proxytune.study import SideBySide

Frame = NDArray[np.uint8]
PALETTE_SIZE = 64
"""In a GIF's palette, which all of its frames share: what does not move is then not stored again."""
DPI = 100.0
STILL, GIF, MP4 = ".png", ".gif", ".mp4"
NO_PLACES = "nothing can be drawn, as this study's domain family records no x and y"


def check_episode_file(path: Path) -> None:
    """Refuse a file that cannot be written, before anything is simulated for it.

    Raises:
        InputError: If its format is unknown, its writer is missing, or its folder cannot be written to.
    """
    if path.suffix.lower() not in (STILL, GIF, MP4):
        raise InputError(f"--output {path}: unknown format '{path.suffix}'; end the name in {STILL}, {GIF} or {MP4}")
    check_place(path)
    if path.suffix.lower() == MP4:
        find_ffmpeg()


def write_episode(pair: SideBySide, metrics: Sequence[str], path: Path) -> None:
    """Write a still picture, or an animation whose frames are counted on standard error.

    Args:
        pair: The episode.
        metrics: Those that a still picture shows.
        path: Where to; its ending says as what.

    Raises:
        InputError: If it is not known where the robots were.
        RunError: If it cannot be written.
    """
    if not all(episode.has_places for episode in pair.sides.values()):
        raise InputError(f"--output {path}: {NO_PLACES}; leave the option out to see its metrics")
    if path.suffix.lower() == STILL:
        save_figure(episode_figure(pair, metrics), path)
        return
    animation = Animation(pair)
    with Bars(len(animation.times), "frames") as bars:
        bars.begin("drawing", 0)
        frames = _count_frames(animation, bars)
        if path.suffix.lower() == MP4:
            write_mp4(path, frames, FRAME_HZ)
        else:
            write_gif(path, frames, animation.samples(), FRAME_HZ)


def _count_frames(animation: Animation, watcher: Watcher) -> Iterator[Frame]:
    for time in animation.times:
        yield animation.frame(time)
        watcher.episode()


def write_gif(path: Path, frames: Iterable[Frame], samples: Sequence[Frame], frame_hz: float) -> None:
    """Write a GIF that plays for ever.

    Args:
        path: The file.
        frames: Each (rows, columns, 3).
        samples: Some of them, from which the palette is made.
        frame_hz: Frames a second.

    Raises:
        RunError: If it cannot be written.
    """
    # Without k-means the white of the ground turns grey where pictures have many colours
    palette = Image.fromarray(np.concatenate(list(samples))).quantize(PALETTE_SIZE, kmeans=2, dither=Image.Dither.NONE)
    pictures = (Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    first = next(pictures)
    how = {"save_all": True, "append_images": pictures, "duration": round(1000.0 / frame_hz), "loop": 0}
    write_whole(path, "the animation ", lambda draft: first.save(draft, format="GIF", optimize=True, **how))


def find_ffmpeg() -> str:
    """The program that writes an MP4: the one that is installed, or that of the package imageio-ffmpeg.

    Raises:
        InputError: If there is none.
    """
    found = shutil.which(str(matplotlib.rcParams["animation.ffmpeg_path"]))
    if found:
        return found
    try:
        return str(importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe())
    except (ModuleNotFoundError, RuntimeError):
        raise InputError("an .mp4 takes ffmpeg: pip install imageio-ffmpeg, or write a .gif") from None


def write_mp4(path: Path, frames: Iterable[Frame], frame_hz: float) -> None:
    """Write an MP4 of frames (rows, columns, 3), whose numbers of rows and columns are even.

    Raises:
        InputError: If ffmpeg is missing.
        RunError: If it cannot be written.
    """
    with matplotlib.rc_context({"animation.ffmpeg_path": find_ffmpeg()}), _quiet():
        try:
            write_whole(path, "the animation ", lambda draft: _encode(draft, iter(frames), frame_hz))
        except subprocess.CalledProcessError as problem:
            said = f"{problem.stderr}".strip().splitlines()[-1:] or [f"exit status {problem.returncode}"]
            raise RunError(f"{path}: ffmpeg cannot encode it ({said[0]}); write a .gif instead") from None


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Without matplotlib's account of what ffmpeg said: we say it in one line."""
    log = logging.getLogger("matplotlib.animation")
    level = log.level
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(level)


def _encode(path: Path, frames: Iterator[Frame], frame_hz: float) -> None:
    first = next(frames)
    figure = Figure(figsize=(first.shape[1] / DPI, first.shape[0] / DPI), dpi=DPI)
    shown = figure.figimage(first)
    # The draft's name does not end in .mp4
    writer = FFMpegWriter(fps=round(frame_hz), codec="h264", extra_args=["-f", "mp4"])
    with writer.saving(figure, str(path), DPI):
        writer.grab_frame()
        for frame in frames:
            shown.set_data(frame)
            writer.grab_frame()
