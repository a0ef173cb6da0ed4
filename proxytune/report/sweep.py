"""Sweep along parameters: tables, CSV, JSON document, figures, page, and the files of all that hold the same values."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from itertools import cycle, groupby
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from rich.console import Group, RenderableType

from proxytune.files import csv_text
from proxytune.identity import digest
from proxytune.report import figure_style as style
from proxytune.report.html import write_page
from proxytune.report.scores import score_document
from proxytune.report.study.page import study_foot
from proxytune.report.text import Cell, group_texts, table_text
from proxytune.report.view import Drawn, Paragraphs, Part, Table, View, columns_of
from proxytune.report.wording import listed, plain, short, with_unit
from proxytune.report.writing import picture_of, write_text
from proxytune.space import Theta
from proxytune.study import StudySettings
from proxytune.sweep import METRICS, OUTWARDS, Series, SweepCurve, SweepPoint, describe_shape, series_of, shape_of
from proxytune.usefulness import MEASURES, POD_IMAGE, POD_POSE, PPV, PRPV, SRCC, Assessment

OF_PRPV = ("prpv", "prpv_interval", "prpv_normalised", "expected_prpv")
KEYS = (*OF_PRPV, *(one.key for one in MEASURES if one is not PRPV), "intervals", "chance", "at_noise_floor")
LEVELS = ("noise_floor", "noise_floor_interval", "noise_floor_kind")
NO_POD = "POD was left out: give --target-model MODEL.toml, the model of the target"


def curve_name(curve: SweepCurve) -> str:
    """A file name for the curve: its parameter, a mark of what is held, and whether POD is in it.

    The mark is left out where the others are nominal; the curve's JSON has what is held.
    """
    mark = [held_mark(curve.base)] if held_texts(curve.base, curve.parameter) else []
    return "_".join(["sweep", curve.parameter, *mark, *(["pod"] if curve.has_pod else [])])


def held_mark(base: Theta) -> str:
    """Six characters that stand for the values that parameters are held at."""
    return digest(json.dumps(sorted((name, float(value)) for name, value in base.items())), length=6)


def held_texts(base: Theta, swept: str) -> list[str]:
    """Values that parameters are held at but for the one that is swept, as texts; those nominal are not named."""
    return [f"{name}={value:g}" for name, value in sorted(base.items()) if name != swept]


def curve_document(curve: SweepCurve) -> dict[str, Any]:
    """The curve as plain JSON; None where an agent has no episode that worked."""
    assessed = [point.assessment for point in curve.points if point.assessment is not None]
    levels = score_document(assessed[0]) if assessed else {}
    shapes = [(series, shape_of(series, curve.base.get(curve.parameter))) for series in series_of(curve)]
    return {
        "parameter": curve.parameter,
        "unit": curve.unit,
        "base": dict(curve.base),
        **{name: levels.get(name) for name in LEVELS},
        "points": [_point_document(point) for point in curve.points],
        "shapes": {
            series.key: {"better": series.measure.better, **asdict(shape), "worsens_on_both_sides": shape.monotone}
            for series, shape in shapes
        },
        "notes": [] if curve.has_pod else [NO_POD],
    }


def curve_csv(curve: SweepCurve) -> str:
    """The curve as CSV, one row per value and per measure three columns: score, and the ends of its interval.

    Cells are empty where there is no score or no interval.
    """
    series = series_of(curve)
    keys = [key for one in series for key in (one.key, f"{one.key}_low", f"{one.key}_high")]
    rows: list[list[Cell]] = []
    for point in curve.points:
        found = [one.estimates[point.value] for one in series]
        cells = [cell for one in found for cell in (one.value, *(one.interval or (None, None)))]
        rows.append([point.value, *cells, len(point.evaluation.failures)])
    return csv_text([curve.parameter, *keys, "failed_episodes"], rows)


def sweep_text(curves: Sequence[SweepCurve], episodes: int, files: Sequence[Path], held: str) -> Group:
    """Curves as `sweep` prints them: the paper's measures, the others, what each shows; episodes run, files written."""
    parts: list[RenderableType] = []
    for curve in curves:
        title = " ".join([curve.parameter, *held_texts(curve.base, curve.parameter)])
        first, second = curve_tables(curve)
        parts += [table_text(replace(first, title=title)), table_text(replace(second, title=""))]
        parts.append("\n".join(["", *first.notes, ""]))
    hints = [] if all(curve.has_pod for curve in curves) else [NO_POD]
    lines = [*say_failures(curves), *hints, f"{episodes} episodes run", *map(str, files)]
    return group_texts(*parts, "\n".join(lines), held)


def curve_tables(curve: SweepCurve) -> tuple[Table, Table]:
    """The scores by value: the paper's measures, with what they show, then the others; intervals are in the files."""
    series = series_of(curve)
    sides = [one for one in series if one.measure.in_paper], [one for one in series if not one.measure.in_paper]
    values = [point.value for point in curve.points]
    rows = [[(f"{value:.4g}", *(_cell(one, value) for one in own)) for value in values] for own in sides]
    # Metrics stand on lines of their own, so that many columns fit.
    heads = [[one.name.replace(" ", "\n").replace("_", "\n") for one in own] for own in sides]
    columns = [columns_of((), (curve.label, *own)) for own in heads]
    first, second = (f"Along {curve.parameter}: {kind} measures" for kind in ("the paper's", "other"))
    lines = tuple(f"{curve.parameter}: {describe_shape(one, curve.base.get(curve.parameter))}" for one in series)
    return Table(first, columns[0], tuple(rows[0]), lines), Table(second, columns[1], tuple(rows[1]))


def shapes_note(curve: SweepCurve) -> str:
    """Say in one sentence what all measures do away from where the parameter is held; those alike are told together."""
    held = curve.base.get(curve.parameter)
    alike = dict[str, list[str]]()
    for series in series_of(curve):
        shape = shape_of(series, held)
        below, above = OUTWARDS[shape.below], OUTWARDS[shape.above]
        course = f"on both sides {above}" if below == above else f"downwards {below}, upwards {above}"
        alike.setdefault(course, []).append(plain(series.name))
    at = "" if held is None else f"from {short(held, 4)} "
    return "; ".join(f"{listed(names)}: {at}{course}" for course, names in alike.items())


def say_failures(curves: Sequence[SweepCurve]) -> list[str]:
    """Say why points have no score, in one line each."""
    points = [(curve, point, f"{curve.parameter} {point.value:g}") for curve in curves for point in curve.points]
    lines = [f"{which}: {point.evaluation.failure}" for _, point, which in points if point.evaluation.failure]
    bare = [which for curve, point, which in points if curve.has_pod and not point.pod]
    return lines + [f"{which}: no POD, since no replay of the target's commands worked" for which in bare]


def _point_document(point: SweepPoint) -> dict[str, Any]:
    measures = score_document(point.assessment) if point.assessment else {}
    pod = {
        name: {
            "value": found.value,
            "interval": found.interval and list(found.interval),
            "unit": METRICS[name],
            "starts": found.starts,
        }
        for name, found in point.pod.items()
    }
    return {
        "value": point.value,
        **{name: measures.get(name) for name in KEYS},
        "pod": pod or None,
        "failed_episodes": len(point.evaluation.failures),
        "failure": point.evaluation.failure or None,
    }


def _cell(series: Series, value: float) -> str:
    """The score, PRPV with its interval."""
    one = series.estimates[value]
    if one.value is None:
        return "failed" if series.measure is PRPV else ""
    text = format(one.value, series.measure.digits)
    if series.measure is not PRPV or one.interval is None:
        return text
    return f"{text} ({one.interval[0]:.0f} to {one.interval[1]:.0f})"


def sweep_view(study: str, curves: Sequence[SweepCurve], figures: Mapping[str, Drawn], held: str) -> View:
    """One curve or more: the figures of all, then of each its figure and tables; `held` is a sentence on the others."""
    own = {curve_name(curve): curve for curve in curves}
    parts: list[Part] = [
        picture_of("sweep", "bars" if name.startswith("sweep_bars") else "all", image)
        for name, image in figures.items()
        if name not in own
    ]
    for curve in curves:
        if image := figures.get(curve_name(curve)):
            parts.append(picture_of("sweep", "curve", image, parameter=curve.parameter))
        first, second = curve_tables(curve)
        parts += [replace(first, notes=(shapes_note(curve),)), *([second] if second.columns[1:] else [])]
    wrong = say_failures(curves)
    parts += [Paragraphs("What failed", tuple(wrong))] if wrong else []
    names, answer = listed([curve.parameter for curve in curves]), " ".join(f"{_lowest(curve)}." for curve in curves)
    title = f"{study}: how does usefulness depend on {names}?"
    step = "search all parameters at once with `python -m proxytune study`."
    shapes = {one.parameter: shape_of(series_of(one)[0], None) for one in curves}
    flat = [name for name, shape in shapes.items() if shape.near_best and not shape.worse]
    if flat:
        step = f"raise starts, or add agents whose scores change with {' or '.join(flat)}: noise hides a difference."
    return View(title, f"{answer} {held}.", step, tuple(parts))


def _lowest(curve: SweepCurve) -> str:
    """Say where PRPV is lowest, and which other values these episodes leave open."""
    prpv = series_of(curve)[0]
    shape = shape_of(prpv, curve.base.get(curve.parameter))
    if shape.score is None:
        return f"{curve.parameter}: {prpv.name} is undefined at every point"
    best, points = listed([short(value, 4) for value in shape.best]), len(curve.points)
    worse = len(shape.worse)
    beyond = f"worse beyond noise at {worse} of {points} values" if worse else "at no other value worse beyond noise"
    return f"{curve.parameter}: {prpv.name} is lowest ({shape.score:.3g}) at {best}, and {beyond}"


def figures_of_sweep(curves: Sequence[SweepCurve], truth: Theta | None) -> dict[str, Figure]:
    """One figure per curve, and two of all curves with the same values of the others, by name."""
    figures = {curve_name(curve): panels_figure(curve, truth) for curve in curves}
    for alike in held_alike(curves):
        if names := _names_together(alike):
            last = list({curve.parameter: curve for curve in alike}.values())
            figures |= dict(zip(names, (sweep_figure(last, truth), bars_figure(last)), strict=True))
    return figures


def write_curves(curves: Sequence[SweepCurve], folder: Path) -> list[Path]:
    """Write each curve as CSV and as JSON; return the paths."""
    written = []
    for curve in curves:
        texts = {"csv": curve_csv(curve), "json": json.dumps(curve_document(curve), indent=2, allow_nan=False) + "\n"}
        for ending, text in texts.items():
            written.append(folder / f"{curve_name(curve)}.{ending}")
            write_text(written[-1], text)
    return written


def write_sweep_page(
    settings: StudySettings,
    curves: Sequence[SweepCurve],
    figures: Mapping[str, Figure],
    folder: Path,
    held: str,
    command: str,
) -> Path:
    """Write the page of curves that hold the same values beside their figures, of `figures_of_sweep`; its path."""
    names = [*_names_together(curves), *map(curve_name, curves)]
    drawn = {name: figures[name] for name in names}
    view = sweep_view(settings.name, curves, drawn, f"{held[0].upper()}{held[1:]}")
    path = folder / f"{names[0]}.html"
    write_page(path, view, study_foot(settings, command))
    return path


def held_alike(curves: Sequence[SweepCurve]) -> list[list[SweepCurve]]:
    """Curves by what they hold the others at."""

    def base(curve: SweepCurve) -> list[tuple[str, float]]:
        return sorted(curve.base.items())

    return [list(members) for _, members in groupby(sorted(curves, key=base), key=base)]


def held_values(curves: Sequence[SweepCurve], whose: str = "") -> str:
    """Say what the others are held at, and whose values these are; of one curve its own value is none of these."""
    own = curves[0].parameter if len(curves) == 1 else ""
    values = ", ".join(held_texts(curves[0].base, own))
    return f"the others are held at {whose}{values}" if values else "the others are nominal"


def _names_together(alike: Sequence[SweepCurve]) -> list[str]:
    """Names of the figures of several parameters; none where there is one parameter."""
    if len({curve.parameter for curve in alike}) < 2:
        return []
    mark = f"_{held_mark(dict(alike[0].base))}" if alike[0].base else ""
    return [f"sweep_all{mark}", f"sweep_bars{mark}"]


COLOURS = (style.BLUE, style.VERMILLION, style.GREEN, style.PURPLE, style.ORANGE)
MARKERS = "osD^v"
POD_NAMES = {POD_POSE: "POD, pose [m]", POD_IMAGE: "POD, image [full scale]"}
HEIGHT, BELOW = 1.2, 0.4
"""Heights of a row of panels, and of all below them [inch]."""


def sweep_figure(curves: Sequence[SweepCurve], truth: Theta | None = None) -> Figure:
    """Draw PRPV beside PPV, one row per parameter, bootstrap intervals as bands; lower is better in both."""
    figure, panels = style.grid_of(HEIGHT * len(curves) + BELOW, len(curves), 2, sharey="col")
    for curve, row in zip(curves, panels, strict=True):
        draw_prpv_and_ppv(row[0], row[1], curve)
        for axes in row:
            axes.set_xlabel(plain(curve.label), fontsize=8)
            mark_values(axes, curve, truth)
    # Only now: a limit set earlier would hide what later rows of the shared axis hold.
    for axes, measure in zip(panels[0], (PRPV, PPV), strict=True):
        axes.set_ylim(bottom=-0.03 * axes.get_ylim()[1])
        axes.set_title(with_unit(measure.name, measure.unit), fontsize=8)
    style.legend_below(figure, *panels.ravel(), without=["PRPV"])
    return figure


def panels_figure(curve: SweepCurve, truth: Theta | None = None) -> Figure:
    """Draw PRPV, PPV, SRCC and, where it was asked for, POD along one parameter, as the paper's figure does."""
    series, rows = series_of(curve), 3 if curve.has_pod else 2
    figure, panels = style.grid_of(HEIGHT * rows + BELOW, rows, 2)
    prpv, ppv, srcc, key, *pod = panels.flat
    draw_prpv_and_ppv(prpv, ppv, curve)
    chosen = [one for one in series if one.measure is SRCC]
    for one, colour, marker in zip(chosen, cycle(COLOURS), cycle(MARKERS), strict=False):
        draw_series(srcc, one, colour, marker, f"SRCC, {one.metric.replace('_', ' ')}")
    for axes, measure in zip(pod, POD_NAMES, strict=False):
        draw_series(axes, next(one for one in series if one.measure is measure), style.BLUE, "o", POD_NAMES[measure])
    for axes, measure in zip((prpv, ppv, srcc, *pod), (PRPV, PPV, SRCC, *POD_NAMES), strict=False):
        axes.set_title(POD_NAMES.get(measure) or with_unit(measure.name, measure.unit), fontsize=8)
        mark_values(axes, curve, truth)
        axes.set_xlim(prpv.get_xlim())
        axes.xaxis.set_major_locator(MaxNLocator(4))
    for axes in (prpv, ppv, *pod):
        axes.set_ylim(bottom=min(0.0, -0.03 * axes.get_ylim()[1]))
    figure.supxlabel(plain(curve.label), fontsize=8)
    # The empty panel has the key of the others; the measure itself is left to its axis.
    key.set_axis_off()
    named = style.named_handles((prpv, srcc))
    named.pop("PRPV", None)
    names = [fill(name, WIDEST) for name in named]
    key.legend(list(named.values()), names, loc="center", fontsize=7, frameon=False)
    return figure


BESIDE = "lower and higher value"
SIDE = 1 / 3
"""The bars stand at the held value and so much of the parameter's box to either side."""
APART = 4.0
"""From one parameter's bars to the next one's."""
CHARACTERS = 50
"""That fit across the figure."""


def bars_figure(curves: Sequence[SweepCurve]) -> Figure:
    """Draw PRPV at the `bar_points` of each parameter with its bootstrap interval, and the noise floor by its kind."""
    figure, axes = style.one_panel(2.9)
    ticks: list[tuple[float, str]] = []
    for place, curve in enumerate(curves):
        indices, held = bar_points(curve)
        chosen = [curve.points[index] for index in indices]
        spots = [place * APART + offset for offset in range(len(chosen))]
        ticks += [(spot, short(point.value)) for spot, point in zip(spots, chosen, strict=True)]
        for spot, point in zip(spots, chosen, strict=True):
            if point.assessment is None:
                axes.annotate("failed", (spot, 0), rotation=90, ha="center", va="bottom", fontsize=7)
                continue
            inner, score = point.assessment.prpv_interval, point.assessment.prpv.value
            colour, label = (style.BLUE, HELD) if point is curve.points[held] else (style.LIGHT_BLUE, BESIDE)
            axes.bar(spot, score, width=0.85, color=colour, label=label)
            if inner.low is not None and inner.high is not None:
                ends = [[score - inner.low], [inner.high - score]]
                axes.errorbar([spot], [score], yerr=ends, fmt="none", ecolor="0.2", lw=1.0, capsize=2, label=INTERVAL)
        name = fill(plain(curve.label), max(5, CHARACTERS // len(curves)))
        axes.text(
            (spots[0] + spots[-1]) / 2, 1.02, name, transform=axes.get_xaxis_transform(),
            ha="center", va="bottom", fontsize=7,
        )  # fmt: skip
    found = [point.assessment for curve in curves for point in curve.points if point.assessment is not None]
    if found:
        draw_levels(axes, found)
        style.legend_below(figure, axes)
    style.dress(axes, up=with_unit(PRPV.name, PRPV.unit))
    axes.set_xticks([spot for spot, _ in ticks], [text for _, text in ticks], rotation=90)
    return figure


def bar_points(curve: SweepCurve) -> tuple[list[int], int]:
    """Points of a curve that stand for low, held and high, fewer where the held value is at an end; and the held one.

    The held value is the middle of the range where none was given.
    """
    values = np.array([point.value for point in curve.points])
    low, high = values[0], values[-1]
    middle = int(np.abs(values - curve.base.get(curve.parameter, (low + high) / 2)).argmin())
    wanted = values[middle] + SIDE * (high - low) * np.array([-1.0, 1.0])
    sides = [
        [min(indices, key=lambda index: abs(values[index] - goal))] if indices else []
        for indices, goal in ((range(middle), wanted[0]), (range(middle + 1, len(values)), wanted[1]))
    ]
    return [*sides[0], middle, *sides[1]], middle


HELD, INTERVAL = "held value", "95 % interval"
WIDEST = 20
"""Characters of a name that fit into the key."""


def draw_series(axes: Axes, series: Series, colour: str, marker: str, label: str = "", band: str = "") -> None:
    """A line through the scores, with its band of 95 % intervals, and names of both for a legend."""
    known = {value: one.value for value, one in series.estimates.items() if one.value is not None}
    if banded := [(value, *one.interval) for value, one in series.estimates.items() if one.interval]:
        places, lows, highs = np.array(banded).T
        axes.fill_between(places, lows, highs, color=colour, alpha=0.18, linewidth=0, label=band)
    axes.plot(list(known), list(known.values()), marker=marker, color=colour, ms=3, lw=1.2, label=label)


def draw_prpv_and_ppv(prpv: Axes, ppv: Axes, curve: SweepCurve) -> None:
    """PRPV over the values of a parameter, with the noise floor and chance, and PPV; both with their bands."""
    if found := [point.assessment for point in curve.points if point.assessment is not None]:
        draw_levels(prpv, found)
        series = {one.measure: one for one in series_of(curve)}
        draw_series(prpv, series[PRPV], style.BLUE, "o", "PRPV", INTERVAL)
        draw_series(ppv, series[PPV], style.BLUE, "o")


def draw_levels(axes: Axes, found: Sequence[Assessment]) -> None:
    """The noise floor by its kind, and chance: its mean, since it varies a little with the proxy's own order."""
    style.draw_noise_floor(axes, found[0].noise_floor)
    chance = float(np.mean([assessment.chance.mean for assessment in found]))
    axes.axhline(chance, color="0.45", linewidth=1.0, linestyle=":", label="chance")


def mark_values(axes: Axes, curve: SweepCurve, truth: Theta | None) -> None:
    """A line where the parameter is held when others are swept, a triangle at the top at the target's own value."""
    if curve.parameter in curve.base:
        axes.axvline(curve.base[curve.parameter], color="0.35", linewidth=0.9, linestyle=(0, (5, 2)), label=HELD)
    if truth is not None and curve.parameter in truth:
        style.mark_truth(axes, truth[curve.parameter])
    style.dress(axes)
