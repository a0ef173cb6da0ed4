"""`import`: a bag, a table or a trajectory, made a log."""

import argparse
from collections.abc import Collection, Sequence
from pathlib import Path

from rich.console import Group
from rich.table import Table
from rich.text import Text

from proxytune.api import import_log
from proxytune.cli.options import configure_source, facts_of, wanted_of
from proxytune.cli.terminal import Answer, waiting
from proxytune.importing import Source, Survey

MEASURES = ("drive", "time", "poses", "rate", "jitter", "lost", "gaps", "commands", "answers after")
"""The columns of the table of drives."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the source, the log to write, and what to take."""
    parser.add_argument(
        "source", type=Path, metavar="SOURCE", help="a ROS bag, CSV, TUM, MRCLAM or .npz, file or folder"
    )
    parser.add_argument("output", type=Path, nargs="?", metavar="OUTPUT", help="the log's folder to write [list only]")
    parser.add_argument("--robot", metavar="NAME", help="the robot, of list robots or your own [the log's name]")
    configure_source(parser)


def run(arguments: argparse.Namespace) -> Answer:
    """List what the source holds, and write the log."""
    wanted, facts = wanted_of(arguments), facts_of(arguments)
    with waiting(f"reading {arguments.source}"):
        report = import_log(arguments.source, arguments.output, wanted=wanted, facts=facts)
    return Answer(report.document(), _told(report.source, report.cautions, arguments.output))


def _told(source: Source, cautions: Sequence[str], output: Path | None) -> Group:
    channels = _table(source.form, ("what", "type", "count", "taken for"), {"count"})
    for channel in source.channels:
        channels.add_row(channel.name, channel.kind, str(channel.count), channel.role)
    drives = _table("Drives", MEASURES, {*MEASURES[1:]})
    for one in source.surveys:
        drives.add_row(*_row(one))
    beware = (f"- beware: {line}" for line in cautions)
    notes = Text("\n".join((*beware, *(f"- {note}" for note in source.notes))))
    last = f"next: python -m proxytune diagnose {output}" if output else "give OUTPUT to write the log"
    return Group(channels, Text(), drives, Text(), notes, Text(last))


def _table(title: str, columns: Sequence[str], numbers: Collection[str]) -> Table:
    table = Table(title=title, title_justify="left", box=None, pad_edge=False, header_style="")
    for column in columns:
        table.add_column(column, justify="right" if column in numbers else "left", overflow="fold")
    return table


def _row(one: Survey) -> tuple[str, ...]:
    gaps = f"{one.gaps} to {one.longest_gap_s:.1f} s" if one.gaps else "none"
    lag = "?" if one.lag_s is None else f"{one.lag_s:.2f} s"
    numbers = (f"{one.seconds:.1f} s", str(one.poses), f"{one.poses_hz:.1f} Hz", f"{1e3 * one.jitter_s:.1f} ms")
    return (one.name, *numbers, f"{100.0 * one.lost:.1f} %", gaps, str(one.commands), lag)
