"""Text files of poses and commands: CSV tables, TUM trajectories and those of the UTIAS MRCLAM data set.

Commands may be in a file of their own; each then belongs to the drive that it names, or during which it was issued.
A TUM trajectory has stamp, place and quaternion in each line, as SLAM and motion capture tools write them. MRCLAM has
velocity commands and motion capture of several robots:

K. Y. K. Leung, Y. Halpern, T. D. Barfoot, H. H. T. Liu: The UTIAS multi-robot cooperative localization and mapping
dataset. International Journal of Robotics Research 30 (8), 2011.
"""

import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from proxytune.errors import LogError
from proxytune.importing.columns import (
    Columns,
    channels_of,
    check_fields,
    choose_columns,
    commands_by_drive,
    described,
    gaps_note,
    named_in,
    own_columns,
    pose_fields,
    poses_by_drive,
    summed,
    wheels_by_drive,
    with_commands,
    with_drives,
)
from proxytune.importing.source import Channel, Commands, Drive, Source, Wanted, told_once
from proxytune.importing.text import COMMAND_FIELDS, EXAMPLE, POSE, Table, first_rows, is_number, read_text_table
from proxytune.logs import COMMANDS, ENABLED, WHEELS
from proxytune.settings import nearest

STEMS = ("commands", "cmd_vel", "cmd")
COMMAND_SUFFIXES = (".csv", ".tsv", ".txt")
CommandsOf = Mapping[str, Commands]
"""The commands of a file by the drive that it names, or "" where it names none."""


def find_commands(path: Path, wanted: Wanted) -> Path | None:
    """The file with the commands of a file of poses, or None.

    It is the one asked for, else the first that lies beside the poses: run1_commands, run1_cmd_vel, run1_cmd for
    run1.csv, then commands, cmd_vel, cmd; each as .csv, .tsv or .txt.
    """
    if wanted.without_commands:
        return None
    if wanted.commands:
        places = (Path(wanted.commands), path.parent / wanted.commands)
        if (found := next((place for place in places if place.is_file()), None)) is None:
            raise LogError(f"{wanted.commands}: no such file of commands; check the path given with --commands")
        return found
    stems = (*(f"{path.stem}_{stem}" for stem in STEMS), *STEMS)
    beside = (path.with_name(stem + suffix) for stem in stems for suffix in COMMAND_SUFFIXES)
    return next((place for place in beside if place != path and place.is_file()), None)


def read_commands(path: Path, wanted: Wanted) -> tuple[CommandsOf, tuple[Channel, ...], str]:
    """Read a file of commands, a table with stamps and the columns of one kind; and say what was taken for them."""
    table = read_text_table(path)
    stated = {ours: entry for ours, entry in wanted.columns.items() if ours in COMMAND_FIELDS or named_in(table, entry)}
    found = choose_columns(table, stated, ("time", "episode", *COMMAND_FIELDS))
    columns, kind = with_commands(found, wanted.kind, table)
    used = {field: columns[field] for field in ("time", "episode", *COMMANDS[kind], ENABLED) if field in columns}
    commands = commands_by_drive(table, used, kind)
    channels = tuple(replace(c, name=f"{path.name}: {c.name}") for c in channels_of(table, used))
    return commands, channels, described(used)


def _commands_notes(said: Sequence[tuple[str, str]]) -> list[str]:
    """Tell what was taken for commands in files of these names, those alike together."""
    files = list(dict.fromkeys(said))
    return [f"Commands of {who}: {columns}." for who, columns in told_once(files, len(files), "files")]


def share_commands(path: Path, known: CommandsOf, drives: Sequence[Drive], labels: Sequence[str]) -> list[Drive]:
    """Give each drive its commands of a file: by name, or by time where the file names no drives.

    A drive may also go by its label, which is what the table of poses calls it.
    """
    unnamed = set(known) == {""} or set(labels) == {""}
    if unnamed and len(known) == 1 and len(drives) == 1:
        return [replace(drives[0], commands=next(iter(known.values())))]
    if set(known) == {""}:
        return _by_time(path, known[""], drives)
    driven = {*labels, *(drive.name for drive in drives)}
    for name in known:
        if name not in driven:
            raise LogError(f"{path}: drive '{name}' has no poses; {nearest(name, driven)}")
    shared = []
    for drive, label in zip(drives, labels, strict=True):
        if (commands := known.get(drive.name) or known.get(label)) is None:
            raise LogError(f"{path}: has no commands for drive '{drive.name}'; add them, or leave its poses out")
        shared.append(replace(drive, commands=commands))
    return shared


def _by_time(path: Path, commands: Commands, drives: Sequence[Drive]) -> list[Drive]:
    """Cut commands where drives begin and end; the one in force at a beginning belongs to the drive."""
    spans = sorted((drive.poses.times.min(), drive.poses.times.max()) for drive in drives)
    if any(end >= begin for (_, end), (begin, _) in itertools.pairwise(spans)):
        overlap = "names no drives, and the drives overlap in time, so that commands cannot be shared out"
        raise LogError(f"{path}: {overlap}; add a column 'episode', or give each drive a file of commands")
    shared = []
    for drive in drives:
        begin, end = drive.poses.times.min(), drive.poses.times.max()
        during = (commands.times >= begin) & (commands.times <= end)
        before = np.flatnonzero(commands.times < begin)
        if len(before):
            during[before[np.argmax(commands.times[before])]] = True
        if not during.any():
            none = f"has no command while '{drive.name}' was driven, {begin:.12g} to {end:.12g} s"
            raise LogError(f"{path}: {none}; check that both files have stamps of one clock")
        own = replace(commands, times=commands.times[during], values=commands.values[during])
        shared.append(replace(drive, commands=own))
    return shared


SUFFIXES = (".csv", ".tsv")


def is_csv_tables(path: Path) -> bool:
    """True for a table of text with named columns, or a folder of CSV files."""
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
    """
    check_fields(path, wanted)
    files = _files(path, wanted)
    recordings = [_read_recording(file, wanted, alone=len(files) == 1) for file in files]
    whole = _together("folder of CSV files" if path.is_dir() else "CSV table", [source for source, *_ in recordings])
    drives, channels = [], [*whole.channels]
    said: list[tuple[str, str]] = []
    for apart in dict.fromkeys(place for *_, place in recordings):
        mine = [(source.drives, labels) for source, labels, place in recordings if place == apart]
        group = [drive for own, _ in mine for drive in own]
        if apart:
            commands, own_channels, columns = read_commands(apart, wanted)
            group = share_commands(apart, commands, group, [label for _, labels in mine for label in labels])
            channels += own_channels
            said.append((apart.name, columns))
        drives += group
    notes = (*whole.notes, *_commands_notes(said))
    return replace(whole, drives=tuple(drives), channels=tuple(channels), notes=notes)


def _together(form: str, parts: Sequence[Source]) -> Source:
    """What several files hold, as one source of this form."""
    return Source(
        form,
        tuple(drive for part in parts for drive in part.drives),
        summed([part.channels for part in parts]),
        tuple(dict.fromkeys(note for part in parts for note in part.notes)),
    )


def _files(path: Path, wanted: Wanted) -> list[Path]:
    if not path.is_dir():
        return [path]
    tables = sorted(file for file in path.iterdir() if file.suffix.lower() in SUFFIXES and file.is_file())
    asked_for = {Path(wanted.commands).resolve(), (path / wanted.commands).resolve()} if wanted.commands else set()
    # A name says that a file holds commands: commands.csv, cmd_vel.csv, run1_commands.csv and so on.
    named = [file for file in tables if any(file.stem == it or file.stem.endswith(f"_{it}") for it in STEMS)]
    files = [file for file in tables if file.resolve() not in asked_for and file not in named]
    if not files:
        raise LogError(f"{path}: has no CSV file with poses; give the folder or the file that they were written to")
    return files


def _read_recording(file: Path, wanted: Wanted, *, alone: bool) -> tuple[Source, tuple[str, ...], Path | None]:
    """A file of poses, what it calls each drive ("": nothing), and the file of their commands, if these lie apart."""
    table = read_text_table(file)
    apart = find_commands(file, wanted)
    columns, kind = _columns(table, wanted, apart)
    columns = with_drives(table, columns)
    poses = poses_by_drive(table, columns, gaps=True)
    commands: dict[str, Commands] = commands_by_drive(table, columns, kind) if kind != "none" else {}
    for label in commands:
        if label not in poses:
            raise LogError(f"{file}: drive '{label}' has commands but no poses; leave its rows out")
    names = [label if label and alone else "_".join(filter(None, (file.stem, label))) for label in poses]
    wheels = wheels_by_drive(table, columns)
    drives = tuple(
        Drive(name, commands.get(label), poses[label], wheels=wheels.get(label))
        for name, label in zip(names, poses, strict=True)
    )
    notes = (f"Columns: {described(columns)}.", *gaps_note(table, columns))
    return Source("", drives, tuple(channels_of(table, columns)), notes), tuple(poses), None if commands else apart


def _columns(table: Table, wanted: Wanted, apart: Path | None) -> tuple[Columns, str]:
    """The columns of a table of poses that are used, and the kind of its commands; "none" where it has none."""
    own = not (wanted.commands or wanted.without_commands)
    fields = ("time", "episode", *POSE, *WHEELS, *(("command_time", *COMMAND_FIELDS) if own else ()))
    stated = {
        field: entry
        for field, entry in wanted.columns.items()
        if field in fields and not (apart and field in COMMAND_FIELDS and not named_in(table, entry))
    }
    columns = choose_columns(table, stated, fields)
    found = set(COMMAND_FIELDS) & set(columns) - {ENABLED}
    if not found and "command_time" in wanted.columns:
        none = "command_time is the clock of commands in the same table, which has none"
        raise LogError(f"{table.path}: {none}; leave it out")
    if not own or (apart and not found):
        return {field: column for field, column in columns.items() if field not in COMMAND_FIELDS}, "none"
    if not found:
        pose_fields(table, columns)
        none = f"no column of commands found; its columns are: {', '.join(table.names)}; say which they are ({EXAMPLE})"
        raise LogError(f"{table.path}: {none}, name their file (--commands FILE), or leave them out (--commands none)")
    return with_commands(columns, wanted.kind, table)


MRCLAM_COMMANDS = ("time", "v", "omega")
MRCLAM_POSES = ("time", "x", "y", "heading")
FILE = re.compile(r"(Robot\d+)_(Odometry|Groundtruth)\.dat")


def is_mrclam(path: Path) -> bool:
    """True for a file such as Robot1_Odometry.dat or Robot1_Groundtruth.dat, or a folder with some."""
    return bool(FILE.fullmatch(path.name)) if path.is_file() else bool(_robots(path))


def read_mrclam(path: Path, wanted: Wanted) -> Source:
    """Read one robot's commands (Robot1_Odometry.dat) and poses (Robot1_Groundtruth.dat).

    The path is one of the two files, or the folder; of a folder with several robots `wanted.poses` chooses.
    """
    match = FILE.fullmatch(path.name)
    folder, robot = (path.parent, match[1]) if match and not path.is_dir() else (path, wanted.poses)
    if folder == path:
        robots = _robots(folder)
        if robot and robot not in robots:
            raise LogError(f"{path}: has no robot '{robot}'; {nearest(robot, robots)}")
        if not robot and len(robots) > 1:
            names = ", ".join(robots)
            raise LogError(f"{path}: has several robots: {names}; choose one, as in --poses {robots[0]}")
        robot = robot or robots[0]
    table, columns = read_text_table(folder / f"{robot}_Groundtruth.dat", MRCLAM_POSES), own_columns(MRCLAM_POSES)
    poses = poses_by_drive(table, columns)[""]
    channels = _channels(table, MRCLAM_POSES, "poses")
    notes = [f"{robot}: poses from {table.path.name}, in m and rad."]
    commands = None
    if not wanted.without_commands:
        table = read_text_table(folder / f"{robot}_Odometry.dat", MRCLAM_COMMANDS)
        commands = commands_by_drive(table, own_columns(MRCLAM_COMMANDS), "twist")[""]
        channels += _channels(table, MRCLAM_COMMANDS, "commands")
        notes.append(f"{robot}: commands from {table.path.name}, in m/s and rad/s; the set logs commands there.")
    return Source("MRCLAM data set", (Drive(robot, commands, poses),), tuple(channels), tuple(notes))


def _robots(folder: Path) -> list[str]:
    """Robots of which a folder has both files or one."""
    if not folder.is_dir():
        return []
    matches = (FILE.fullmatch(file.name) for file in sorted(folder.iterdir()))
    return list(dict.fromkeys(match[1] for match in matches if match))


def _channels(table: Table, fields: tuple[str, ...], role: str) -> list[Channel]:
    own = channels_of(table, own_columns(fields))
    return [replace(one, name=f"{table.path.name}: {one.name}", role=role) for one in own]


COLUMNS = ("time", *(field for field in POSE if field != "heading"))


def is_tum(path: Path) -> bool:
    """True for a text file of eight numbers a line, or named .tum; or a folder of such named files."""
    if path.is_dir():
        return any(path.glob("*.tum"))
    if path.suffix.lower() == ".tum":
        return path.is_file()
    rows = first_rows(path)
    return bool(rows) and all(len(row) == len(COLUMNS) and all(map(is_number, row)) for row in rows)


def read_tum(path: Path, wanted: Wanted) -> Source:
    """Read TUM trajectories, a drive each, and the commands of each from a second file (`find_commands`)."""
    check_fields(path, wanted)
    if stated := [field for field in WHEELS if field in wanted.columns]:
        raise LogError(
            f"{path}: {stated[0]}: a TUM file holds no wheel speeds; write poses and wheels into a CSV table"
        )
    said: list[tuple[str, str]] = []
    parts = [_read_one(file, wanted, said) for file in (sorted(path.glob("*.tum")) if path.is_dir() else [path])]
    whole = _together(f"{len(parts)} TUM trajectories" if len(parts) > 1 else "TUM trajectory", parts)
    return replace(whole, notes=(*whole.notes, *_commands_notes(said)))


def _read_one(path: Path, wanted: Wanted, said: list[tuple[str, str]]) -> Source:
    """One trajectory as a drive; what was taken for its commands joins what is said of files."""
    table = read_text_table(path, COLUMNS)
    columns = own_columns(COLUMNS)
    drive = Drive(path.stem, None, poses_by_drive(table, columns)[""])
    source = Source("TUM trajectory", (drive,), tuple(channels_of(table, columns)), (f"Poses: {described(columns)}.",))
    if wanted.without_commands:
        return source
    if (file := find_commands(path, wanted)) is None:
        lay = f"lay {path.stem}_commands.csv (time, v, omega) beside it, name another file with --commands FILE"
        none = "or write --commands none for a log without them"
        raise LogError(f"{path}: a TUM file holds no commands; {lay}, {none}")
    commands, channels, taken = read_commands(file, wanted)
    said.append((file.name, taken))
    shared = tuple(share_commands(file, commands, [drive], [""]))
    return replace(source, drives=shared, channels=(*source.channels, *channels))
