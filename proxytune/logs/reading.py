"""Reading a log's folder, strictly: log.toml with every complaint at once, then samples, commands and frames."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from proxytune.arrays import Floats
from proxytune.errors import LogError, SettingsError
from proxytune.logs.frames import StatedCamera, read_camera, read_frames
from proxytune.logs.log import CAR_COMMANDS, COMMANDS, ENABLED, POSE, WHEELS, Log
from proxytune.logs.rows import Rows, check_known_episodes, read_cells, read_rows
from proxytune.logs.times import Issued, check_headings, episodes_at_own_times, episodes_on_grid, usual_rate
from proxytune.settings import GEOMETRY, Section, read_settings

TEXTS = ("name", "robot", "pose", "source", "licence", "map", "frames")
KEYS = ("format", *TEXTS, "command", "rate_hz", "clock_offset_s", "measured", "camera", *GEOMETRY)
FIT = "fit"
"""What `clock_offset_s` says where the offset is to be fitted."""
FURTHEST_S = 3600.0
"""Clocks may be declared to be an hour apart, as where one has another time zone's half hour."""
Value = TypeVar("Value")


def read_description(settings: Section) -> tuple[Log, StatedCamera | None]:
    """Read log.toml: the log without a drive yet, 0 Hz where poses have times of their own, and its pictures.

    All that is wrong is told in one line.
    """
    wrong: list[str] = []

    def read(check: Callable[[], Value], otherwise: Value) -> Value:
        try:
            return check()
        except SettingsError as problem:
            wrong.append(str(problem).removeprefix(f"{settings.path}: "))
            return otherwise

    read(lambda: settings.only(KEYS), None)
    read(lambda: settings.whole("format", 1, low=1, high=1), 1)
    read(lambda: settings.flag("measured", True), True)
    for key in (key for key in TEXTS if key not in ("name", "robot")):
        read(lambda key=key: settings.text(key, ""), "")  # type: ignore[misc]
    geometry = {
        name: read(lambda key=key: settings.number(key, low=1e-4, high=1e4), 1.0)  # type: ignore[misc]
        for key, name in GEOMETRY.items()
        if key in settings
    }
    offset = settings.get("clock_offset_s")
    log = Log(
        name=read(lambda: settings.text("name", settings.path.resolve().parent.name), ""),
        robot=read(lambda: settings.text("robot"), ""),
        command=read(lambda: settings.text("command", choices=COMMANDS), ""),
        rate_hz=read(lambda: settings.number("rate_hz", low=0.01, high=10000.0) if "rate_hz" in settings else 0.0, 0.0),
        geometry=geometry,
        episodes=(),
        clock_offset_s=None if offset in (None, FIT) else read(lambda: _offset(settings), None),
        fit_clock_offset=offset == FIT,
    )
    camera = read(lambda: read_camera(settings), None)
    if wrong:
        different = list(dict.fromkeys(wrong))
        numbered = "; ".join(f"({number}) {problem}" for number, problem in enumerate(different, start=1))
        raise LogError(f"{settings.path}: {numbered if len(different) > 1 else different[0]}")
    return log, camera


def _offset(settings: Section) -> float:
    if isinstance(settings["clock_offset_s"], str):
        raise settings.error("clock_offset_s", f'must be seconds, or "{FIT}", got {settings["clock_offset_s"]!r}')
    return settings.number("clock_offset_s", low=-FURTHEST_S, high=FURTHEST_S)


LARGEST_DUTY = 1.0 + 1e-6
"""Full duty, and what rounding adds to it."""


def read_log(path: str | Path) -> Log:
    """Read a log's folder.

    Wrapped headings are unwrapped. Where log.toml states `rate_hz`, poses lie on that grid and missing rows are filled:
    the last command held, no pose. Where it does not, poses have times of their own. Where commands.csv lies beside
    samples.csv, commands have times of their own; frames.csv has those of the camera's pictures.

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
        stated, camera = read_description(read_settings(path / "log.toml"))
    except SettingsError as problem:
        raise LogError(str(problem)) from None
    apart = (path / "commands.csv").exists()
    samples = _read_samples(path / "samples.csv", stated.command, apart=apart)
    issued: dict[str, Issued] = {}
    if apart:
        if stated.command == "none":
            told = "log.toml states that there are no commands; state their kind, or take this file out"
            raise LogError(f"{path / 'commands.csv'}: {told}")
        rows, issued = _issued(path / "commands.csv", stated.command)
        check_known_episodes(rows, samples.names)
        _check_overlap(samples, rows, issued, stated.clock_offset_s or 0.0)
    commands = samples.columns(()) if issued else _commands(samples, stated.command)
    own_times, rate_hz = not stated.rate_hz and stated.command != "none", stated.rate_hz
    check_headings(samples, stated.command, usual_rate(samples) if own_times else rate_hz)
    if own_times:
        episodes, rate_hz = episodes_at_own_times(samples, commands, issued)
    else:
        episodes = episodes_on_grid(samples, commands, issued, rate_hz)
    frames = read_frames(camera, path, samples, stated.rate_hz, episodes) if camera else None
    if offset_s := stated.clock_offset_s:  # so much earlier the commands' clock is than that of the poses
        clocks = (one.times if one.issued is None else one.issued for one in episodes)
        episodes = tuple(replace(one, issued=own + offset_s) for one, own in zip(episodes, clocks, strict=True))
    return replace(stated, rate_hz=rate_hz, episodes=episodes, frames=frames)


def read_commands(path: Path) -> tuple[str, dict[str, tuple[Floats, Floats]]]:
    """Read a table as a log's commands.csv: its kind, by its columns; episodes' times (M,) [s] and commands (M, 2)."""
    header, _ = read_cells(path)
    kind = next((kind for kind, columns in COMMANDS.items() if columns and {*columns} <= {*header}), "")
    if not kind:
        known = "; ".join(f"{kind}: {', '.join(columns)}" for kind, columns in COMMANDS.items() if columns)
        raise LogError(f"{path}: has no columns of commands; name them as a log does ({known})")
    return kind, _issued(path, kind)[1]


def _read_samples(path: Path, command: str, *, apart: bool) -> Rows:
    columns = () if apart else COMMANDS[command]
    why = "samples beside a commands.csv" if apart else f"commands of kind '{command}'"
    switch = () if apart or command == "none" else (ENABLED,)
    may_lack = (*POSE, *WHEELS)
    samples = read_rows(path, (*columns, *POSE), why, together=WHEELS, optional=switch, may_lack=may_lack, fewest=2)
    for together in (POSE, WHEELS):
        empty = np.isnan(samples.columns(together)) if together[0] in samples.values else np.empty((0, len(together)))
        half = empty.any(axis=1) & ~empty.all(axis=1)
        if half.any():
            row = int(np.argmax(half))
            column, those = together[int(np.argmax(empty[row]))], ", ".join(together)
            raise samples.error(row, column, f"is empty, but not all of {those}; fill it in or empty them all")
    if not apart:
        _check_sizes(samples, command)
    return samples


def _commands(rows: Rows, command: str) -> Floats:
    """The columns of a kind of command (N, 2); where `enabled` is 0, what drives is 0 and a car still steers."""
    columns = rows.columns(COMMANDS[command])
    if ENABLED in rows.values:
        driving = slice(1) if command in CAR_COMMANDS else slice(None)
        columns[:, driving] *= rows.values[ENABLED][:, None]
    return columns


def _issued(path: Path, command: str) -> tuple[Rows, dict[str, Issued]]:
    """A table of commands of a kind, and every episode's with their times."""
    rows = read_rows(path, COMMANDS[command], f"commands of kind '{command}'", optional=(ENABLED,))
    _check_sizes(rows, command)
    columns = (np.split(each, rows.firsts[1:]) for each in (rows.values["time"], _commands(rows, command)))
    return rows, dict(zip(rows.names, zip(*columns, strict=True), strict=True))


def _check_overlap(samples: Rows, rows: Rows, issued: Mapping[str, Issued], offset_s: float) -> None:
    """Refuse an episode without commands, or whose commands and poses are of different times."""
    for name, first, last in zip(samples.names, samples.firsts, samples.ends - 1, strict=True):
        if name not in issued:
            problem = f"'{name}' is not in commands.csv; add its commands, or leave it out"
            raise samples.error(int(first), "episode", problem)
        begin, end = samples.values["time"][[first, last]]
        own = issued[name][0] + offset_s
        if own[0] >= end or own[-1] < begin:
            row = int(rows.firsts[rows.names.index(name)])
            lie = f"lie between {own[0]:.12g} and {own[-1]:.12g} s, its poses between {begin:.12g} and {end:.12g} s"
            raise rows.error(row, "time", f"the commands of '{name}' {lie}; write both in seconds of one clock")


SIZES: Mapping[str, tuple[str, float, str]] = {
    **dict.fromkeys(COMMANDS["duty"], ("a duty must be", 1.0, "divide by full duty")),
    "throttle": ("throttle must be", 1.0, "divide a percentage by 100, and a pulse's distance from rest by its range"),
    "steering": ("steering must be", 1.0, "divide degrees by the greatest wheel angle, pulses by their range"),
    "steering_angle": ("a wheel angle must be", np.pi / 2.0, "turn degrees into radians"),
}
"""How a command is called in a complaint, the largest, and what to do about a larger one."""


def _check_sizes(rows: Rows, command: str) -> None:
    for name in COMMANDS[command]:
        what, most, remedy = SIZES.get(name, ("", np.inf, ""))
        over = np.abs(rows.values[name]) > most * LARGEST_DUTY
        if over.any():
            row = int(np.argmax(over))
            value = rows.values[name][row]
            raise rows.error(row, name, f"{what} between {-most:.4g} and {most:.4g}, got {value:g}; {remedy}")
    switch = rows.values.get(ENABLED, np.empty(0))
    if not np.isin(switch, (0.0, 1.0)).all():
        row = int(np.argmin(np.isin(switch, (0.0, 1.0))))
        raise rows.error(row, ENABLED, f"must be 1 (motors on) or 0 (cut), got {switch[row]:g}")
