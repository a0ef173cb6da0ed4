"""Tables as files: what LaTeX would take for a command is escaped, and CSV reads back."""

import re
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given, strategies as st

from proxytune.errors import InputError
from proxytune.files import csv_text
from proxytune.report.text import IN_LATEX, check_table_file, in_latex, latex_text

COLUMNS, ROWS = ("measure", "sim_1", "95 % interval"), [("SRCC d_x", "−0.5", "−1 to 1"), ("Kendall τ", "1", "")]


def test_a_latex_table_has_the_rules_of_booktabs_and_a_line_per_row(tmp_path):
    (tmp_path / "t.tex").write_text(latex_text(COLUMNS, ROWS), encoding="utf-8")
    assert (tmp_path / "t.tex").read_text().splitlines() == [
        r"\begin{tabular}{lrr}",
        r"\toprule",
        r"measure & sim\_1 & 95 \% interval \\",
        r"\midrule",
        r"SRCC d\_x & $-$0.5 & $-$1 to 1 \\",
        r"Kendall $\tau$ & 1 &  \\",
        r"\bottomrule",
        r"\end{tabular}",
    ]


@given(st.text(alphabet=[*IN_LATEX, "a", "7", " "], max_size=20))
def test_nothing_that_latex_would_take_for_a_command_is_left(text):
    shown = re.sub(r"\\[&%$#_{}]|\\[a-zA-Z]+(\{\})?|\$[^$]*\$", "", in_latex(text))
    assert not set(shown) & set("\\&%$#_{}~^<>")
    assert shown.isascii()


@given(st.lists(st.text(alphabet="a&\\b%", max_size=5), min_size=3, max_size=3))
def test_every_row_has_as_many_cells_as_there_are_columns(row):
    assert len(re.findall(r"(?<!\\)&", latex_text(COLUMNS, [tuple(row)]).splitlines()[4])) == 2


def test_a_csv_reads_back_and_what_is_undefined_is_empty(tmp_path):
    (tmp_path / "t.csv").write_text(csv_text(("name", "value"), [('a "b", c', 0.1), ("d", None)]), encoding="utf-8")
    table = pd.read_csv(tmp_path / "t.csv")
    assert table.name.tolist() == ['a "b", c', "d"]
    assert (table.value[0], pd.isna(table.value[1])) == (0.1, True)


@pytest.mark.parametrize("name", ["t.txt", "t", "t.TEX"])
def test_a_file_of_another_kind_is_refused(name):
    with pytest.raises(InputError, match=rf"--table {name}: a table is written as .csv or .tex; name the file so"):
        check_table_file(Path(name))
