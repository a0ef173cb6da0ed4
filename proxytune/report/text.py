"""Views on the terminal: tables without lines, with their headings and notes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table as TerminalTable
from rich.text import Text

from proxytune.report.view import Table


def table_text(table: Table, *, ragged: bool = False) -> TerminalTable:
    """A table without lines below its title; names and paths in it are broken, never shortened.

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
    return shown


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
