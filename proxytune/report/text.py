"""Views on the terminal: tables without lines, with their headings and notes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.markup import escape
from rich.measure import Measurement, measure_renderables
from rich.table import Table as TerminalTable
from rich.text import Text

from proxytune.report.view import Table

GAP = 2
"""Blanks between columns."""


@dataclass(frozen=True)
class WholeWords:
    """A table in which names, paths and topics stay whole, to be typed; it is wider than the terminal if it has to be.

    Attributes:
        table: The table; its cells are broken at blanks alone.
    """

    table: TerminalTable

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        columns, endless = self.table.columns, options.update(max_width=100_000)
        cells = [
            [measure_renderables(console, endless, [cell]) for cell in (one.header, *one.cells)] for one in columns
        ]
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

    def __rich_measure__(self, console: Console, options: ConsoleOptions) -> Measurement:
        return Measurement.get(console, options, self.table)


def table_text(table: Table, *, ragged: bool = False) -> WholeWords:
    """A table without lines below its title; no word in it is broken, none is shortened.

    Args:
        table: The table; its notes are left out.
        ragged: Whether numbers begin together, as texts do, instead of ending together.
    """
    names = [one.name for one in table.columns]
    shown = TerminalTable(
        title=escape(table.title) if table.title else None,
        title_justify="left",
        title_style="bold",
        box=None,
        pad_edge=False,
        show_header=any(names),
    )
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
    """Parts below each other.

    Args:
        parts: Tables and texts; a text is shown as it is, without markup.
    """
    return Group(*(Text(part) if isinstance(part, str) else part for part in parts))
