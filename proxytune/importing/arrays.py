"""Arrays in an .npz file: those of gym-duckietown's simulator, or any that a column map names.

All arrays as long as the times become columns of one table, which is then read as any other; one of four dimensions may
hold the frames.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from proxytune import unpacking
from proxytune.errors import InputError, LogError
from proxytune.importing.columns import (
    Columns,
    channels_of,
    check_fields,
    choose_columns,
    column_values,
    commands_by_drive,
    described,
    poses_by_drive,
    usual_names,
    wheels_by_drive,
    with_commands,
)
from proxytune.importing.source import Channel, Drive, Pictures, Source, Wanted
from proxytune.importing.text import COMMAND_FIELDS, POSE, Table
from proxytune.logs import COMMANDS, WHEELS
from proxytune.settings import nearest

Arrays = Mapping[str, NDArray[Any]]
WIDEST = 16
"""An array of more columns is neither commands nor poses."""


def load_arrays(path: Path) -> Arrays:
    """Read every array of an .npz file that does not unpack to more than is allowed."""
    try:
        arrays = unpacking.read_arrays(path)
    except InputError:
        raise
    except Exception as problem:  # A damaged file fails in many ways: zipfile's, zlib's and numpy's own.
        if "pickle" in str(problem):
            raise LogError(f"{path}: holds pickled objects; save plain arrays of numbers with numpy.savez") from None
        raise LogError(f"{path}: is damaged, or no .npz file; save the arrays again with numpy.savez") from None
    if not arrays:
        raise LogError(f"{path}: holds no named arrays; save them with numpy.savez(file, times=…, actions=…, …)")
    return arrays


def as_table(path: Path, arrays: Arrays, times: str) -> Table:
    """The arrays that are as long as the times, as a table: states[0], states[1] are columns of `states`.

    An array `actions` that is one shorter, as no action follows the last pose, ends with an empty row. The entry of a
    column map says which are the times, if it is not "".
    """
    named = [name for name in (times, times.rpartition(":")[0]) if name in arrays]
    names = named if times else usual_names("time", list(arrays))
    if len(names) != 1 or arrays[names[0]].ndim != 1:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        unclear = f"which array (N,) holds the times is not clear; its arrays are: {shapes}"
        raise LogError(f"{path}: {unclear}; say it, as in --columns time=timestamps:s")
    count = len(arrays[names[0]])
    if not count:
        raise LogError(f"{path}: its arrays are empty; record a drive")
    columns: dict[str, NDArray[Any]] = {}
    for name, array in arrays.items():
        if name.startswith("action") and array.ndim == 2 and len(array) == count - 1 and array.dtype.kind in "iuf":
            array = np.vstack((array, np.full((1, array.shape[1]), np.nan)))
        columns |= _flattened(name, array, count)
    return Table(path, pd.DataFrame(columns, index=range(1, count + 1)), "row")


def _flattened(name: str, array: NDArray[Any], count: int) -> dict[str, NDArray[Any]]:
    """The columns of an array; none where it is of another length or does not hold numbers."""
    kinds = "iufU" if array.ndim == 1 else "iuf"
    if array.ndim not in (1, 2) or len(array) != count or array.dtype.kind not in kinds:
        return {}
    if array.ndim == 1:
        return {name: array}
    if array.shape[1] == 1:
        return {name: array[:, 0]}
    return {f"{name}[{place}]": column for place, column in enumerate(array.T)} if array.shape[1] <= WIDEST else {}


USUAL = ("observations", "frames", "images", "obs")
SHAPE = "frames must be (N, rows, columns, 3) of uint8, as many as there are times"


def find_frames(path: Path, arrays: Mapping[str, NDArray[Any]], wanted: str, count: int) -> str:
    """The name of the array of so many frames; what is wanted may be "none", or "" for whichever is there."""
    if wanted == "none":
        return ""
    if wanted and wanted not in arrays:
        raise LogError(f"{path}: has no array '{wanted}'; {nearest(wanted, arrays)}")
    if wanted and not _is_frames(arrays[wanted], count):
        array = arrays[wanted]
        raise LogError(f"{path}: array '{wanted}' is {array.shape} of {array.dtype}; {SHAPE}")
    return wanted or next((name for name in USUAL if name in arrays and _is_frames(arrays[name], count)), "")


def _is_frames(array: NDArray[Any], count: int) -> bool:
    return array.ndim == 4 and len(array) == count and array.shape[-1] == 3 and array.dtype == np.uint8


ACTIONS = ("actions", "action")
POSITIONS = ("positions", "cur_pos")
ANGLES = ("angles", "cur_angle")


def is_arrays(path: Path) -> bool:
    """True for a file of numpy's: .npz, or .npy, which is refused with a reason."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(512)
    return path.suffix == ".npz" or head.startswith(b"\x93NUMPY") or (head.startswith(b"PK") and b".npy" in head)


def read_arrays(path: Path, wanted: Wanted) -> Source:
    """Read arrays of one length: times, commands, places and headings, maybe frames.

    gym-duckietown's are known by their names: `timestamps`, `actions` (N, 2), `positions` or `cur_pos` (N, 3) and
    `angles` or `cur_angle` (N,) [rad]. Of an array (N, k) a column map names a column as "states[0]".
    """
    check_fields(path, wanted)
    arrays = load_arrays(path)
    table = as_table(path, arrays, wanted.columns.get("time", ""))
    _check_wanted(table, arrays, wanted)
    table, gym, notes = _gym_duckietown(table, arrays, wanted)
    none = wanted.without_commands
    fields = ("time", "episode", *POSE, *WHEELS, *(() if none else ("command_time", *COMMAND_FIELDS)))
    stated = {field: entry for field, entry in (gym | dict(wanted.columns)).items() if field in fields}
    columns: Columns = choose_columns(table, stated, fields)
    columns, kind = (columns, "none") if none else with_commands(columns, wanted.kind, table)
    frames = find_frames(path, arrays, wanted.frames, len(table.cells))
    drives = _drives(table, columns, kind, arrays[frames] if frames else None)
    known, role = {name.split("[")[0] for name in table.names}, dict.fromkeys(filter(None, [frames]), "frames")
    out = "left out: not one number, or short row of numbers, for each time"
    others = (
        Channel(name, f"{array.dtype} {array.shape}", len(array) if array.ndim else 1, role.get(name, out))
        for name, array in arrays.items()
        if name not in known
    )
    channels = (*channels_of(table, columns), *others)
    return Source("numpy arrays", tuple(drives), channels, (f"Columns: {described(columns)}.", *notes))


def _check_wanted(table: Table, arrays: Arrays, wanted: Wanted) -> None:
    """Refuse --commands with a name, and arrays for commands and poses of another length than the times."""
    if wanted.commands not in ("", "none"):
        example = f"--columns left={wanted.commands}[0],right={wanted.commands}[1]"
        raise LogError(f"{table.path}: --commands {wanted.commands}: name arrays by column, as in {example}")
    usual = (*(() if wanted.without_commands else ACTIONS), *POSITIONS, *ANGLES)
    for field, entry in (wanted.columns or {name: name for name in usual}).items():
        array = next((name for name in (entry, *(entry.split(mark)[0] for mark in ":[")) if name in arrays), "")
        if array and not any(name == array or name.startswith(f"{array}[") for name in table.names):
            other = f"is {arrays[array].shape} of {arrays[array].dtype}, but there are {len(table.cells)} times"
            remedy = "give one number, or a short row of numbers, for each time"
            raise LogError(f"{table.path}: {field}: array '{array}' {other}; {remedy}")


def _gym_duckietown(table: Table, arrays: Arrays, wanted: Wanted) -> tuple[Table, dict[str, str], list[str]]:
    """A table with gym-duckietown's y turned upwards, its columns by field, and what is to be said of it."""
    names = [next((name for name in usual if name in arrays), "") for usual in (ACTIONS, POSITIONS, ANGLES)]
    actions, positions, angles = names
    if {"x", "y"} & set(wanted.columns) or not {f"{positions}[2]", angles} <= set(table.names):
        return table, {}, []
    height = arrays.get("map_height")
    top = float(height) if height is not None and height.ndim == 0 and height.dtype.kind in "iuf" else 0.0
    y = f"-{positions}[2]" if top == 0.0 else f"map_height-{positions}[2]"
    table = replace(table, cells=table.cells.assign(**{y: top - table.numbers(f"{positions}[2]")}))
    stated = {"x": f"{positions}[0]:m", "y": f"{y}:m", "z": f"{positions}[1]:m", "heading": f"{angles}:rad"}
    pair = COMMANDS.get(wanted.kind or "duty", ())
    if f"{actions}[1]" in table.names:
        stated |= {field: f"{actions}[{place}]" for place, field in enumerate(pair)}
    note = (
        f"{positions} are in gym-duckietown's frame (x right, y up, z down the map): here x is {positions}[0], y is "
        f"{y}, z is {positions}[1], so that the origin is the map's {'bottom' if top else 'top'} left corner; "
        "headings stay"
    )
    return table, stated, [note]


def _drives(table: Table, columns: Columns, kind: str, frames: NDArray[np.uint8] | None) -> list[Drive]:
    poses = poses_by_drive(table, columns)
    commands = commands_by_drive(table, columns, kind) if kind != "none" else {}
    labels = table.labels(columns["episode"].name) if "episode" in columns else np.full(len(table.cells), "")
    wheels = wheels_by_drive(table, columns)
    drives = [
        Drive(label or table.path.stem, commands.get(label), poses[label], wheels=wheels.get(label)) for label in poses
    ]
    if frames is None:
        return drives
    times = column_values(table, columns["time"])
    rows = [np.flatnonzero((labels == label) & np.isfinite(times)) for label in poses]

    def read(numbers: NDArray[np.intp]) -> Iterator[NDArray[np.uint8]]:
        return (frames[number] for number in numbers)

    pictures = [Pictures(times[numbers], partial(read, numbers)) for numbers in rows]
    return [replace(drive, pictures=each) for drive, each in zip(drives, pictures, strict=True)]
