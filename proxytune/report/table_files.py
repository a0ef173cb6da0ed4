"""Tables as files: CSV for programs, LaTeX with booktabs for papers."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from proxytune.errors import InputError

ENDINGS = (".csv", ".tex")
GREEK = ("alpha", "beta", "delta", "theta", "lambda", "mu", "rho", "sigma", "tau", "varphi", "omega", "Theta")
IN_LATEX = {
    "\\": r"\textbackslash{}",
    **{character: f"\\{character}" for character in "&%$#_{}"},
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": "$<$",
    ">": "$>$",
    "−": "$-$",
    "–": "--",
    "…": r"\ldots{}",
    "’": "'",
    "°": r"$^\circ$",
    "²": "$^2$",
    "±": r"$\pm$",
    "×": r"$\times$",
    "·": r"$\cdot$",
    "≤": r"$\leq$",
    "≥": r"$\geq$",
    "→": r"$\rightarrow$",
    "∞": r"$\infty$",
    **{letter: f"$\\{name}$" for letter, name in zip("αβδθλμρστφωΘ", GREEK, strict=True)},
}
"""Characters that pdflatex would take for a command, or has no glyph for; accented letters it reads as they are."""
Cell = str | float | None


def check_table_file(option: str, path: Path) -> None:
    """Refuse a file of another kind before anything is worked out.

    Raises:
        InputError: If its name ends otherwise.
    """
    if path.suffix not in ENDINGS:
        raise InputError(f"{option} {path}: a table is written as {' or '.join(ENDINGS)}; name the file so")


def csv_text(columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> str:
    """A table as CSV; cells without a value are empty."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([columns, *rows])
    return text.getvalue()


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
