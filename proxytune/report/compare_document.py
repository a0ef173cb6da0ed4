"""A comparison of engines as JSON and as tables; the JSON's keys are promises."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rich.table import Table

from proxytune.search.summary import EngineSummary, Estimate, Region


def compare_document(name: str, summaries: Sequence[EngineSummary], budget: int, tolerance: float) -> dict[str, Any]:
    """The comparison as plain JSON; None where a figure is undefined or not known."""
    return {
        "objective": name,
        "budget": budget,
        "noise_floor_regret": tolerance,
        "default": summaries[0].engine,
        "engines": [{**asdict(one), "verdict": verdict(one)} for one in summaries],
    }


def compare_tables(name: str, summaries: Sequence[EngineSummary], budget: int) -> list[Table]:
    """The comparison for the terminal, the first engine first: how good and how soon, then what is known of θ."""
    first = summaries[0].engine
    title = f"{name}, {budget} evaluations, {summaries[0].seeds} seeds; less, share and saved are to {first}"
    columns = (
        "fresh score\nof the answer",
        "less",
        "reached",
        "evaluations\nto it",
        "share",
        "saved",
        "s per\nproposal",
    )
    rows = [
        (
            one.engine,
            told(one.score, ".1f"),
            told(one.score_difference, ".1f"),
            f"{one.reached}",
            needed(one.evaluations, budget),
            told(one.ratio, ".2f"),
            told(one.saved, ".1f"),
            f"{one.seconds:.2g}",
        )
        for one in summaries
    ]
    known = [_known(one) for one in summaries if one.error or one.region]
    of_truth = _table(
        "what is known of θ", ("θ error", "region\nholds it", "its share", "intervals hold", "misfit"), known
    )
    return [_table(title, columns, rows), *([of_truth] if known else [])]


def _known(one: EngineSummary) -> tuple[str, ...]:
    return (one.engine, told(one.error, ".2f"), *_region(one.region, one.seeds))


def _region(region: Region | None, seeds: int) -> tuple[str, ...]:
    if region is None:
        return ("", "", "", "")
    by_parameter = (region.intervals_covered or {}).items()
    return (
        "" if region.covered is None else f"{region.covered} of {seeds}",
        told(region.share, ".1%"),
        "\n".join(f"{name} {count}" for name, count in by_parameter),
        f"{region.misfits} of {seeds}",
    )


def _table(title: str, columns: Sequence[str], rows: Sequence[tuple[str, ...]]) -> Table:
    table = Table(box=None, pad_edge=False, title=title, title_justify="left")
    table.add_column("engine")
    for column in columns:
        table.add_column(column, justify="right")
    for row in rows:
        table.add_row(*row)
    return table


def compare_lines(summaries: Sequence[EngineSummary]) -> list[str]:
    """What the comparison says, one line per rival of the first, and how to read the tables."""
    first = summaries[0].engine
    lines = [f"{first} {verdict(one)} than {one.engine}" for one in summaries[1:]]
    how = "with 95 % bootstrap intervals over seeds: means of scores and of pairs of one seed, medians of the others"
    return [*lines, how]


def verdict(summary: EngineSummary) -> str:
    """Whether the first engine gets to the floor in fewer evaluations than this engine, beyond the paired interval."""
    if summary.saved is None:
        return "is the one that the others are compared with"
    if summary.saved.low > 0.0:
        return "reaches the noise floor in fewer evaluations"
    if summary.saved.high < 0.0:
        return "reaches the noise floor in more evaluations"
    return "reaches the noise floor in no fewer evaluations, beyond the paired interval,"


def told(estimate: Estimate | None, digits: str) -> str:
    """A figure with its interval; empty where there is none."""
    if estimate is None:
        return ""
    return f"{estimate.value:{digits}} ({estimate.low:{digits}} to {estimate.high:{digits}})"


def needed(estimate: Estimate, budget: int) -> str:
    """Evaluations, those beyond the budget as such."""
    texts = [f">{budget}" if value > budget else f"{value:.0f}" for value in vars(estimate).values()]
    return f"{texts[0]} ({texts[1]} to {texts[2]})"
