"""An episode written as a picture or a movie, by what its file is called."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from proxytune.errors import InputError
from proxytune.report.drive.animation import FRAME_HZ, Animation
from proxytune.report.drive.figure import episode_figure
from proxytune.report.drive.movie import Frame, ffmpeg, write_gif, write_mp4
from proxytune.report.writing import save
from proxytune.running import Bars, Watcher
from proxytune.study import SideBySide

STILL, GIF, MP4 = ".png", ".gif", ".mp4"
NO_PLACES = "nothing can be drawn, as this study's domain family records no x and y"


def check_output(path: Path) -> None:
    """Refuse a file that cannot be written, before anything is simulated for it.

    Raises:
        InputError: If its format is unknown, its writer is missing, or its folder cannot be written to.
    """
    if path.suffix.lower() not in (STILL, GIF, MP4):
        raise InputError(f"--output {path}: unknown format '{path.suffix}'; end the name in {STILL}, {GIF} or {MP4}")
    folder = next(parent for parent in path.absolute().parents if parent.exists())
    if path.is_dir() or not folder.is_dir() or not os.access(folder, os.W_OK):
        raise InputError(f"--output {path}: cannot be written there; choose another place")
    if path.suffix.lower() == MP4:
        ffmpeg()


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
        save(episode_figure(pair, metrics), path)
    else:
        _write_animation(Animation(pair), path)


def _write_animation(animation: Animation, path: Path) -> None:
    with Bars(len(animation.times), "frames") as bars:
        bars.begin("drawing", 0)
        frames = _counted(animation, bars)
        if path.suffix.lower() == MP4:
            write_mp4(path, frames, FRAME_HZ)
        else:
            write_gif(path, frames, animation.samples(), FRAME_HZ)


def _counted(animation: Animation, watcher: Watcher) -> Iterator[Frame]:
    for time in animation.times:
        yield animation.frame(time)
        watcher.episode()
