"""`fleet`: θ of several robots of one kind, and p(θ) over them."""

import argparse

from proxytune.api import fleet
from proxytune.cli.options import study_folder, typed
from proxytune.cli.terminal import Answer, waiting
from proxytune.files import check_place
from proxytune.report import fleet_text


def run(arguments: argparse.Namespace) -> Answer:
    """Tell θ of each robot and p(θ) over them; nothing is simulated."""
    if arguments.output:
        check_place(arguments.output, folder=True)
    with waiting("learning θ of each robot"):
        report = fleet(study_folder(arguments.path), arguments.targets)
    written = report.write(arguments.output, typed(arguments)) if arguments.output else ()
    files = dict(zip(("figure", "report"), written, strict=False))
    document = {**report.document(), **{name: str(path) for name, path in files.items()}}
    return Answer(document, fleet_text(report.result, files))
