"""The convergence figure: how PRPV fell over a study's trials."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from proxytune.report.style import BLUE, GREEN, ORANGE, VERMILLION, dress
from proxytune.study.result import StudyResult


def convergence(result: StudyResult) -> Figure:
    """Draw the observed PRPV of every trial and the lowest so far, with the target's noise floor and chance level.

    Filled points were proposed by the surrogate, open ones come from the quasi-random design; crosses are trials that
    failed, triangles what PRPV of those cut off cannot be below; the ring is the best θ, which is the surrogate's and
    need not be the lowest point.
    """
    figure = Figure(figsize=(5.2, 3.2), layout="constrained")
    axes = figure.subplots()
    _levels(axes, result)
    _trials(axes, result)
    axes.set_xlabel("trial", fontsize=8)
    axes.set_ylabel("PRPV [ordered pairs of agents]", fontsize=8)
    axes.set_ylim(bottom=min(-0.4, -0.02 * axes.get_ylim()[1]))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    dress(axes)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=7, frameon=False)
    return figure


def _levels(axes: Axes, result: StudyResult) -> None:
    """What a proxy that knows nothing would get, and what no proxy can be told to beat."""
    chance, floor = result.best.assessment.chance, result.best.assessment.noise_floor
    axes.axhline(chance.mean, color="0.45", linewidth=1.0, linestyle=":", label=f"chance {chance.mean:.1f}")
    if floor.value is not None and floor.low is not None and floor.high is not None:
        axes.axhspan(floor.low, floor.high, color=GREEN, alpha=0.15, linewidth=0)
        axes.axhline(floor.value, color=GREEN, linewidth=1.0, linestyle="--", label=f"noise floor {floor.value:.1f}")


def _trials(axes: Axes, result: StudyResult) -> None:
    scored = [(trial.number, trial.prpv) for trial in result.trials if trial.prpv is not None]
    failed = [trial.number for trial in result.trials if trial.state == "failed"]
    bounds = [(trial.number, trial.bound) for trial in result.trials if trial.bound is not None]
    initial = result.study.settings.initial
    _points(axes, [point for point in scored if point[0] <= initial], "white", "design")
    _points(axes, [point for point in scored if point[0] > initial], BLUE, "proposed")
    if failed:
        axes.plot(failed, np.zeros(len(failed)), "x", color=VERMILLION, markersize=4, label="failed")
    if bounds:
        axes.plot(*zip(*bounds, strict=True), "^", color="0.45", markersize=4, label="cut off, at least")
    numbers, scores = zip(*scored, strict=True)
    lowest = np.minimum.accumulate(scores)
    last = result.trials[-1].number
    axes.step([*numbers, last], [*lowest, lowest[-1]], where="post", color=ORANGE, linewidth=1.5, label="lowest so far")
    best = result.best
    (ring,) = axes.plot(best.trial.number, best.assessment.prpv.value, "o", color=VERMILLION, label="best θ")
    ring.set(fillstyle="none", markersize=9)


def _points(axes: Axes, points: list[tuple[int, float]], face: str, label: str) -> None:
    if points:
        numbers, scores = zip(*points, strict=True)
        axes.plot(numbers, scores, "o", color=BLUE, markerfacecolor=face, markersize=4, zorder=3, label=label)
