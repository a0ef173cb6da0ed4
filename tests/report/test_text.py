"""Tables on the terminal: numbers end together, names are no markup, notes and files are lines."""

from readable import on_terminal

from proxytune.report.text import file_texts, group_texts, section_text, table_text
from proxytune.report.view import Column, Table, columns_of

TABLE = Table("A [b]x[/b]", columns_of(("agent",), ("s per\nepisode",)), (("  [bold]", "1"), ("c", "12")), ("[i]",))


def printed(*parts):
    return [line.rstrip() for line in on_terminal(group_texts(*parts), width=60).splitlines()]


def test_numbers_end_together_below_the_title_begin_together_in_a_section_and_nothing_is_markup():
    assert printed(table_text(TABLE)) == [
        "A [b]x[/b]",
        "            s per",
        "agent     episode",
        "  [bold]        1",
        "c              12",
    ]
    title, head, first, *rest = printed(*section_text(TABLE))[1:]
    assert title == "A [b]x[/b]"
    assert (head.strip(), first) == ("s per", "agent     episode")
    assert rest == ["  [bold]  1", "c         12", "note: [i]"]


def test_columns_without_names_have_no_head_and_files_are_told_by_what_they_are():
    assert printed(table_text(Table("", (Column(""), Column("")), (("trials", "7"),)))) == ["trials  7"]
    assert printed("as [it] is", *file_texts({"report": "a.html"})) == ["as [it] is", "report: a.html"]
