"""`export`: what was found, for other simulators, into a user's own files, or for the robot; a study's trials."""

import argparse

from rich.console import Group
from rich.text import Text

from proxytune.api import TRIALS, export
from proxytune.cli.terminal import Answer
from proxytune.files import check_place
from proxytune.report import IN_WHEELS


def run(arguments: argparse.Namespace) -> Answer:
    """Write the file, and say what went where and what has no place."""
    check_place(arguments.output)
    wheels, has = (tuple(filter(None, given.split(","))) for given in (arguments.wheels, arguments.has))
    report = export(arguments.model, arguments.output, to=arguments.to, into=arguments.into, wheels=wheels, has=has)
    cautions = (f"beware: {line}" for line in report.facts.get("cautions", ()))
    lines = [*cautions, *map(str, report.lines), str(arguments.output)]
    if arguments.to in TRIALS:
        lines.insert(0, f"{report.facts['trials']} trials of '{report.facts['name']}'")
    if arguments.to == "optuna":
        lines.append(f"look: optuna-dashboard sqlite:///{arguments.output}")
    said = Text("\n".join(lines))
    if arguments.into is None:
        return Answer(report.document(), said)
    diff = report.facts["diff"] or f"{arguments.into}: nothing in it has to change\n"
    rest = f"--to filter --has {','.join(IN_WHEELS)} --output cmd_vel_filter.py"
    then = f"the filter for the rest: proxytune export {arguments.model} {rest}"
    return Answer(report.document(), Group(Text(diff, no_wrap=True, overflow="ignore"), said, Text(then)))
