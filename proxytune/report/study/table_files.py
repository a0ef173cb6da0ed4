"""A study's tables as files: its trials, its parameters and how useful the proxy is."""

from pathlib import Path

import pandas as pd

from proxytune.report.study.theta_table import theta_columns, theta_rows
from proxytune.report.study.usefulness_table import USEFULNESS_COLUMNS, usefulness_rows
from proxytune.report.table_files import write_latex
from proxytune.report.writing import write_text
from proxytune.study import StudyResult


def write_tables(result: StudyResult, trials: pd.DataFrame, folder: Path) -> list[Path]:
    """Write trials.csv, and as LaTeX parameters.tex and usefulness.tex; their paths.

    Args:
        result: What the study has found.
        trials: One row per trial.
        folder: Where to.

    Raises:
        RunError: If one cannot be written.
    """
    write_text(folder / "trials.csv", trials.to_csv(lineterminator="\n"))
    write_latex(folder / "parameters.tex", theta_columns(result), theta_rows(result))
    figures = [row[:3] for row in usefulness_rows(result)]
    write_latex(folder / "usefulness.tex", USEFULNESS_COLUMNS[:3], figures)
    return [folder / name for name in ("trials.csv", "parameters.tex", "usefulness.tex")]
