"""Tables of a diagnosis as people read them."""

from collections.abc import Mapping

from rich.markup import escape
from rich.table import Table

from proxytune.diagnosis import Estimate

TEXTS = ("parameter", "unit", "window", "effect", "form", "error")
"""Columns of words; all others are of numbers."""


def plain_table(title: str, columns: tuple[str, ...]) -> Table:
    """An empty table without lines."""
    table = Table(title=escape(title), title_justify="left", title_style="bold", box=None, pad_edge=False)
    for column in columns:
        table.add_column(escape(column), justify="left" if column in TEXTS else "right", overflow="fold")
    return table


def parameters_table(title: str, declared: Mapping[str, Estimate], theta: Mapping[str, Estimate]) -> Table:
    """Fitted parameters before and after effects were added, by name in θ."""
    table = plain_table(title, ("parameter", "declared only", "effects added", "95 % interval", "unit"))
    for name, after in theta.items():
        if name.endswith(".imbalance") and after.value == 0.0:
            continue
        before = declared.get(name)
        interval = f"{after.interval[0]:.4g} … {after.interval[1]:.4g}" if after.interval[0] < after.interval[1] else ""
        old = f"{before.value:.4g}" if before else ""
        table.add_row(name, old, f"{after.value:.4g}", interval, after.unit)
    return table
