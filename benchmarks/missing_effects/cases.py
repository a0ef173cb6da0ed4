"""The format: cases as folders, truths apart from them, predicted poses. It needs NumPy and nothing of proxytune."""

import csv
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

POSE = ("x", "y", "heading")
HORIZONS_S = (1, 2, 5)
BETWEEN_S = 1.0
"""Windows of every horizon begin so far apart."""


FARTHEST = 1e6
"""No time, place or heading is beyond this."""


class FormatError(Exception):
    """A file is not what the format says; one line that names it."""


@dataclass(frozen=True)
class Drive:
    """One drive of a robot, its rows evenly spaced in time."""

    name: str  # what it is called
    times: Array  # of the rows (T,) [s]
    commands: Array  # in the units of the log (T, 2), each held until the next
    poses: Array  # as the tracker measured them (T, 3) [m], [m], [rad]; NaN where they are not told

    @property
    def row_s(self) -> float:
        """Seconds between rows."""
        return float(self.times[1] - self.times[0])


@dataclass(frozen=True)
class Case:
    """What an entry may know of a robot."""

    name: str  # name of its folder
    folder: Path
    robot: Mapping[str, Any]  # its figures as its maker states them, and the kind of its commands
    drives: tuple[Drive, ...]  # drives with commands and poses, to learn from
    held_out: tuple[Drive, ...]  # drives with commands and the first pose only, to predict


def case_folders(folder: Path) -> tuple[Path, ...]:
    """The folders of the cases, in order.

    Raises:
        FormatError: If there are none.
    """
    found = tuple(sorted(path.parent for path in (folder / "cases").glob("*/robot.json")))
    if not found:
        raise FormatError(f"{folder}: has no cases; write some with benchmarks/missing_effects/write.py")
    return found


def read_case(folder: Path) -> Case:
    """Read one case.

    Raises:
        FormatError: If a file is missing.
    """
    robot = read_json(folder / "robot.json")
    return Case(folder.name, folder, robot, *(_drives(folder / part) for part in ("log", "held_out")))


def _drives(folder: Path) -> tuple[Drive, ...]:
    file = folder / "samples.csv"
    head, rows = _table(file)
    commands = [name for name in head if name not in ("episode", "time", *POSE)]
    columns = [head.index(name) for name in ("time", *commands, *POSE)]
    parts: dict[str, list[list[float]]] = {}
    for row in rows:
        parts.setdefault(row[head.index("episode")], []).append([float(row[n] or "nan") for n in columns])
    tables = {name: np.array(part) for name, part in parts.items()}
    return tuple(Drive(name, part[:, 0], part[:, 1:-3], part[:, -3:]) for name, part in tables.items())


def read_json(file: Path) -> Any:
    """What a JSON file holds.

    Raises:
        FormatError: If there is no such file, or it is not JSON.
    """
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except OSError:
        raise FormatError(f"{file}: is missing") from None
    except ValueError:
        raise FormatError(f"{file}: is not JSON") from None


def read_poses(file: Path) -> dict[str, tuple[Array, Array]]:
    """Times (T,) and poses (T, 3) by drive, of a table `episode,time,x,y,heading`.

    Raises:
        FormatError: If the file is missing, lacks a column, or has a cell that is no sensible number.
    """
    head, rows = _table(file)
    if missing := [name for name in ("episode", "time", *POSE) if name not in head]:
        raise FormatError(f"{file}: has no column '{missing[0]}'; it needs episode,time,{','.join(POSE)}")
    parts: dict[str, list[list[float]]] = {}
    for line, row in enumerate(rows, 2):
        if len(row) != len(head):
            raise FormatError(f"{file}: line {line} has {len(row)} cells, its head {len(head)}")
        values = [_number(row[head.index(name)], f"{file}: line {line}, column '{name}'") for name in ("time", *POSE)]
        parts.setdefault(row[head.index("episode")], []).append(values)
    tables = {name: np.array(part) for name, part in parts.items()}
    return {name: (part[:, 0], part[:, 1:]) for name, part in tables.items()}


def _table(file: Path) -> tuple[list[str], list[list[str]]]:
    try:
        with file.open(encoding="utf-8-sig", newline="") as lines:
            rows = [row for row in csv.reader(lines) if row]
    except OSError:
        raise FormatError(f"{file}: is missing") from None
    except (UnicodeDecodeError, csv.Error):
        raise FormatError(f"{file}: is not a CSV in UTF-8") from None
    if not rows:
        raise FormatError(f"{file}: is empty")
    return rows[0], rows[1:]


def _number(cell: str, where: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not abs(value) <= FARTHEST:
        raise FormatError(f"{where}: '{cell}' is no number within ±{FARTHEST:g}")
    return value


def write_drives(file: Path, drives: Iterable[Drive], commands: Sequence[str]) -> None:
    """Write samples.csv; poses that are not told are left empty."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("w", encoding="utf-8", newline="") as lines:
        table = csv.writer(lines, lineterminator="\n")
        table.writerow(("episode", "time", *commands, *POSE))
        for drive in drives:
            for time, command, pose in zip(drive.times, drive.commands, drive.poses, strict=True):
                told = ("" if math.isnan(value) else f"{value:.6f}" for value in pose)
                table.writerow((drive.name, f"{time:.3f}", *(f"{value:.6f}" for value in command), *told))


def write_poses(file: Path, drives: Sequence[Drive], poses: Sequence[Array]) -> None:
    """Write poses (T, 3) of drives as `episode,time,x,y,heading`."""
    told = (Drive(d.name, d.times, np.empty((len(d.times), 0)), p) for d, p in zip(drives, poses, strict=True))
    write_drives(file, told, ())


def errors(predicted: Sequence[Array], measured: Sequence[Array], row_s: float) -> dict[int, float]:
    """RMSE of position by horizon [s], over windows: of the motion since each begins, seen from there [m]."""
    found = {}
    for horizon in HORIZONS_S:
        reach, step = round(horizon / row_s), round(BETWEEN_S / row_s)
        both = zip(predicted, measured, strict=True)
        apart = [_moved(one, reach, step) - _moved(other, reach, step) for one, other in both]
        found[horizon] = float(np.sqrt(np.mean(np.abs(np.concatenate(apart)) ** 2)))
    return found


def _moved(poses: Array, reach: int, step: int) -> NDArray[np.complex128]:
    """How far each window of `reach` rows leads, ahead + i · left."""
    start, end = poses[:-reach:step], poses[reach::step]
    return (end - start)[:, :2] @ np.array((1.0, 1.0j)) * np.exp(-1j * start[:, 2])
