"""A study's result for people: on the terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from proxytune.report.study.finding import finding_of
from proxytune.report.study.information_table import INFORMATION_COLUMNS, information_rows
from proxytune.report.study.search_rows import search_rows
from proxytune.report.study.theta_table import theta_columns, theta_notes, theta_rows
from proxytune.report.study.usefulness_table import USEFULNESS_COLUMNS, usefulness_notes, usefulness_rows
from proxytune.report.study.verdict import sentence
from proxytune.study import StudyResult

THETA, USEFULNESS, INFORMATION, SEARCH = (
    "Parameters",
    "Usefulness at the best θ (lower is better; 95 % intervals)",
    "What informs each parameter",
    "Search",
)


def study_table(result: StudyResult, spent: str, files: Mapping[str, Any]) -> RenderableType:
    """The result of a study as `study` shows it: one sentence, then one table per subject, a fact a row."""
    theta = _table(theta_columns(result), theta_rows(result))
    usefulness = _table(USEFULNESS_COLUMNS, usefulness_rows(result))
    informed = information_rows(result)
    return Group(
        Text(sentence(finding_of(result))),
        *_group(THETA, theta, theta_notes(result)),
        *_group(USEFULNESS, usefulness, usefulness_notes(result)),
        *(_group(INFORMATION, _table(INFORMATION_COLUMNS, informed)) if informed else []),
        *_group(SEARCH, _table((), [*search_rows(result), ("episodes", spent)])),
        *(Text(f"{name}: {path}") for name, path in files.items()),
    )


def _group(title: str, table: Table, notes: Sequence[str] = ()) -> list[RenderableType]:
    return [Text(f"\n{title}", style="bold"), table, *(Text(f"note: {note}") for note in notes)]


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """A table without lines; names and paths are broken, never shortened."""
    table = Table(box=None, pad_edge=False, show_header=bool(head))
    for name in head or rows[0]:
        table.add_column(name if head else "", overflow="fold")
    for row in rows:
        table.add_row(*map(escape, row))
    return table
