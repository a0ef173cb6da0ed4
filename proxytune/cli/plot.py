"""`plot`: draw a study's figures again from study.db, also with other metrics; nothing is simulated."""

import argparse
import re
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from proxytune import report, study
from proxytune.api import StudyReport, read_families
from proxytune.cli.options import typed
from proxytune.cli.study import families_answer
from proxytune.cli.terminal import Answer
from proxytune.scores import Metric
from proxytune.storage import Store
from proxytune.sweep import all_curves

RESCORED = "rescored"


def run(arguments: argparse.Namespace) -> Answer:
    """Draw the figures of study and sweeps, and write report and tables; of other metrics into a folder of theirs."""
    metrics = [Metric.parse(text) for text in arguments.metric]
    settings = study.read_study_settings(arguments.path)
    if settings.families and not metrics:
        return families_answer(read_families(settings.path), {})
    settings.check_single()
    with Store.read(settings.home) as store:
        run = study.open_read_only(settings, store)
        curves = all_curves(run.of(study.with_metrics(run.study, metrics)) if metrics else run)
        result = None
        if not curves:
            settings.check_theta()
        searched = settings.objective != study.LEARNING and store.trials(run.study.objective.name)
        if searched or not curves:  # Sweeps alone make no study
            result = study.rescored(run, metrics) if metrics else study.result_of(run)
    names = [re.sub(r"[^\w.-]+", "_", str(metric).replace("%", "percent")) for metric in metrics]
    folder = settings.home / RESCORED / "+".join(names) if names else settings.home
    drawn = report.figures_of_sweep(curves, run.study.truth)
    figures = report.save_figures(drawn, folder / "figures")
    shown = result.study.settings if result else settings
    latest, command = list({report.curve_name(curve): curve for curve in curves}.values()), typed(arguments)
    pages = []
    for alike in report.held_alike(latest):
        held = report.held_values(alike)
        pages.append(str(report.write_sweep_page(shown, alike, drawn, folder / "figures", held, command)))
    document: dict[str, Any] = {}
    if result:
        found = StudyReport(result, study.Spent())
        own_figures, page = found.write(folder, command if metrics else "")
        figures = [*own_figures, *figures]
        tables = [str(path) for path in report.write_study_tables(result, found.trials(), folder / "figures")]
        document = {**report.study_document(result), "report": str(page), "tables": tables}
    paths = [str(path) for path in figures]
    written = [*paths, *pages, *document.get("tables", ()), *filter(None, [document.get("report")])]
    text: RenderableType = Text("\n".join(written))
    if result and metrics:
        named = ", ".join(str(metric) for metric in shown.metrics)
        note = f"none run; scored with {named}; the trials are still those that the study's own metrics led to"
        text = Group(report.study_text(result, note, {}), text)
    return Answer({**document, "figures": paths, "pages": pages}, text)
