"""Commands and poses of a table's rows, drive by drive."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.errors import LogError
from proxytune.importing.orientation import headings_and_tilts
from proxytune.importing.source import Commands, Floats, Poses
from proxytune.importing.tables.cells import Table
from proxytune.importing.tables.columns import Columns, column_values, missing
from proxytune.importing.tables.fields import PLACE, POSE, QUATERNION
from proxytune.logs import COMMANDS

LEAST_EXTENT_M = 0.01
"""A drive that stays within this, in a unit that nobody stated, is taken for one in another unit."""


@dataclass(frozen=True)
class Labelled:
    """Rows of a table that hold something, M of them.

    Attributes:
        times: Their stamps (M,) [s].
        values: What they hold (M, fields).
        labels: The drive that each belongs to (M,); "" where the table names none.
    """

    times: Floats
    values: Floats
    labels: NDArray[np.str_]

    @property
    def names(self) -> tuple[str, ...]:
        """The drives in order of their first rows."""
        return tuple(dict.fromkeys(str(label) for label in self.labels))


def commands_by_drive(table: Table, columns: Columns, kind: str) -> dict[str, Commands]:
    """The commands of each drive that a table names; of "" where it names none.

    Raises:
        LogError: If a cell is no number, or half of a command is empty.
    """
    rows = _filled_rows(table, columns, COMMANDS[kind])
    drives = {}
    for name in rows.names:
        mine = rows.labels == name
        drives[name] = Commands(kind, rows.times[mine], rows.values[mine])
        _check_clock(drives[name].times, f"{_where(table, name)}: commands")
    if not drives:
        raise LogError(f"{table.path}: has columns of commands, but no row with one; fill them, or take them out")
    return drives


def pose_fields(table: Table, columns: Columns) -> list[str]:
    """The fields of a pose that the table has, quaternions last.

    Raises:
        LogError: If it lacks some.
    """
    lacking = [field for field in ("time", "x", "y") if field not in columns]
    if "heading" not in columns and not set(QUATERNION) <= set(columns):
        lacking.append("heading (or qx, qy, qz, qw)")
    if lacking:
        raise missing(table, lacking)
    turned = ("heading",) if "heading" in columns else QUATERNION
    return [field for field in POSE if field in columns and field in (*PLACE, *turned)]


def poses_by_drive(table: Table, columns: Columns) -> dict[str, Poses]:
    """The poses of each drive that a table names; of "" where it names none.

    Raises:
        LogError: If a column is missing, a cell is no number, part of a pose is empty, or a drive has no two poses.
    """
    fields = pose_fields(table, columns)
    rows = _filled_rows(table, columns, fields)
    if not len(rows.times):
        raise LogError(f"{table.path}: has no row with a pose; give the file that the poses were written to")
    by_field = dict(zip(fields, rows.values.T, strict=True))
    places = np.stack([by_field.get(axis, np.zeros(len(rows.times))) for axis in PLACE], axis=1)
    _check_extent(table, columns, places)
    headings, tilts = by_field.get("heading"), np.zeros(len(rows.times))
    if headings is None:
        headings, tilts = headings_and_tilts(rows.values[:, -4:], str(table.path))
    poses = Poses(rows.times, places, headings, tilts)
    drives = {}
    for name in rows.names:
        mine = rows.labels == name
        if mine.sum() < 2:
            raise LogError(f"{_where(table, name)}: has a single pose; a drive needs two or more")
        drives[name] = poses.only(mine)
        _check_clock(drives[name].times, f"{_where(table, name)}: poses")
    return drives


def _filled_rows(table: Table, columns: Columns, fields: Sequence[str]) -> Labelled:
    """The rows in which some fields are given, all of them or none."""
    if "time" not in columns:
        raise missing(table, ["time"])
    times = column_values(table, columns["time"])
    values = np.stack([column_values(table, columns[field]) for field in fields], axis=1)
    rows = np.isfinite(values).any(axis=1)
    for field, lacks in zip(("time", *fields), ~np.isfinite(np.column_stack((times, values))).T, strict=True):
        if (lacks & rows).any():
            row = int(np.argmax(lacks & rows))
            others = ", ".join(name for name in ("time", *fields) if name != field)
            raise table.error(row, columns[field].name, f"is empty beside {others}; fill it, or empty those too")
    labels = table.labels(columns["episode"].name) if "episode" in columns else np.full(len(times), "")
    return Labelled(times[rows], values[rows], labels[rows])


def _check_clock(times: Floats, where: str) -> None:
    if len(times) > 1 and np.ptp(times) == 0.0:
        raise LogError(f"{where}: all {len(times)} stamps are {times[0]:.12g} s; record with a clock that runs")


def _check_extent(table: Table, columns: Columns, places: Floats) -> None:
    """Refuse metres in columns whose names end in mm or cm: the robot would hardly have moved."""
    guessed = [columns[axis] for axis in ("x", "y") if columns[axis].known_by == "by its name"]
    extent = np.ptp(places[:, :2], axis=0).max()
    for column in guessed:
        if column.unit.factor < 1.0 and 0.0 < extent < LEAST_EXTENT_M:
            raise LogError(
                f"{table.path}: column '{column.name}' in {column.unit.name}, as its name ends: the robot moved "
                f"{extent * 1e3:.2g} mm in all; state its unit, as in --columns {column.field}={column.name}:m"
            )


def _where(table: Table, name: str) -> str:
    return f"{table.path}: drive '{name}'" if name else str(table.path)
