"""Commands in a file of their own: which file, what is in it, and which drive each command belongs to."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from proxytune.errors import LogError
from proxytune.importing.source import Channel, Commands, Drive
from proxytune.importing.tables.columns import channels_of, choose_columns, command_kind, described, named_in
from proxytune.importing.tables.fields import COMMAND_FIELDS
from proxytune.importing.tables.measures import commands_by_drive
from proxytune.importing.tables.text import read_text_table
from proxytune.importing.wanted import Wanted
from proxytune.logs import COMMANDS
from proxytune.settings import nearest

STEMS = ("commands", "cmd_vel", "cmd")
SUFFIXES = (".csv", ".tsv", ".txt")


@dataclass(frozen=True)
class CommandFile:
    """What a file of commands holds.

    Attributes:
        path: The file.
        commands: The commands by the drive that the file names; of "" where it names none.
        channels: Its columns.
        note: What was taken for what.
    """

    path: Path
    commands: Mapping[str, Commands]
    channels: tuple[Channel, ...]
    note: str


def is_named_as_commands(path: Path) -> bool:
    """Whether a file's name says that it holds commands: commands.csv, cmd_vel.csv, run1_commands.csv and so on."""
    return path.suffix.lower() in SUFFIXES and any(
        path.stem == stem or path.stem.endswith(f"_{stem}") for stem in STEMS
    )


def find_commands(path: Path, wanted: Wanted) -> Path | None:
    """The file with the commands of a file of poses, or None.

    It is the one asked for, else the first that lies beside the poses: run1_commands, run1_cmd_vel, run1_cmd for
    run1.csv, then commands, cmd_vel, cmd; each as .csv, .tsv or .txt.

    Raises:
        LogError: If the one asked for is not there.
    """
    if wanted.commands == "none" or wanted.kind == "none":
        return None
    if wanted.commands:
        places = (Path(wanted.commands), path.parent / wanted.commands)
        found = next((place for place in places if place.is_file()), None)
        if found is None:
            raise LogError(f"{wanted.commands}: no such file of commands; check the path given with --commands")
        return found
    stems = (*(f"{path.stem}_{stem}" for stem in STEMS), *STEMS)
    beside = (path.with_name(stem + suffix) for stem in stems for suffix in SUFFIXES)
    return next((place for place in beside if place != path and place.is_file()), None)


def read_commands(path: Path, wanted: Wanted) -> CommandFile:
    """Read a file of commands: a table with stamps and the columns of one kind of command.

    Raises:
        LogError: If it is not such a table.
    """
    table = read_text_table(path)
    stated = {
        field: entry for field, entry in wanted.columns.items() if field in COMMAND_FIELDS or named_in(table, entry)
    }
    columns = choose_columns(table, stated, ("time", "episode", *COMMAND_FIELDS))
    kind = command_kind(columns, wanted.kind, table)
    used = {field: columns[field] for field in ("time", "episode", *COMMANDS[kind]) if field in columns}
    commands = commands_by_drive(table, used, kind)
    channels = tuple(replace(c, name=f"{path.name}: {c.name}") for c in channels_of(table, used))
    return CommandFile(path, commands, channels, f"Commands of {path.name}: {described(used)}.")


def share_commands(file: CommandFile, drives: Sequence[Drive], labels: Sequence[str]) -> list[Drive]:
    """Give each drive its commands: by name, or by time where the file names no drives.

    Args:
        file: The commands.
        drives: The drives, without commands.
        labels: What the table of poses calls each; a drive may go by either name.

    Raises:
        LogError: If commands and drives do not match.
    """
    unnamed = set(file.commands) == {""} or set(labels) == {""}
    if unnamed and len(file.commands) == 1 and len(drives) == 1:
        return [replace(drives[0], commands=next(iter(file.commands.values())))]
    if set(file.commands) == {""}:
        return _by_time(file, drives)
    known = {*labels, *(drive.name for drive in drives)}
    for name in file.commands:
        if name not in known:
            raise LogError(f"{file.path}: drive '{name}' has no poses; {nearest(name, known)}")
    return [_by_name(file, drive, label) for drive, label in zip(drives, labels, strict=True)]


def _by_name(file: CommandFile, drive: Drive, label: str) -> Drive:
    commands = file.commands.get(drive.name) or file.commands.get(label)
    if commands is None:
        raise LogError(f"{file.path}: has no commands for drive '{drive.name}'; add them, or leave its poses out")
    return replace(drive, commands=commands)


def _by_time(file: CommandFile, drives: Sequence[Drive]) -> list[Drive]:
    """Cut commands where drives begin and end; the one in force at a beginning belongs to the drive."""
    spans = sorted((drive.poses.times.min(), drive.poses.times.max()) for drive in drives)
    if any(end >= begin for (_, end), (begin, _) in itertools.pairwise(spans)):
        raise LogError(
            f"{file.path}: names no drives, and the drives overlap in time, so that commands cannot be shared out; "
            "add a column 'episode', or give each drive a file of commands"
        )
    return [replace(drive, commands=_within(file, drive)) for drive in drives]


def _within(file: CommandFile, drive: Drive) -> Commands:
    commands, times = file.commands[""], drive.poses.times
    during = (commands.times >= times.min()) & (commands.times <= times.max())
    before = np.flatnonzero(commands.times < times.min())
    if len(before):
        during[before[np.argmax(commands.times[before])]] = True
    if not during.any():
        raise LogError(
            f"{file.path}: has no command while '{drive.name}' was driven, {times.min():.12g} to {times.max():.12g} s; "
            "check that both files have stamps of one clock"
        )
    return replace(commands, times=commands.times[during], values=commands.values[during])
