"""TUM trajectories: stamp, place and quaternion in each line, as SLAM and motion capture tools write them."""

from dataclasses import replace
from pathlib import Path

from proxytune.errors import LogError
from proxytune.importing.source import Drive, Source
from proxytune.importing.tables.columns import channels_of, check_fields, described, own_columns, summed
from proxytune.importing.tables.command_files import find_commands, read_commands, share_commands
from proxytune.importing.tables.fields import PLACE, QUATERNION
from proxytune.importing.tables.measures import poses_by_drive
from proxytune.importing.tables.text import first_rows, is_number, read_text_table
from proxytune.importing.wanted import Wanted

COLUMNS = ("time", *PLACE, *QUATERNION)


def is_tum(path: Path) -> bool:
    """Whether this is a text file of eight numbers a line, or named .tum; or a folder of such named files."""
    if path.is_dir():
        return any(_files(path))
    if path.suffix.lower() == ".tum":
        return path.is_file()
    rows = first_rows(path)
    return bool(rows) and all(len(row) == len(COLUMNS) and all(map(is_number, row)) for row in rows)


def _files(path: Path) -> list[Path]:
    """The trajectories: the file itself, or those of a folder."""
    return sorted(path.glob("*.tum")) if path.is_dir() else [path]


def read_tum(path: Path, wanted: Wanted) -> Source:
    """Read TUM trajectories, a drive each, and the commands of each from a second file (`find_commands`).

    Raises:
        LogError: If a line is not stamp, place and quaternion, or there are no commands and none were not asked for.
    """
    check_fields(wanted.columns, str(path))
    parts = [_read_one(file, wanted) for file in _files(path)]
    return replace(
        parts[0],
        form=f"{len(parts)} TUM trajectories" if len(parts) > 1 else parts[0].form,
        drives=tuple(drive for part in parts for drive in part.drives),
        channels=summed([part.channels for part in parts]),
        notes=tuple(dict.fromkeys(note for part in parts for note in part.notes)),
    )


def _read_one(path: Path, wanted: Wanted) -> Source:
    table = read_text_table(path, COLUMNS)
    columns = own_columns(COLUMNS)
    drive = Drive(path.stem, None, poses_by_drive(table, columns)[""])
    source = Source("TUM trajectory", (drive,), tuple(channels_of(table, columns)), (f"Poses: {described(columns)}.",))
    if "none" in (wanted.commands, wanted.kind):
        return source
    file = find_commands(path, wanted)
    if file is None:
        raise LogError(
            f"{path}: a TUM file holds no commands; lay {path.stem}_commands.csv (time, v, omega) beside it, name "
            "another file with --commands FILE, or write --commands none for a log without them"
        )
    commands = read_commands(file, wanted)
    return replace(
        source,
        drives=tuple(share_commands(commands, [drive], [""])),
        channels=(*source.channels, *commands.channels),
        notes=(*source.notes, commands.note),
    )
