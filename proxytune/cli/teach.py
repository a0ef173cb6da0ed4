"""`teach`: learning curves and PLV, how many target samples each proxy saves."""

import argparse

from proxytune.api import teach
from proxytune.cli.options import check_made, on_its_cluster, study_folder, typed
from proxytune.cli.terminal import Answer
from proxytune.report import teach_text


@on_its_cluster
def run(arguments: argparse.Namespace) -> Answer:
    """Run what is left of the experiment; a finished one is summed up again without training or driving."""
    folder = study_folder(arguments.path)
    check_made(folder)
    report = teach(folder, progress=True)
    figure, page = report.write(typed(arguments))
    document = {**report.document(), "figure": str(figure), "report": str(page)}
    return Answer(document, teach_text(report.experiment, report.prpv, {"figure": figure, "report": page}))
