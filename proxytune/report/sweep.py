"""Sweep along parameters: tables, CSV, JSON document, page, and the files of all that hold the same values."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from hashlib import sha256
from itertools import groupby
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from rich.console import Group, RenderableType

from proxytune.report.html import write_page
from proxytune.report.scores import score_document
from proxytune.report.study.page import study_foot
from proxytune.report.sweep_figures import bars_figure, panels_figure, sweep_figure
from proxytune.report.table_files import Cell, csv_text
from proxytune.report.text import group_texts, table_text
from proxytune.report.view import Drawn, Paragraphs, Part, Table, View, columns_of
from proxytune.report.wording import listed, plain, short
from proxytune.report.writing import picture_of, write_text
from proxytune.space import Theta
from proxytune.study import StudySettings
from proxytune.sweep import METRICS, OUTWARDS, Series, SweepCurve, SweepPoint, describe_shape, series_of, shape_of
from proxytune.usefulness import MEASURES, PRPV

OF_PRPV = ("prpv", "prpv_interval", "prpv_normalised", "expected_prpv")
KEYS = (
    *OF_PRPV,
    *(measure.key for measure in MEASURES if measure is not PRPV),
    "intervals",
    "chance",
    "at_noise_floor",
)
LEVELS = ("noise_floor", "noise_floor_interval", "noise_floor_kind")
NO_POD = "POD was left out: give --target-model MODEL.toml, the model of the target"


def curve_name(curve: SweepCurve) -> str:
    """A file name for the curve: its parameter, a mark of what is held, and whether POD is in it.

    The mark is left out where the others are nominal; the curve's JSON has what is held.
    """
    mark = [held_mark(curve.base)] if held_texts(curve) else []
    return "_".join(["sweep", curve.parameter, *mark, *(["pod"] if curve.has_pod else [])])


def held_mark(base: Theta) -> str:
    """Six characters that stand for the values that parameters are held at."""
    values = sorted((name, float(value)) for name, value in base.items())
    return sha256(json.dumps(values).encode()).hexdigest()[:6]


def held_texts(curve: SweepCurve) -> list[str]:
    """Values that the curve's other parameters are held at, as texts; those nominal are not named."""
    return [f"{name}={value:g}" for name, value in sorted(curve.base.items()) if name != curve.parameter]


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
    for row, point in enumerate(curve.points):
        found = [one.estimates[row] for one in series]
        cells = [cell for one in found for cell in (one.score, *(one.interval or (None, None)))]
        rows.append([point.value, *cells, len(point.evaluation.failures)])
    return csv_text([curve.parameter, *keys, "failed_episodes"], rows)


def sweep_text(curves: Sequence[SweepCurve], episodes: int, files: Sequence[Path], held: str) -> Group:
    """Curves as `sweep` prints them: the paper's measures, then the others, and what each shows.

    Args:
        curves: What was swept.
        episodes: How many episodes were run for it.
        files: What was written.
        held: What the other parameters are held at, in words.
    """
    parts: list[RenderableType] = []
    for curve in curves:
        title = " ".join([curve.parameter, *held_texts(curve)])
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
    rows = [
        [(f"{point.value:.4g}", *(_cell(one, row) for one in own)) for row, point in enumerate(curve.points)]
        for own in sides
    ]
    # Metrics stand on lines of their own, so that many columns fit.
    heads = [[one.name.replace(" ", "\n").replace("_", "\n") for one in own] for own in sides]
    columns = [columns_of((), (curve.label, *own)) for own in heads]
    first, second = (f"Along {curve.parameter}: {kind} measures" for kind in ("the paper's", "other"))
    lines = tuple(curve_lines(curve))
    return Table(first, columns[0], tuple(rows[0]), lines), Table(second, columns[1], tuple(rows[1]))


def curve_lines(curve: SweepCurve) -> list[str]:
    """Say what the curve shows, a line per measure: where it is best, and whether it worsens on both sides."""
    held_at = curve.base.get(curve.parameter)
    return [f"{curve.parameter}: {describe_shape(series, held_at)}" for series in series_of(curve)]


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
    return [
        f"{curve.parameter} {point.value:g}: {point.evaluation.failure}"
        for curve in curves
        for point in curve.points
        if point.evaluation.failure
    ] + [
        f"{curve.parameter} {point.value:g}: no POD, since no replay of the target's commands worked"
        for curve in curves
        for point in curve.points
        if curve.has_pod and not point.pod
    ]


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


def _cell(series: Series, row: int) -> str:
    """The score, PRPV with its interval."""
    one = series.estimates[row]
    if one.score is None:
        return "failed" if series.measure is PRPV else ""
    text = format(one.score, series.measure.digits)
    if series.measure is not PRPV or one.interval is None:
        return text
    return f"{text} ({one.interval[0]:.0f} to {one.interval[1]:.0f})"


def sweep_view(study: str, curves: Sequence[SweepCurve], figures: Mapping[str, Drawn], held: str) -> View:
    """Curves: the figures of all, then of each its figure and tables.

    Args:
        study: The study's name.
        curves: What was swept, at least one.
        figures: By name.
        held: What the other parameters are held at, in a sentence.
    """
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
    return View(
        f"{study}: how does usefulness depend on {names}?", f"{answer} {held}.", _next_step(curves), tuple(parts)
    )


def _lowest(curve: SweepCurve) -> str:
    """Say where PRPV is lowest, and which other values these episodes leave open."""
    prpv = series_of(curve)[0]
    shape = shape_of(prpv, curve.base.get(curve.parameter))
    if shape.score is None:
        return f"{curve.parameter}: {prpv.name} is undefined at every point"
    best, points = listed([short(value, 4) for value in shape.best]), len(curve.points)
    worse = points - len(shape.near_best)
    beyond = f"worse beyond noise at {worse} of {points} values" if worse else "at no other value worse beyond noise"
    return f"{curve.parameter}: {prpv.name} is lowest ({shape.score:.3g}) at {best}, and {beyond}"


def _next_step(curves: Sequence[SweepCurve]) -> str:
    flat = [one.parameter for one in curves if len(shape_of(series_of(one)[0], None).near_best) == len(one.points)]
    if flat:
        return f"raise starts, or add agents whose scores change with {' or '.join(flat)}: noise hides a difference."
    return "search all parameters at once with `python -m proxytune study`."


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
    """Write the page of curves that hold the same values beside their figures; return its path.

    Args:
        settings: The study's.
        curves: At least one.
        figures: Theirs, by name, as `figures_of_sweep` has them; others may be among them.
        folder: Where the page goes.
        held: What the other parameters are held at, in words.
        command: The command that makes the page, as typed in a shell.
    """
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


def held_values(base: Theta, whose: str = "") -> str:
    """Say what the others are held at, and whose values these are."""
    values = ", ".join(f"{name}={value:g}" for name, value in sorted(base.items()))
    return f"the others are held at {whose}{values}" if values else "the others are nominal"


def _names_together(alike: Sequence[SweepCurve]) -> list[str]:
    """Names of the figures of several parameters; none where there is one parameter."""
    if len({curve.parameter for curve in alike}) < 2:
        return []
    mark = f"_{held_mark(dict(alike[0].base))}" if alike[0].base else ""
    return [f"sweep_all{mark}", f"sweep_bars{mark}"]
