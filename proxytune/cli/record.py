"""`record`: the log of a simulated domain that is driven through manoeuvres, and along its lanes for pictures."""

import argparse
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.text import Text

from proxytune.cli.terminal.answer import Answer
from proxytune.diagnosis.filming import FilmedDrive, film
from proxytune.diagnosis.recording import PICTURES, frames_text, log_text, record, samples_text
from proxytune.driving.lane_following import LaneFollowing
from proxytune.errors import InputError
from proxytune.logs import Frames, Log
from proxytune.report.writing import write_picture, write_text
from proxytune.settings import Section
from proxytune.study.family import load_family
from proxytune.study.settings import read_study_settings

MOST_FRAMES = 1_000_000
"""As many as six digits number."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the study, the model and the log to write."""
    parser.add_argument("path", type=Path, metavar="PATH", help="a study's folder, for its [domain]")
    parser.add_argument("--model", type=Path, required=True, metavar="MODEL", help="the model.toml of the domain")
    parser.add_argument("--output", type=Path, required=True, metavar="DIR", help="the log's folder to write")
    parser.add_argument("--repeats", type=int, default=2, metavar="N", help="drives of each manoeuvre [2]")
    parser.add_argument("--seconds", type=float, default=60.0, metavar="S", help="length of a drive [60 s]")
    parser.add_argument("--frames", type=int, default=0, metavar="N", help="pictures, taken on lane drives [0: none]")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of manoeuvres, starts and noise [1]")


def run(arguments: argparse.Namespace) -> Answer:
    """Drive every manoeuvre, and lanes where pictures are wanted, and write the log."""
    _check(arguments)
    settings = read_study_settings(arguments.path)
    if not arguments.model.is_file():
        raise InputError(f"--model {arguments.model}: no such file; check the path")
    family = load_family(settings, arguments.model)
    if not isinstance(family, LaneFollowing):
        raise InputError(f"{settings.folder}: only the lane-following family can be recorded; give another study")
    drives = film(family, arguments.frames, arguments.seed) if arguments.frames else ()
    sizes = {"repeats": arguments.repeats, "seconds": arguments.seconds, "seed": arguments.seed}
    with Console(stderr=True).status("driving") as status:
        log = record(family, name=arguments.output.name, **sizes)
        if arguments.frames:
            road = _write_map(settings.domain, arguments.output)
            log = _film(log, drives, road, arguments, status.update)
    _write(log, arguments.output, f"{arguments.model.name} on the {family.plant} plant, driven by proxytune")
    return _answer(log, arguments)


def _check(arguments: argparse.Namespace) -> None:
    if arguments.repeats < 1 or arguments.seed < 0 or not 5.0 <= arguments.seconds <= 600.0:
        raise InputError("--repeats must be at least 1, --seed at least 0 and --seconds between 5 and 600")
    if not 0 <= arguments.frames <= MOST_FRAMES:
        raise InputError(f"--frames must be between 0 and {MOST_FRAMES}, got {arguments.frames}")


def _write_map(domain: Section, folder: Path) -> str:
    """The map's name; a user's own file is copied into the log."""
    name = domain.text("map", "small_loop")
    if not name.endswith(".toml"):
        return name
    source = domain.path.parent / name
    write_text(folder / source.name, source.read_text(encoding="utf-8"))
    return str((folder / source.name).resolve())


def _film(
    log: Log, filmed: Iterable[FilmedDrive], road: str, arguments: argparse.Namespace, tell: Callable[[str], None]
) -> Log:
    """The log with lane drives after its own; each drive's pictures are written before the next one starts."""
    episodes, paths = list(log.episodes), list[Path]()
    drives, times = list[int](), list[float]()
    for episode, taken, pictures in filmed:
        for picture in pictures:
            paths.append(arguments.output / (PICTURES % len(paths)))
            write_picture(paths[-1], picture)
        drives += [len(episodes)] * len(pictures)
        times += taken.tolist()
        episodes.append(episode)
        tell(f"driving: {len(paths)} of {arguments.frames} frames")
    frames = Frames(tuple(paths), np.array(drives), np.array(times), road)
    return replace(log, episodes=tuple(episodes), frames=frames)


def _write(log: Log, folder: Path, source: str) -> None:
    """Its tables, then log.toml: without that a folder is no log."""
    write_text(folder / "samples.csv", samples_text(log))
    if log.frames:
        write_text(folder / "frames.csv", frames_text(log, log.frames, range(len(log.frames.paths)), "%.6f"))
    write_text(folder / "log.toml", log_text(log, source))


def _answer(log: Log, arguments: argparse.Namespace) -> Answer:
    rows, frames = sum(len(episode.times) for episode in log.episodes), arguments.frames
    document = {"log": str(arguments.output), "episodes": len(log.episodes), "rows": rows, "frames": frames}
    pictures = f", {frames} frames" if frames else ""
    text = f"{len(log.episodes)} drives, {rows} rows{pictures}\n{arguments.output}"
    return Answer({**document, "seed": arguments.seed}, Text(text))
