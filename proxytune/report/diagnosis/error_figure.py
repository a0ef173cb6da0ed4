"""The error of predictions by how far ahead, before and after, with the error that noise alone makes."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from proxytune.diagnosis import Diagnosis, HorizonError, Rmse
from proxytune.report.diagnosis.model_names import BEFORE, after
from proxytune.report.style import BLUE, COLUMN, GREEN, VERMILLION, dress, legend_below


def error_figure(diagnosis: Diagnosis) -> Figure:
    """Draw errors of position and heading by horizon with 95 % intervals, on logarithmic axes, over the noise floor."""
    figure = Figure(figsize=(COLUMN, 2.6), layout="constrained")
    place, heading = figure.subplots(1, 2)
    errors = diagnosis.errors
    floors = [(_bracket(error), (np.degrees(error.heading_floor),) * 2) for error in errors]
    pairs = [(BEFORE, VERMILLION, "o", -0.1), (after(diagnosis), BLUE, "s", 0.1)]
    for axes, factor, heads, column in ((place, 1e3, False, 0), (heading, 180.0 / np.pi, True, 1)):
        for number, (name, colour, marker, shift) in enumerate(pairs[: 2 if diagnosis.effects else 1]):
            rms_errors = [_before_and_after(error, heads)[number] for error in errors]
            _estimates(axes, rms_errors, factor, (colour, marker, name, shift))
        _draw_floor(axes, [floor[column] for floor in floors])
        _scale(axes)
        axes.set_xticks(range(len(errors)), [f"{error.horizon_s:g}" for error in errors])
        axes.set_xlim(-0.5, len(errors) - 0.5)
        axes.set_xlabel("prediction length [s]", fontsize=8)
        dress(axes)
    place.set_ylabel("position error, RMS [mm]", fontsize=8)
    heading.set_ylabel("heading error, RMS [deg]", fontsize=8)
    legend_below(figure, place)
    return figure


def _scale(axes: Axes) -> None:
    """A logarithmic axis in plain numbers, so that small errors are seen beside large ones; the floor off its end."""
    axes.use_sticky_edges = False
    axes.margins(y=0.08)
    axes.set_yscale("log", nonpositive="clip")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def _bracket(error: HorizonError) -> tuple[float, float]:
    """The noise floor of position, lower and upper end [mm]."""
    return 1e3 * error.floor.lower, 1e3 * error.floor.upper


def _draw_floor(axes: Axes, brackets: Sequence[tuple[float, float]]) -> None:
    """A bar from the lower to the upper end, a line at the lower."""
    spots, lower = np.arange(len(brackets)), [low for low, _ in brackets]
    axes.bar(spots, [high - low for low, high in brackets], 0.5, lower, color=GREEN, alpha=0.2, zorder=0)
    axes.hlines(lower, spots - 0.25, spots + 0.25, color=GREEN, lw=1.4, label="noise floor: poses alone, to upper end")


def _before_and_after(error: HorizonError, heads: bool) -> tuple[Rmse, Rmse]:
    return (error.heading_before, error.heading_after) if heads else (error.before, error.after)


def _estimates(axes: Axes, rms_errors: Sequence[Rmse], factor: float, style: tuple[str, str, str, float]) -> None:
    """Values with their intervals, where those are finite."""
    colour, marker, name, shift = style
    values = factor * np.array([one.value for one in rms_errors])
    ends = factor * np.array([one.interval for one in rms_errors])
    whole = np.isfinite(ends).all(axis=1, keepdims=True)
    ends = np.where(whole, ends, values[:, None])
    arms = np.maximum(0.0, np.stack((values - ends[:, 0], ends[:, 1] - values)))
    axes.errorbar(
        np.arange(len(rms_errors)) + shift,
        values,
        yerr=arms,
        fmt=marker,
        color=colour,
        ms=4,
        capsize=2,
        lw=1.0,
        label=name,
    )
