"""A comparison of engines as JSON, tables, figure and page; the JSON's keys are promises."""

from collections.abc import Sequence
from dataclasses import asdict
from itertools import cycle
from typing import Any

import numpy as np
from compared_engines import ENGINES, engine_of
from matplotlib.axes import Axes
from matplotlib.colors import is_color_like
from matplotlib.figure import Figure
from runs import EngineSummary, Estimate, Region, Run, median_curve

from proxytune.errors import InputError
from proxytune.report import (
    BLUE,
    COLUMN,
    GREEN,
    LIGHT_BLUE,
    ORANGE,
    PURPLE,
    VERMILLION,
    LineName,
    Paragraphs,
    Picture,
    Table,
    View,
    columns_of,
    dress,
    name_lines,
)
from proxytune.search import Look

LINES = {"solid": "-", "dashed": (0, (4, 1.5)), "dotted": (0, (1, 1)), "dashdot": (0, (5, 1, 1, 1))}
PALETTE = tuple(
    Look(colour, line)
    for line in ("solid", "dashed", "dotted", "dashdot")
    for colour in (GREEN, PURPLE, LIGHT_BLUE, BLUE, VERMILLION, ORANGE)
)
"""For engines that do not say how they would like to be drawn, in this order."""
HEIGHT = 3.0
"""Of the figure [inch]."""

FLOOR, SHARED = "noise floor", "← shared design"

BEYOND = 0.8
"""So much of an evaluation is drawn after the last, so that one sees where it ended."""
CAPTION = (
    "The lower, the nearer the best so far is to the optimum; medians over the seeds, with the 95 % band of the first "
    "engine. Left of the vertical line all engines share one design. Below the dashed line no θ can be told from the "
    "optimum: differences there mean nothing."
)


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
        (
            "fresh score",
            "of the\ntruth's",
            f"less {first.engine}'s",
            "θ error",
            f"less {first.engine}'s",
            "s per\nproposal",
        ),
        [
            (
                one.engine,
                with_interval(one.score, ".1f"),
                with_interval(one.of_truth, ".2f"),
                with_interval(one.regret_difference, ".1f"),
                with_interval(one.error, ".2f"),
                with_interval(one.error_difference, ".2f"),
                _time(one),
            )
            for one in summaries
        ],
    )
    soon = _table(
        "evaluations needed to reach the noise floor",
        ("reached", "median", f"{first.engine}'s share", f"saved by {first.engine}", "simulated s"),
        [
            (
                one.engine,
                _of(one.reached, one.seeds),
                needed(one.evaluations, budget),
                *_paired(one),
                with_interval(one.simulated, ".0f"),
            )
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


def compare_figure(engines: Sequence[Sequence[Run]], tolerance: float) -> Figure:
    """Draw the median over seeds of the lowest regret so far, one line per engine, named where it ends.

    The first engine has its 95 % band. Up to the vertical line all engines share the design; below the dashed line a θ
    cannot be told from the optimum.
    """
    figure = Figure(figsize=(COLUMN, HEIGHT), layout="constrained")
    axes = figure.subplots()
    key, names = engines[0][0].key, [runs[0].key.engine for runs in engines]
    looks = looks_of(names)
    for number, runs in enumerate(engines):
        _curve(axes, runs, looks[names[number]], banded=number == 0)
    axes.axvline(key.initial + 0.5, color="0.6", linewidth=0.8)
    axes.axhline(tolerance, color="0.3", linewidth=0.8, linestyle="--", label=FLOOR)
    axes.set_xlabel("evaluations", fontsize=8)
    axes.set_ylabel("lowest regret so far [ordered pairs]", fontsize=8)
    axes.set_xlim(1, key.budget + BEYOND)
    axes.set_ylim(*_range(engines, tolerance))
    dress(axes)
    axes.annotate(
        SHARED, (key.initial + 0.5, 1.0), (0, 2), xycoords=("data", "axes fraction"),
        textcoords="offset points", fontsize=7, color="0.3", ha="left",
    )  # fmt: skip
    ends = [float(median_curve(runs)[0][-1]) for runs in engines]
    named = [LineName(name, look.colour, end) for (name, look), end in zip(looks.items(), ends, strict=True)]
    name_lines(axes, [*named, LineName(FLOOR, "0.3", tolerance)])
    return figure


def looks_of(names: Sequence[str]) -> dict[str, Look]:
    """How each engine is drawn: as it would like to be, else by the next of the palette that no engine asked for."""
    wished = {name: look for name in names if (look := _wish(name))}
    asked_for = {*wished.values(), *(engine.look for engine in ENGINES)}
    free = cycle([look for look in PALETTE if look not in asked_for] or PALETTE)
    return {name: wished.get(name) or next(free) for name in names}


def _wish(name: str) -> Look | None:
    """How an engine would like to be drawn, if that can be drawn; runs outlast engines, so it may be unknown."""
    try:
        look = engine_of(name).look
    except InputError:
        return None
    return look if look and look.line in LINES and is_color_like(look.colour) else None


def _curve(axes: Axes, runs: Sequence[Run], look: Look, *, banded: bool) -> None:
    colour, line = look.colour, LINES[look.line]
    middle, low, high = median_curve(runs)
    places = np.append(np.arange(1, len(middle) + 1), len(middle) + BEYOND)
    middle, low, high = (np.append(curve, curve[-1]) for curve in (middle, low, high))
    if banded:
        axes.fill_between(places, low, high, step="post", color=colour, alpha=0.15, linewidth=0)
    label = f"{runs[0].key.engine} ({len(runs)} seeds)"
    axes.step(places, middle, where="post", color=colour, linestyle=line, lw=1.3, label=label)


def _range(engines: Sequence[Sequence[Run]], tolerance: float) -> tuple[float, float]:
    """From below the lowest median, the floor and 0 to above the highest median that is finite."""
    medians = np.concatenate([median_curve(runs)[0] for runs in engines])
    finite = medians[np.isfinite(medians)]
    low, high = min(0.0, tolerance, *finite), max(1.0, tolerance, *finite)
    return low - 0.04 * (high - low) if low < 0.0 else 0.0, high + 0.04 * (high - low)


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
