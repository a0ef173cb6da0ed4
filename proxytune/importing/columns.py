"""Columns of a table taken for what a map says, else by their names, and their rows as commands and poses, by drive.

A unit is the one stated, else the one that a column's name ends in, else the package's; values that speak against a
unit that nobody stated are refused.
"""

import itertools
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Floats
from proxytune.errors import LogError
from proxytune.importing.checks import FURTHEST_BACK_S, headings_and_tilts
from proxytune.importing.source import Channel, Commands, Poses, Wanted, Wheels
from proxytune.importing.text import COMMAND_FIELDS, EXAMPLE, PLACE, POSE, QUANTITIES, QUATERNION, USUAL, Table
from proxytune.logs import COMMANDS, ENABLED, WHEELS
from proxytune.settings import nearest


@dataclass(frozen=True)
class Unit:
    """A unit of a quantity, as in "length", and the factor to the package's own: s, m, rad, m/s, rad/s, duty."""

    name: str
    quantity: str
    factor: float
    counted: bool = False  # whether it is of the angle that a wheel has turned, whose speed is wanted


UNITS = {
    name: Unit(name, quantity, factor)
    for quantity, units in {
        "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
        "length": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3},
        "angle": {"rad": 1.0, "deg": np.pi / 180.0},
        "speed": {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2, "km/h": 1.0 / 3.6},
        "turning speed": {"rad/s": 1.0, "deg/s": np.pi / 180.0, "rpm": np.pi / 30.0},
        "duty": {"duty": 1.0, "percent": 1e-2, "pwm255": 1.0 / 255.0},
        "number": {"number": 1.0},
    }.items()
    for name, factor in units.items()
}
"""Every unit by its name; the first of each quantity is the package's own, the others as they are likely."""
ENDINGS = {unit.name.replace("/", "_"): unit for unit in UNITS.values() if unit.name not in ("duty", "number")} | {
    "sec": UNITS["s"],
    "nsec": UNITS["ns"],
    "mps": UNITS["m/s"],
    "radps": UNITS["rad/s"],
    "degps": UNITS["deg/s"],
    "kmh": UNITS["km/h"],
    "%": UNITS["percent"],
    "pct": UNITS["percent"],
}
"""What a column's name may end in after an underscore, blank or bracket, as in stamp_ns, pos_x [mm], v_m_s."""
EPOCHS = ((1e17, UNITS["ns"]), (1e14, UNITS["us"]), (1e11, UNITS["ms"]))
"""From which value on a stamp is no date in a greater unit: 1e11 s lie in the year 5138, 1e11 ms in 1973."""
LARGEST = {"speed": 30.0, "turning speed": 300.0, "length": 1000.0}
"""Beyond these [m/s, rad/s, m from end to end] a unit that nobody stated is doubted."""
PULSES = (900.0, 2200.0)
"""Lengths of servo pulses [us]."""
SHORTEST_STEP_S, LONGEST_STEP_S = 1e-5, 10.0
"""Median step of stamps outside of which a unit that nobody stated is doubted."""


TICKS = re.compile(r"ticks/(\d+(?:\.\d+)?)")
"""A wheel's counter, and how far it counts in a turn."""
COUNTERS = (2.0**16, 2.0**32)
"""Counters begin anew after so many ticks: the first that is more than all that a column spans."""


def unit_named(name: str) -> Unit | None:
    """A unit of UNITS, or that of a counter such as ticks/4096; None where there is no such unit."""
    ticks = TICKS.fullmatch(name)
    if ticks and float(ticks[1]) > 0.0:
        return Unit(name, "turning speed", 2.0 * np.pi / float(ticks[1]), counted=True)
    return UNITS.get(name)


def own_unit(quantity: str) -> Unit:
    """The package's unit of a quantity."""
    return next(unit for unit in UNITS.values() if unit.quantity == quantity)


def plain(name: str) -> str:
    """A column's name in small letters, everything but letters, figures and % made single underscores."""
    return re.sub(r"(?:[^\w%]|_)+", "_", name.strip().lower().lstrip("%#")).strip("_")


def split_ending(name: str, quantity: str) -> tuple[str, Unit | None]:
    """The plain name of a column without its unit, and the unit where it ends in one of that quantity."""
    simple = plain(name)
    for ending in sorted(ENDINGS, key=len, reverse=True):
        stem = simple.removesuffix(f"_{ending}")
        if stem != simple and ENDINGS[ending].quantity == quantity:
            return stem.strip("_"), ENDINGS[ending]
    return simple, None


def split_unit(entry: str, quantity: str, names: Sequence[str], where: str) -> tuple[str, Unit | None]:
    """The column that an entry of a map names, as in "stamp_ns:ns" or "yaw", and its unit where the entry states one.

    One of the file's names may hold a colon itself.
    """
    name, colon, unit = entry.rpartition(":")
    if entry in names or not colon or (name not in names and unit_named(unit) is None):
        return entry, None
    known = [known.name for known in UNITS.values() if known.quantity == quantity and quantity != "number"]
    if not known:
        raise LogError(f"{where}: has no unit; leave out ':{unit}'")
    known += ["ticks/4096 (of a measured wheel)"] if quantity == "turning speed" else []
    if (found := unit_named(unit)) is None:
        raise LogError(f"{where}: unknown unit '{unit}'; known are: {', '.join(known)}")
    if found.quantity != quantity:
        raise LogError(f"{where}: '{unit}' is no unit of {quantity}; known are: {', '.join(known)}")
    return name, found


def epoch_unit(values: Floats) -> Unit | None:
    """The unit of stamps that are too large for seconds since 1970, or None."""
    largest = np.nanmax(np.abs(values), initial=0.0)
    return next((unit for least, unit in EPOCHS if largest >= least), None)


def contradiction(unit: Unit, values: Floats) -> str:
    """The reason why values (N,), NaN where a cell is empty, are not in a unit that nobody stated, or ""."""
    seen = values[np.isfinite(values)]
    if not len(seen):
        return ""
    with np.errstate(over="ignore"):
        if unit.quantity == "time":
            times = seen * unit.factor
            steps = np.diff(times)
            step = np.median(steps[steps > 0]) if (steps > 0).any() else 1.0
            if step < SHORTEST_STEP_S or step > LONGEST_STEP_S:
                return f"rows would be {step:.2g} s apart"
            return "stamps would lie after the year 5000" if np.abs(times).max() > 1e11 else ""
        if unit.quantity == "angle":
            return _angle_contradiction(unit, seen)
        size = np.ptp(seen) if unit.quantity == "length" else np.abs(seen).max()
    if unit.quantity == "duty" and size * unit.factor > 1.0 + 1e-6:
        pulses = "; servo pulses are made shares by (pulse - rest) / range" if PULSES[0] < size < PULSES[1] else ""
        return f"{size:g} is more than full duty{pulses}"
    if size * unit.factor > LARGEST.get(unit.quantity, np.inf):
        return f"{size:g} {unit.name} {'from end to end ' if unit.quantity == 'length' else ''}is much for a robot"
    return ""


def _angle_contradiction(unit: Unit, values: Floats) -> str:
    if unit.name == "rad":
        jumps = np.abs(np.abs(np.diff(values)) - 360.0) < 30.0
        return "the values jump by 360, like degrees" if jumps.any() else ""
    low, high = values.min(), values.max()
    like_radians = (low >= -3.2 and high <= 3.2) or (low >= 0.0 and high <= 6.3)
    return f"values from {low:g} to {high:g} look like radians" if like_radians and low < high else ""


@dataclass(frozen=True)
class Column:
    """A column of a table, and what it is taken for."""

    field: str  # the package's name of it
    name: str  # the table's
    unit: Unit
    known_by: str  # how the unit is known: "stated", "by its name", "by its size" or "assumed"

    def __str__(self) -> str:
        if self.unit.quantity == "number":
            return f"{self.field} from '{self.name}'"
        return f"{self.field} from '{self.name}' ({self.unit.name}, {self.known_by})"


Columns = Mapping[str, Column]


def own_columns(names: Sequence[str]) -> dict[str, Column]:
    """Columns that have the package's names and units."""
    return {name: Column(name, name, own_unit(QUANTITIES[name]), "stated") for name in names}


def usual_names(field: str, names: Sequence[str]) -> list[str]:
    """Those names that are usual for a field."""
    stems = {name: split_ending(name, QUANTITIES[field])[0].removeprefix("field_") for name in names}
    return [name for name, stem in stems.items() if stem.replace("_", "") in USUAL[field]]


def choose_columns(table: Table, stated: Mapping[str, str], fields: Sequence[str]) -> dict[str, Column]:
    """Find the columns of some fields: those stated in a column map, else by their usual names."""
    chosen = {field: _stated(table, field, stated[field]) for field in fields if field in stated}
    if "heading" in chosen:
        fields = [field for field in fields if field not in QUATERNION]
    taken = {column.name for column in chosen.values()}
    for field in (field for field in fields if field not in chosen):
        names = [name for name in usual_names(field, table.names) if name not in taken]
        if len(names) > 1:
            either = " or ".join(f"'{name}'" for name in names)
            raise LogError(f"{table.path}: {field} may be {either}; say which, as in --columns {field}={names[0]}")
        if names:
            chosen[field] = _by_ending(field, names[0])
    if set(QUATERNION) <= set(chosen) and "heading" not in stated:
        chosen.pop("heading", None)
    for field in ("time", "command_time"):
        time = chosen.get(field)
        if time and time.known_by == "assumed":
            unit = epoch_unit(table.numbers(time.name))
            chosen[field] = replace(time, unit=unit, known_by="by its size") if unit else time
    return chosen


def with_drives(table: Table, columns: Columns) -> Columns:
    """The columns with one that tells drives apart, where stamps go back: an unused one that changes there alone."""
    if "episode" in columns or "time" not in columns:
        return columns
    times = column_values(table, columns["time"])
    rows = np.flatnonzero(np.isfinite(times))
    back = np.flatnonzero(np.diff(times[rows]) < -FURTHEST_BACK_S) + 1
    if not len(back):
        return columns
    taken = {column.name for column in columns.values()}
    names = [name for name in table.names if name not in taken and _names_drives(table, name, rows, back)]
    if len(names) == 1:
        return {**columns, "episode": Column("episode", names[0], own_unit("number"), "where stamps go back")}
    either = f"take {' or '.join(names)}" if names else "add a column that names the drive of each row"
    remedy = f"{either}, as in --columns episode={names[0] if names else 'run'}"
    problem = f"stamps go back, as where another drive begins; {remedy}"
    raise table.error(int(rows[back[0]]), columns["time"].name, problem)


def _names_drives(table: Table, name: str, rows: NDArray[np.intp], back: NDArray[np.intp]) -> bool:
    """True of a column that changes where stamps go back, and nowhere else, to another value each time."""
    values = table.cells[name].astype(str).to_numpy()[rows]
    changes = np.flatnonzero(values[1:] != values[:-1]) + 1
    return np.array_equal(changes, back) and len({values[0], *values[back]}) == len(back) + 1


def check_fields(path: Path, wanted: Wanted) -> None:
    """Refuse a column map that names something else than the package's fields."""
    for field in wanted.columns:
        if field not in QUANTITIES:
            raise LogError(f"{path}: column map: unknown name '{field}'; {nearest(field, QUANTITIES)}")


def column_values(table: Table, column: Column) -> Floats:
    """The values of a column in the package's unit (N,), NaN where a cell is empty."""
    values = table.numbers(column.name)
    problem = contradiction(column.unit, values) if column.known_by in ("assumed", "by its name") else ""
    if column.field in WHEELS and column.known_by == "assumed" and not problem:
        seen = values[np.isfinite(values)]
        problem = "whole numbers are more like counts" if seen.any() and not (seen % 1.0).any() else ""
    if problem:
        others = [unit for unit in UNITS.values() if unit.quantity == column.unit.quantity and unit != column.unit]
        likely = next((unit for unit in others if not contradiction(unit, values)), column.unit)
        remedy = f"state its unit, as in --columns {column.field}={column.name}:{likely.name}"
        if "pulses" in problem:
            remedy = "write such a column into the file"
        elif column.field in WHEELS:
            remedy = (
                f"state its unit, as in --columns {column.field}={column.name}:ticks/4096 (so many a turn), or rad/s"
            )
        elif column.field == "throttle":
            remedy = f"if it is in percent, --columns throttle={column.name}:percent"
        elif column.field == "steering":
            remedy = f"if it is the wheels' angle, import a speed with it: --columns steering_angle={column.name}:deg"
        taken = f"column '{column.name}' as {column.field} in {column.unit.name} ({column.known_by})"
        raise LogError(f"{table.path}: {taken}: {problem}; {remedy}")
    return values * column.unit.factor


def missing(table: Table, fields: Sequence[str]) -> LogError:
    """The complaint about fields that no column was found for."""
    car = {"throttle", "steering", "speed", "steering_angle"} & set(fields)
    example = EXAMPLE.replace("v=cmd_lin,omega=cmd_ang", "throttle=gas,steering=wheel") if car else EXAMPLE
    if len(fields) == 1 and (field := fields[0].split()[0]) in QUANTITIES:
        example = f"--columns {field}=COLUMN"
    lacking = f"no column found for {', '.join(fields)}; its columns are: {', '.join(table.names)}"
    which = "it is" if len(fields) == 1 else "is which"
    return LogError(f"{table.path}: {lacking}; say which {which}, as in {example}")


def with_commands(columns: Columns, kind: str, table: Table) -> tuple[Columns, str]:
    """The columns without those of other commands than the table's, and the kind of these; "" asks for any."""
    kinds = [name for name, pair in COMMANDS.items() if pair and set(pair) <= set(columns) and kind in ("", name)]
    stated = [name for name in kinds if all(columns[field].known_by == "stated" for field in COMMANDS[name])]
    kinds = stated if len(stated) == 1 else kinds
    if len(kinds) > 1:
        either = " or ".join(kinds)
        raise LogError(f"{table.path}: its commands may be {either}; choose one, as in --kind {kinds[0]}")
    if kinds:
        unused = set(COMMAND_FIELDS) - {*COMMANDS[kinds[0]], ENABLED}
        return {field: column for field, column in columns.items() if field not in unused}, kinds[0]
    pairs = [COMMANDS[kind]] if kind in COMMANDS else [pair for pair in COMMANDS.values() if set(pair) & set(columns)]
    lacking = [field for pair in pairs for field in pair if field not in columns]
    raise missing(table, lacking or ["commands (v and omega, or left and right)"])


def named_in(table: Table, entry: str) -> bool:
    """True if an entry of a column map names a column of a table."""
    return entry in table.names or entry.rpartition(":")[0] in table.names


def described(columns: Columns) -> str:
    """The fields with the columns taken for them."""
    return ", ".join(str(column) for column in columns.values())


def channels_of(table: Table, columns: Columns) -> list[Channel]:
    """All columns of a table and what each was taken for."""
    fields = {column.name: column.field for column in columns.values()}
    return [Channel(name, "column", table.filled(name), fields.get(name, "left out")) for name in table.names]


def _stated(table: Table, field: str, entry: str) -> Column:
    where = f"{table.path}: column map: {field}={entry}"
    name, unit = split_unit(entry, QUANTITIES[field], table.names, where)
    if name not in table.names:
        raise LogError(f"{where}: has no column '{name}'; {nearest(name, table.names)}")
    if unit and unit.counted and field not in WHEELS:
        raise LogError(f"{where}: ticks are of a measured wheel, {' or '.join(WHEELS)}; state another unit")
    return Column(field, name, unit, "stated") if unit else _by_ending(field, name)


def _by_ending(field: str, name: str) -> Column:
    _, unit = split_ending(name, QUANTITIES[field])
    return Column(field, name, unit or own_unit(QUANTITIES[field]), "by its name" if unit else "assumed")


def summed(parts: Sequence[Sequence[Channel]]) -> tuple[Channel, ...]:
    """Columns of several files, those of equal name and role as one."""
    counts = Counter[tuple[str, str]]()
    for channel in itertools.chain.from_iterable(parts):
        counts[channel.name, channel.role] += channel.count
    return tuple(Channel(name, "column", count, role) for (name, role), count in counts.items())


LEAST_EXTENT_M = 0.01
"""A drive that stays within this, in a unit that nobody stated, is taken for one in another unit."""


def commands_by_drive(table: Table, columns: Columns, kind: str) -> dict[str, Commands]:
    """The commands of each drive that a table names; of "" where it names none."""
    fields = (*COMMANDS[kind], *((ENABLED,) if ENABLED in columns else ()))
    own_clock = "command_time" in columns
    timed = {**columns, "time": columns["command_time"]} if own_clock else columns
    times, values, labels = _filled_rows(table, timed, fields)
    if own_clock:  # a command stands in every row until the next one
        anew = np.append(True, (np.diff(times) != 0.0) | (np.diff(values, axis=0) != 0.0).any(axis=1))[: len(times)]
        times, values, labels = times[anew], values[anew], labels[anew]
    drives = {}
    for name in dict.fromkeys(map(str, labels)):
        mine = labels == name
        drives[name] = Commands(kind, times[mine], values[mine], in_rows="x" in columns and not own_clock)
        _check_clock(drives[name].times, f"{_where(table, name)}: commands")
    if not drives:
        raise LogError(f"{table.path}: has columns of commands, but no row with one; fill them, or take them out")
    return drives


def pose_fields(table: Table, columns: Columns) -> list[str]:
    """The fields of a pose that the table has, quaternions last."""
    lacking = [field for field in ("time", "x", "y") if field not in columns]
    if "heading" not in columns and not set(QUATERNION) <= set(columns):
        lacking.append("heading (or qx, qy, qz, qw)")
    if lacking:
        raise missing(table, lacking)
    turned = ("heading",) if "heading" in columns else QUATERNION
    return [field for field in POSE if field in columns and field in (*PLACE, *turned)]


def poses_by_drive(table: Table, columns: Columns, *, gaps: bool = False) -> dict[str, Poses]:
    """The poses of each drive that a table names; of "" where it names none.

    With `gaps`, rows that lack part of a pose are left out (`gaps_note` tells of them).
    """
    fields = pose_fields(table, columns)
    times, values, labels = _filled_rows(table, columns, fields, gaps=gaps)
    if not len(times):
        raise LogError(f"{table.path}: has no row with a pose; give the file that the poses were written to")
    by_field = dict(zip(fields, values.T, strict=True))
    places = np.stack([by_field.get(axis, np.zeros(len(times))) for axis in PLACE], axis=1)
    extent = np.ptp(places[:, :2], axis=0).max()
    for column in (columns[axis] for axis in ("x", "y") if columns[axis].known_by == "by its name"):
        # Metres in columns whose names end in mm or cm: the robot would hardly have moved
        if column.unit.factor < 1.0 and 0.0 < extent < LEAST_EXTENT_M:
            taken = f"column '{column.name}' in {column.unit.name}, as its name ends"
            remedy = f"state its unit, as in --columns {column.field}={column.name}:m"
            raise LogError(f"{table.path}: {taken}: the robot moved {extent * 1e3:.2g} mm in all; {remedy}")
    headings, tilts = by_field.get("heading"), np.zeros(len(times))
    if headings is None:
        headings, tilts = headings_and_tilts(values[:, -4:], str(table.path))
    poses = Poses(times, places, headings, tilts)
    drives = {}
    for name in dict.fromkeys(map(str, labels)):
        mine = labels == name
        if mine.sum() < 2:
            raise LogError(f"{_where(table, name)}: has a single pose; a drive needs two or more")
        drives[name] = poses.only(mine)
        _check_clock(drives[name].times, f"{_where(table, name)}: poses")
    return drives


def wheels_by_drive(table: Table, columns: Columns) -> dict[str, Wheels]:
    """The measured wheel speeds of each drive that a table names, where it has them; counts are differentiated."""
    if not set(WHEELS) & set(columns):
        return {}
    if lacking := [field for field in WHEELS if field not in columns]:
        raise missing(table, lacking)
    times, values, labels = _filled_rows(table, columns, WHEELS)
    drives = {}
    for name in dict.fromkeys(map(str, labels)):
        own, first = np.unique(times[labels == name], return_index=True)
        if len(own) < 2:
            raise LogError(f"{_where(table, name)}: has a single row of wheel speeds; a drive needs two or more")
        speeds = [
            _rate(turned, own, columns[field].unit)
            for field, turned in zip(WHEELS, values[labels == name][first].T, strict=True)
        ]
        drives[name] = Wheels(own, np.stack(speeds, axis=1))
    return drives


def _rate(values: Floats, times: Floats, unit: Unit) -> Floats:
    """Speeds (W,), of counted angles [rad] too, whose counter may begin anew."""
    if not unit.counted:
        return values
    around = next((ticks for ticks in COUNTERS if np.ptp(values) < ticks * unit.factor), COUNTERS[-1])
    return np.asarray(np.gradient(np.unwrap(values, period=around * unit.factor), times))


def gaps_note(table: Table, columns: Columns) -> list[str]:
    """Say how many rows lack part of a pose; nothing where none does."""
    fields = pose_fields(table, columns)
    lacks = ~np.isfinite(np.stack([column_values(table, columns[field]) for field in fields], axis=1))
    partly = lacks.any(axis=1) & ~lacks.all(axis=1)
    if not partly.any():
        return []
    row = int(np.argmax(partly))
    first = f"{table.counted} {table.cells.index[row]}, column '{columns[fields[int(np.argmax(lacks[row]))]].name}'"
    count = "1 row lacks" if partly.sum() == 1 else f"{partly.sum()} rows lack"
    return [f"{table.path.name}: {count} part of a pose (first: {first}); it is left out there, commands are kept."]


MOST_GAPS = 0.5
"""Where more of the rows lack part of a pose, a column is wrong."""


def _filled_rows(
    table: Table, columns: Columns, fields: Sequence[str], *, gaps: bool = False
) -> tuple[Floats, Floats, NDArray[np.str_]]:
    """Times, values (M, fields) and drives of the rows in which some fields are given, all of them or none.

    With gaps, rows that lack some are left out, unless they are many.
    """
    if "time" not in columns:
        raise missing(table, ["time"])
    times = column_values(table, columns["time"])
    values = np.stack([column_values(table, columns[field]) for field in fields], axis=1)
    lacking = ~np.isfinite(values)
    rows = ~lacking.all(axis=1)
    if gaps and (rows & lacking.any(axis=1)).sum() <= MOST_GAPS * rows.sum():
        rows &= ~lacking.any(axis=1)
    for field, lacks in zip(("time", *fields), ~np.isfinite(np.column_stack((times, values))).T, strict=True):
        if (lacks & rows).any():
            row = int(np.argmax(lacks & rows))
            others = ", ".join(name for name in ("time", *fields) if name != field)
            raise table.error(row, columns[field].name, f"is empty beside {others}; fill it, or empty those too")
    labels = table.labels(columns["episode"].name) if "episode" in columns else np.full(len(times), "")
    return times[rows], values[rows], labels[rows]


def _check_clock(times: Floats, where: str) -> None:
    if len(times) > 1 and np.ptp(times) == 0.0:
        raise LogError(f"{where}: all {len(times)} stamps are {times[0]:.12g} s; record with a clock that runs")


def _where(table: Table, name: str) -> str:
    return f"{table.path}: drive '{name}'" if name else str(table.path)
