"""`plot`: draw a study's figures again from study.db; nothing is simulated."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from rich.text import Text

from proxytune.cli.answer import Answer
from proxytune.cli.study import draw
from proxytune.cli.sweep import draw_curves
from proxytune.report.study_document import study_document
from proxytune.study.result import result_of
from proxytune.study.run import as_stored
from proxytune.study.store import Store
from proxytune.study.study import open_study
from proxytune.study.sweep import all_curves


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the study."""
    parser.add_argument("path", type=Path, metavar="PATH", help="a study's folder, also while the study runs")


def run(arguments: argparse.Namespace) -> Answer:
    """Draw the convergence figure, the report and every finished sweep."""
    opened = open_study(arguments.path)
    folder = opened.settings.folder
    with Store.read(folder) as store:
        study = as_stored(opened, store)
        result = result_of(study, store)
        curves = all_curves(study, store)
    figures, report = draw(result, folder)
    figures += draw_curves(curves, folder / "figures")
    document = {**study_document(result), "figures": [str(path) for path in figures], "report": str(report)}
    return Answer(document, _shown([*figures, report]))


def _shown(files: Sequence[Path]) -> Text:
    return Text("\n".join(str(path) for path in files))
