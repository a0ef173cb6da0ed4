"""A sweep's curve as JSON, CSV and a table; the JSON's keys are promises."""

import csv
import io
from collections.abc import Sequence
from typing import Any

from rich.table import Table

from proxytune.report.score_document import document_of
from proxytune.study.sweep import Curve, SweepPoint

MEASURES = ("prpv", "prpv_interval", "prpv_normalised", "ppv", "at_noise_floor")
LEVELS = ("noise_floor", "noise_floor_interval")


def curve_name(curve: Curve) -> str:
    """A file name for the curve: its parameter, and what the others are held at."""
    return "_".join(["sweep", curve.parameter, *held(curve)])


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
    }


def curve_csv(curve: Curve) -> str:
    """The curve as CSV, one row per value of the parameter; empty cells where there is no score."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([curve.parameter, "prpv", "prpv_low", "prpv_high", "ppv", "failed_episodes"])
    for row in map(_point, curve.points):
        low, high = row["prpv_interval"] or (None, None)
        writer.writerow([row["value"], row["prpv"], low, high, row["ppv"], row["failed_episodes"]])
    return text.getvalue()


def curve_table(curve: Curve) -> Table:
    """The curve for the terminal."""
    table = Table(box=None, pad_edge=False, title=" ".join([curve.parameter, *held(curve)]), title_justify="left")
    for name in (f"{curve.parameter} [{curve.unit}]" if curve.unit else curve.parameter, "PRPV", "interval", "PPV"):
        table.add_column(name, justify="right")
    for row in map(_point, curve.points):
        ends = row["prpv_interval"]
        table.add_row(
            f"{row['value']:.4g}",
            "failed" if row["prpv"] is None else str(row["prpv"]),
            f"{ends[0]:.1f} to {ends[1]:.1f}" if ends else "",
            "" if row["ppv"] is None else f"{row['ppv']:.3g}",
        )
    return table


def failures(curves: Sequence[Curve]) -> list[str]:
    """Why points have no score, in one line each."""
    return [
        f"{curve.parameter} {point.value:g}: {point.evaluation.failure}"
        for curve in curves
        for point in curve.points
        if point.evaluation.failure
    ]


def _point(point: SweepPoint) -> dict[str, Any]:
    measures = document_of(point.assessment) if point.assessment else {}
    return {
        "value": point.value,
        **{name: measures.get(name) for name in MEASURES},
        "failed_episodes": len(point.evaluation.failures),
        "failure": point.evaluation.failure or None,
    }
