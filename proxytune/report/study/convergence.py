"""The convergence figure: how the answer's PRPV fell over a study's trials."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from proxytune.report.line_names import LineName, name_lines
from proxytune.report.style import BLUE, COLUMN, GREEN, VERMILLION, dress, floor_name, legend_below
from proxytune.study import PRPV, StudyResult

TWO_LINES = 0.14
"""How far apart names of two lines are, as a share of the panel's height."""


def convergence(result: StudyResult) -> Figure:
    """Draw every trial's PRPV, that of the answer so far, and at the end the answer's on fresh episodes.

    Where the objective is another measure, that is drawn in its place.

    The answer so far is the visited θ of lowest expected PRPV, which need not be the luckiest trial. Filled points were
    proposed by the surrogate, open ones come from the quasi-random design; crosses are trials that failed, triangles
    what PRPV of those cut off cannot be below. The diamond with its 95 % interval, right of the last trial, is
    the answer in episodes that the search has not seen.
    """
    figure = Figure(figsize=(COLUMN, 2.9), layout="constrained")
    axes = figure.subplots()
    _trials(axes, result)
    named = [_answer(axes, result)]
    if result.study.objective == PRPV:
        _fresh(axes, result)
        named += _levels(axes, result)
    axes.set_xlabel("trial", fontsize=8)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylabel(result.study.objective.label, fontsize=8)
    if result.study.objective == PRPV:
        axes.set_ylabel("PRPV [ordered pairs]", fontsize=8)
        axes.set_ylim(bottom=min(-0.4, -0.02 * axes.get_ylim()[1]))
        axes.yaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    dress(axes)
    name_lines(axes, named, TWO_LINES)
    legend_below(figure, axes, without=[name.words for name in named])
    return figure


def _levels(axes: Axes, result: StudyResult) -> list[LineName]:
    """Chance, and the noise floor that a perfect proxy would score; with their names."""
    chance, floor = result.judged.chance, result.floor
    named = [LineName(f"chance\n{chance.mean:.1f}", "0.45", chance.mean)]
    axes.axhline(chance.mean, color="0.45", linewidth=1.0, linestyle=":", label=named[0].words)
    if floor.value is not None and floor.low is not None and floor.high is not None:
        axes.axhspan(floor.low, floor.high, color=GREEN, alpha=0.15, linewidth=0)
        named.append(LineName(f"{floor_name(floor)}\n{floor.value:.1f}", GREEN, floor.value))
        axes.axhline(floor.value, color=GREEN, linewidth=1.0, linestyle="--", label=named[-1].words)
    return named


def _trials(axes: Axes, result: StudyResult) -> None:
    scored = [(trial.number, value) for trial in result.trials if (value := result.value_of(trial)) is not None]
    failed = [trial.number for trial in result.trials if trial.state == "failed"]
    bounds = [(trial.number, trial.bound) for trial in result.trials if trial.bound is not None]
    initial = result.study.settings.initial
    _points(axes, [point for point in scored if point[0] <= initial], "white", "design")
    _points(axes, [point for point in scored if point[0] > initial], BLUE, "proposed")
    if failed:
        axes.plot(failed, np.zeros(len(failed)), "x", color="black", markersize=4, label="failed")
    if bounds:
        axes.plot(*zip(*bounds, strict=True), "^", color="0.45", markersize=4, label="stopped early, at least")


def _points(axes: Axes, points: list[tuple[int, float]], face: str, label: str) -> None:
    if points:
        numbers, scores = zip(*points, strict=True)
        axes.plot(numbers, scores, "o", color=BLUE, markerfacecolor=face, markersize=4, zorder=3, label=label)


def _answer(axes: Axes, result: StudyResult) -> LineName:
    """PRPV of the answer so far; where fresh episodes chose another in the end, the line ends at that one's.

    Returns:
        The line's name.
    """
    pairs = zip(result.trials, result.answers, strict=True)
    answers = [(trial.number, result.value_of(answer)) for trial, answer in pairs if answer is not None]
    ends = [*answers, (result.trials[-1].number + 1, result.value_of(result.best.trial))]
    named = LineName("answer\nso far", VERMILLION, ends[-1][1] or 0.0)
    axes.step(*zip(*ends, strict=True), where="post", color=VERMILLION, linewidth=1.5, label=named.words)
    return named


def _fresh(axes: Axes, result: StudyResult) -> None:
    fresh = result.confirmation.answer.assessment if result.confirmation else None
    if fresh is None:
        return
    score, inner = fresh.prpv.value, fresh.prpv_interval
    reach = None if inner.low is None or inner.high is None else [[score - inner.low], [inner.high - score]]
    place, label = result.trials[-1].number + 1, "answer, fresh episodes"
    bars = np.maximum(0.0, reach) if reach else None
    axes.errorbar(
        [place], [score], yerr=bars, fmt="D", color=VERMILLION, markersize=5, capsize=2, zorder=4, label=label
    )
