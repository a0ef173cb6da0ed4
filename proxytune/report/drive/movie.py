"""Episodes as files, by what the file is called: a PNG, or proxy and target beside each other as a GIF or an MP4."""

import importlib
import logging
import shutil
import subprocess
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.text import Text
from numpy.typing import NDArray
from PIL import Image

from proxytune.arrays import Floats
from proxytune.errors import InputError, RunError
from proxytune.files import check_place, write_whole
from proxytune.report import figure_style as style
from proxytune.report.drive.figure import COLOURS, draw_map, draw_start, episode_figure
from proxytune.report.wording import plain
from proxytune.report.writing import save_figure
from proxytune.running import Bars, Watcher
from proxytune.study import RecordedEpisode, SideBySide

FRAME_HZ = 10
"""Frames a second, of the episode and of who watches it."""
SIDE_INCH, HEIGHT_INCH, DPI = 3.4, 5.6, 100
"""Size of a side; all is an even number of pixels, as video encoders ask for."""
LINGER_S = 1.0
"""The last frame stays so long [s]."""


class Animation:
    """An episode as frames at `times` [s]: what never moves is drawn once."""

    def __init__(self, pair: SideBySide) -> None:
        ends = [episode.seconds for episode in pair.sides.values()]
        moving = np.arange(0.0, max(ends) + 1.0 / FRAME_HZ, 1.0 / FRAME_HZ)
        self.times: Sequence[float] = [*moving.tolist(), *[float(moving[-1])] * round(LINGER_S * FRAME_HZ)]
        figure = Figure(figsize=(SIDE_INCH * len(pair.sides), HEIGHT_INCH), dpi=DPI, layout="constrained")
        # Typed as nothing in particular, as matplotlib states no types of it
        canvas: Any = FigureCanvasAgg
        self._canvas = canvas(figure)
        panels = figure.subfigures(1, len(pair.sides), squeeze=False)[0]
        self._views = [_View(panel, pair, side) for panel, side in zip(panels, pair.sides, strict=True)]
        self._canvas.draw()
        self._still = self._canvas.copy_from_bbox(figure.bbox)

    def frame(self, time: float) -> NDArray[np.uint8]:
        """Frame of a time [s], (rows, columns, 3)."""
        self._canvas.restore_region(self._still)
        for view in self._views:
            view.show(time)
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()


class _View:
    """One side: its map above, its camera and commands below."""

    def __init__(self, figure: SubFigure, pair: SideBySide, side: str) -> None:
        self._episode = pair.sides[side]
        upper, lower = figure.subfigures(2, 1, height_ratios=(3.4, 1.9), squeeze=False)[:, 0]
        map_axes = upper.subplots()
        draw_map(map_axes, pair)
        draw_start(map_axes, self._episode.places)
        map_axes.set_title(side, color=COLOURS[side], fontsize=11, fontweight="bold", loc="left")
        line: dict[str, Any] = {"color": COLOURS[side], "animated": True}
        (self._path,) = map_axes.plot([], [], linewidth=1.8, solid_capstyle="round", **line)
        (self._robot,) = map_axes.plot([], [], markersize=13, markeredgecolor="white", clip_on=False, **line)
        # The time, right above the map
        place = {"transform": map_axes.transAxes, "ha": "right", "va": "bottom"}
        self._clock = map_axes.text(1.0, 1.02, "", fontsize=10, animated=True, **place)
        self._camera: AxesImage | None = None
        commanded = lower
        if self._episode.pictures is not None:
            camera, commanded = lower.subfigures(1, 2, width_ratios=(2.1, 1.3), squeeze=False)[0]
            axes = camera.subplots()
            axes.set(xticks=[], yticks=[])
            axes.set_title("camera", fontsize=8, pad=3)
            self._camera = axes.imshow(self._episode.pictures[0], interpolation="nearest", animated=True)
        self._bars = _bars(commanded, pair, side)

    def show(self, time: float) -> None:
        """Draw what moves, as it is at a time [s]; after its end an episode stays as it ended."""
        episode = self._episode
        row = _row(episode.poses["time"], time)
        places = episode.places[: row + 1]
        self._path.set_data(*places.T)
        self._robot.set_data(*places[-1:].T)
        self._robot.set_marker((3, 0, np.degrees(_heading(episode, row)) - 90.0))
        self._clock.set_text(f"ended at {episode.seconds:.1f} s" if time >= episode.seconds else f"{time:.1f} s")
        for artist in (self._path, self._robot, self._clock):
            _redraw(artist)
        if not episode.channels:
            return
        row = _row(episode.commands["time"], time)
        if self._camera is not None and episode.pictures is not None:
            self._camera.set_data(episode.pictures[row])
            _redraw(self._camera)
        for channel, bar in self._bars.items():
            bar.set_ydata((0.0, float(episode.commands[channel][row])))
            _redraw(bar)


def _bars(figure: SubFigure, pair: SideBySide, side: str) -> Mapping[str, Line2D]:
    """A bar a channel, on a scale that every side shares."""
    channels = pair.sides[side].channels
    if not channels:
        return {}
    axes = figure.subplots()
    issued = np.concatenate([e.commands[channel] for e in pair.sides.values() for channel in channels])
    low, high = min(0.0, float(issued.min())), max(0.0, float(issued.max()))
    axes.set(xlim=(-0.6, len(channels) - 0.4), ylim=(low, high if high > low else 1.0))
    axes.locator_params(axis="y", nbins=5)
    axes.axhline(0.0, color="black", linewidth=0.8)
    axes.set_xticks(range(len(channels)), [plain(channel) for channel in channels])
    axes.set_ylabel(f"command [{pair.command_unit}]" if pair.command_unit else "command", fontsize=8, labelpad=2)
    style.dress(axes)
    look: dict[str, Any] = {"color": COLOURS[side], "linewidth": 14, "solid_capstyle": "butt", "animated": True}
    return {channel: axes.plot([place] * 2, [0.0, 0.0], **look)[0] for place, channel in enumerate(channels)}


def _row(times: Floats, time: float) -> int:
    """The last row that is not later than a time [s]; rounding does not make it an earlier one."""
    return max(0, int(np.searchsorted(times, time + 1e-6, side="right")) - 1)


def _heading(episode: RecordedEpisode, row: int) -> float:
    """Heading of the robot [rad]; along its path where no heading was recorded."""
    if "heading" in episode.poses:
        return float(episode.poses["heading"][row])
    step = np.subtract(*episode.places[[max(row, 1), max(row, 1) - 1]])
    return float(np.arctan2(step[1], step[0]))


def _redraw(artist: Line2D | AxesImage | Text) -> None:
    assert artist.axes is not None
    artist.axes.draw_artist(artist)


Frame = NDArray[np.uint8]
PALETTE_SIZE = 64
"""In a GIF's palette, which all of its frames share: what does not move is then not stored again."""
STILL, GIF, MP4 = ".png", ".gif", ".mp4"
NO_PLACES = "nothing can be drawn, as this study's domain family records no x and y"


def check_episode_file(path: Path) -> None:
    """Refuse a file of unknown format, without its writer or in no folder for it, before anything is simulated."""
    if path.suffix.lower() not in (STILL, GIF, MP4):
        raise InputError(f"--output {path}: unknown format '{path.suffix}'; end the name in {STILL}, {GIF} or {MP4}")
    check_place(path)
    if path.suffix.lower() == MP4:
        find_ffmpeg()


def write_episode(pair: SideBySide, metrics: Sequence[str], path: Path) -> None:
    """Write a still picture with these metrics, or an animation whose frames are counted, as the path's ending says.

    An InputError if it is not known where the robots were, a RunError if it cannot be written.
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
            write_mp4(path, frames)
        else:
            # Three frames that show every colour: of the beginning, the middle and the end
            shown = (animation.times[place] for place in (0, len(animation.times) // 2, -1))
            write_gif(path, frames, [*map(animation.frame, shown)])


def _count_frames(animation: Animation, watcher: Watcher) -> Iterator[Frame]:
    for time in animation.times:
        yield animation.frame(time)
        watcher.episode()


def write_gif(path: Path, frames: Iterable[Frame], samples: Sequence[Frame]) -> None:
    """Write a GIF of frames (rows, columns, 3) that plays for ever; its palette is made from the samples."""
    # Without k-means the white of the ground turns grey where pictures have many colours
    palette = Image.fromarray(np.concatenate(list(samples))).quantize(PALETTE_SIZE, kmeans=2, dither=Image.Dither.NONE)
    pictures = (Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    first = next(pictures)
    how = {"save_all": True, "append_images": pictures, "duration": round(1000.0 / FRAME_HZ), "loop": 0}
    write_whole(path, lambda draft: first.save(draft, format="GIF", optimize=True, **how), what="the animation ")


def find_ffmpeg() -> str:
    """The program that writes an MP4, installed or of the package imageio-ffmpeg; refused if there is none."""
    if found := shutil.which(str(matplotlib.rcParams["animation.ffmpeg_path"])):
        return found
    try:
        return str(importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe())
    except (ModuleNotFoundError, RuntimeError):
        raise InputError("an .mp4 takes ffmpeg: pip install imageio-ffmpeg, or write a .gif") from None


def write_mp4(path: Path, frames: Iterable[Frame]) -> None:
    """Write an MP4 of frames (rows, columns, 3), whose numbers of rows and columns are even; refused without ffmpeg."""
    log = logging.getLogger("matplotlib.animation")
    level = log.level
    log.setLevel(logging.ERROR)  # What ffmpeg said is said in one line
    try:
        with matplotlib.rc_context({"animation.ffmpeg_path": find_ffmpeg()}):
            write_whole(path, lambda draft: _encode(draft, iter(frames)), what="the animation ")
    except subprocess.CalledProcessError as problem:
        said = f"{problem.stderr}".strip().splitlines()[-1:] or [f"exit status {problem.returncode}"]
        raise RunError(f"{path}: ffmpeg cannot encode it ({said[0]}); write a .gif instead") from None
    finally:
        log.setLevel(level)


def _encode(path: Path, frames: Iterator[Frame]) -> None:
    first = next(frames)
    figure = Figure(figsize=(first.shape[1] / DPI, first.shape[0] / DPI), dpi=DPI)
    shown = figure.figimage(first)
    # The draft's name does not end in .mp4
    writer = FFMpegWriter(fps=FRAME_HZ, codec="h264", extra_args=["-f", "mp4"])
    with writer.saving(figure, str(path), DPI):
        writer.grab_frame()
        for frame in frames:
            shown.set_data(frame)
            writer.grab_frame()
