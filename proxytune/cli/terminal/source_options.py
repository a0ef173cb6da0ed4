"""The options that say what to take from a bag or a table, alike for every command that reads one."""

import argparse
from pathlib import Path

from proxytune.errors import InputError
from proxytune.importing import Facts, Wanted, finite, read_geometry
from proxytune.logs import COMMANDS


def configure_source(parser: argparse.ArgumentParser) -> None:
    """Add what to take and what only the user knows."""
    group = parser.add_argument_group("a bag, table or trajectory as LOG")
    group.add_argument(
        "--commands", default="", metavar="TOPIC", help="topic or file of the commands, or none [chosen]"
    )
    group.add_argument(
        "--poses", default="", metavar="TOPIC", help="topic of the poses, or PARENT>CHILD of a transform"
    )
    group.add_argument("--pictures", default="", metavar="TOPIC", help="topic of the pictures, or none [chosen]")
    group.add_argument("--stamps", choices=("header", "receive"), default="header", help="whose times count [header]")
    group.add_argument(
        "--columns",
        default="",
        metavar="OURS=THEIRS:UNIT,…",
        help="of a table, as in time=stamp_ns:ns,x=pos_x:mm,heading=yaw:deg,v=cmd_lin,omega=cmd_ang",
    )
    group.add_argument(
        "--kind", choices=[*COMMANDS], default="", help="kind of the commands, where the source is silent"
    )
    group.add_argument(
        "--figure",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="of a robot without a folder: wheel_radius_m, baseline_m, full_speed_m_s (repeat it)",
    )
    group.add_argument("--map", default="", metavar="MAP", help="the map that pictures show, of list maps or a file")
    group.add_argument(
        "--clock-offset", default="", metavar="S", help="seconds that poses are stamped later than commands, or fit"
    )


def wanted_of(arguments: argparse.Namespace) -> Wanted:
    """What to take.

    Raises:
        InputError: If the column map is none.
    """
    return Wanted(
        commands=arguments.commands,
        poses=arguments.poses,
        frames=arguments.pictures,
        stamps=arguments.stamps,
        columns=_columns(arguments.columns),
        kind=arguments.kind,
    )


def facts_of(arguments: argparse.Namespace) -> Facts:
    """What only the user knows.

    Raises:
        InputError: If a figure or the offset is no number.
    """
    offset = arguments.clock_offset
    if offset not in ("", "fit") and finite(offset) is None:
        raise InputError(f"--clock-offset {offset}: give seconds, as in -0.25, or fit")
    road = arguments.map
    road = str(Path(road).resolve()) if road.endswith(".toml") else road
    return Facts(arguments.robot or "", read_geometry(arguments.figure), road, offset)


def _columns(text: str) -> dict[str, str]:
    columns = {}
    for part in (part.strip() for part in text.split(",") if part.strip()):
        ours, equals, theirs = part.partition("=")
        if not (equals and ours.strip() and theirs.strip()):
            raise InputError(f"--columns {part}: write OURS=THEIRS or OURS=THEIRS:UNIT, as in x=pos_x:mm")
        columns[ours.strip()] = theirs.strip()
    return columns
