"""What the terminal shows as tables of a page."""

from rich.console import Group
from rich.markup import escape
from rich.table import Table as TerminalTable
from rich.text import Text

from proxytune.report.page.parts import Table
from proxytune.report.page.tables import terminal_tables


def terminal(title, *rows):
    table = TerminalTable(title=title)
    for name in ("agent", "s per\nepisode"):
        table.add_column(name)
    for row in rows:
        table.add_row(*map(escape, row))
    return table


def test_tables_in_a_group_become_tables_with_their_texts_as_they_are():
    shown = Group(Text("first"), Group(terminal("A [b]x[/b]", ("  [bold]", "1"))), terminal(None, ("a", "b\nc")))
    first, second = terminal_tables(shown)
    assert first == Table("A x", ("agent", "s per episode"), (("  [bold]", "1"),))
    assert second.title == ""
    assert second.rows == (("a", "b c"),)


def test_what_is_no_table_gives_none():
    assert terminal_tables(Group(Text("words"))) == ()
