"""Tables of a page as HTML, and those of the terminal as tables of a page."""

import html
from collections.abc import Iterator, Sequence

from rich.console import Group, RenderableType
from rich.table import Table as TerminalTable
from rich.text import Text

from proxytune.report.page.parts import Table

PROSE = 28
"""A cell of more characters than this is wrapped, and kept wide enough to be read."""


def table_html(table: Table, label: str) -> str:
    """A table in a region of its own that scrolls; the first cell of each row names the row.

    Args:
        table: The table.
        label: The id of its heading.
    """
    numeric = [_is_numeric(cells) for cells in zip(*table.rows, strict=True)] or [False] * len(table.columns)
    caption = f'<caption class="unseen">{html.escape(table.title)}</caption>'
    rows = "".join(f"<tr>{''.join(_row(row, numeric))}</tr>" for row in table.rows)
    region = f'<div class="scroll" role="region" tabindex="0" aria-labelledby="{label}">'
    return f"{region}<table>{caption}{_head(table.columns, numeric)}<tbody>{rows}</tbody></table></div>"


def _head(columns: Sequence[str], numeric: Sequence[bool]) -> str:
    cells = (
        f'<th scope="col"{_class(right)}>{html.escape(name)}</th>' for name, right in zip(columns, numeric, strict=True)
    )
    return f"<thead><tr>{''.join(cells)}</tr></thead>" if columns else ""


def _row(row: Sequence[str], numeric: Sequence[bool]) -> Iterator[str]:
    for place, (cell, right) in enumerate(zip(row, numeric, strict=True)):
        if place == 0:
            yield f'<th scope="row"{_class(right)}>{html.escape(cell)}</th>'
        else:
            yield f"<td{_class(right, len(cell))}>{html.escape(cell)}</td>"


def _class(right: bool, length: int = 0) -> str:
    return ' class="number"' if right else ' class="prose"' if length > PROSE else ""


def _is_numeric(cells: Sequence[str]) -> bool:
    """Whether a column is of numbers, which are told by what they begin with."""
    filled = [cell for cell in cells if cell]
    return bool(filled) and all(len(cell) <= PROSE and cell.lstrip("−-±>≤≥ ")[:1].isdigit() for cell in filled)


def terminal_tables(shown: RenderableType) -> tuple[Table, ...]:
    """The tables among what the terminal shows, in their order."""
    if isinstance(shown, Group):
        return tuple(table for one in shown.renderables for table in terminal_tables(one))
    return (_of_terminal(shown),) if isinstance(shown, TerminalTable) else ()


def _of_terminal(table: TerminalTable) -> Table:
    columns = [[_text(cell) for cell in column.cells] for column in table.columns]
    heads = tuple(_text(column.header) for column in table.columns)
    rows = tuple(zip(*columns, strict=True))
    return Table(_text(table.title or ""), heads if any(heads) else (), rows)


def _text(cell: RenderableType) -> str:
    """A cell without markup, on one line; what it is indented by tells what it belongs to."""
    plain = cell.plain if isinstance(cell, Text) else Text.from_markup(str(cell)).plain
    return plain.replace("\n", " ").rstrip()
