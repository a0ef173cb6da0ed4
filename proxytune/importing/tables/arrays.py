"""Arrays in an .npz file: those of gym-duckietown's simulator, or any that a column map names."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from proxytune.errors import LogError
from proxytune.importing.source import Channel, Drive, Source
from proxytune.importing.tables.array_files import Arrays, as_table, load_arrays
from proxytune.importing.tables.cells import Table
from proxytune.importing.tables.columns import (
    Columns,
    channels_of,
    check_fields,
    choose_columns,
    column_values,
    command_kind,
    described,
)
from proxytune.importing.tables.fields import COMMAND_FIELDS, POSE
from proxytune.importing.tables.frame_arrays import find_frames, pictures_of
from proxytune.importing.tables.measures import commands_by_drive, poses_by_drive
from proxytune.importing.wanted import Wanted
from proxytune.logs import COMMANDS

ACTIONS = ("actions", "action")
POSITIONS = ("positions", "cur_pos")
ANGLES = ("angles", "cur_angle")


def is_arrays(path: Path) -> bool:
    """Whether this is a file of numpy's: .npz, or .npy, which is refused with a reason."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(512)
    return path.suffix == ".npz" or head.startswith(b"\x93NUMPY") or (head.startswith(b"PK") and b".npy" in head)


def read_arrays(path: Path, wanted: Wanted) -> Source:
    """Read arrays of one length: times, commands, places and headings, maybe frames.

    gym-duckietown's are known by their names: `timestamps`, `actions` (N, 2), `positions` or `cur_pos` (N, 3) and
    `angles` or `cur_angle` (N,) [rad]. Of an array (N, k) a column map names a column as "states[0]".

    Raises:
        LogError: If the file is damaged or holds pickled objects, or arrays are missing or of other lengths.
    """
    check_fields(wanted.columns, str(path))
    arrays = load_arrays(path)
    table = as_table(path, arrays, wanted.columns.get("time", ""))
    _check_wanted(table, arrays, wanted)
    table, gym, notes = _gym_duckietown(table, arrays, wanted)
    columns, kind = _columns(table, gym | dict(wanted.columns), wanted)
    frames = find_frames(path, arrays, wanted.frames, len(table.cells))
    drives = _drives(table, columns, kind, arrays[frames] if frames else None)
    channels = (*channels_of(table, columns), *_other_channels(table, arrays, frames))
    return Source("numpy arrays", tuple(drives), channels, (f"Columns: {described(columns)}.", *notes))


def _check_wanted(table: Table, arrays: Arrays, wanted: Wanted) -> None:
    """Refuse --commands with a name, and arrays for commands and poses of another length than the times."""
    if wanted.commands not in ("", "none"):
        raise LogError(
            f"{table.path}: --commands {wanted.commands}: name arrays by column, as in --columns "
            f"left={wanted.commands}[0],right={wanted.commands}[1]"
        )
    usual = {} if wanted.columns else {name: name for name in (*ACTIONS, *POSITIONS, *ANGLES)}
    if "none" in (wanted.commands, wanted.kind):
        usual = {name: name for name in usual if name not in ACTIONS}
    for field, entry in {**usual, **wanted.columns}.items():
        array = next((name for name in (entry, *(entry.split(mark)[0] for mark in ":[")) if name in arrays), "")
        if array and not any(name == array or name.startswith(f"{array}[") for name in table.names):
            raise LogError(
                f"{table.path}: {field}: array '{array}' is {arrays[array].shape} of {arrays[array].dtype}, "
                f"but there are {len(table.cells)} times; give one number, or a short row of numbers, for each time"
            )


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
    return table, stated, [_gym_note(positions, y, bool(top))]


def _gym_note(positions: str, y: str, measured: bool) -> str:
    origin = "bottom" if measured else "top"
    return (
        f"{positions} are in gym-duckietown's frame (x right, y up, z down the map): here x is {positions}[0], "
        f"y is {y}, z is {positions}[1], so that the origin is the map's {origin} left corner; headings stay"
    )


def _columns(table: Table, stated: Mapping[str, str], wanted: Wanted) -> tuple[Columns, str]:
    """The columns that are used, and the kind of the commands; "none" where none are wanted."""
    none = "none" in (wanted.commands, wanted.kind)
    fields = ("time", "episode", *POSE, *(() if none else COMMAND_FIELDS))
    columns = choose_columns(table, {field: entry for field, entry in stated.items() if field in fields}, fields)
    if none:
        return columns, "none"
    kind = command_kind(columns, wanted.kind, table)
    unused = set(COMMAND_FIELDS) - set(COMMANDS[kind])
    return {field: column for field, column in columns.items() if field not in unused}, kind


def _drives(table: Table, columns: Columns, kind: str, frames: NDArray[np.uint8] | None) -> list[Drive]:
    poses = poses_by_drive(table, columns)
    commands = commands_by_drive(table, columns, kind) if kind != "none" else {}
    labels = table.labels(columns["episode"].name) if "episode" in columns else np.full(len(table.cells), "")
    drives = [Drive(label or table.path.stem, commands.get(label), poses[label]) for label in poses]
    if frames is None:
        return drives
    times = column_values(table, columns["time"])
    pictures = [pictures_of(frames, times, labels == label) for label in poses]
    return [replace(drive, pictures=each) for drive, each in zip(drives, pictures, strict=True)]


def _other_channels(table: Table, arrays: Arrays, frames: str) -> list[Channel]:
    """Arrays that are no columns: frames, and those left out."""
    columns = {name.split("[")[0] for name in table.names}
    others = {name: array for name, array in arrays.items() if name not in columns}
    return [
        Channel(name, f"{array.dtype} {array.shape}", len(array) if array.ndim else 1, _role(name, frames))
        for name, array in others.items()
    ]


def _role(name: str, frames: str) -> str:
    return "frames" if name == frames else "left out: not one number, or short row of numbers, for each time"
