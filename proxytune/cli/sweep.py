"""`sweep`: usefulness along one parameter, or along each parameter of the study."""

import argparse

from proxytune.api import run_sweep
from proxytune.cli.options import check_made, on_its_cluster, study_folder, typed
from proxytune.cli.terminal import Answer
from proxytune.files import check_place
from proxytune.report import sweep_text


@on_its_cluster
def run(arguments: argparse.Namespace) -> Answer:
    """Simulate what is missing of the sweeps, and draw them."""
    folder = study_folder(arguments.path)
    check_made(folder) if arguments.output is None else check_place(arguments.output, folder=True)
    chosen = {"points": arguments.points, "at": arguments.at, "target_model": arguments.target_model}
    report = run_sweep(folder, arguments.parameter, progress=True, **chosen)
    figures, files = report.write(arguments.output, typed(arguments))
    document = report.document()
    at = document.pop("at")
    paths = {"figures": [str(path) for path in figures], "files": [str(path) for path in files]}
    text = sweep_text(report.curves, report.episodes, [*figures, *files], report.held)
    return Answer(document | paths | {"at": at}, text)
