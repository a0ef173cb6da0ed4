"""The UTIAS MRCLAM data set's own files: velocity commands and motion capture of several robots.

K. Y. K. Leung, Y. Halpern, T. D. Barfoot, H. H. T. Liu: The UTIAS multi-robot cooperative localization and mapping
dataset. International Journal of Robotics Research 30 (8), 2011.
"""

import re
from pathlib import Path

from proxytune.errors import LogError
from proxytune.importing.source import Channel, Drive, Source
from proxytune.importing.tables.cells import Table
from proxytune.importing.tables.columns import channels_of, own_columns
from proxytune.importing.tables.measures import commands_by_drive, poses_by_drive
from proxytune.importing.tables.text import read_text_table
from proxytune.importing.wanted import Wanted
from proxytune.settings import nearest

COMMANDS = ("time", "v", "omega")
POSES = ("time", "x", "y", "heading")
FILE = re.compile(r"(Robot\d+)_(Odometry|Groundtruth)\.dat")


def is_mrclam(path: Path) -> bool:
    """Whether this is a file such as Robot1_Odometry.dat or Robot1_Groundtruth.dat, or a folder with some."""
    return bool(FILE.fullmatch(path.name)) if path.is_file() else bool(_robots(path))


def read_mrclam(path: Path, wanted: Wanted) -> Source:
    """Read one robot's commands (Robot1_Odometry.dat) and poses (Robot1_Groundtruth.dat).

    Args:
        path: One of the two files, or the folder; of a folder with several robots `wanted.poses` chooses.
        wanted: What to take; commands "none" leaves them out.

    Raises:
        LogError: If a file is missing or not as the data set writes it, or the robot is not chosen.
    """
    match = FILE.fullmatch(path.name)
    folder, robot = (path.parent, match[1]) if match and not path.is_dir() else (path, _choose(path, wanted.poses))
    table, columns = read_text_table(folder / f"{robot}_Groundtruth.dat", POSES), own_columns(POSES)
    poses = poses_by_drive(table, columns)[""]
    channels = _channels(table, POSES, "poses")
    notes = [f"{robot}: poses from {table.path.name}, in m and rad."]
    commands = None
    if "none" not in (wanted.commands, wanted.kind):
        table = read_text_table(folder / f"{robot}_Odometry.dat", COMMANDS)
        commands = commands_by_drive(table, own_columns(COMMANDS), "twist")[""]
        channels += _channels(table, COMMANDS, "commands")
        notes.append(f"{robot}: commands from {table.path.name}, in m/s and rad/s; the set logs commands there.")
    return Source("MRCLAM data set", (Drive(robot, commands, poses),), tuple(channels), tuple(notes))


def _robots(folder: Path) -> list[str]:
    """Robots of which a folder has both files or one."""
    if not folder.is_dir():
        return []
    matches = (FILE.fullmatch(file.name) for file in sorted(folder.iterdir()))
    return list(dict.fromkeys(match[1] for match in matches if match))


def _choose(folder: Path, robot: str) -> str:
    robots = _robots(folder)
    if not robots:
        raise LogError(f"{folder}: has no file such as Robot1_Groundtruth.dat; give a folder of the MRCLAM data set")
    if robot and robot not in robots:
        raise LogError(f"{folder}: has no robot '{robot}'; {nearest(robot, robots)}")
    if not robot and len(robots) > 1:
        names = ", ".join(robots)
        raise LogError(f"{folder}: has several robots: {names}; choose one, as in --poses {robots[0]}")
    return robot or robots[0]


def _channels(table: Table, fields: tuple[str, ...], role: str) -> list[Channel]:
    return [
        Channel(f"{table.path.name}: {c.name}", c.kind, c.count, role) for c in channels_of(table, own_columns(fields))
    ]
