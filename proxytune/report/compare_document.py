"""A comparison of engines as JSON and as a table; the JSON's keys are promises."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rich.table import Table

from proxytune.search.summary import EngineSummary, Estimate


def compare_document(name: str, summaries: Sequence[EngineSummary], budget: int, tolerance: float) -> dict[str, Any]:
    """The comparison as plain JSON; None where a figure is undefined or not known."""
    return {
        "objective": name,
        "budget": budget,
        "noise_floor_regret": tolerance,
        "default": summaries[0].engine,
        "engines": [{**asdict(one), "verdict": verdict(one)} for one in summaries],
    }


def compare_table(name: str, summaries: Sequence[EngineSummary], budget: int) -> Table:
    """The comparison for the terminal, the default first."""
    table = Table(box=None, pad_edge=False, title=f"{name}, {budget} evaluations", title_justify="left")
    table.add_column("engine")
    columns = (
        "seeds",
        "regret",
        "at floor",
        "evaluations\nto floor",
        "saved by\ndefault",
        "θ error",
        "s per\nproposal",
    )
    for column in columns:
        table.add_column(column, justify="right", vertical="bottom")
    for one in summaries:
        table.add_row(
            one.engine,
            str(one.seeds),
            _told(one.regret, ".0f"),
            str(one.reached),
            _needed(one.evaluations, budget),
            _told(one.saved, ".1f"),
            _told(one.error, ".2f"),
            f"{one.seconds:.2g}",
        )
    return table


def compare_lines(summaries: Sequence[EngineSummary]) -> list[str]:
    """What the comparison says, one line per rival of the default, and how to read the table."""
    default = summaries[0].engine
    lines = [f"{default} {verdict(one)} than {one.engine}" for one in summaries[1:]]
    return [*lines, "medians with 95 % bootstrap intervals over seeds; 'saved' is the mean over pairs of one seed"]


def verdict(summary: EngineSummary) -> str:
    """Whether the default gets to the floor in fewer evaluations than this engine, beyond the paired interval."""
    if summary.saved is None:
        return "is the default"
    if summary.saved.low > 0.0:
        return "reaches the noise floor in fewer evaluations"
    if summary.saved.high < 0.0:
        return "reaches the noise floor in more evaluations"
    return "reaches the noise floor in no fewer evaluations, beyond the paired interval,"


def _told(estimate: Estimate | None, digits: str) -> str:
    if estimate is None:
        return ""
    return f"{estimate.value:{digits}} ({estimate.low:{digits}} to {estimate.high:{digits}})"


def _needed(estimate: Estimate, budget: int) -> str:
    """Evaluations, those beyond the budget as such."""
    texts = [f">{budget}" if value > budget else f"{value:.0f}" for value in vars(estimate).values()]
    return f"{texts[0]} ({texts[1]} to {texts[2]})"
