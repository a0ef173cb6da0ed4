"""Reading a log's folder, strictly."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from proxytune.errors import LogError, SettingsError
from proxytune.logs.frames import read_camera, read_frames
from proxytune.logs.grid import places_on_grid, spread
from proxytune.logs.headings import check_headings, unwrapped
from proxytune.logs.log import COMMANDS, GEOMETRY, POSE, WHEELS, Floats, Log, LogEpisode
from proxytune.logs.rows import Layout, Rows, check_known_episodes, read_rows
from proxytune.settings import Section, read_settings

TEXTS = ("name", "robot", "pose", "source", "licence", "map", "frames")

LARGEST_DUTY = 1.0 + 1e-6
"""Full duty, and what rounding adds to it."""


class _Issued(NamedTuple):
    """An episode's commands at times of their own: times (M,) [s], commands (M, 2)."""

    times: Floats
    commands: Floats


def read_log(path: str | Path) -> Log:
    """Read a log's folder.

    Missing rows are filled: the last command held, no pose. Wrapped headings are unwrapped. Where commands.csv lies
    beside samples.csv, commands have times of their own; frames.csv has those of the camera's pictures.

    Args:
        path: Folder with log.toml, samples.csv and maybe commands.csv and frames.csv.

    Raises:
        LogError: If the folder is not such a log, naming file, line and column.
    """
    path = Path(path)
    if not path.is_dir():
        problem = "is a file; give the folder that it lies in" if path.exists() else "no such folder; check the path"
        raise LogError(f"{path}: {problem}")
    try:
        settings = read_settings(path / "log.toml")
        command, rate_hz, geometry = _read_description(settings)
        camera = read_camera(settings)
        name, robot = settings.text("name", path.resolve().name), settings.text("robot")
    except SettingsError as problem:
        raise LogError(str(problem)) from None
    apart = (path / "commands.csv").exists()
    samples = _read_samples(path / "samples.csv", command, apart=apart)
    check_headings(samples, command, rate_hz)
    issued = _read_commands(path / "commands.csv", command, samples) if apart else {}
    episodes = _episodes(samples, command, rate_hz, issued)
    frames = read_frames(camera, path, samples, rate_hz, episodes) if camera else None
    return Log(name, robot, command, rate_hz, geometry, episodes, frames)


def _read_description(settings: Section) -> tuple[str, float, dict[str, float]]:
    """Command kind, rate and geometry that log.toml states."""
    settings.only(("format", *TEXTS, "command", "rate_hz", "measured", "camera", *GEOMETRY))
    settings.whole("format", 1, low=1, high=1)
    for key in TEXTS:
        settings.text(key, "")
    if not isinstance(settings.values.get("measured", True), bool):
        raise settings.error("measured", f"must be true or false, got {settings.values['measured']!r}")
    command = settings.text("command", choices=COMMANDS)
    still = command == "none" and "rate_hz" not in settings.values
    rate_hz = 0.0 if still else settings.number("rate_hz", low=0.01, high=10000.0)
    stated = {name: key for key, name in GEOMETRY.items() if key in settings.values}
    return command, rate_hz, {name: settings.number(key, low=1e-4, high=1e4) for name, key in stated.items()}


def _read_samples(path: Path, command: str, *, apart: bool) -> Rows:
    columns = () if apart else COMMANDS[command]
    why = "samples beside a commands.csv" if apart else f"commands of kind '{command}'"
    samples = read_rows(path, Layout((*columns, *POSE), WHEELS, (*POSE, *WHEELS), 2, why))
    for together in (POSE, WHEELS):
        if together[0] in samples.values:
            _check_whole(samples, together)
    if not apart:
        _check_duties(samples, command)
    return samples


def _read_commands(path: Path, command: str, samples: Rows) -> dict[str, _Issued]:
    """Every episode's commands, each at its own time."""
    if command == "none":
        raise LogError(f"{path}: log.toml states that there are no commands; state their kind, or take this file out")
    rows = read_rows(path, Layout(COMMANDS[command], (), (), 1, f"commands of kind '{command}'"))
    _check_duties(rows, command)
    check_known_episodes(rows, samples.names)
    times, columns = rows.values["time"], rows.columns(COMMANDS[command])
    cuts = rows.firsts[1:]
    parts = zip(rows.names, np.split(times, cuts), np.split(columns, cuts), strict=True)
    issued = {name: _Issued(own, values) for name, own, values in parts}
    _check_overlap(samples, rows, issued)
    return issued


def _check_overlap(samples: Rows, rows: Rows, issued: dict[str, _Issued]) -> None:
    """Refuse an episode without commands, or whose commands and poses are of different times."""
    lasts = np.append(samples.firsts[1:], len(samples.lines)) - 1
    for name, first, last in zip(samples.names, samples.firsts, lasts, strict=True):
        if name not in issued:
            raise samples.error(
                int(first), "episode", f"'{name}' is not in commands.csv; add its commands, or leave it out"
            )
        begin, end = samples.values["time"][[first, last]]
        own = issued[name].times
        if own[0] >= end or own[-1] < begin:
            row = int(rows.firsts[rows.names.index(name)])
            problem = (
                f"the commands of '{name}' lie between {own[0]:.12g} and {own[-1]:.12g} s, its poses between "
                f"{begin:.12g} and {end:.12g} s; write both in seconds of one clock"
            )
            raise rows.error(row, "time", problem)


def _check_duties(rows: Rows, command: str) -> None:
    for name in COMMANDS["duty"] if command == "duty" else ():
        over = np.abs(rows.values[name]) > LARGEST_DUTY
        if over.any():
            row = int(np.argmax(over))
            problem = f"a duty must be between -1 and 1, got {rows.values[name][row]:g}; divide by full duty"
            raise rows.error(row, name, problem)


def _check_whole(samples: Rows, names: tuple[str, ...]) -> None:
    empty = np.isnan(samples.columns(names))
    half = empty.any(axis=1) & ~empty.all(axis=1)
    if half.any():
        row = int(np.argmax(half))
        column = names[int(np.argmax(empty[row]))]
        raise samples.error(row, column, f"is empty, but not all of {', '.join(names)}; fill it in or empty them all")


def _episodes(samples: Rows, command: str, rate_hz: float, issued: dict[str, _Issued]) -> tuple[LogEpisode, ...]:
    """The rows on their grids of times."""
    places, ends = places_on_grid(samples, rate_hz)
    filled = np.zeros(int(ends[-1]), dtype=np.int64)
    filled[places] = np.arange(len(places))
    columns = () if issued else COMMANDS[command]
    commands = samples.columns(columns)[np.maximum.accumulate(filled)]
    measured = Rows(
        samples.path, samples.lines, samples.names, samples.firsts, {**samples.values, "heading": unwrapped(samples)}
    )
    poses = spread(measured.columns(POSE), places, len(filled))
    wheels = spread(measured.columns(WHEELS), places, len(filled)) if WHEELS[0] in samples.values else None
    times = samples.values["time"]
    episodes = []
    for index, (begin, end) in enumerate(zip((0, *ends[:-1]), ends, strict=True)):
        name = samples.names[index]
        first, last = samples.firsts[index], (*samples.firsts, len(times))[index + 1]
        grid = times[first] + np.arange(end - begin) / rate_hz if rate_hz else times[first:last]
        speeds = None if wheels is None else wheels[begin:end]
        own = issued.get(name, _Issued(grid, commands[begin:end]))
        when = own.times if issued else None
        episodes.append(LogEpisode(name, grid, own.commands, poses[begin:end], speeds, when))
    return tuple(episodes)
