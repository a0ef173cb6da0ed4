"""Logs: commands and measured poses of a robot, as a folder with log.toml and samples.csv."""

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from proxytune.errors import LogError, SettingsError
from proxytune.settings import Section, nearest, read_settings

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]

COMMANDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "duty": ("left", "right"),
        "twist": ("v", "omega"),
        "wheel_speed": ("wheel_command_left", "wheel_command_right"),
        "none": (),
    }
)
"""The columns of each kind of command: duties in [−1, 1], a speed [m/s] and yaw rate [rad/s], wheel speeds [rad/s]."""

POSE = ("x", "y", "heading")
WHEELS = ("wheel_left", "wheel_right")

GEOMETRY: Mapping[str, str] = MappingProxyType(
    {"wheel_radius_m": "wheel_radius", "baseline_m": "effective_baseline", "full_speed_m_s": "full_speed"}
)
"""What log.toml may say of a robot, and what a robot.toml calls it."""

TEXTS = ("name", "robot", "pose", "source", "licence", "map", "frames")

OFF_GRID = 0.25 + 1e-6
"""A row may be this far from its place on the grid of times, in samples."""

SPARSEST = 10
"""A log with more missing rows than this for each row that it has states its times or its rate wrongly."""

LARGEST_DUTY = 1.0 + 1e-6
"""Full duty, and what rounding adds to it."""


@dataclass(frozen=True)
class LogEpisode:
    """One drive, on a regular grid of times.

    Attributes:
        name: What the column `episode` says.
        times: Times of the samples (rows,) [s], 1 / rate_hz apart.
        commands: What was commanded (rows, 2), in the units of the log's command kind, held until the next row.
        poses: Measured poses (rows, 3): x [m], y [m], heading [rad, unwrapped]; NaN where there is none.
        wheels: Measured wheel speeds (rows, 2), left and right [rad/s], or None.
    """

    name: str
    times: NDArray[np.float64]
    commands: NDArray[np.float64]
    poses: NDArray[np.float64]
    wheels: NDArray[np.float64] | None


@dataclass(frozen=True)
class Log:
    """A robot's drives.

    Attributes:
        name: What the log is called.
        robot: Name of the robot.
        command: Kind of the commands, one of COMMANDS; "none" for still frames, whose commands are (rows, 0).
        rate_hz: Samples per second; 0 for still frames that state none, whose times are as in the file.
        geometry: Figures that log.toml states itself: wheel_radius, effective_baseline [m], full_speed [m/s].
        episodes: The drives.
    """

    name: str
    robot: str
    command: str
    rate_hz: float
    geometry: dict[str, float]
    episodes: tuple[LogEpisode, ...]


@dataclass(frozen=True)
class _Samples:
    """The rows of samples.csv, N of them in E episodes.

    Attributes:
        path: The file.
        lines: Line of each row in the file (N,).
        names: Episodes in order (E,).
        firsts: First row of each episode (E,).
        values: Columns by name (N,), NaN where a cell is empty.
    """

    path: Path
    lines: Whole
    names: tuple[str, ...]
    firsts: Whole
    values: Mapping[str, Floats]

    @property
    def episode(self) -> Whole:
        """Episode of each row (N,)."""
        begins = np.zeros(len(self.lines), dtype=np.int64)
        begins[self.firsts[1:]] = 1
        return np.cumsum(begins)

    @property
    def follows(self) -> NDArray[np.bool_]:
        """Whether each row from the second on is of the same episode as the one before (N − 1,)."""
        return np.asarray(np.diff(self.episode) == 0)

    def columns(self, names: tuple[str, ...]) -> Floats:
        """Some columns side by side (N, len(names))."""
        return np.stack([self.values[name] for name in names], axis=1) if names else np.empty((len(self.lines), 0))

    def error(self, row: int, column: str, problem: str) -> LogError:
        """The one-line complaint about a cell."""
        return LogError(f"{self.path}: line {self.lines[row]}, column '{column}': {problem}")


def read_log(path: Path) -> Log:
    """Read a log's folder.

    Missing rows are filled: the last command held, no pose. Wrapped headings are unwrapped.

    Args:
        path: Folder with log.toml and samples.csv.

    Raises:
        LogError: If the folder is not such a log, naming file, line and column.
    """
    if not path.is_dir():
        problem = "is a file; give the folder that it lies in" if path.exists() else "no such folder; check the path"
        raise LogError(f"{path}: {problem}")
    try:
        settings = read_settings(path / "log.toml")
        command, rate_hz, geometry = _read_description(settings)
        name, robot = settings.text("name", path.resolve().name), settings.text("robot")
    except SettingsError as problem:
        raise LogError(str(problem)) from None
    samples = _read_samples(path / "samples.csv", command)
    _check_values(samples, command)
    _check_headings(samples, command, rate_hz)
    return Log(name, robot, command, rate_hz, geometry, _episodes(samples, command, rate_hz))


def _read_description(settings: Section) -> tuple[str, float, dict[str, float]]:
    """Command kind, rate and geometry that log.toml states."""
    settings.only(("format", *TEXTS, "command", "rate_hz", "measured", *GEOMETRY))
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


def _read_samples(path: Path, command: str) -> _Samples:
    lines, cells = _read_cells(path)
    header = cells[0]
    _check_header(path, header, command)
    if len(cells) == 1:
        raise LogError(f"{path}: has no rows; add one per sample")
    for line, row in zip(lines, cells, strict=True):
        if len(row) != len(header):
            counts = f"has {len(row)} cells, but the first line names {len(header)} columns"
            raise LogError(f"{path}: line {line}: {counts}")
    rows = pd.DataFrame(cells[1:], columns=header, dtype=str)
    labels = rows["episode"].str.strip()
    changes = np.flatnonzero(labels.ne(labels.shift()).to_numpy())
    names = tuple(str(label) for label in labels.iloc[changes])
    samples = _Samples(path, np.array(lines[1:]), names, changes, {})
    _check_episodes(samples)
    measures = [name for name in header if name != "episode"]
    return replace(samples, values={name: _numbers(samples, rows[name]) for name in measures})


def _read_cells(path: Path) -> tuple[list[int], list[list[str]]]:
    """Every line that is not blank, with its number; the first has the columns."""
    try:
        text = path.read_text(encoding="utf-8-sig")
        rows = list(csv.reader(text.splitlines(), strict=True))
    except FileNotFoundError:
        raise LogError(f"{path}: no such file; a log has its samples beside log.toml") from None
    except OSError as problem:
        raise LogError(f"{path}: cannot be read ({problem.strerror})") from None
    except (UnicodeDecodeError, csv.Error):
        raise LogError(f"{path}: is not a CSV file; save it as comma-separated text (UTF-8)") from None
    lines = [line for line, row in enumerate(rows, start=1) if any(row)]
    if not lines:
        raise LogError(f"{path}: is empty; its first line must name the columns, episode and time first")
    header = [cell.strip() for cell in rows[lines[0] - 1]]
    return lines, [header, *(rows[line - 1] for line in lines[1:])]


def _check_header(path: Path, header: list[str], command: str) -> None:
    needed = ("episode", "time", *COMMANDS[command], *POSE)
    wheels = WHEELS if set(WHEELS) & set(header) else ()
    for name in header:
        if name not in (*needed, *WHEELS):
            raise LogError(f"{path}: line 1: unknown column '{name}'; {nearest(name, (*needed, *WHEELS))}")
        if header.count(name) > 1:
            raise LogError(f"{path}: line 1: names the column '{name}' twice; take one of them out")
    for name in (*needed, *wheels):
        if name not in header:
            raise LogError(
                f"{path}: line 1: no column '{name}'; commands of kind '{command}' need {','.join((*needed, *wheels))}"
            )


def _check_episodes(samples: _Samples) -> None:
    for name, first in zip(samples.names, samples.firsts, strict=True):
        if not name:
            raise samples.error(int(first), "episode", "is empty; name the drive")
    repeated = pd.Series(samples.names).duplicated().to_numpy()
    if repeated.any():
        again = int(np.argmax(repeated))
        problem = f"'{samples.names[again]}' comes back after another episode; keep each episode's rows together"
        raise samples.error(int(samples.firsts[again]), "episode", problem)
    lengths = np.diff(np.append(samples.firsts, len(samples.lines)))
    if (lengths < 2).any():
        single = int(np.argmax(lengths < 2))
        problem = f"'{samples.names[single]}' has a single row; a drive needs two or more, so leave it out"
        raise samples.error(int(samples.firsts[single]), "episode", problem)


def _numbers(samples: _Samples, cells: pd.Series) -> Floats:
    """A column's values, NaN where a pose's or wheel's cell is empty."""
    texts = cells.str.strip()
    values = pd.to_numeric(texts, errors="coerce").to_numpy(dtype=np.float64)
    may_lack = cells.name in (*POSE, *WHEELS)
    wrong = ~np.isfinite(values)
    if may_lack:
        wrong &= (texts != "").to_numpy()
    if wrong.any():
        row = int(np.argmax(wrong))
        rule = "must be a finite number, or empty where nothing was measured" if may_lack else "must be a finite number"
        raise samples.error(row, str(cells.name), f"{rule}, got '{texts.iloc[row]}'")
    return values


def _check_values(samples: _Samples, command: str) -> None:
    """What no drive can have: half a pose, time that stands still, more than full duty."""
    for together in (POSE, WHEELS):
        if together[0] in samples.values:
            _check_whole(samples, together)
    time = samples.values["time"]
    stuck = samples.follows & (np.diff(time) <= 0)
    if stuck.any():
        row = int(np.argmax(stuck)) + 1
        problem = (
            f"{time[row]:.12g} s does not come after {time[row - 1]:.12g} s of the row before; sort the rows by time"
        )
        raise samples.error(row, "time", problem)
    for name in COMMANDS["duty"] if command == "duty" else ():
        over = np.abs(samples.values[name]) > LARGEST_DUTY
        if over.any():
            row = int(np.argmax(over))
            problem = f"a duty must be between -1 and 1, got {samples.values[name][row]:g}; divide by full duty"
            raise samples.error(row, name, problem)


def _check_whole(samples: _Samples, names: tuple[str, ...]) -> None:
    empty = np.isnan(samples.columns(names))
    half = empty.any(axis=1) & ~empty.all(axis=1)
    if half.any():
        row = int(np.argmax(half))
        column = names[int(np.argmax(empty[row]))]
        raise samples.error(row, column, f"is empty, but not all of {', '.join(names)}; fill it in or empty them all")


def _check_headings(samples: _Samples, command: str, rate_hz: float) -> None:
    """Refuse headings in degrees: they jump by 360, or fit the course over ground far better than as radians."""
    heading = samples.values["heading"]
    if command == "none" or np.isnan(heading).all():
        return
    largest = int(np.nanargmax(np.abs(heading)))
    beyond = abs(heading[largest]) > 7.0
    jumps = samples.follows & (np.abs(np.abs(np.diff(heading)) - 360.0) < 30.0)
    if (beyond and jumps.any()) or _fits_as_degrees(samples, rate_hz, beyond=bool(beyond)):
        problem = f"{heading[largest]:g} and the others look like degrees; write headings in radians"
        raise samples.error(largest, "heading", problem)


def _fits_as_degrees(samples: _Samples, rate_hz: float, *, beyond: bool) -> bool:
    """Whether course over ground and heading keep together with the heading in degrees only.

    Angles are doubled, so that a robot may go backwards, and longer ways weigh more. Where headings go beyond a turn
    of radians, a course that hardly varies is told by its direction too.
    """
    span = max(2, 2 * round(rate_hz / 4.0))
    x, y, heading = samples.columns(POSE).T
    if len(x) <= span:
        return False
    way = (x[span:] - x[:-span]) + 1j * (y[span:] - y[:-span])
    middle = heading[span // 2 : -span // 2]
    moving = (samples.episode[span:] == samples.episode[:-span]) & (np.abs(way) > 0.02) & np.isfinite(middle)
    if moving.sum() < 20:
        return False
    way, middle = way[moving], middle[moving]
    doubled = way**2 / np.abs(way) / np.abs(way).sum()
    degrees, radians = (complex(np.sum(doubled * np.exp(-2j * h))) for h in (np.radians(middle), middle))
    scattered = abs(degrees) > 0.6 and abs(degrees) > abs(radians) + 0.3
    return scattered or (beyond and degrees.real > 0.8 and degrees.real > radians.real + 0.3)


def _episodes(samples: _Samples, command: str, rate_hz: float) -> tuple[LogEpisode, ...]:
    """The rows on their grids of times."""
    places, ends = _places(samples, rate_hz)
    filled = np.zeros(int(ends[-1]), dtype=np.int64)
    filled[places] = np.arange(len(places))
    commands = samples.columns(COMMANDS[command])[np.maximum.accumulate(filled)]
    values = {**samples.values, "heading": _unwrap(samples)}
    measured = replace(samples, values=values)
    poses = _spread(measured.columns(POSE), places, len(filled))
    wheels = _spread(measured.columns(WHEELS), places, len(filled)) if WHEELS[0] in values else None
    times = samples.values["time"]
    episodes = []
    for index, (begin, end) in enumerate(zip((0, *ends[:-1]), ends, strict=True)):
        first, last = samples.firsts[index], (*samples.firsts, len(times))[index + 1]
        grid = times[first] + np.arange(end - begin) / rate_hz if rate_hz else times[first:last]
        speeds = None if wheels is None else wheels[begin:end]
        episodes.append(LogEpisode(samples.names[index], grid, commands[begin:end], poses[begin:end], speeds))
    return tuple(episodes)


def _places(samples: _Samples, rate_hz: float) -> tuple[Whole, Whole]:
    """Where each row lies on all grids laid end to end (N,), and where each episode's grid ends (E,)."""
    lasts = np.append(samples.firsts[1:], len(samples.lines)) - 1
    if not rate_hz:
        return np.arange(len(samples.lines)), lasts + 1
    time, episode = samples.values["time"], samples.episode
    elapsed = (time - time[samples.firsts][episode]) * rate_hz
    _check_grid(samples, elapsed, rate_hz)
    steps = np.rint(elapsed).astype(np.int64)
    ends = np.cumsum(steps[lasts] + 1)
    return steps + np.append(0, ends[:-1])[episode], ends


def _check_grid(samples: _Samples, elapsed: Floats, rate_hz: float) -> None:
    """Refuse rows off the grid, two rows at one place of it, and a grid that is nearly empty."""
    off = np.abs(elapsed - np.rint(elapsed)) > OFF_GRID
    off[1:] |= samples.follows & (np.diff(np.rint(elapsed)) < 1)
    sparse = np.append(np.diff(elapsed) * samples.follows, 0.0)
    longest = int(np.argmax(sparse))
    if sparse.sum() > SPARSEST * len(elapsed):
        problem = (
            f"the rows cover {sparse.sum():.0f} samples of {rate_hz:g} Hz with {len(elapsed)} rows, with a gap of "
            f"{sparse[longest] / rate_hz:g} s before this one; write seconds, correct rate_hz or split the episode"
        )
        raise samples.error(longest + 1, "time", problem)
    if off.any():
        row = int(np.argmax(off))
        problem = (
            f"{samples.values['time'][row]:.12g} s lies off the grid of {rate_hz:g} Hz from the episode's first row; "
            f"resample to steps of {1.0 / rate_hz:g} s or correct rate_hz"
        )
        raise samples.error(row, "time", problem)


def _spread(values: Floats, places: Whole, length: int) -> Floats:
    spread = np.full((length, values.shape[1]), math.nan)
    spread[places] = values
    return spread


def _unwrap(samples: _Samples) -> Floats:
    """Headings without jumps by whole turns within an episode, gaps passed over."""
    heading = samples.values["heading"].copy()
    measured = np.flatnonzero(np.isfinite(heading))
    if not len(measured):
        return heading
    episode = samples.episode[measured]
    turns = np.append(0.0, np.rint(np.diff(heading[measured]) / math.tau)).cumsum()
    begins = np.append(True, np.diff(episode) > 0)
    start = turns[np.maximum.accumulate(np.where(begins, np.arange(len(measured)), 0))]
    heading[measured] -= (turns - start) * math.tau
    return heading
