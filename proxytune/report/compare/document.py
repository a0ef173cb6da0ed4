"""A comparison of engines as JSON and as tables; the JSON's keys are promises."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from proxytune.comparison.summary import EngineSummary, Estimate, Region
from proxytune.report.view import Table, columns_of


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
    """The comparison as tables, the first engine first: how good, how soon, and what is known of θ."""
    first = summaries[0]
    good = _table(
        f"{name}: the answer after {budget} evaluations, {first.seeds} seeds",
        ("fresh score", f"less {first.engine}'s", "θ error", "s per\nproposal"),
        [
            (
                one.engine,
                with_interval(one.score, ".1f"),
                with_interval(one.regret_difference, ".1f"),
                with_interval(one.error, ".2f"),
                _time(one),
            )
            for one in summaries
        ],
    )
    soon = _table(
        "evaluations needed to reach the noise floor",
        ("reached", "median", f"{first.engine}'s share", f"saved by {first.engine}"),
        [
            (one.engine, _of(one.reached, one.seeds), needed(one.evaluations, budget), *_paired(one))
            for one in summaries
        ],
    )
    known = [(one.engine, *_region(one.region, one.seeds)) for one in summaries if one.region]
    of_truth = _table("the truth", ("region\nholds it", "its share", "intervals hold it", "misfit"), known)
    return [good, soon, *([of_truth] if known else [])]


def _time(one: EngineSummary) -> str:
    return f"{one.seconds:.2g}"


def _paired(one: EngineSummary) -> tuple[str, str]:
    return with_interval(one.ratio, ".2f"), with_interval(one.saved, ".1f")


def _of(count: int | None, seeds: int) -> str:
    return "" if count is None else f"{count} of {seeds}"


def _region(region: Region | None, seeds: int) -> tuple[str, ...]:
    if region is None:
        return ("", "", "", "")
    by_parameter = (region.intervals_covered or {}).items()
    held = "\n".join(f"{name} {count}" for name, count in by_parameter)
    return _of(region.covered, seeds), with_interval(region.share, ".1%"), held, _of(region.misfits, seeds)


def _table(title: str, columns: Sequence[str], rows: Sequence[tuple[str, ...]]) -> Table:
    return Table(title, columns_of(("engine",), columns), tuple(rows))


def compare_lines(summaries: Sequence[EngineSummary]) -> list[str]:
    """What the comparison says, one line per rival of the first, and how to read the tables."""
    first = summaries[0].engine
    reach = "to reach the noise floor (paired 95 % interval)"
    lines = [f"{first} {verdict(one)} than {one.engine} {reach}" for one in summaries[1:]]
    how = "intervals: 95 % bootstrap over seeds; means of scores and of paired differences, medians of the rest"
    return [*lines, how]


def verdict(summary: EngineSummary) -> str:
    """Whether the first engine gets to the floor in fewer evaluations than this engine, beyond the paired interval."""
    if summary.saved is None:
        return "is the engine that the others are compared with"
    if summary.saved.low > 0.0:
        return "needs significantly fewer evaluations"
    if summary.saved.high < 0.0:
        return "needs significantly more evaluations"
    return "needs no significantly fewer evaluations"


def with_interval(estimate: Estimate | None, digits: str) -> str:
    """A figure with its interval; empty where there is none."""
    if estimate is None:
        return ""
    return f"{estimate.value:{digits}} ({estimate.low:{digits}} to {estimate.high:{digits}})"


def needed(estimate: Estimate, budget: int) -> str:
    """Evaluations, those beyond the budget as such."""
    texts = [f">{budget}" if value > budget else f"{value:.0f}" for value in vars(estimate).values()]
    return f"{texts[0]} ({texts[1]} to {texts[2]})"
