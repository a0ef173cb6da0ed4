"""The measures of one proxy or several as a file."""

from collections.abc import Mapping
from pathlib import Path

from proxytune.report.scores.table import measured_text
from proxytune.report.table_files import write_csv, write_latex
from proxytune.usefulness import MEASURES, Assessment


def write_scores_table(assessments: Mapping[str, Assessment], path: Path) -> None:
    """Write every measure of every proxy: as CSV a row for each, as LaTeX a row per measure and a column per proxy.

    Raises:
        RunError: If it cannot be written.
    """
    if path.suffix == ".csv":
        columns = ("proxy", "measure", "value", "low", "high", "better")
        write_csv(path, columns, [row for name, one in assessments.items() for row in _figures(name, one)])
    else:
        cells = {name: _texts(one) for name, one in assessments.items()}
        measures = next(iter(cells.values()))
        rows = [(measure, *(texts[measure] for texts in cells.values())) for measure in measures]
        write_latex(path, ("measure", *assessments), rows)


def _figures(proxy: str, assessment: Assessment) -> list[tuple[str | float | None, ...]]:
    return [
        (proxy, measure.key_for(metric), found.value, *(found.interval or (None, None)), measure.better)
        for measure in MEASURES
        for metric, found in measure.measured(assessment).items()
    ]


def _texts(assessment: Assessment) -> dict[str, str]:
    return {
        measure.name_for(metric): measured_text(found)
        for measure in MEASURES
        for metric, found in measure.measured(assessment).items()
    }
