"""A sweep's curve as JSON, CSV and a table; the JSON's keys are promises."""

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import asdict
from hashlib import sha256
from typing import Any

from rich.table import Table

from proxytune.report.scores.document import document_of
from proxytune.space import Theta
from proxytune.sweep import METRICS, Curve, PodMean, Series, SweepPoint, describe, series_of, shape_of
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


def curve_name(curve: Curve) -> str:
    """A file name for the curve: its parameter, a mark of what is held, and whether POD is in it.

    The mark is left out where the others are nominal; the curve's JSON has what is held.
    """
    mark = [held_mark(curve.base)] if held(curve) else []
    return "_".join(["sweep", curve.parameter, *mark, *(["pod"] if curve.has_pod else [])])


def held_mark(base: Theta) -> str:
    """Six characters that stand for the values that parameters are held at."""
    values = sorted((name, float(value)) for name, value in base.items())
    return sha256(json.dumps(values).encode()).hexdigest()[:6]


def held(curve: Curve) -> list[str]:
    """What the curve's other parameters are held at, as texts; those nominal are not named."""
    return [f"{name}={value:g}" for name, value in sorted(curve.base.items()) if name != curve.parameter]


def curve_document(curve: Curve) -> dict[str, Any]:
    """The curve as plain JSON; None where an agent has no episode that worked."""
    assessed = [point.assessment for point in curve.points if point.assessment is not None]
    levels = document_of(assessed[0]) if assessed else {}
    return {
        "parameter": curve.parameter,
        "unit": curve.unit,
        "base": dict(curve.base),
        **{name: levels.get(name) for name in LEVELS},
        "points": [_point(point) for point in curve.points],
        "shapes": {series.key: _shape(series, curve) for series in series_of(curve)},
        "notes": [] if curve.has_pod else [NO_POD],
    }


def curve_csv(curve: Curve) -> str:
    """The curve as CSV, one row per value and per measure three columns: score, and the ends of its interval.

    Cells are empty where there is no score or no interval.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    series = series_of(curve)
    keys = [key for one in series for key in (one.key, f"{one.key}_low", f"{one.key}_high")]
    writer.writerow([curve.parameter, *keys, "failed_episodes"])
    for row, point in enumerate(curve.points):
        found = [one.estimates[row] for one in series]
        cells = [cell for one in found for cell in (one.score, *(one.interval or (None, None)))]
        writer.writerow([point.value, *cells, len(point.evaluation.failures)])
    return text.getvalue()


def curve_tables(curve: Curve) -> tuple[Table, Table]:
    """The curve for the terminal, the paper's measures first, then the others; intervals are in the files."""
    series = series_of(curve)
    first = [one for one in series if one.measure.in_paper]
    second = [one for one in series if not one.measure.in_paper]
    title = " ".join([curve.parameter, *held(curve)])
    return _table(curve, first, title), _table(curve, second, None)


def curve_lines(curve: Curve) -> list[str]:
    """What the curve shows, a line per measure: where it is best, and whether it worsens on both sides."""
    held_at = curve.base.get(curve.parameter)
    return [f"{curve.parameter}: {describe(series, held_at)}" for series in series_of(curve)]


def failures(curves: Sequence[Curve]) -> list[str]:
    """Why points have no score, in one line each."""
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


def _point(point: SweepPoint) -> dict[str, Any]:
    measures = document_of(point.assessment) if point.assessment else {}
    return {
        "value": point.value,
        **{name: measures.get(name) for name in KEYS},
        "pod": {name: _pod(name, found) for name, found in point.pod.items()} or None,
        "failed_episodes": len(point.evaluation.failures),
        "failure": point.evaluation.failure or None,
    }


def _pod(name: str, found: PodMean) -> dict[str, Any]:
    ends = found.interval and list(found.interval)
    return {"value": found.value, "interval": ends, "unit": METRICS[name], "starts": found.starts}


def _shape(series: Series, curve: Curve) -> dict[str, Any]:
    shape = shape_of(series, curve.base.get(curve.parameter))
    return {"better": series.measure.better, **asdict(shape), "worsens_on_both_sides": shape.monotone}


def _table(curve: Curve, series: Sequence[Series], title: str | None) -> Table:
    table = Table(box=None, pad_edge=False, title=title, title_justify="left")
    for name in (curve.label, *(_broken(one.name) for one in series)):
        table.add_column(name, justify="right", vertical="bottom", overflow="fold")
    for row, point in enumerate(curve.points):
        table.add_row(f"{point.value:.4g}", *(_cell(one, row) for one in series))
    return table


def _cell(series: Series, row: int) -> str:
    """The score, PRPV with its interval."""
    one = series.estimates[row]
    if one.score is None:
        return "failed" if series.measure is PRPV else ""
    text = format(one.score, series.measure.digits)
    if series.measure is not PRPV or one.interval is None:
        return text
    return f"{text} ({one.interval[0]:.0f} to {one.interval[1]:.0f})"


def _broken(name: str) -> str:
    """The name with its metric on lines of their own, so that many columns fit."""
    return name.replace(" ", "\n").replace("_", "\n")
