"""Logs recorded of the domain of a model file: manoeuvres, and lane drives for pictures; `record` is this."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from proxytune.diagnosis import PICTURES, FilmedDrive, film, frames_text, log_text, record, samples_text
from proxytune.driving import LaneFollowing, read_robot
from proxytune.errors import InputError, LogError
from proxytune.logs import Frames, Log, log_cautions, read_commands
from proxytune.report import write_picture, write_text
from proxytune.study import StudySettings, bare_family, cautions_of

Tell = Callable[[str], None]
LONGEST_S = 3600.0
"""A longer drive of a table is a slip of its times, and would never end."""


@dataclass(frozen=True)
class Wanted:
    """Drives to be recorded."""

    repeats: int = 2  # drives of each manoeuvre, or of each drive of the table
    seconds: float = 60.0  # length of a manoeuvre [s]
    frames: int = 0  # how many pictures are taken, on lane drives; 0: none
    seed: int = 1  # of manoeuvres, starts and noise
    # a table of commands to drive instead of manoeuvres, as a log's commands.csv; None: manoeuvres
    commands: Path | None = None


def recordable(settings: StudySettings, model: Path) -> LaneFollowing:
    """The domain of a model, by a study's [domain]; an InputError if it cannot be recorded."""
    family = bare_family(settings, model)
    if not isinstance(family, LaneFollowing):
        raise InputError(f"{settings.folder}: only the lane-following family can be recorded; give another study")
    return family


def check_no_more_pictures(folder: Path, count: int) -> None:
    """Refuse the folder of so many pictures if it has more: those of an earlier, longer run would stay among them."""
    more = [path for path in folder.glob("frames/*.png") if path.stem.isdecimal() and int(path.stem) >= count]
    if more:
        remedy = f"give another folder, or remove {more[0].parent}"
        raise InputError(f"{min(more)}: is of an earlier, longer run, and there are now {count} pictures; {remedy}")


def record_log(
    settings: StudySettings, model: Path, folder: Path, wanted: Wanted, tell: Tell
) -> tuple[Log, tuple[str, ...]]:
    """Drive every manoeuvre, and lanes where pictures are wanted, and write the log; without log.toml it is none.

    Returns:
        The log, and what is probably not meant in its domain or itself, a sentence each.

    Raises:
        InputError: If the domain cannot be recorded, its robot cannot do what a table says, it has no camera or expert
            where pictures are wanted, or the folder has more pictures than those.
        EpisodeError: If a lane drive ends before its pictures are taken.
        RunError: If a file cannot be written.
    """
    check_no_more_pictures(folder, wanted.frames)
    family = recordable(settings, model)
    drives = film(family, wanted.frames, wanted.seed) if wanted.frames else ()
    table = None if wanted.commands is None else (str(wanted.commands), *read_commands(wanted.commands))
    for drive, (times, _) in () if table is None else table[2].items():
        if (lasts := times[-1] - times[0]) > LONGEST_S:
            remedy = f"cut it into drives of at most {LONGEST_S:g} s, or check its times"
            raise LogError(f"{wanted.commands}: drive '{drive}' lasts {lasts:g} s; {remedy}")
    repeats, seconds, seed = wanted.repeats, wanted.seconds, wanted.seed
    log = record(family, name=folder.name, repeats=repeats, seconds=seconds, seed=seed, table=table)
    if wanted.frames:
        road = settings.domain.text("map", "small_loop")
        if road.endswith(".toml"):  # A user's own map is copied into the log
            source = settings.domain.path.parent / road
            write_text(folder / source.name, source.read_text(encoding="utf-8"))
            road = str((folder / source.name).resolve())
        log = _film(log, drives, road, folder, lambda taken: tell(f"driving: {taken} of {wanted.frames} frames"))
    write_text(folder / "samples.csv", samples_text(log))
    if log.frames:
        write_text(folder / "frames.csv", frames_text(log, log.frames, range(len(log.frames.paths)), "%.6f"))
    found = (*cautions_of(family), *log_cautions(log, read_robot(family.robot, family.folder).figures))
    write_text(folder / "log.toml", log_text(log, f"{model.name} on the {family.plant} plant, driven by proxytune"))
    return log, tuple(dict.fromkeys(found))


def _film(log: Log, filmed: Iterable[FilmedDrive], road: str, folder: Path, tell: Callable[[int], None]) -> Log:
    """The log with lane drives after its own; each drive's pictures are written before the next one starts."""
    episodes, paths = list(log.episodes), list[Path]()
    drives, times = list[int](), list[float]()
    for episode, taken, pictures in filmed:
        for picture in pictures:
            paths.append(folder / (PICTURES % len(paths)))
            write_picture(paths[-1], picture)
        drives += [len(episodes)] * len(pictures)
        times += taken.tolist()
        episodes.append(episode)
        tell(len(paths))
    frames = Frames(tuple(paths), np.array(drives), np.array(times), road)
    return replace(log, episodes=tuple(episodes), frames=frames)
