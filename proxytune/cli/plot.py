"""`plot`: draw a study's figures again from study.db; nothing is simulated."""

import argparse
from pathlib import Path
from typing import Any

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
    """Draw the study's own figures, the report and every finished sweep."""
    opened = open_study(arguments.path)
    folder = opened.settings.folder
    with Store.read(folder) as store:
        study = as_stored(opened, store)
        curves = all_curves(study, store)
        only_swept = bool(curves) and not store.trials()
        result = None if only_swept else result_of(study, store)
    figures = draw_curves(curves, folder / "figures")
    document: dict[str, Any] = {}
    if result:
        drawn, report = draw(result, folder)
        figures = [*drawn, *figures]
        document = {**study_document(result), "report": str(report)}
    paths = [str(path) for path in figures]
    return Answer({**document, "figures": paths}, Text("\n".join([*paths, *([document["report"]] if result else [])])))
