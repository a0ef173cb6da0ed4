"""Views on the terminal, tables without lines with their headings and notes; and tables as files, CSV and LaTeX."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.markup import escape
from rich.measure import measure_renderables
from rich.table import Table as TerminalTable
from rich.text import Text

from proxytune.errors import InputError
from proxytune.files import package_table
from proxytune.report.view import Table

GAP = 2
"""Blanks between columns."""


@dataclass(frozen=True)
class WholeWords:
    """A table broken at blanks alone: names and paths stay whole, to be typed, wider than the terminal if need be."""

    table: TerminalTable

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        columns, endless = self.table.columns, options.update(max_width=100_000)
        cells = [[measure_renderables(console, endless, [it]) for it in (one.header, *one.cells)] for one in columns]
        widths = [max(cell.minimum for cell in column) for column in cells]
        left = options.max_width - sum(widths) - GAP * (len(widths) - 1)
        wanted = [max(cell.maximum for cell in column) - width for column, width in zip(cells, widths, strict=True)]
        # The least greedy are served first
        for rank, place in enumerate(sorted(range(len(wanted)), key=wanted.__getitem__)):
            more = max(0, min(wanted[place], left // (len(wanted) - rank)))
            widths[place], left = widths[place] + more, left - more
        for column, width in zip(columns, widths, strict=True):
            column.width = width
        yield from console.render(self.table, options.update(width=sum(widths) + GAP * (len(widths) - 1)))


def table_text(table: Table, *, ragged: bool = False) -> WholeWords:
    """A table without lines and notes below its title, no word broken; ragged numbers begin together, as texts do."""
    names = [one.name for one in table.columns]
    look: dict[str, Any] = {"title_justify": "left", "title_style": "bold", "box": None, "pad_edge": False}
    shown = TerminalTable(title=escape(table.title) if table.title else None, show_header=any(names), **look)
    # Heads of one line stand beside the last line of others.
    vertical: Literal["top", "bottom"] = "bottom" if any("\n" in name for name in names) else "top"
    for one in table.columns:
        justify: Literal["left", "right"] = "right" if one.numbers and not ragged else "left"
        shown.add_column(escape(one.name), justify=justify, vertical=vertical, overflow="fold")
    for row in table.rows:
        shown.add_row(*map(escape, row))
    return WholeWords(shown)


def section_text(table: Table) -> list[RenderableType]:
    """A table with a free line above its title, and its notes below."""
    head = Text(f"\n{table.title}", style="bold")
    return [head, table_text(replace(table, title=""), ragged=True), *note_texts(table.notes)]


def note_texts(notes: Sequence[str]) -> list[Text]:
    """Notes, a line each."""
    return [Text(f"note: {note}") for note in notes]


def file_texts(files: Mapping[str, Any]) -> list[Text]:
    """Paths of files, a line each, after what they are."""
    return [Text(f"{name}: {path}") for name, path in files.items()]


def group_texts(*parts: RenderableType) -> Group:
    """Tables and texts below each other; a text is shown as it is, without markup."""
    return Group(*(Text(part) if isinstance(part, str) else part for part in parts))


ENDINGS = (".csv", ".tex")
IN_LATEX: dict[str, str] = package_table("report/templates/latex.toml")
Cell = str | float | None


def check_table_file(path: Path) -> None:
    """Refuse a file of another kind before anything is worked out."""
    if path.suffix not in ENDINGS:
        raise InputError(f"--table {path}: a table is written as {' or '.join(ENDINGS)}; name the file so")


def latex_text(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    r"""A table as LaTeX, to be taken in by `\input` between `\usepackage{booktabs}` and a caption.

    It has the rules of booktabs; the first column is of names, the others of figures.
    """
    head, *body = (" & ".join(map(in_latex, row)) + r" \\" for row in (columns, *rows))
    lines = [rf"\begin{{tabular}}{{{'l' + 'r' * (len(columns) - 1)}}}", r"\toprule", head, r"\midrule"]
    return "\n".join([*lines, *body, r"\bottomrule", r"\end{tabular}"]) + "\n"


def in_latex(text: str) -> str:
    """A text as LaTeX shows it."""
    return "".join(IN_LATEX.get(character, character) for character in text.strip())
