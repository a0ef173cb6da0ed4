"""A comparison of engines as a page."""

from collections.abc import Sequence

from proxytune.comparison.summary import EngineSummary
from proxytune.report.compare.document import compare_lines, compare_tables
from proxytune.report.view import Paragraphs, Picture, Table, View

CAPTION = (
    "The lower, the nearer the best so far is to the optimum; medians over the seeds, with the 95 % band of the first "
    "engine. Left of the vertical line all engines share one design. Below the dashed line no θ can be told from the "
    "optimum: differences there mean nothing."
)


def compare_view(name: str, summaries: Sequence[EngineSummary], budget: int, figure: bytes) -> View:
    """A comparison as a page: what the terminal shows, and the figure.

    Args:
        name: The objective's.
        summaries: One per engine; the others are compared with the first.
        budget: Evaluations per run.
        figure: The PNG.
    """
    *verdicts, how = compare_lines(summaries)
    picture = Picture("How fast each engine comes near the optimum", figure, CAPTION)
    tables = compare_tables(name, summaries, budget)
    parts: list[Picture | Table | Paragraphs] = [picture, *tables, Paragraphs("How to read the tables", (f"{how}.",))]
    answer = _answer(summaries, verdicts, budget)
    return View(f"Search engines on {name}", answer, _next_step(summaries), tuple(parts))


def _answer(summaries: Sequence[EngineSummary], verdicts: Sequence[str], budget: int) -> str:
    """What the terminal says of each engine; where none reached the floor, that says nothing."""
    if not any(one.reached for one in summaries):
        return f"No engine reached the noise floor in {budget} evaluations: which is sooner there is not known."
    return " ".join(f"{verdict}." for verdict in verdicts) or f"{summaries[0].engine} alone was run."


def _next_step(summaries: Sequence[EngineSummary]) -> str:
    first, *others = summaries
    if not others:
        return "name two engines or more with --engines."
    if not any(one.reached for one in summaries):
        return "raise --budget until some engine reaches the noise floor."
    sooner = [one.engine for one in others if one.saved and one.saved.high < 0.0]
    if sooner:
        return f'set engine = "{sooner[0]}" in study.toml: it needs fewer evaluations than {first.engine}.'
    if all(one.saved and one.saved.low > 0.0 for one in others):
        return f"keep {first.engine}."
    return f"keep {first.engine}, or raise --seeds from {first.seeds} to {2 * first.seeds} to tell the engines apart."
