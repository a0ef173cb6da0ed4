"""Frames as a file: a GIF by Pillow, an MP4 by ffmpeg."""

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
from proxytune.report.writing import write_movie

Frame = NDArray[np.uint8]
COLOURS = 64
"""In a GIF's palette, which all of its frames share: what does not move is then not stored again."""

DPI = 100.0


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
    palette = Image.fromarray(np.concatenate(list(samples))).quantize(COLOURS, kmeans=2, dither=Image.Dither.NONE)
    pictures = _with_palette(frames, palette)
    first = next(pictures)
    how = {"save_all": True, "append_images": pictures, "duration": round(1000.0 / frame_hz), "loop": 0}
    write_movie(path, lambda draft: first.save(draft, format="GIF", optimize=True, **how))


def _with_palette(frames: Iterable[Frame], palette: Image.Image) -> Iterator[Image.Image]:
    return (Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)


def ffmpeg() -> str:
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
    with matplotlib.rc_context({"animation.ffmpeg_path": ffmpeg()}), _quiet():
        try:
            write_movie(path, lambda draft: _encode(draft, iter(frames), frame_hz))
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
