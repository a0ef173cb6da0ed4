"""CSV files: poses and commands in one table, or in two that are joined by time."""

from dataclasses import dataclass
from pathlib import Path

from proxytune.errors import LogError
from proxytune.importing.source import Channel, Commands, Drive, Source
from proxytune.importing.tables.cells import Table
from proxytune.importing.tables.columns import (
    Columns,
    channels_of,
    check_fields,
    choose_columns,
    command_kind,
    described,
    holds_commands,
    named_in,
    summed,
)
from proxytune.importing.tables.command_files import find_commands, is_named_as_commands, read_commands, share_commands
from proxytune.importing.tables.fields import COMMAND_FIELDS, EXAMPLE, POSE
from proxytune.importing.tables.measures import commands_by_drive, pose_fields, poses_by_drive
from proxytune.importing.tables.text import first_rows, is_number, read_text_table
from proxytune.importing.wanted import Wanted
from proxytune.logs import COMMANDS

SUFFIXES = (".csv", ".tsv")


@dataclass(frozen=True)
class Recording:
    """What one file of poses holds.

    Attributes:
        drives: Its drives.
        labels: What the file calls each; "" where it names none.
        apart: The file that their commands are in; None where they have theirs, or need none.
        channels: Its columns.
        note: What was taken for what.
    """

    drives: tuple[Drive, ...]
    labels: tuple[str, ...]
    apart: Path | None
    channels: tuple[Channel, ...]
    note: str


def is_csv_tables(path: Path) -> bool:
    """Whether this is a table of text with named columns, or a folder of CSV files."""
    if path.is_dir():
        return any(file.suffix.lower() in SUFFIXES for file in path.iterdir())
    if path.suffix.lower() in SUFFIXES:
        return path.is_file()
    rows = first_rows(path)
    if len(rows) < 2 or len(rows[0]) < 2 or len(rows[0]) != len(rows[1]):
        return False
    return not any(map(is_number, rows[0])) and any(map(is_number, rows[1]))


def read_csv_tables(path: Path, wanted: Wanted) -> Source:
    """Read a CSV file, or a folder in which each CSV file is a drive.

    Separators are commas, semicolons, tabs or blanks; lines that begin with # are comments. A command counts as issued
    in each row in which it stands. Commands may be in a second file (`find_commands`).

    Raises:
        LogError: If it cannot be read so, with file, line and column.
    """
    check_fields(wanted.columns, str(path))
    files = _files(path, wanted)
    recordings = [_read_recording(file, wanted, alone=len(files) == 1) for file in files]
    drives, channels, notes = (
        [],
        list(summed([recording.channels for recording in recordings])),
        [recording.note for recording in recordings],
    )
    for apart in dict.fromkeys(recording.apart for recording in recordings):
        mine = [recording for recording in recordings if recording.apart == apart]
        group = [drive for recording in mine for drive in recording.drives]
        if apart:
            commands = read_commands(apart, wanted)
            group = share_commands(commands, group, [label for recording in mine for label in recording.labels])
            channels += commands.channels
            notes.append(commands.note)
        drives += group
    form = "folder of CSV files" if path.is_dir() else "CSV table"
    return Source(form, tuple(drives), tuple(channels), tuple(dict.fromkeys(notes)))


def _files(path: Path, wanted: Wanted) -> list[Path]:
    if not path.is_dir():
        return [path]
    tables = sorted(file for file in path.iterdir() if file.suffix.lower() in SUFFIXES and file.is_file())
    asked_for = {Path(wanted.commands).resolve(), (path / wanted.commands).resolve()} if wanted.commands else set()
    files = [file for file in tables if file.resolve() not in asked_for and not is_named_as_commands(file)]
    if not files:
        raise LogError(f"{path}: has no CSV file with poses; give the folder or the file that they were written to")
    return files


def _read_recording(file: Path, wanted: Wanted, *, alone: bool) -> Recording:
    table = read_text_table(file)
    apart = find_commands(file, wanted)
    columns, kind = _columns(table, wanted, apart)
    poses = poses_by_drive(table, columns)
    commands: dict[str, Commands] = commands_by_drive(table, columns, kind) if kind != "none" else {}
    if commands or wanted.commands == "none":
        apart = None
    for label in commands:
        if label not in poses:
            raise LogError(f"{file}: drive '{label}' has commands but no poses; leave its rows out")
    names = [label if label and alone else "_".join(filter(None, (file.stem, label))) for label in poses]
    drives = tuple(Drive(name, commands.get(label), poses[label]) for name, label in zip(names, poses, strict=True))
    note = f"Columns: {described(columns)}."
    return Recording(drives, tuple(poses), apart, tuple(channels_of(table, columns)), note)


def _columns(table: Table, wanted: Wanted, apart: Path | None) -> tuple[Columns, str]:
    """The columns of a table of poses that are used, and the kind of its commands; "none" where it has none."""
    own = wanted.commands == "" and wanted.kind != "none"
    fields = ("time", "episode", *POSE, *(COMMAND_FIELDS if own else ()))
    stated = {
        field: entry
        for field, entry in wanted.columns.items()
        if field in fields and not (apart and field in COMMAND_FIELDS and not named_in(table, entry))
    }
    columns = choose_columns(table, stated, fields)
    if not own or (apart and not holds_commands(columns)):
        return {field: column for field, column in columns.items() if field not in COMMAND_FIELDS}, "none"
    if not holds_commands(columns):
        pose_fields(table, columns)
        raise LogError(
            f"{table.path}: no column of commands found; its columns are: {', '.join(table.names)}; say which they are "
            f"({EXAMPLE}), name their file (--commands FILE), or leave them out (--commands none)"
        )
    kind = command_kind(columns, wanted.kind, table)
    unused = set(COMMAND_FIELDS) - set(COMMANDS[kind])
    return {field: column for field, column in columns.items() if field not in unused}, kind
