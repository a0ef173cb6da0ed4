"""`import`: a bag, a table or a trajectory, made a log."""

import argparse

from rich.console import Group
from rich.text import Text

from proxytune.api import import_log
from proxytune.cli.options import facts_of, wanted_of
from proxytune.cli.terminal import Answer, waiting
from proxytune.files import check_place
from proxytune.importing import Survey
from proxytune.report import Column, Table, columns_of, percent, table_text

MEASURES = ("drive", "time", "poses", "rate", "jitter", "lost", "gaps", "commands", "answers after")
"""The columns of the table of drives."""


def run(arguments: argparse.Namespace) -> Answer:
    """List what the source holds, and write the log."""
    if arguments.output is not None:
        check_place(arguments.output, folder=True)
    wanted, facts = wanted_of(arguments), facts_of(arguments)
    with waiting(f"reading {arguments.source}"):
        report = import_log(arguments.source, arguments.output, wanted=wanted, facts=facts)
    source, output = report.source, arguments.output
    rows = tuple((one.name, one.kind, str(one.count), one.role) for one in source.channels)
    columns = (Column("what"), Column("type"), Column("count", numbers=True), Column("taken for"))
    channels = table_text(Table(source.form, columns, rows))
    drives = table_text(Table("Drives", columns_of(MEASURES[:1], MEASURES[1:]), tuple(map(_row, source.surveys))))
    beware = (f"- beware: {line}" for line in report.cautions)
    notes = Text("\n".join((*beware, *(f"- {note}" for note in source.notes))))
    last = f"next: python -m proxytune diagnose {output}" if output else "give OUTPUT to write the log"
    return Answer(report.document(), Group(channels, Text(), drives, Text(), notes, Text(last)))


def _row(one: Survey) -> tuple[str, ...]:
    gaps = f"{one.gaps} to {one.longest_gap_s:.1f} s" if one.gaps else "none"
    lag = "?" if one.lag_s is None else f"{one.lag_s:.2f} s"
    numbers = (f"{one.seconds:.1f} s", str(one.poses), f"{one.poses_hz:.1f} Hz", f"{1e3 * one.jitter_s:.1f} ms")
    return (one.name, *numbers, percent(one.lost), gaps, str(one.commands), lag)
